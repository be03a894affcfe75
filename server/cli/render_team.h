/* lumend render as one of several ranks (server/farm/farm.h): what they have to agree on. */
#ifndef LUM_SERVER_CLI_RENDER_TEAM_H
#define LUM_SERVER_CLI_RENDER_TEAM_H

#include "core/base/team.h"
#include "core/pass/stats.h"
#include "server/world/world.h"

/* Since start_ns. With a team, by the clock of rank 0, as is pass->ms then: all stop after the same pass. */
double lum_render_spent_ms(struct lum_team *team, int64_t start_ns, struct lum_pass_stats *inout_pass);

/* What went from rank to rank, without what MPI and the wire add to it. */
struct lum_render_told {
    uint64_t scene_bytes, edits_bytes; /* from rank 0 to each other, once */
    uint64_t heard_bytes;              /* by rank 0 from all others, up to the last frame */
};
struct cJSON;
/* Adds "team" to the statistics: {"ranks","scene_bytes","edits_bytes"} of the run, {"heard_bytes"} of a frame. True
 * where there is no team. */
bool lum_render_add_told(struct cJSON *run, const struct lum_team *team, const struct lum_render_told *told);
bool lum_render_add_heard(struct cJSON *frame, const struct lum_team *team, struct lum_render_told *inout_told);

/* All have the same scene, and trace rays by the same instructions: else the job ends. */
bool lum_render_compare_scenes(struct lum_team *team, const struct lum_world *world, struct lum_proto_error *err);
/* All have made the same picture, to the bit: else the job ends. what: "the picture", for the message. Without a team:
 * nothing. */
void lum_render_compare_films(struct lum_team *team, const struct lum_film *film, const char *what);

#endif

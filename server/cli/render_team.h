/* lumend render as one of several ranks (server/farm/farm.h): what they have to agree on. */
#ifndef LUM_SERVER_CLI_RENDER_TEAM_H
#define LUM_SERVER_CLI_RENDER_TEAM_H

#include "core/base/team.h"
#include "core/pass/stats.h"
#include "server/world/world.h"

/* Since start_ns. With a team, by the clock of rank 0, as is pass->ms then: all stop after the same pass. */
double lum_render_spent_ms(struct lum_team *team, int64_t start_ns, struct lum_pass_stats *inout_pass);

/* Adds "team" to the statistics of a frame: how many ranks there are, and the bytes that this one has heard from the
 * others since the frame before. Accepts NULL for both. */
struct cJSON;
bool lum_render_add_team(struct cJSON *frame, struct lum_team *team, uint64_t *inout_heard_bytes);

/* All have read the same scene, and trace rays by the same instructions: else the job ends. */
bool lum_render_compare_scenes(struct lum_team *team, const struct lum_world *world, struct lum_proto_error *err);
/* All have made the same picture, to the bit: else the job ends. */
void lum_render_compare_films(struct lum_team *team, const struct lum_film *film);

#endif

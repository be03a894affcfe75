/* The scene of lumend render and its edits, where several ranks render it: rank 0 alone reads files, and runs the
 * importer; the others hear what came of it. */
#ifndef LUM_SERVER_CLI_TEAM_SCENE_H
#define LUM_SERVER_CLI_TEAM_SCENE_H

#include "core/base/team.h"
#include "server/import/import.h"
#include "server/world/world.h"

/* As lum_scene_load. team: NULL: there are no others. *ret_told_bytes: to each of them. */
bool lum_team_scene_load(struct lum_team *team, struct lum_world *world, const char *scene,
                         const struct lum_import_config *import, uint64_t *ret_told_bytes, struct lum_proto_error *err);
/* As lum_edits_load. What an edit imports each rank reads by itself. */
bool lum_team_edits_load(struct lum_team *team, const char *replay, struct lum_ops *ret_ops, uint64_t *ret_told_bytes,
                         struct lum_proto_error *err);

#endif

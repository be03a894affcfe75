/* Where a scene comes from: a built-in name, a .jsonl file of ops, or a model file for the importer. */
#ifndef LUM_SERVER_WORLD_SCENE_SOURCE_H
#define LUM_SERVER_WORLD_SCENE_SOURCE_H

#include "server/base/embed.h"
#include "server/import/import.h"
#include "server/world/world.h"

/* The built-in scene of this name, or NULL. */
const struct lum_embedded *lum_scene_builtin(const char *name);

/* The built-in replay of this name, or NULL. That of scene S is called S-moves. */
const struct lum_embedded *lum_replay_builtin(const char *name);

/* What --edits names: a built-in replay, or a file of ops. Ends with a 0 that does not count; free it. NULL: err says
 * why, and the caller names it in front of that. */
char *lum_edits_text(const char *replay, size_t *ret_n, struct lum_proto_error *err);
/* The ops in it. Errors likewise. */
bool lum_edits_load(const char *replay, struct lum_ops *ret_ops, struct lum_proto_error *err);

/* Fills an empty world and commits. Assets of a .jsonl are below import->assets_dir, or beside the file when that is
 * NULL. Views of a model file start with its first camera; one without any gets "main", and one without any light
 * "default-sky"; the log says so. Blocking. The caller names the scene in front of err->text. */
bool lum_scene_load(struct lum_world *world, const char *scene, const struct lum_import_config *import,
                    struct lum_proto_error *err);

/* The same with nothing but a camera, "main". */
bool lum_scene_begin(struct lum_world *world, struct lum_proto_error *err);

#endif

/* Where a scene comes from: a built-in name, a .jsonl file of ops, or a model file for the importer. */
#ifndef LUM_SERVER_SCENE_SOURCE_H
#define LUM_SERVER_SCENE_SOURCE_H

#include "server/embed.h"
#include "server/import.h"
#include "server/world.h"

/* The built-in scene of this name, or NULL. */
const struct lum_embedded *lum_scene_builtin(const char *name);

/* A file of ops, for --edits; whole in memory. */
bool lum_scene_read_ops(const char *path, struct lum_ops *ret_ops, struct lum_proto_error *err);

/* Fills an empty world and commits. Assets of a .jsonl are below import->assets_dir, or beside the file when that is NULL.
 * A model file without a camera gets "main", and one without any light "default-sky"; the log says so. Blocking. */
bool lum_scene_load(struct lum_world *world, const char *scene, const struct lum_import_config *import,
                    struct lum_proto_error *err);

#endif

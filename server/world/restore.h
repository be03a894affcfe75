/* The renderer's scene, made of a whole document: of what a journal had, or after an edit that could not be undone. */
#ifndef LUM_SERVER_WORLD_RESTORE_H
#define LUM_SERVER_WORLD_RESTORE_H

#include "core/base/pool.h"
#include "protocol/document/document.h"
#include "server/world/totals.h"

struct lum_scene;

/* Puts all records into an empty scene. Meshes are made by all threads of the pool, each by one of them. On failure err
 * names the record. */
LUM_MUST_USE enum lum_status lum_scene_of_document(struct lum_scene *scene, struct lum_pool *pool,
                                                   const struct lum_document *doc, struct lum_totals *ret_totals,
                                                   struct lum_error *err);

#endif

/* A binary glTF 2.0 in the making: JSON, and bytes that are shared where they are the same. Nothing of scenes here.
 *
 * Errors are sticky: the first is kept, later calls do nothing and give index 0, and lum_glb_finish tells it. What is
 * added by pointer is borrowed until the file is written, unless its owner says that it passes over. */
#ifndef LUM_SERVER_EXPORT_GLB_H
#define LUM_SERVER_EXPORT_GLB_H

#include <stdio.h>

#include "core/base/base.h"

struct cJSON;
struct lum_glb;

/* Arrays at the root of the file. */
enum lum_glb_list {
    LUM_GLB_ACCESSORS,
    LUM_GLB_BUFFER_VIEWS,
    LUM_GLB_CAMERAS,
    LUM_GLB_IMAGES,
    LUM_GLB_MATERIALS,
    LUM_GLB_MESHES,
    LUM_GLB_NODES,
    LUM_GLB_SAMPLERS,
    LUM_GLB_TEXTURES,
    LUM_GLB_LIGHTS,     /* of KHR_lights_punctual */
    LUM_GLB_IES_LIGHTS, /* of EXT_lights_ies */
    LUM_GLB_LIST_COUNT
};

/* max_bytes: of the whole file, below 4 GiB. NULL: memory is short. */
struct lum_glb *lum_glb_create(uint64_t max_bytes);
void lum_glb_destroy(struct lum_glb *g); /* accepts NULL */

bool lum_glb_ok(const struct lum_glb *g);
void lum_glb_fail(struct lum_glb *g, const struct lum_error *err);
void lum_glb_fail_memory(struct lum_glb *g);

/* Adds an owned object to the list; its index. */
uint32_t lum_glb_add(struct lum_glb *g, enum lum_glb_list list, struct cJSON *item);
/* The file uses it. name: of static storage. */
void lum_glb_uses(struct lum_glb *g, const char *name);
/* The object extensions.NAME of o, made where it is not there; NULL: failed. */
struct cJSON *lum_glb_extension(struct lum_glb *g, struct cJSON *o, const char *name);

/* A buffer view of these bytes. free_bytes: passes over, and is freed by that; NULL: borrowed. The same bytes again
 * give the same view. */
uint32_t lum_glb_bytes(struct lum_glb *g, const void *bytes, size_t n, void (*free_bytes)(void *));
/* An accessor of n floats, by so many; bounds: with min and max. */
uint32_t lum_glb_floats(struct lum_glb *g, const float *values, size_t n, uint32_t n_components, bool bounds,
                        void (*free_values)(void *));
uint32_t lum_glb_indices(struct lum_glb *g, const uint32_t *values, size_t n, void (*free_values)(void *));

/* Ends the making: scene_extras (owned, may be NULL) goes with the scene, of all nodes that none has as its child. */
LUM_MUST_USE enum lum_status lum_glb_finish(struct lum_glb *g, struct cJSON *scene_extras, struct lum_error *err);
uint64_t lum_glb_size(const struct lum_glb *g); /* of the file, once it is finished */
LUM_MUST_USE enum lum_status lum_glb_write(const struct lum_glb *g, FILE *out, struct lum_error *err);
void lum_glb_copy(const struct lum_glb *g, uint8_t *to); /* lum_glb_size bytes */

#endif

/* From records to the renderer: the only file that sees protocol records and the core scene.
 *
 * Here colours become chromaticities of luminance 1, colour temperatures become colours, degrees become radians, and
 * whatever photometric size a light was given in becomes the one natural to its kind (core/scene/desc.h). */
#ifndef LUM_SERVER_WORLD_APPLY_H
#define LUM_SERVER_WORLD_APPLY_H

#include "core/light/web.h"
#include "core/render/view.h"
#include "core/scene/scene.h"
#include "protocol/document/document.h"

/* Asked before each record, which may take long to make. False: no more. */
struct lum_go_on {
    bool (*ask)(void *user); /* NULL: always */
    void *user;
};

/* Puts and removes what the changes say, in order, all or nothing: when the renderer refuses one, those before it are
 * taken back, *ret_failed (may be NULL) is its index, and the scene is as before. LUM_ERR_INTERNAL: taking back failed
 * too (memory), the scene must be made anew from the document. LUM_ERR_CANCELLED: it was told to make no more, and
 * took nothing back. Does not commit. */
LUM_MUST_USE enum lum_status lum_apply_changes(struct lum_scene *scene, const struct lum_changes *changes,
                                               const struct lum_go_on *go_on, size_t *ret_failed,
                                               struct lum_error *err);
/* Takes all of them back, last first. */
LUM_MUST_USE enum lum_status lum_apply_reverse(struct lum_scene *scene, const struct lum_changes *changes,
                                               struct lum_error *err);

/* Puts one record. Records that are settings, not things (render, import, sensor, patch, preset), are checked and put
 * nothing.
 */
LUM_MUST_USE enum lum_status lum_apply_put(struct lum_scene *scene, const struct lum_record *r, struct lum_error *err);

/* Makes the mesh of a record whose `deforming` is not set, beside the scene. Thread: any, while nobody writes the
 * scene. */
LUM_MUST_USE enum lum_status lum_apply_make_mesh(const struct lum_scene *scene, const struct lum_record *mesh,
                                                 struct lum_made_mesh *ret_made, struct lum_error *err);

/* The conversions on their own. Strings of the result are borrowed from the record. web: of an ies light, else
 * NULL. */
LUM_MUST_USE enum lum_status lum_apply_light(const struct lum_record *r, const struct lum_web *web,
                                             struct lum_light_desc *ret_light, struct lum_error *err);
LUM_MUST_USE enum lum_status lum_apply_material(const struct lum_record *r, struct lum_material_desc *ret_material,
                                                struct lum_error *err);
struct lum_camera lum_apply_camera(const struct lum_record_camera *c);
struct lum_medium_desc lum_apply_medium(const struct lum_record *r);
/* What the render record says of method, samples, depth, seed, virtual point lights, caches and antialiasing; camera
 * and size stay. */
LUM_MUST_USE enum lum_status lum_apply_settings(const struct lum_record *render,
                                                struct lum_view_settings *inout_settings, struct lum_error *err);
LUM_MUST_USE enum lum_status lum_apply_tone_map(const char *name, enum lum_tone_map *ret_tone, struct lum_error *err);

/* The renderer's refusal as the wire shows it; path: where the op is ("ops/3"), or "". Returns false. */
bool lum_apply_error(const struct lum_error *e, const char *path, struct lum_proto_error *ret_error);

#endif

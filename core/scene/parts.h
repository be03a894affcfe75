/* Private to core/scene: the parts of a snapshot. Immutable, and shared between snapshots in which they are equal. */
#ifndef LUM_CORE_SCENE_PARTS_H
#define LUM_CORE_SCENE_PARTS_H

#include "core/light/tree.h"
#include "core/scene/snapshot.h"

struct lum_env_map;
struct lum_light_desc;
struct lum_mesh_surface;
struct lum_scene;

/* Vector i of an array. */
static inline struct lum_vec3 lum_v3_load(const float *array, uint32_t i)
{
    return lum_v3(array[3 * (size_t)i], array[3 * (size_t)i + 1], array[3 * (size_t)i + 2]);
}
struct lum_mesh *lum_mesh_ref(struct lum_mesh *mesh);
void lum_mesh_unref(struct lum_mesh *mesh);
/* Where there is uv, unless they are there: tangent.c. False: no memory. */
bool lum_mesh_make_tangents(struct lum_mesh *mesh);
struct lum_image *lum_image_ref(struct lum_image *image);
void lum_image_unref(struct lum_image *image);

/* An image and, once an environment light asked for it, its luminance distribution. Or that of a sky: no image. */
struct lum_env_part {
    struct lum_refs refs;
    struct lum_image *image;
    struct lum_env_map *map;
};
struct lum_env_part *lum_env_part_ref(struct lum_env_part *env);
void lum_env_part_unref(struct lum_env_part *env);

struct lum_instance_part {
    struct lum_refs refs;
    struct lum_instance *items; /* each holds a reference to its mesh */
    uint32_t n;
};
struct lum_material_part {
    struct lum_refs refs;
    struct lum_material *items; /* each texture holds a reference to its image */
    uint32_t n;
};
struct lum_light_part {
    struct lum_refs refs;
    struct lum_bounds bounds; /* of the instances and the emitter shapes */
    struct lum_light_table table;
    struct lum_light *items;
    uint32_t *active, *afar;
    float *active_cdf, *pick_pdf;
    struct lum_light_tree tree;
    struct lum_mesh_surface *surfaces; /* per light; zero but for mesh emitters */
    struct lum_env_part **envs;        /* per light; NULL but for skies, and environments with an image */
    const struct lum_web **webs;       /* per light; NULL but for ies */
    uint32_t n;
    struct lum_accel_shape *shapes;
    uint32_t *shape_lights; /* per shape: its light */
    uint32_t n_shapes;
};
struct lum_camera_row {
    char id[LUM_ID_MAX + 1];
    struct lum_camera camera;
};
struct lum_camera_part {
    struct lum_refs refs;
    struct lum_camera_row *items;
    uint32_t n;
};
struct lum_snapshot_parts {
    struct lum_instance_part *instances;
    struct lum_material_part *materials;
    struct lum_light_part *lights;
    struct lum_camera_part *cameras;
    struct lum_medium media[LUM_MEDIA_MAX]; /* a few hundred bytes: not worth sharing */
    uint32_t n_media;
};

void lum_instance_part_unref(struct lum_instance_part *part); /* all accept NULL */
void lum_material_part_unref(struct lum_material_part *part);
void lum_light_part_unref(struct lum_light_part *part);
void lum_camera_part_unref(struct lum_camera_part *part);

/* resolve.c: the scene's entries as a renderer reads them. */
enum lum_status lum_resolve_materials(const struct lum_scene *scene, const struct lum_normalisation *norm,
                                      struct lum_material_part **ret_part, struct lum_error *err);
enum lum_status lum_resolve_instances(const struct lum_scene *scene, const struct lum_normalisation *norm,
                                      struct lum_instance_part **ret_part, struct lum_error *err);
enum lum_status lum_resolve_cameras(const struct lum_scene *scene, struct lum_camera_part **ret_part,
                                    struct lum_error *err);
enum lum_status lum_resolve_media(const struct lum_scene *scene, const struct lum_normalisation *norm,
                                  struct lum_snapshot_parts *parts, struct lum_error *err);
/* The same objects with the same meshes in the same places. */
bool lum_instances_same_geometry(const struct lum_instance_part *a, const struct lum_instance_part *b);

struct lum_bounds lum_instances_bounds(const struct lum_instance_part *part);

/* lights.c. Sets the light index of emissive instances. */
struct lum_light_input {
    const struct lum_scene *scene;
    const struct lum_normalisation *norm;
    struct lum_instance_part *instances;
    const struct lum_material_part *materials;
    const struct lum_light_part *previous; /* NULL at first */
    const struct lum_bounds *bounds;       /* of the instances */
};
enum lum_status lum_resolve_lights(const struct lum_light_input *in, struct lum_light_part **ret_part,
                                   struct lum_error *err);
/* sky.c: the shape and power of a sky, and what both hold. */
enum lum_status lum_sky_resolve(const struct lum_light_input *in, const struct lum_light_desc *d,
                                struct lum_light *inout_light, struct lum_env_part **ret_env, struct lum_error *err);
/* Nothing added, removed, moved or reshaped; nothing brighter, dimmer, switched or regrouped. */
bool lum_lights_same_shape(const struct lum_snapshot_parts *a, const struct lum_snapshot_parts *b);
bool lum_lights_same_power(const struct lum_snapshot_parts *a, const struct lum_snapshot_parts *b);

/* The same lights, after `change` of power and switch of each. What they are made of stays that of `part`, which has to
 * live as long. NULL: out of memory. */
struct lum_light_part *lum_lights_relit(const struct lum_light_part *part,
                                        void (*change)(void *user, struct lum_light *light), void *user);

struct lum_bounds lum_shape_bounds(const struct lum_accel_shape *shape);

/* commit.c: some candidate hit on this material could be let through. */
bool lum_material_has_holes(const struct lum_material *m);
/* commit.c: both let the same rays through, and leave as much of them. */
bool lum_material_passes_same(const struct lum_material *a, const struct lum_material *b);

/* snapshot.c: alpha test of a candidate hit; user is the snapshot (struct lum_accel_alpha). */
bool lum_snapshot_opaque(const void *user, uint32_t object, uint32_t prim, float u, float v);
/* As lum_accel_panes.passes. */
bool lum_snapshot_passes(const void *user, uint32_t object, uint32_t prim, float u, float v, struct lum_vec3 d,
                         struct lum_accel_pane *ret_pane);

#endif

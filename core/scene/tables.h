/* Private to core/scene: the tables behind struct lum_scene and the parts that snapshots share.
 *
 * A table is an array of entries sorted by id. Sorted, because the order of everything in a snapshot is by id: the same
 * content gives the same picture whatever order it arrived in. Entries refer to each other by pointer and count their
 * users; an entry with users cannot be removed, and a replaced one keeps its address. */
#ifndef LUM_CORE_SCENE_TABLES_H
#define LUM_CORE_SCENE_TABLES_H

#include "core/scene/desc.h"
#include "core/scene/scene.h"
#include "core/scene/snapshot.h"

struct lum_entry {
    char id[LUM_ID_MAX + 1];
    uint32_t users; /* entries that refer to this one */
};
struct lum_table {
    struct lum_entry **rows; /* sorted by id */
    uint32_t n, capacity;
};

struct lum_mesh_entry {
    struct lum_entry base;
    struct lum_mesh *mesh;
    struct lum_accel_mesh *spare; /* deforming: the pose before; refitted when no snapshot holds it any more */
};

/* An image and, once an environment light asked for it, its luminance distribution. Shared with snapshots. */
struct lum_env_part {
    struct lum_refs refs;
    struct lum_image *image;
    struct lum_env_map *map;
};
struct lum_image_entry {
    struct lum_entry base;
    struct lum_image *image;
    struct lum_env_part *env; /* NULL until used as an environment */
};

enum lum_material_slot {
    LUM_SLOT_BASE_COLOR,
    LUM_SLOT_METALLIC_ROUGHNESS,
    LUM_SLOT_EMISSION,
    LUM_SLOT_NORMAL,
    LUM_SLOT_COUNT
};
struct lum_material_entry {
    struct lum_entry base;
    struct lum_material_desc desc; /* image ids are NULL: see images */
    struct lum_image_entry *images[LUM_SLOT_COUNT];
};

struct lum_object_entry {
    struct lum_entry base;
    struct lum_mesh_entry *mesh;
    struct lum_material_entry *material;
    struct lum_affined local_to_world;
    bool visible;
    struct lum_shine shine; /* group is NULL: see below */
    char group[LUM_ID_MAX + 1];
};

struct lum_light_entry {
    struct lum_entry base;
    struct lum_light_desc desc; /* image, group are NULL: see below */
    struct lum_image_entry *image;
    char group[LUM_ID_MAX + 1];
};

struct lum_camera_entry {
    struct lum_entry base;
    struct lum_camera camera;
};

struct lum_medium_entry {
    struct lum_entry base;
    struct lum_medium_desc desc;
};

#define LUM_ENTITY_COUNT (LUM_ENTITY_MEDIUM + 1)
struct lum_scene {
    struct lum_device *device; /* borrowed */
    struct lum_table tables[LUM_ENTITY_COUNT];
    const struct lum_snapshot *last; /* the newest snapshot, or NULL before the first commit */
    struct lum_versions previous;    /* of the scene that this one replaced; else 0 */
    uint64_t dropped_triangles, dropped_texels;
    bool straight_glass;
};

/* tables.c */
uint32_t lum_table_lower_bound(const struct lum_table *table, const char *id);
struct lum_entry *lum_entry_find(const struct lum_table *table, const char *id); /* NULL: none */
/* The entry named id, or a fresh zeroed one of entry_size that lum_table_keep will insert without failing. */
enum lum_status lum_table_open(struct lum_table *table, const char *id, size_t entry_size, struct lum_entry **ret_entry,
                               struct lum_error *err);
void lum_table_keep(struct lum_table *table, struct lum_entry *entry); /* inserts unless it is there */
void lum_table_drop(struct lum_table *table, struct lum_entry *entry); /* frees a fresh entry after a failure */
/* Finds what `field` refers to; ids NULL and "" give NULL where optional. */
enum lum_status lum_scene_lookup(const struct lum_scene *scene, enum lum_entity kind, const char *id, const char *field,
                                 struct lum_entry **ret_entry, struct lum_error *err);
/* Counts that a user changed from one entry to another; either may be NULL. Entries begin with struct lum_entry. */
void lum_entry_move_use(void *from, void *to);
size_t lum_bounded_length(const char *text, size_t limit); /* at most limit; NULL: 0 */
enum lum_status lum_check_range(const char *field, double value, double lo, double hi, struct lum_error *err);
enum lum_status lum_check_vec(const char *field, struct lum_vec3d v, double limit, struct lum_error *err);
enum lum_status lum_check_rgb(const char *field, struct lum_rgb c, float hi, struct lum_error *err);

/* Coordinates, lengths and matrix entries: |x| <= this. Far beyond any scene, and its cube is finite in double. */
#define LUM_LENGTH_MAX 1e15

/* Vertices and triangles of one mesh: three 32-bit indices each stay addressable with 32 bits. */
#define LUM_MESH_MAX (64u << 20)
/* Width and height of an image. */
#define LUM_IMAGE_SIDE_MAX 16384u

/* mesh.c */
struct lum_mesh *lum_mesh_ref(struct lum_mesh *mesh);
void lum_mesh_unref(struct lum_mesh *mesh);

/* image.c */
struct lum_image *lum_image_ref(struct lum_image *image);
void lum_image_unref(struct lum_image *image);
struct lum_env_part *lum_env_part_ref(struct lum_env_part *env);
void lum_env_part_unref(struct lum_env_part *env);
enum lum_status lum_image_entry_env(struct lum_image_entry *entry, struct lum_env_part **ret_env,
                                    struct lum_error *err);

/* ---- the parts of a snapshot: immutable, shared between snapshots in which they are equal ---- */

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
/* Inclusive prefix sums of triangle areas in scene space, for one mesh under one linear map. */
struct lum_area_cdf {
    struct lum_refs refs;
    struct lum_mesh *mesh;
    float linear[3][3];
    double total;
    struct lum_vec3 centre; /* of the area, relative to the map's translation */
    float *sums;
};
/* lum_light.mean_emission, and what it was found for: holds references to the images. */
struct lum_emission_mean {
    struct lum_texture emission, alpha;
    enum lum_alpha_mode alpha_mode;
    float alpha_factor, alpha_cutoff;
    float mean;
};
struct lum_light_part {
    struct lum_refs refs;
    struct lum_bounds bounds; /* of the instances and the emitter shapes */
    struct lum_light_table table;
    struct lum_light *items;
    uint32_t *active;
    float *active_cdf, *pick_pdf;
    struct lum_area_cdf **cdfs;      /* per light; NULL but for mesh emitters */
    struct lum_emission_mean *means; /* per light; zero but for mesh emitters with a texture or holes */
    struct lum_env_part **envs;      /* per light; NULL but for environments with an image */
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

/* resolve.c: the scene's entries as a renderer reads them. previous: the last snapshot, or NULL. */
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

struct lum_bounds lum_instance_bounds(const struct lum_instance *instance);
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
/* Nothing added, removed, moved or reshaped; nothing brighter, dimmer, switched or regrouped. */
bool lum_lights_same_shape(const struct lum_snapshot_parts *a, const struct lum_snapshot_parts *b);
bool lum_lights_same_power(const struct lum_snapshot_parts *a, const struct lum_snapshot_parts *b);

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

/* placement.c */
struct lum_normalisation lum_scene_place(const struct lum_scene *scene, const struct lum_normalisation *previous);

#endif

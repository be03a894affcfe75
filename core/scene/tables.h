/* Private to core/scene: the tables behind struct lum_scene.
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

struct lum_image_entry {
    struct lum_entry base;
    struct lum_image *image;
    struct lum_env_part *env; /* NULL until used as an environment */
};

#define LUM_SLOT_MEMBER(SLOT, name) LUM_SLOT_##SLOT,
enum { LUM_TEXTURES(LUM_SLOT_MEMBER) LUM_SLOT_COUNT };
struct lum_material_entry {
    struct lum_entry base;
    struct lum_material_desc desc; /* image ids are NULL: see images */
    struct lum_image_entry *images[LUM_SLOT_COUNT];
    struct lum_brushed_table *brushed; /* NULL: it is rough alike all ways */
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
    struct lum_light_desc desc; /* image, group are NULL: see below; a reference to its web */
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
    uint64_t version_step;           /* lum_scene_fork; else 0, which counts as 1 */
    uint64_t dropped_triangles, dropped_texels;
    bool straight_glass;
    bool hurry;
    bool has_quick; /* since they were last asked for there are others with trees that were made in a hurry, perhaps */
    bool new_trees; /* since the last commit */
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
enum lum_status lum_check_vec(const char *field, struct lum_vec3d v, struct lum_error *err);
enum lum_status lum_check_rgb(const char *field, struct lum_rgb c, float hi, struct lum_error *err);

/* Coordinates, lengths and matrix entries: |x| <= this. Far beyond any scene, and its cube is finite in double. */
#define LUM_LENGTH_MAX 1e15

/* Vertices and triangles of one mesh: three 32-bit indices each stay addressable with 32 bits. */
#define LUM_MESH_MAX (64u << 20)
/* Width and height of an image. */
#define LUM_IMAGE_SIDE_MAX 16384u

/* image.c */
enum lum_status lum_image_entry_env(struct lum_image_entry *entry, struct lum_env_part **ret_env,
                                    struct lum_error *err);

/* placement.c */
struct lum_normalisation lum_scene_place(const struct lum_scene *scene, const struct lum_normalisation *previous);

#endif

/* A snapshot: one revision of the scene, immutable, shared by reference count. Everything here is in scene space and
 * ready to trace and shade. Render threads borrow it for a pass; nobody writes it.
 *
 * Units in scene space: lengths are metres * norm.scale, so an intensity in cd becomes cd * scale^2 and an extinction
 * becomes sigma / scale; radiance, luminance and irradiance keep their values. */
#ifndef LUM_CORE_SCENE_SNAPSHOT_H
#define LUM_CORE_SCENE_SNAPSHOT_H

#include "core/accel/accel.h"
#include "core/light/light.h"
#include "core/material/material.h"
#include "core/math/affine.h"
#include "core/math/bounds.h"
#include "core/math/rgb.h"
#include "core/medium/medium.h"
#include "core/scene/desc.h"

/* p_scene = (p_world - centre) * scale, in double. A scene is placed anew when a surface would lie beyond
 * LUM_SCENE_REACH on any axis. */
#define LUM_SCENE_REACH 128.0f
struct lum_normalisation {
    struct lum_vec3d centre;
    double scale; /* a power of two */
};
static inline bool lum_normalisation_equal(const struct lum_normalisation *a, const struct lum_normalisation *b)
{
    return a->centre.x == b->centre.x && a->centre.y == b->centre.y && a->centre.z == b->centre.z &&
           a->scale == b->scale;
}

static inline struct lum_vec3 lum_world_to_scene(const struct lum_normalisation *n, struct lum_vec3d p)
{
    return lum_v3((float)((p.x - n->centre.x) * n->scale), (float)((p.y - n->centre.y) * n->scale),
                  (float)((p.z - n->centre.z) * n->scale));
}

/* A mesh as the renderer reads it. Vertices are in the mesh's own normalised local space. */
struct lum_mesh {
    struct lum_refs refs;
    struct lum_accel_mesh *accel;
    struct lum_triangles *triangles; /* of positions and indices */
    const float *positions;          /* 3 per vertex */
    float *normals, *tangents;       /* 3 per vertex, unit; or NULL. tangents: given, or of lum_mesh_make_tangents */
    float *uvs, *colors, *tangent_signs; /* 2, 3, 1 per vertex; or NULL. signs: of the bitangents of given tangents */
    const uint32_t *indices;             /* 3 per triangle */
    uint32_t n_vertices, n_triangles;
    struct lum_vec3 bounds_lo, bounds_hi; /* of the triangles; lo > hi when there is none */
    struct lum_affined local_to_given;    /* normalised local -> the coordinates that the client gave */
    bool deforming, quick;                /* quick: accel was made in a hurry */
};

struct lum_instance {
    const struct lum_mesh *mesh;
    uint32_t material; /* index in lum_snapshot.materials */
    uint32_t light;    /* index of its mesh light, or LUM_NO_OBJECT */
    struct lum_affine local_to_scene;
    float normal_m[3][3]; /* inverse transpose: local normals -> scene, not unit. Keeps outward outward in mirrors
                           * too, as glTF asks */
    uint64_t hash;        /* lum_hash64_text of the id */
    char id[LUM_ID_MAX + 1];
};
struct lum_bounds lum_instance_bounds(const struct lum_instance *instance);
/* A normal of its mesh, of any length, in the scene: unit. */
struct lum_vec3 lum_instance_normal(const struct lum_instance *instance, struct lum_vec3 n);

/* What changed last: a counter per class of edit. A stage runs again when one of those that it depends on differs. */
struct lum_versions {
    uint64_t geometry;    /* objects, meshes, emitter shapes, visibility, alpha, what panes leave of light */
    uint64_t material;    /* anything in a material but the amount of emission */
    uint64_t light_shape; /* where light comes from: added, removed, moved, reshaped */
    uint64_t light_power; /* colour, intensity, on/off */
    uint64_t medium; /* anything in a medium that dims or scatters; and all of them when the scene is placed anew */
};

static inline bool lum_versions_equal(const struct lum_versions *a, const struct lum_versions *b)
{
    return a->geometry == b->geometry && a->material == b->material && a->light_shape == b->light_shape &&
           a->light_power == b->light_power && a->medium == b->medium;
}

struct lum_snapshot_parts;
struct lum_snapshot {
    struct lum_refs refs;
    uint64_t scene_rev;
    struct lum_versions versions;
    struct lum_normalisation norm;
    struct lum_vec3 bounds_lo, bounds_hi; /* of all geometry; lo > hi when there is none */
    struct lum_accel_top *top;
    struct lum_accel_alpha alpha;
    bool has_alpha;
    struct lum_accel_panes panes; /* of lum_material_is_pane */
    bool has_panes, has_sheets;   /* sheets: of lum_material_is_sheet */
    bool has_unlit;               /* materials */
    const struct lum_instance *instances;
    uint32_t n_instances;
    const struct lum_material *materials;
    uint32_t n_materials;
    struct lum_light_table lights;
    const struct lum_medium *media; /* that dim or scatter; sorted by id */
    uint32_t n_media;
    uint64_t n_triangles;             /* instanced */
    struct lum_snapshot_parts *parts; /* private to core/scene: ownership of the above, cameras */
    const struct lum_snapshot
        *whole;                   /* where this one is in other light: the scene as it is; owns the parts. Else NULL */
    struct lum_light_part *relit; /* private to core/scene: its lights */
};

const struct lum_snapshot *lum_snapshot_ref(const struct lum_snapshot *);
void lum_snapshot_unref(const struct lum_snapshot *); /* accepts NULL. Thread: any */

/* The same scene in other light: `change` is called for each of its lights, and may set power and on. The same light
 * has the same versions, whenever it is asked for. Thread: any. */
LUM_MUST_USE enum lum_status lum_snapshot_relit(const struct lum_snapshot *, void (*change)(void *, struct lum_light *),
                                                void *user, const struct lum_snapshot **ret_snapshot,
                                                struct lum_error *err);

/* LUM_ERR_NOT_FOUND when there is no such camera. id NULL: the first by name, "main" preferred. */
LUM_MUST_USE enum lum_status lum_snapshot_camera(const struct lum_snapshot *, const char *id,
                                                 struct lum_camera *ret_camera, struct lum_error *err);
/* A camera that frames the whole scene from a pleasant angle; for files that bring none. */
struct lum_camera lum_snapshot_framing_camera(const struct lum_snapshot *);

/* World box, in metres, around the triangles of the object `id` and of those below it ("id/..."): an import is framed
 * by it. NULL: of all. False: nothing of that name is to be seen. */
struct lum_box {
    struct lum_vec3d lo, hi;
};
bool lum_snapshot_bounds(const struct lum_snapshot *, const char *id, struct lum_box *ret_world);

/* A surface that shines, as lighting designers see it. */
struct lum_luminaire {
    const char *id;          /* of the object; the snapshot's */
    struct lum_vec3d centre; /* of its area, metres */
    double area_m2;          /* of one side */
    double luminance_cd_m2;  /* mean over the area, holes included as dark */
    double flux_lm; /* all that leaves it: pi * luminance * area of each side that shines. Both as if switched on */
    double material_flux_lm; /* that of its material, were it not dimmed for itself; 0 where that does not shine */
    struct lum_rgb color;    /* chromaticity, luminance 1; of a white texel. White where it is dimmed to nothing */
    bool both_sides;
};
/* False: light number `light` of the table is no surface of an object. */
bool lum_snapshot_luminaire(const struct lum_snapshot *, uint32_t light, struct lum_luminaire *ret_luminaire);

#endif

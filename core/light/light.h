/* Lights at render time, and the table of them. All in scene space (snapshot.h has the units). */
#ifndef LUM_CORE_LIGHT_LIGHT_H
#define LUM_CORE_LIGHT_LIGHT_H

#include "core/base/base.h"
#include "core/light/falloff.h"
#include "core/math/rgb.h"
#include "core/math/vec.h"

struct lum_instance;
struct lum_snapshot;
struct lum_env_map; /* luminance distribution of an environment (light/environment.c) */
struct lum_web;     /* intensity by direction (light/web.h) */
struct lum_light_tree;
struct lum_facets;

/* What lights are at render time: a row of functions (emitter.h). These are asked for by name; a kind of light may
 * bring one that nobody else knows. */
struct lum_emitter_row;
extern const struct lum_emitter_row lum_emitter_point, /* with a falloff: point, spot, ies */
    lum_emitter_directional, lum_emitter_far_disc,     /* directional light with an extent: the sun */
    lum_emitter_quad, lum_emitter_disc, lum_emitter_sphere, lum_emitter_opening_rectangle,
    lum_emitter_opening_disc, /* openings: of a lamp with a web */
    lum_emitter_mesh, lum_emitter_environment;

/* A point light nearer than this, in scene units, shines as from this far: the scale of lum_ray_offset, below which its
 * side of the surface is not known. Keeps 1 / r^2 finite. */
#define LUM_POINT_LIGHT_NEAR 0x1p-16f

/* Scene units to a far disc from the middle of the scene, which is 64 across at most: it is seen under the same angle
 * from everywhere, and is as bright, within 2e-5. */
#define LUM_FAR 0x1p22f

struct lum_light {
    const struct lum_emitter_row *kind;
    const struct lum_falloff *falloff; /* point */
    struct lum_rgb
        power;         /* cd * scale^2 (point, opening), lx (directional), cd/m2 (area, mesh, far disc, environment) */
    struct lum_vec3 p; /* centre */
    struct lum_vec3 n; /* unit: where light goes (spot, ies, directional, quad, disc) */
    struct lum_vec3 u, v;            /* quad, opening: half edges */
    float radius, area;              /* scene units */
    float omc_inner, omc_outer;      /* spot: 1 - cos of the half angles, which stays exact for narrow cones */
    struct lum_frame frame;          /* environment: t, b, n are the images of the picture's +X, +Y, +Z (environment.h).
                                      * web: of its directions, left-handed (web.h) */
    const struct lum_env_map *env;   /* environment image or sky, or NULL: constant */
    uint64_t env_hash;               /* of a sky, for a copy of the light that outlives it; 0: none, or an image */
    const struct lum_web *web;       /* ies; else NULL */
    uint64_t web_hash;               /* of it, for a copy of the light that outlives it */
    uint32_t instance;               /* mesh emitter: its instance */
    const float *tri_cdf;            /* mesh emitter: n_triangles inclusive prefix sums of area, last = area */
    const struct lum_facets *facets; /* mesh emitter of few triangles, without texture or holes: relative to facets_at
                                      * (facets.h); else NULL */
    struct lum_vec3 facets_at;
    float mean_emission; /* mesh: mean luminance over its area of what texture and holes leave of power */
    bool both_sides;     /* mesh emitter: shines from both; else from the side that its triangles wind around */
    uint32_t shape;      /* index among the accel shapes, or LUM_NO_OBJECT */
    bool on, camera_visible;
    bool delta; /* point, directional: cannot be hit */
    char id[LUM_ID_MAX + 1], group[LUM_ID_MAX + 1];
};

/* active: lights that are on and have power > 0. Their CDF is by emitted flux. */
struct lum_light_table {
    const struct lum_light *lights;
    uint32_t n_lights;
    const uint32_t *active;  /* indices of them */
    const float *active_cdf; /* inclusive, last = 1 */
    const float *pick_pdf;   /* per light: probability of being picked; 0 when it does not emit */
    uint32_t n_active;
    const struct lum_light_tree *tree; /* of those that are somewhere (tree.h) */
    const uint32_t *afar;              /* indices of those active that are not in it */
    uint32_t n_afar;
    float tree_share;     /* sum of pick_pdf of those that are in it; 0: fewer than two of them emit */
    uint32_t environment; /* index, or LUM_NO_OBJECT */
    float scene_radius;   /* of the sphere around the bounds */
};

/* Picks an emitting light, for no place above others (see tree.h); u is remapped to a fresh number. LUM_NO_OBJECT when
 * none emits. */
uint32_t lum_lights_pick(const struct lum_light_table *t, float *inout_u, float *ret_prob);

/* True when it is nowhere: directional, a far disc, an environment. */
bool lum_light_is_from_afar(const struct lum_light *l);

/* True for an environment without a part that is so much brighter than the rest that it casts shadows with edges. */
bool lum_light_is_even_sky(const struct lum_light *l);

/* True when light b sends its light along the same paths as a: power and switch aside. */
bool lum_light_same_shape(const struct lum_light *a, const struct lum_light *b);

/* Radiance that emitter i sends from a hit surface towards -d (0 from the back of quads, discs, spheres and meshes that
 * shine from one side): lum_surface.emission. Of a mesh its BSDF has it with its texture. d: unit. */
struct lum_rgb lum_light_emitted(const struct lum_light *l, struct lum_vec3 d, bool backface);
/* Radiance arriving along a ray that leaves the scene in direction d: the environment, or black. camera_ray: respects
 * camera_visible. */
struct lum_rgb lum_lights_background(const struct lum_light_table *t, struct lum_vec3 d, bool camera_ray);

#endif

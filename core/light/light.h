/* Lights at render time: evaluation and sampling. All in scene space (snapshot.h has the units). */
#ifndef LUM_CORE_LIGHT_LIGHT_H
#define LUM_CORE_LIGHT_LIGHT_H

#include "core/base/base.h"
#include "core/light/falloff.h"
#include "core/light/rect.h"
#include "core/math/rgb.h"
#include "core/math/vec.h"

struct lum_instance;
struct lum_snapshot;
struct lum_env_map; /* luminance distribution of an environment image (light/environment.c) */

enum lum_emitter {
    LUM_EMIT_POINT, /* with a falloff: point, spot */
    LUM_EMIT_DIRECTIONAL,
    LUM_EMIT_QUAD,
    LUM_EMIT_DISC,
    LUM_EMIT_SPHERE,
    LUM_EMIT_MESH,
    LUM_EMIT_ENVIRONMENT,
};

struct lum_light {
    enum lum_emitter kind;
    enum lum_falloff falloff;      /* point */
    struct lum_rgb power;          /* cd * scale^2 (point), lx (directional), cd/m2 (area, mesh, environment tint) */
    struct lum_vec3 p;             /* centre */
    struct lum_vec3 n;             /* unit: where light goes (spot, directional, quad, disc) */
    struct lum_vec3 u, v;          /* quad: half edges */
    float radius, area;            /* scene units */
    float omc_inner, omc_outer;    /* spot: 1 - cos of the half angles, which stays exact for narrow cones */
    struct lum_frame env_frame;    /* environment: t, b, n are the images of the picture's +X, +Y, +Z (environment.h) */
    const struct lum_env_map *env; /* environment image, or NULL: constant */
    uint32_t instance;             /* mesh emitter: its instance */
    const float *tri_cdf;          /* mesh emitter: n_triangles inclusive prefix sums of area, last = area */
    float
        mean_emission; /* mesh emitter: mean luminance over its area of what its texture and its holes leave of power */
    bool both_sides;   /* mesh emitter: shines from both; else from the side that its triangles wind around */
    uint32_t shape;    /* index among the accel shapes, or LUM_NO_OBJECT */
    bool on, camera_visible;
    bool delta; /* point, directional: cannot be hit */
    char id[LUM_ID_MAX + 1], group[LUM_ID_MAX + 1];
};

/* Lights that are on and have power > 0 are in [0, n_active) of the order table; the CDF over them is by emitted flux.
 */
struct lum_light_table {
    const struct lum_light *lights;
    uint32_t n_lights;
    const uint32_t *active;  /* indices of lights that emit */
    const float *active_cdf; /* inclusive, last = 1 */
    const float *pick_pdf;   /* per light: probability of being picked; 0 when it does not emit */
    uint32_t n_active;
    uint32_t environment; /* index, or LUM_NO_OBJECT */
    float scene_radius;   /* of the sphere around the bounds */
};

/* Picks an emitting light; u is remapped to a fresh number. LUM_NO_OBJECT when none emits. */
uint32_t lum_lights_pick(const struct lum_light_table *t, float *inout_u, float *ret_prob);

/* A point light nearer than this, in scene units, shines as from this far: the scale of lum_ray_offset, below which its
 * side of the surface is not known. Keeps 1 / r^2 finite. */
#define LUM_POINT_LIGHT_NEAR 0x1p-16f

struct lum_light_sample {
    struct lum_vec3 wi;      /* unit, from the point to the light */
    float distance;          /* to the light; INFINITY for directional and environment */
    struct lum_rgb radiance; /* arriving radiance; delta lights: irradiance on a plane facing wi */
    float pdf_sa;            /* solid angle, given this light was picked; 0 for delta lights */
};
/* Samples light i as seen from p. False when it cannot reach p (behind, inside a sphere, zero area, outside the cone).
 * Quads are sampled over the spherical rectangle (Urena 2013; by area below 1e-3 sr and when u and v are not at right
 * angles), spheres over the cone, discs and meshes over area (meshes emit nothing where they are see-through), images
 * over luminance, a constant environment over the sphere. Thread: any. */
bool lum_light_sample_at(const struct lum_snapshot *s, uint32_t i, struct lum_vec3 p, struct lum_vec2 u,
                         struct lum_light_sample *ret_sample);

/* The same of an environment, which is seen alike from everywhere. */
bool lum_environment_sample(const struct lum_light *l, struct lum_vec2 u, struct lum_light_sample *ret_sample);
/* True for an environment without a part that is so much brighter than the rest that it casts shadows with edges. */
bool lum_light_is_even_sky(const struct lum_light *l);

/* The same where it may be of another pdf (lum_light_plain_pdf): quads are sampled by area, which costs a fifth, unless
 * they are so near that the weights would differ much. */
bool lum_light_sample_plainly(const struct lum_snapshot *s, uint32_t i, struct lum_vec3 p, struct lum_vec2 u,
                              struct lum_light_sample *ret_sample);

/* A light as seen from one point: what all samples of it there have in common. They are those of
 * lum_light_sample_plainly. Borrows the snapshot. */
struct lum_light_view {
    const struct lum_snapshot *snapshot;
    uint32_t index;
    struct lum_vec3 p;
    enum lum_light_view_kind {
        LUM_VIEW_NONE,  /* nothing of the light reaches p */
        LUM_VIEW_AREA,  /* a quad, by area */
        LUM_VIEW_ANGLE, /* a quad, by solid angle: rect is set */
        LUM_VIEW_OTHER,
    } kind;
    struct lum_rect_view rect;
};
void lum_light_look(const struct lum_snapshot *s, uint32_t i, struct lum_vec3 p, struct lum_light_view *ret_view);
bool lum_light_view_sample(const struct lum_light_view *view, struct lum_vec2 u, struct lum_light_sample *ret_sample);
/* Cosine at a surface of unit normal n, over pdf_sa, of the samples that are asked for, one by bit: what each is worth
 * to a matte surface. Negative: it is below the horizon; 0: there is none. Others are undefined. */
#define LUM_LIGHT_WEIGHTS 16u
void lum_light_view_weights(const struct lum_light_view *view, struct lum_vec3 n,
                            const struct lum_vec2 u[LUM_LIGHT_WEIGHTS], uint32_t asked,
                            float ret_weight[LUM_LIGHT_WEIGHTS]);

/* pdf_sa with which lum_light_sample_at would make the direction p -> p_light (on light i, geometric normal ng_light).
 * For the environment p_light and ng_light are unused. For MIS. */
float lum_light_pdf(const struct lum_snapshot *s, uint32_t i, struct lum_vec3 p, struct lum_vec3 wi,
                    struct lum_vec3 p_light, struct lum_vec3 ng_light);
/* The same of lum_light_sample_plainly. */
float lum_light_plain_pdf(const struct lum_snapshot *s, uint32_t i, struct lum_vec3 p, struct lum_vec3 wi,
                          struct lum_vec3 p_light, struct lum_vec3 ng_light);

/* What lum_light_pdf says where it is the same for all directions in which light i is seen from p: over solid angle,
 * within 2e-4. 0: it is not. */
float lum_light_even_pdf(const struct lum_snapshot *s, uint32_t i, struct lum_vec3 p);

/* What many points at once make of one u. */
enum lum_target_kind {
    LUM_TARGET_NONE,      /* a see-through place: no point has a sample */
    LUM_TARGET_QUAD,      /* a point of it that depends on whence it is seen */
    LUM_TARGET_POINT,     /* p, of an area: its pdf over solid angle is r^2 / (cos area) */
    LUM_TARGET_DIRECTION, /* wi, of one pdf */
    LUM_TARGET_EACH,      /* of each point lum_light_sample_at */
};
struct lum_light_target {
    enum lum_target_kind kind;
    struct lum_vec3 p, n; /* POINT: where it lies, QUAD: its centre, and the unit normal there */
    struct lum_vec3 u, v; /* QUAD: half edges */
    bool both_sides;      /* POINT: it shines from */
    float area;           /* POINT, QUAD */
    float near2;          /* QUAD: what lies within sqrt(near2) of its centre has lum_light_sample_at */
    struct lum_vec3 wi;   /* DIRECTION */
    float pdf_sa;
    struct lum_rgb radiance; /* POINT, QUAD, DIRECTION */
};
void lum_light_aim(const struct lum_snapshot *s, uint32_t i, struct lum_vec2 u, struct lum_light_target *ret_target);

/* A place on a disc or a mesh, whose samples lie evenly over the area: the same from wherever it is seen. */
struct lum_emitter_point {
    struct lum_vec3 p,
        n; /* n: unit, of a mesh by winding, of one that shines from one side towards it; 0: nothing shines there */
    struct lum_rgb per_power; /* radiance per unit of power: the emission texture */
};
/* False: of other kinds of light, and in see-through places of a mesh. */
bool lum_emitter_point(const struct lum_snapshot *s, const struct lum_light *l, struct lum_vec2 u,
                       struct lum_emitter_point *ret_place);
/* lum_light_sample_at of the u that led to this place. */
bool lum_light_sample_place(const struct lum_light *l, struct lum_vec3 p, const struct lum_emitter_point *place,
                            struct lum_light_sample *ret_sample);

/* Light that leaves a light (light/emit.c), for paths that start there. */
struct lum_light_ray {
    struct lum_vec3 o, d;     /* d: unit. o: off the emitter's surface, ready to trace */
    struct lum_rgb flux_unit; /* per unit of power; its mean over both u is the light's flux */
};
/* Position and direction in proportion to what is emitted, so that every shot carries the same flux, but for textures,
 * images and colour. Light from afar enters through the box around the scene: directional light is uniform over the
 * faces that it sees, a constant environment is a box that shines inwards. False: nothing leaves there. Thread: any. */
bool lum_light_emit(const struct lum_snapshot *s, uint32_t i, struct lum_vec2 u_position, struct lum_vec2 u_direction,
                    struct lum_light_ray *ret_shot);
/* Flux of a light per unit of power: the mean luminance of flux_unit.
 * bounds: of all geometry; lo > hi when there is none. */
double lum_light_flux_unit(const struct lum_light *l, struct lum_vec3 bounds_lo, struct lum_vec3 bounds_hi);
/* Likewise of a mesh emitter of this area, in whatever unit. */
double lum_mesh_light_flux(const struct lum_light *l, double area);

/* True when light b sends its light along the same paths as a: power and switch aside. */
bool lum_light_same_shape(const struct lum_light *a, const struct lum_light *b);

/* Radiance that emitter i sends from a hit surface towards -d (0 from the back of quads, discs, spheres and meshes that
 * shine from one side). Of a mesh that is lum_surface.emission: its BSDF has it with its texture. */
struct lum_rgb lum_light_emitted(const struct lum_light *l, bool backface);
/* Radiance arriving along a ray that leaves the scene in direction d: the environment, or black. camera_ray: respects
 * camera_visible. */
struct lum_rgb lum_lights_background(const struct lum_light_table *t, struct lum_vec3 d, bool camera_ray);

#endif

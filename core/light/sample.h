/* Sampling a light as it is seen from a point. */
#ifndef LUM_CORE_LIGHT_SAMPLE_H
#define LUM_CORE_LIGHT_SAMPLE_H

#include <stdbool.h>
#include <stdint.h>

#include "core/light/facets.h"
#include "core/light/rect.h"
#include "core/math/rgb.h"
#include "core/math/vec.h"

struct lum_light;
struct lum_portals;
struct lum_snapshot;

struct lum_light_sample {
    struct lum_vec3 wi;      /* unit, from the point to the light */
    float distance;          /* to the light; INFINITY for directional and environment */
    struct lum_rgb radiance; /* arriving radiance; delta lights: irradiance on a plane facing wi */
    float pdf_sa;            /* solid angle, given this light was picked; 0 for delta lights */
};
/* Samples light i as seen from p. False when it cannot reach p (behind, inside a sphere, zero area, outside the cone).
 * Quads are sampled over the spherical rectangle (Urena 2013; by area below 1e-3 sr and when u and v are not at right
 * angles), spheres over the cone, discs and meshes over area (meshes emit nothing where they are see-through), those of
 * few triangles over solid angle where that is large (facets.h), images over luminance, a constant environment over the
 * sphere. Thread: any. */
bool lum_light_sample_at(const struct lum_snapshot *s, uint32_t i, struct lum_vec3 p, struct lum_vec2 u,
                         struct lum_light_sample *ret_sample);

/* The same of an environment, which is seen alike from everywhere. */
bool lum_environment_sample(const struct lum_light *l, struct lum_vec2 u, struct lum_light_sample *ret_sample);

/* An environment as seen from p by way of portals (light/portals.h; NULL: none) as often as all around, where p is in
 * their box; and the pdf with which unit direction wi comes of that. */
bool lum_environment_sample_by_portals(const struct lum_light *l, const struct lum_portals *portals, struct lum_vec3 p,
                                       struct lum_vec2 u, struct lum_light_sample *ret_sample);
float lum_environment_pdf_by_portals(const struct lum_light *l, const struct lum_portals *portals, struct lum_vec3 p,
                                     struct lum_vec3 wi);

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
        LUM_VIEW_NONE,   /* nothing of the light reaches p */
        LUM_VIEW_AREA,   /* a quad, by area */
        LUM_VIEW_ANGLE,  /* a quad, by solid angle: rect is set */
        LUM_VIEW_FACETS, /* a mesh of few triangles, by solid angle: facets is set */
        LUM_VIEW_OTHER,
    } kind;
    union {
        struct lum_rect_view rect;
        struct lum_facets_view facets;
    };
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
    struct lum_vec3 p, n;   /* POINT: where it lies, QUAD: its centre, and the unit normal there */
    struct lum_vec3 u, v;   /* QUAD: half edges */
    bool both_sides;        /* POINT: it shines from */
    float area;             /* POINT, QUAD */
    float near2;            /* POINT, QUAD: what lies within sqrt(near2) of its centre has lum_light_sample_at */
    struct lum_vec3 centre; /* POINT: of the light, if near2 is above 0 */
    struct lum_vec3 wi;     /* DIRECTION */
    float pdf_sa;
    struct lum_rgb radiance; /* POINT, QUAD, DIRECTION */
};
void lum_light_aim(const struct lum_snapshot *s, uint32_t i, struct lum_vec2 u, struct lum_light_target *ret_target);

/* A place on a disc or a mesh, of samples that lie evenly over the area: the same from wherever it is seen. */
struct lum_light_place {
    struct lum_vec3 p, n;     /* n: unit, of a mesh by winding, or towards its one shining side; 0: nothing shines */
    struct lum_rgb per_power; /* radiance per unit of power: the emission texture */
};
/* False: of other kinds of light, and in see-through places of a mesh. */
bool lum_light_place(const struct lum_snapshot *s, const struct lum_light *l, struct lum_vec2 u,
                     struct lum_light_place *ret_place);
/* lum_light_sample_at of the u that led to this place, but for those who are near a mesh of few triangles (facets.h):
 * they have lum_light_sample_near. False: they are not. */
bool lum_light_sample_near(const struct lum_light *l, struct lum_vec3 p, struct lum_vec2 u,
                           struct lum_light_sample *ret_sample);
bool lum_light_sample_place(const struct lum_light *l, struct lum_vec3 p, const struct lum_light_place *place,
                            struct lum_light_sample *ret_sample);

#endif

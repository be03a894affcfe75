/* How much light an emitter sends to a point of a surface when nothing is in the way, in closed form. */
#ifndef LUM_CORE_LIGHT_IRRADIANCE_H
#define LUM_CORE_LIGHT_IRRADIANCE_H

#include "core/light/light.h"

struct lum_irradiance {
    float cosine_integral; /* of max(0, n.w) over the directions w in which the emitter is seen: irradiance at radiance
                              1, 0 .. pi */
    float mean_cos;        /* n.w, averaged over these directions; for lobes that are nearly Lambert's */
};

/* At n_points points p of surfaces whose normals n are unit vectors. Exact for quads (Lambert 1760: the polygon,
 * clipped at the horizon), discs (its contour integral, which is elementary on the circle and on the chord of the
 * horizon), spheres (Snyder 1996), convex meshes of few triangles (facets.h) and a constant environment, all from
 * their emitting side only. What a point gets does
 * not depend on the others. */
void lum_light_irradiance(const struct lum_light *l, uint32_t n_points, const struct lum_vec3 *p,
                          const struct lum_vec3 *n, struct lum_irradiance *ret);
/* False: it must not be asked for. There is no closed form for meshes that are not convex or not even, environment
 * images and lights without an area. */
bool lum_light_has_irradiance(const struct lum_light *l);

/* The outline of a flat or convex light, edge by edge, as it is seen from a point: relative to that, clockwise as seen
 * from where the light goes, in any order. It is clipped at the horizon of n, a unit vector. */
struct lum_outline {
    struct lum_vec3d n, e; /* e: the integral of directions, so far */
    struct lum_vec3d out, in;
    int crossings; /* of the horizon: down at `out`, up at `in`; more than two are not told apart */
};
void lum_outline_add(struct lum_outline *inout, struct lum_vec3d a, struct lum_vec3d b);
/* Along the horizon, where it crosses that. */
void lum_outline_close(struct lum_outline *inout);
struct lum_irradiance lum_outline_irradiance(struct lum_outline *inout);

/* The solid angle of a quad that is far from p, within 2e-4. False: it is near, or p behind. */
bool lum_quad_far(const struct lum_light *l, struct lum_vec3 p, float *ret_solid_angle);

#endif

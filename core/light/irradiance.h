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
 * horizon), spheres (Snyder 1996) and a constant environment, all from their emitting side only. What a point gets does
 * not depend on the others. */
void lum_light_irradiance(const struct lum_light *l, uint32_t n_points, const struct lum_vec3 *p,
                          const struct lum_vec3 *n, struct lum_irradiance *ret);
/* False: it must not be asked for. There is no closed form for meshes, environment images and lights without an area.
 */
bool lum_light_has_irradiance(const struct lum_light *l);

/* The solid angle of a quad that is far from p, within 2e-4. False: it is near, or p behind. */
bool lum_quad_far(const struct lum_light *l, struct lum_vec3 p, float *ret_solid_angle);

#endif

/* How the intensity of a light at a point goes with direction: a row of functions. */
#ifndef LUM_CORE_LIGHT_FALLOFF_H
#define LUM_CORE_LIGHT_FALLOFF_H

#include <stdbool.h>

#include "core/math/vec.h"

struct lum_light;

struct lum_falloff {
    /* Share of the light's intensity, 0 to 1, that goes to where wi (unit) points to the light from. */
    float (*share)(const struct lum_light *l, struct lum_vec3 wi);
    /* Flux per unit of that intensity: the integral of the share over the sphere, in sr. */
    double (*flux)(const struct lum_light *l);
    /* A direction (unit) in proportion to intensity. Undefined where the flux is 0. */
    struct lum_vec3 (*draw)(const struct lum_light *l, struct lum_vec2 u);
    bool cone; /* dark outside the outer cone */
};
extern const struct lum_falloff lum_falloff_even, /* the same all around */
    lum_falloff_spot,                             /* all in the inner cone, none outside the outer */
    lum_falloff_web;                              /* as measured (web.h) */

/* Of a spot at an angle from its axis, given as 1 - cos, which stays exact for narrow cones. */
float lum_spot_share(const struct lum_light *l, float one_minus_cos);

#endif

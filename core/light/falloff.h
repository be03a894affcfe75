/* How the intensity of a light at a point falls off around its axis: a row of functions. */
#ifndef LUM_CORE_LIGHT_FALLOFF_H
#define LUM_CORE_LIGHT_FALLOFF_H

#include <stdbool.h>

#include "core/math/vec.h"

struct lum_light;

struct lum_falloff {
    /* Share of the intensity on the axis at an angle from it, given as 1 - cos, which stays exact for narrow cones. */
    float (*share)(const struct lum_light *l, float one_minus_cos);
    /* Flux per unit of that intensity: the integral of the share over the sphere, in sr. */
    double (*flux)(const struct lum_light *l);
    /* A direction (unit) in proportion to intensity. Undefined where the flux is 0. */
    struct lum_vec3 (*draw)(const struct lum_light *l, struct lum_vec2 u);
    bool cone; /* dark outside the outer cone */
};
extern const struct lum_falloff lum_falloff_even, /* the same all around */
    lum_falloff_spot;                             /* all in the inner cone, none outside the outer */

/* The share that goes to where wi (unit) points to the light from. */
float lum_falloff_towards(const struct lum_light *l, struct lum_vec3 wi);

#endif

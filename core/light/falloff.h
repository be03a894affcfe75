/* How the intensity of a light at a point falls off around its axis. One is a row of falloff.c. */
#ifndef LUM_CORE_LIGHT_FALLOFF_H
#define LUM_CORE_LIGHT_FALLOFF_H

#include "core/math/vec.h"

struct lum_light;

enum lum_falloff {
    LUM_FALLOFF_EVEN, /* the same all around */
    LUM_FALLOFF_SPOT, /* all in the inner cone, none outside the outer */
};

/* Share of the intensity on the axis at an angle from it, given as 1 - cos, which stays exact for narrow cones. */
float lum_falloff_at(const struct lum_light *l, float one_minus_cos);
/* The same of what goes to where wi (unit) points to the light from. */
float lum_falloff_towards(const struct lum_light *l, struct lum_vec3 wi);
/* Flux per unit of that intensity: the integral of the share over the sphere, in sr. */
double lum_falloff_flux(const struct lum_light *l);
/* A direction (unit) in proportion to intensity. Undefined where the flux is 0. */
struct lum_vec3 lum_falloff_draw(const struct lum_light *l, struct lum_vec2 u);

#endif

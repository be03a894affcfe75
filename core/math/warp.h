/* Maps from the unit square to other domains. All keep strata together and have a constant Jacobian times the stated
 * pdf. */
#ifndef LUM_CORE_MATH_WARP_H
#define LUM_CORE_MATH_WARP_H

#include "core/math/vec.h"

/* Unit disc, pdf 1 / pi (Shirley & Chiu 1997: concentric). */
static inline struct lum_vec2 lum_warp_disc(struct lum_vec2 u)
{
    float x = 2.0f * u.x - 1.0f, y = 2.0f * u.y - 1.0f;
    if (x == 0.0f && y == 0.0f)
        return (struct lum_vec2){0.0f, 0.0f};
    bool wide = fabsf(x) > fabsf(y);
    float r = wide ? x : y;
    float phi = wide ? 0.25f * LUM_PI * (y / x) : 0.5f * LUM_PI - 0.25f * LUM_PI * (x / y);
    return (struct lum_vec2){r * cosf(phi), r * sinf(phi)};
}

/* Hemisphere around +z, pdf_sa = z / pi. z is 0 only where the disc point rounds onto the rim. */
static inline struct lum_vec3 lum_warp_cosine(struct lum_vec2 u)
{
    struct lum_vec2 d = lum_warp_disc(u);
    return lum_v3(d.x, d.y, sqrtf(lum_max(1.0f - d.x * d.x - d.y * d.y, 0.0f)));
}

/* Directions within an angle of +z, given one_minus_cos of that angle in (0, 2], which stays exact for narrow cones.
 * pdf_sa = 1 / (2 pi one_minus_cos). */
static inline struct lum_vec3 lum_warp_cone(struct lum_vec2 u, float one_minus_cos)
{
    float omc = u.x * one_minus_cos, s = sqrtf(lum_max(omc * (2.0f - omc), 0.0f)), phi = 2.0f * LUM_PI * u.y;
    return lum_v3(s * cosf(phi), s * sinf(phi), 1.0f - omc);
}

/* Barycentric weights of vertices 1 and 2, uniform over the triangle. */
static inline struct lum_vec2 lum_warp_triangle(struct lum_vec2 u)
{
    float s = sqrtf(u.x);
    return (struct lum_vec2){s * (1.0f - u.y), s * u.y};
}

/* Weight of a sample made with density a that another technique makes with density b: the power heuristic (Veach 1995).
 * As a ratio, because squares of densities of tiny lights overflow. */
static inline float lum_power_heuristic(float pdf_a, float pdf_b)
{
    if (!(pdf_a > 0.0f))
        return 0.0f;
    float r = pdf_b / pdf_a;
    return 1.0f / (1.0f + r * r);
}

#endif

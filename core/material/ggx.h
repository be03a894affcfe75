/* The GGX distribution of microfacets, isotropic. Directions are local: z is the macroscopic normal.
 *
 * Everything is written without a division by a cosine, so that grazing directions need no guard. alpha >=
 * LUM_ALPHA_MIN. */
#ifndef LUM_CORE_MATERIAL_GGX_H
#define LUM_CORE_MATERIAL_GGX_H

#include <stdint.h>

#include "core/math/vec.h"

#define LUM_ALPHA_MIN 1e-3f /* below: delta lobe (pbrt's threshold, NOTES H18) */

/* Density of microfacet normals h (unit, h.z >= 0). The denominator is alpha^2 cos^2 + sin^2 with sin^2 taken from x
 * and y: no cancellation near the peak. */
static inline float lum_ggx_d(struct lum_vec3 h, float alpha)
{
    float t = alpha * alpha * h.z * h.z + h.x * h.x + h.y * h.y;
    return alpha * alpha / (LUM_PI * t * t);
}

/* cos * sqrt(1 + alpha^2 tan^2), finite at cos = 0. */
static inline float lum_ggx_s(float cos, float alpha)
{
    return sqrtf(alpha * alpha + (1.0f - alpha * alpha) * cos * cos);
}

/* G1(o) / o.z (Smith). */
static inline float lum_ggx_g1_over_cos(float cos_o, float alpha)
{
    return 2.0f / (cos_o + lum_ggx_s(cos_o, alpha));
}

/* G2(o, i) / (o.z i.z), height-correlated Smith (Heitz 2014 eq. 99); both cosines as positive numbers. Never divides by
 * 0: the sum vanishes only where both cosines do and alpha does, and alpha does not. */
static inline float lum_ggx_g2_over_cos(float cos_o, float cos_i, float alpha)
{
    float t = cos_i * lum_ggx_s(cos_o, alpha) + cos_o * lum_ggx_s(cos_i, alpha);
    return t > 0.0f ? 2.0f / t : 0.0f;
}

/* A microfacet normal with the density of those visible from o: G1(o) max(0, o.h) D(h) / o.z (Dupuy & Benyoub 2023: the
 * reflection of a spherical cap). */
static inline struct lum_vec3 lum_ggx_sample_visible(struct lum_vec3 o, float alpha, struct lum_vec2 u)
{
    struct lum_vec3 w = lum_normalize(lum_v3(o.x * alpha, o.y * alpha, o.z));
    float phi = 2.0f * LUM_PI * u.x;
    float z = (1.0f - u.y) * (1.0f + w.z) - w.z;
    float s = sqrtf(lum_max(1.0f - z * z, 0.0f));
    struct lum_vec3 c = lum_v3(s * cosf(phi) + w.x, s * sinf(phi) + w.y, z + w.z);
    return lum_normalize(lum_v3(c.x * alpha, c.y * alpha, lum_max(c.z, 0.0f)));
}

/* Row of the albedo table for a roughness: looked up once for a surface, used for every direction. */
struct lum_ggx_row {
    uint32_t i;
    float w; /* of row i + 1; below 0: a mirror */
};
struct lum_ggx_row lum_ggx_row(float alpha); /* 0: the mirror */

/* Directional albedo of single-scattering reflection with Schlick's Fresnel, as f0 * scale + f90 * bias.
 * cos_o = the cosine; _mean: averaged over the hemisphere with weight 2 cos. Interpolated from a table, within 0.01
 * everywhere, 0.002 on average. */
struct lum_ggx_albedo {
    float scale, bias;
};
struct lum_ggx_albedo lum_ggx_albedo(struct lum_ggx_row row, float cos_o);
struct lum_ggx_albedo lum_ggx_albedo_mean(struct lum_ggx_row row);

#endif

/* The GGX distribution where microfacets lean farther one way than across (brushed metal, KHR_materials_anisotropy):
 * alpha.x along the local x axis, alpha.y along y. With both alike these are the functions of ggx.h.
 *
 * D: Burley 2012, section B.2, eq. 13. Smith's shadowing depends on the azimuth by the roughness seen from there: Heitz
 * 2014, eq. 80 and 86. Cosines enter squared or as absolute values where the comment says so. */
#ifndef LUM_CORE_MATERIAL_BRUSHED_H
#define LUM_CORE_MATERIAL_BRUSHED_H

#include "core/base/base.h"
#include "core/material/ggx.h"

/* Roughness along the stretch of an interface whose roughness across is alpha: the specification of
 * KHR_materials_anisotropy. */
static inline float lum_brushed_along(float alpha, float strength)
{
    float w = strength * strength;
    return alpha * (1.0f - w) + w;
}

/* Density of microfacet normals h (unit, h.z >= 0). */
static inline float lum_brushed_d(struct lum_vec3 h, struct lum_vec2 alpha)
{
    float a2 = alpha.x * alpha.y, x = h.x * alpha.y, y = h.y * alpha.x, z = h.z * a2;
    float t = x * x + y * y + z * z; /* of lum_ggx_d: times a2 */
    return a2 * a2 * a2 / (LUM_PI * t * t);
}

/* As lum_ggx_s: |cos| sqrt(1 + (roughness seen from there)^2 tan^2). */
static inline float lum_brushed_s(struct lum_vec3 w, struct lum_vec2 alpha)
{
    float x = w.x * alpha.x, y = w.y * alpha.y;
    return sqrtf(x * x + y * y + w.z * w.z);
}

static inline float lum_brushed_g1_over_cos(struct lum_vec3 o, struct lum_vec2 alpha)
{
    return 2.0f / (o.z + lum_brushed_s(o, alpha));
}

/* i may be on the other side. */
static inline float lum_brushed_g2_over_cos(struct lum_vec3 o, struct lum_vec3 i, struct lum_vec2 alpha)
{
    float t = fabsf(i.z) * lum_brushed_s(o, alpha) + o.z * lum_brushed_s(i, alpha);
    return t > 0.0f ? 2.0f / t : 0.0f;
}

/* As lum_ggx_sample_visible. */
static inline struct lum_vec3 lum_brushed_sample_visible(struct lum_vec3 o, struct lum_vec2 alpha, struct lum_vec2 u)
{
    struct lum_vec3 w = lum_normalize(lum_v3(o.x * alpha.x, o.y * alpha.y, o.z));
    float phi = 2.0f * LUM_PI * u.x;
    float z = (1.0f - u.y) * (1.0f + w.z) - w.z;
    float s = sqrtf(lum_max(1.0f - z * z, 0.0f));
    struct lum_vec3 c = lum_v3(s * cosf(phi) + w.x, s * sinf(phi) + w.y, z + w.z);
    return lum_normalize(lum_v3(c.x * alpha.x, c.y * alpha.y, lum_max(c.z, 0.0f)));
}

/* What such microfacets reflect of light that meets one of them: struct lum_ggx_albedo by strength, roughness across,
 * cosine and azimuth. A table, made by quadrature: the isotropic one is off by up to 0.4. Interpolated, within 0.02 of
 * the albedo, 0.003 on average. Immutable, shared. */
struct lum_brushed_table;
/* alpha: across. 0 or more: for that alone; else for all, where a texture says it. So with strength. NULL: no memory.
 */
struct lum_brushed_table *lum_brushed_table_create(float strength, float alpha);
bool lum_brushed_table_serves(const struct lum_brushed_table *table, float strength, float alpha); /* as created */
struct lum_brushed_table *lum_brushed_table_ref(const struct lum_brushed_table *table);
void lum_brushed_table_unref(const struct lum_brushed_table *table); /* accepts NULL */

/* Of a surface, for every direction. */
struct lum_brushed_row {
    struct lum_ggx_row alpha, strength;
};
struct lum_brushed_row lum_brushed_row(const struct lum_brushed_table *table, float strength, float alpha);
/* w: local, on either side; by a cosine: mean over azimuths; _mean: as lum_ggx_albedo_mean. */
struct lum_ggx_albedo lum_brushed_albedo(const struct lum_brushed_table *table, const struct lum_brushed_row *row,
                                         struct lum_vec3 w);
struct lum_ggx_albedo lum_brushed_albedo_at(const struct lum_brushed_table *table, const struct lum_brushed_row *row,
                                            float cos);
struct lum_ggx_albedo lum_brushed_albedo_mean(const struct lum_brushed_table *table, const struct lum_brushed_row *row);

#endif

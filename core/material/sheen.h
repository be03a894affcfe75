/* The fuzz of cloth: KHR_materials_sheen. Fibres that stand on the surface reflect towards grazing directions (the
 * distribution "Charlie" and its shadowing: Estevez & Kulla 2017), over what the surface is otherwise and below a clear
 * coat. What it reflects, of the largest channel, is taken from what lies below as a clear coat takes it
 * (clearcoat.h); of white fuzz under such a coat up to a twentieth is lost. Internal to core/material.
 *
 * Two deviations. Below a roughness of LUM_SHEEN_ROUGHNESS_MIN the fit of the shadowing sends back more than arrives:
 * less counts as that. And cosines below 0.002, a tenth of a degree, count as that: reciprocal still. */
#ifndef LUM_CORE_MATERIAL_SHEEN_H
#define LUM_CORE_MATERIAL_SHEEN_H

#include "core/material/bsdf.h"

#define LUM_SHEEN_ROUGHNESS_MIN (4.0f / 15.0f) /* the first row of the table of albedos */

/* Of a BSDF that is complete but for a clear coat. */
void lum_sheen_init(struct lum_bsdf *inout_bsdf, struct lum_rgb color, float roughness, struct lum_vec3 wo);

/* What it leaves at these cosines to what lies below: of even scattering, and of other. */
float lum_sheen_even(const struct lum_bsdf *b, float cos_i);
float lum_sheen_left(const struct lum_bsdf *b, float cos_i);
/* 1 - E at a cosine; 1 where there is no sheen. */
float lum_sheen_through(const struct lum_bsdf *b, float cos);

/* Dims the gloss of what lies below, and adds its own. o, i: local. above: i is on wo's side. */
void lum_sheen_add(const struct lum_bsdf *b, struct lum_vec3 o, struct lum_vec3 i, bool above,
                   struct lum_bsdf_value *inout_value);

#endif

/* A clear coat over all that a surface is otherwise: KHR_materials_clearcoat. A dielectric of index 1.5 with a
 * roughness and bumps of its own, on both sides, which does not follow the bumps of what lies below.
 *
 * It reflects E(wo) of what arrives, and leaves 1 - E to what lies below. The even part of that is dimmed by (1 -
 * E(wo)) (1 - E(wi)) / mean, as the base is by its own coat: together they return what arrives. What reflects by
 * microfacets, and glass, is dimmed by the lesser of 1 - E(wo) and 1 - E(wi): reciprocal, never more than arrives, all
 * of it of a mirror, and of a rough metal that is white up to a twentieth less. Emission is not dimmed. Internal to
 * core/material. */
#ifndef LUM_CORE_MATERIAL_CLEARCOAT_H
#define LUM_CORE_MATERIAL_CLEARCOAT_H

#include "core/material/bsdf.h"

/* Of a BSDF that is complete otherwise. alpha: 0, or LUM_ALPHA_MIN at least. n: its shading normal, without the bumps
 * of what lies below, facing wo. */
void lum_clearcoat_init(struct lum_bsdf *inout_bsdf, float weight, float alpha, struct lum_vec3 n, struct lum_vec3 wo);

/* What it leaves of light that goes at these cosines to what lies below: of even scattering, and of other. */
float lum_clearcoat_even(const struct lum_bsdf *b, float cos_i);
float lum_clearcoat_left(const struct lum_bsdf *b, float cos_i);
/* Dims the gloss of what lies below, and adds its own. cos_i: of wi, local. */
void lum_clearcoat_add(const struct lum_bsdf *b, struct lum_vec3 wo, struct lum_vec3 wi, float cos_i,
                       struct lum_bsdf_value *inout_value);

/* f |cos| of its mirror. */
float lum_clearcoat_mirror(const struct lum_bsdf *b, struct lum_vec3 wo);
/* Direction that it reflects wo into. False: into the surface. */
bool lum_clearcoat_reflect(const struct lum_bsdf *b, struct lum_vec3 wo, struct lum_vec2 u, struct lum_vec3 *ret_wi);

/* Albedo for light from wo, of gloss alone. */
float lum_clearcoat_gloss_albedo(const struct lum_bsdf *b, struct lum_vec3 wo);

#endif

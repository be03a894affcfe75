/* What a BSDF (bsdf_model.h) does: its values and densities, what is sampled of it, and its albedos. */
#ifndef LUM_CORE_MATERIAL_BSDF_H
#define LUM_CORE_MATERIAL_BSDF_H

#include "core/material/bsdf_model.h"

/* f(wo, wi) |cos wi| of the non-delta lobes, and the solid-angle pdf with which lum_bsdf_sample makes wi. wo as given
 * to lum_bsdf_init. Black and 0 where wi lies on different sides of the shading and of the geometric normal (light
 * leaks, else). Transmission is of radiance: it includes eta^2. */
struct lum_rgb lum_bsdf_eval(const struct lum_bsdf *b, struct lum_vec3 wo, struct lum_vec3 wi, float *ret_pdf_sa);

/* The same in two parts: of the cosine-shaped lobes (diffuse base, light from several microfacets), and the rest. */
struct lum_bsdf_value {
    struct lum_rgb diffuse, gloss;
    float pdf_sa;       /* of the whole mixture */
    float gloss_pdf_sa; /* of lum_bsdf_gloss alone */
};
struct lum_bsdf_value lum_bsdf_eval_parts(const struct lum_bsdf *b, struct lum_vec3 wo, struct lum_vec3 wi);

/* gloss and gloss_pdf_sa of that, for n directions. */
void lum_bsdf_eval_gloss(const struct lum_bsdf *b, struct lum_vec3 wo, uint32_t n, const struct lum_vec3 *wi,
                         struct lum_rgb *ret_gloss, float *ret_pdf_sa);

/* True when the clear coat reflects with a gloss; when anything does, or may. */
static inline bool lum_clearcoat_is_gloss(const struct lum_bsdf *b)
{
    return b->clear.share > 0.0f && b->clear.alpha > 0.0f;
}
static inline bool lum_bsdf_has_gloss(const struct lum_bsdf *b)
{
    return b->alpha > 0.0f || b->sheen.share > 0.0f || lum_clearcoat_is_gloss(b);
}

/* pdf of the cosine-shaped lobes alone. */
float lum_bsdf_cosine_pdf(const struct lum_bsdf *b, struct lum_vec3 wi);

/* Albedo of the cosine-shaped lobes of this side for light that arrives at a cosine: their f |cos| is this times cos_i
 * / pi. Of brushed surfaces its mean over azimuths. */
struct lum_rgb lum_bsdf_diffuse_at(const struct lum_bsdf *b, float cos_i);

/* What the cosine-shaped lobes send towards wo under even light from everywhere above: integral of their f |cos|. */
struct lum_rgb lum_bsdf_diffuse_albedo(const struct lum_bsdf *b);

/* What of light that arrives from w, above or below, microfacets send on that it meets first; and the mean of that. */
struct lum_ggx_albedo lum_bsdf_facet_albedo(const struct lum_bsdf *b, struct lum_vec3 w);
struct lum_ggx_albedo lum_bsdf_facet_albedo_mean(const struct lum_bsdf *b);

/* What of light from wo leaves the base through its own coat, by a cosine: 1 where that has none. */
float lum_bsdf_through_base(const struct lum_bsdf *b, float cos);

/* What the fuzz of cloth sends on of light from wo. */
struct lum_rgb lum_bsdf_sheen_albedo(const struct lum_bsdf *b, struct lum_vec3 wo);

/* What glossy reflection sends on of light from wo; of delta lobes, of glass and of fuzz nothing. */
struct lum_rgb lum_bsdf_gloss_albedo(const struct lum_bsdf *b, struct lum_vec3 wo);

/* The strongest of the lobes that reflect so: roughness, and reflectance at normal incidence and at grazing. */
struct lum_gloss_lobe {
    float alpha, f0, f90;
};
struct lum_gloss_lobe lum_bsdf_gloss_lobe(const struct lum_bsdf *b, struct lum_vec3 wo);

/* The BSDF without its cosine-shaped lobes: for estimators that sample the rest alone. */
struct lum_bsdf lum_bsdf_gloss(const struct lum_bsdf *b);

struct lum_bsdf_sample {
    struct lum_vec3 wi;
    struct lum_rgb weight; /* f |cos| / pdf */
    float pdf_sa;          /* 0 for a delta lobe */
    enum lum_lobe lobe;
};
/* u: picks the direction, u_lobe: picks the lobe. False: absorbed. */
bool lum_bsdf_sample(const struct lum_bsdf *b, struct lum_vec3 wo, struct lum_vec2 u, float u_lobe,
                     struct lum_bsdf_sample *ret_sample);

/* All delta lobes at once, for methods that follow every branch: weights are of the lobes themselves, not divided by
 * the probability of choosing one. Returns how many. */
uint32_t lum_bsdf_delta_lobes(const struct lum_bsdf *b, struct lum_vec3 wo, struct lum_bsdf_sample ret_lobes[2]);

/* What is left of light that goes straight on through the surface to wo: of a pane its delta lobe's weight, else 0. */
struct lum_rgb lum_bsdf_straight(const struct lum_bsdf *b, struct lum_vec3 wo);

/* What thin rough glass lets through of light from wo: by one microfacet, and evenly by several. Black of any other. */
struct lum_rgb lum_bsdf_haze_albedo(const struct lum_bsdf *b, struct lum_vec3 wo, struct lum_rgb *ret_even);

/* Rough albedo for AOVs and demodulation: base, reflectance at normal incidence, tint of transmission. At most 1. */
struct lum_rgb lum_bsdf_albedo(const struct lum_bsdf *b);

/* What a sheet of two faces reflects and transmits, each of which reflects r: light leaves it after it crossed it 1, 3,
 * 5 ... times (transmitted) or 2, 4 ... times (reflected), losing 1 - tint each time. Of a coloured r its largest
 * channel is taken from what enters. */
void lum_glass_sheet(struct lum_rgb r, struct lum_rgb tint, struct lum_rgb *ret_up, struct lum_rgb *ret_down);

/* Fresnel reflectance of a dielectric, cos_i in [0,1], eta = n_i / n_t. 1 at total internal reflection. */
float lum_fresnel_dielectric(float cos_i, float eta);

#endif

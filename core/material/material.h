/* Materials at render time, and the BSDF they make at a point.
 *
 * The model is glTF 2.0's: a metallic GGX, or a dielectric GGX coat (Fresnel from ior and specular) over a base that is
 * diffuse or transmits. roughness^2 = alpha; alpha below LUM_ALPHA_MIN is a perfect mirror (delta). Reflection uses
 * height-correlated Smith and visible-normal sampling. (1 - F(v.h)) on the base keeps the sum reciprocal and at most 1. */
#ifndef LUM_CORE_MATERIAL_MATERIAL_H
#define LUM_CORE_MATERIAL_MATERIAL_H

#include "core/base/base.h"
#include "core/math/vec.h"
#include "core/scene/scene.h"

struct lum_surface;

#define LUM_ALPHA_MIN 1e-3f /* below: delta lobe (pbrt's threshold, algorithms D18) */

/* Decoded texels, immutable, shared. */
struct lum_image {
    struct lum_refs refs;
    enum lum_texel texel;
    uint32_t width, height;
    const void *pixels;
};

/* Bilinear, linear RGB(A); RGB32F reads alpha 1. uv (0,0) is the top left texel's corner, as in glTF. */
struct lum_texel_value {
    struct lum_rgb rgb;
    float a;
};
struct lum_texel_value lum_image_sample(const struct lum_image *image, struct lum_vec2 uv, enum lum_wrap wrap_u,
                                        enum lum_wrap wrap_v);

struct lum_texture {
    const struct lum_image *image; /* NULL: none */
    float m[2][3];                 /* uv' = m [u v 1] */
    enum lum_wrap wrap_u, wrap_v;
};

struct lum_material {
    struct lum_texture base_color_tex, metallic_roughness_tex, emission_tex, normal_tex;
    struct lum_rgb base_color, specular_color, emission; /* emission: radiance, cd/m2 */
    struct lum_rgb sigma_a; /* absorption inside a solid, per scene unit */
    float metallic, roughness, ior, specular, transmission, normal_scale, alpha, alpha_cutoff;
    enum lum_alpha_mode alpha_mode;
    bool thin, unlit;
    char id[LUM_ID_MAX + 1];
};

/* True when the material lets light through or mirrors without spread, so that a deferred method must recurse. */
bool lum_material_is_specular(const struct lum_material *m);

enum lum_lobe { LUM_LOBE_DIFFUSE, LUM_LOBE_GLOSSY, LUM_LOBE_REFLECT, LUM_LOBE_TRANSMIT, LUM_LOBE_GLOSSY_TRANSMIT };

/* The BSDF at one point: parameters looked up, frame built. */
struct lum_bsdf {
    struct lum_frame frame;  /* around ns */
    struct lum_vec3 ng;      /* unit, towards wo */
    struct lum_rgb diffuse;  /* albedo of the diffuse base */
    struct lum_rgb f0;       /* specular reflectance at normal incidence */
    float f90;
    struct lum_rgb transmit; /* tint of the transmitting base; black: none */
    float alpha;             /* GGX roughness; 0: delta */
    float eta;               /* ior outside / ior inside as seen by wo (1: nothing bends) */
    bool thin;
    struct lum_rgb emission; /* towards wo */
};

/* wo: unit, away from the surface, on surface->ng's side. */
void lum_bsdf_init(struct lum_bsdf *ret_bsdf, const struct lum_material *m, const struct lum_surface *s, struct lum_vec3 wo);

/* f(wo, wi) |cos wi| of the non-delta lobes, and the solid-angle pdf with which lum_bsdf_sample makes wi. Black and 0 where
 * shading and geometric side disagree (algorithms D11). */
struct lum_rgb lum_bsdf_eval(const struct lum_bsdf *b, struct lum_vec3 wo, struct lum_vec3 wi, float *ret_pdf_sa);

struct lum_bsdf_sample {
    struct lum_vec3 wi;
    struct lum_rgb weight; /* f |cos| / pdf */
    float pdf_sa;          /* 0 for a delta lobe */
    enum lum_lobe lobe;
};
/* u: picks the direction, u_lobe: picks the lobe. False: absorbed. */
bool lum_bsdf_sample(const struct lum_bsdf *b, struct lum_vec3 wo, struct lum_vec2 u, float u_lobe,
                     struct lum_bsdf_sample *ret_sample);

/* Directional-hemispherical albedo estimate used for AOVs and demodulation: diffuse + f0. */
struct lum_rgb lum_bsdf_albedo(const struct lum_bsdf *b);

/* Fresnel reflectance of a dielectric, cos_i in [0,1], eta = n_i / n_t. 1 at total internal reflection. */
float lum_fresnel_dielectric(float cos_i, float eta);

#endif

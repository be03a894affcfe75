/* The BSDF that a material makes at a point.
 *
 * The model is glTF 2.0's metallic-roughness with KHR_materials_specular, _ior, _transmission, _volume and _unlit: a
 * mix of a metal, of a dielectric coat over a diffuse base, and of glass. roughness^2 = alpha; alpha below
 * LUM_ALPHA_MIN is a perfect mirror (delta). Reflection is GGX with height-correlated Smith and visible-normal
 * sampling, Fresnel by Schlick; glass has the exact dielectric Fresnel, and refracts as Walter et al. 2007 (a solid) or
 * passes straight on (thin). Microfacets of what is brushed lean farther along one direction than across (brushed.h,
 * KHR_materials_anisotropy). Thin glass has two faces, and what is reflected to and fro between them is in what it
 * reflects and transmits: of clear glass 2 R / (1 + R) and (1 - R) / (1 + R), with R that of a face.
 *
 * A sheet (paper, cloth, opal: KHR_materials_diffuse_transmission) has a second base, which sends to wo what arrives on
 * the far side: even, and under a coat like the one on this side. Estimators of what is lit on this side leave it out:
 * who wants the whole surface adds it (lum_bsdf_add_far_side), or takes it as a surface of its own.
 *
 * Fuzz (sheen.h) and a clear coat (clearcoat.h) may lie over all of that, in this order.
 *
 * Two deviations. Light that meets several microfacets is not lost (Kulla & Conty 2017; of all but solid glass).
 * And where glTF dims the diffuse base by 1 - F(v.h), which on smooth surfaces at grazing angles creates up to 0.9 of
 * the incoming energy anew, the base here is dimmed by (1 - E(wo)) (1 - E(wi)) / (1 - mean E), with E the albedo of the
 * coat (Kelemen & Szirmay-Kalos 2001): reciprocal, and coat and base together return what arrives, and no more. */
#ifndef LUM_CORE_MATERIAL_BSDF_MODEL_H
#define LUM_CORE_MATERIAL_BSDF_MODEL_H

#include <stdbool.h>
#include <stdint.h>

#include "core/material/brushed.h"
#include "core/material/ggx.h"
#include "core/math/rgb.h"
#include "core/math/vec.h"

struct lum_material;
struct lum_surface;

enum lum_lobe {
    LUM_LOBE_DIFFUSE,
    LUM_LOBE_GLOSSY,
    LUM_LOBE_REFLECT,
    LUM_LOBE_TRANSMIT,
    LUM_LOBE_GLOSSY_TRANSMIT,
    LUM_LOBE_DIFFUSE_TRANSMIT,
};

#define LUM_CLEARCOAT_F0 0.04f /* of index 1.5 */

/* A clear coat: see clearcoat.h. */
struct lum_clearcoat {
    float weight;           /* 0: there is none */
    float alpha;            /* GGX roughness; 0: delta */
    float left, norm;       /* 1 - E(wo); and that over its mean: what dims even scattering, but for wi's factor */
    float share;            /* probability that a sample is of it, where it is none of the cosine-shaped lobes */
    struct lum_ggx_row row; /* of alpha */
    struct lum_vec3 n;      /* unit shading normal */
};

/* The fuzz of cloth: see sheen.h. */
struct lum_sheen {
    struct lum_rgb color;
    float weight; /* of its largest channel; 0: there is none */
    float roughness;
    float left, norm; /* as of a clear coat */
    float share;      /* probability that a sample is of it, where it is neither cosine-shaped nor of the clear coat */
};

/* The BSDF at one point for one outgoing direction: parameters looked up, frame built. */
struct lum_bsdf {
    struct lum_frame frame;   /* around ns, bent so that wo is above it */
    struct lum_vec3 ng;       /* unit, towards wo; 0: wo lies in the surface and nothing is scattered */
    struct lum_rgb diffuse;   /* albedo of the diffuse base under its coat; black where the surface has none */
    struct lum_rgb through;   /* of a sheet: albedo for light that arrives on the far side; else black */
    struct lum_rgb f0;        /* metal and coat: reflectance at normal incidence (Schlick), black: none */
    float f90;                /* and at grazing */
    struct lum_rgb transmit;  /* glass: its share of the surface times its tint; black: none */
    struct lum_rgb glass_f0;  /* glass: reflectance at normal incidence */
    float glass_f90;          /* and at grazing and beyond the critical angle */
    float glass;              /* share of the surface that is glass */
    struct lum_rgb multi;     /* light that met several microfacets: its albedo, but for wi's factor 1 - a(wi) */
    struct lum_rgb multi_far; /* and what of it thin rough glass lets through */
    float coat[3];      /* coat over the base: 1 - E(wi) = coat[0] - coat[1] scale - coat[2] bias; largest channel */
    float coat_norm;    /* (1 - E(wo)) / (1 - mean E) of the coat: what dims the base, but for wi's factor */
    float coat_left;    /* 1 - E(wo) */
    float lobes;        /* of this side, by the luminance that each returns: what probabilities are shares of */
    float diffuse_prob; /* probability that a sample is of the base or of multi: cosine-shaped */
    float far_prob;     /* and of these, that it is of the far side; 0: that was not added */
    float alpha;        /* GGX roughness; 0: delta. Brushed: of even roughness that spreads about as much */
    struct lum_vec2 spread; /* of what is brushed: along frame.t and frame.b */
    const struct lum_brushed_table
        *brushed;                       /* microfacets lean farther along frame.t than across; NULL: alike all ways */
    struct lum_brushed_row brushed_row; /* of that table */
    struct lum_ggx_row row;             /* of alpha, where it is alike all ways */
    float eta; /* n on wo's side / n on the other; of what is thin or straight, from outside. 1: no interface */
    struct lum_sheen sheen;
    struct lum_clearcoat clear;
    bool thin;
    bool straight;           /* transmission is delta, and bends nothing */
    struct lum_rgb emission; /* towards wo */
};

/* wo: unit, away from the surface, on surface->ng's side (if not, the surface is turned). */
void lum_bsdf_init(struct lum_bsdf *ret_bsdf, const struct lum_material *m, const struct lum_surface *s,
                   struct lum_vec3 wo);

/* Counts in what a sheet lets through: wi may then be on the far side. */
void lum_bsdf_add_far_side(struct lum_bsdf *inout_bsdf);

/* What a sheet lets through, as a surface that faces the other way: seen from -wo it reflects what is sent to wo. */
struct lum_bsdf lum_bsdf_far_side(const struct lum_bsdf *b);

/* Of a matt white surface, which reflects all light evenly: radiance is irradiance / pi. n, ng: unit. */
struct lum_bsdf lum_bsdf_white(struct lum_vec3 n, struct lum_vec3 ng);

#endif

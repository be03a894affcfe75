/* Materials at render time: images, textures, and what holds of a whole material. */
#ifndef LUM_CORE_MATERIAL_MATERIAL_H
#define LUM_CORE_MATERIAL_MATERIAL_H

#include "core/base/base.h"
#include "core/math/rgb.h"
#include "core/math/vec.h"
#include "core/scene/desc.h"

/* Decoded texels, immutable, shared. */
struct lum_image {
    struct lum_refs refs;
    enum lum_texel texel;
    uint32_t width, height;
    const void *pixels;
    struct lum_rgb mean;          /* of lum_image_mean */
    void (*release)(void *owner); /* of who lends the pixels; NULL: they are its own */
    void *owner;
};

/* Bilinear, linear RGB(A); RGB32F reads alpha 1. uv (0,0) is the top left texel's corner, as in glTF. */
struct lum_texel_value {
    struct lum_rgb rgb;
    float a;
};
struct lum_texel_value lum_image_sample(const struct lum_image *image, struct lum_vec2 uv, enum lum_wrap wrap_u,
                                        enum lum_wrap wrap_v);

/* Linear, of texels spread evenly over the image. */
struct lum_rgb lum_image_mean(const struct lum_image *image);

struct lum_texture {
    const struct lum_image *image; /* NULL: none */
    float m[2][3];                 /* uv' = m [u v 1] */
    enum lum_wrap wrap_u, wrap_v;
};
/* 1 when there is no image. uv is the mesh's; may be anything. */
struct lum_texel_value lum_texture_sample(const struct lum_texture *texture, struct lum_vec2 uv);
/* Asks memory for the texels that lum_texture_sample would read. There is an image. */
void lum_texture_ask(const struct lum_texture *texture, struct lum_vec2 uv);

struct lum_brushed_table;
struct lum_material {
    struct lum_texture base_color_tex, metallic_roughness_tex, emission_tex, normal_tex, anisotropy_tex;
    struct lum_texture specular_tex, specular_color_tex, transmission_tex, diffuse_transmission_tex;
    struct lum_texture clearcoat_tex, clearcoat_roughness_tex, clearcoat_normal_tex;
    struct lum_rgb base_color, specular_color, emission; /* emission: radiance, cd/m2 */
    struct lum_rgb diffuse_transmittance;                /* of a sheet; black: it is none */
    float diffuse_transmission_share;                    /* of the base that it takes where its texture is 1 */
    struct lum_rgb sheen_color;                          /* of fuzz; black: there is none */
    float sheen_roughness;
    float clearcoat, clearcoat_roughness, clearcoat_normal_scale; /* clearcoat 0: there is none */
    const struct lum_brushed_table *brushed; /* rough more one way than across; NULL: alike all ways */
    float anisotropy;                        /* how much more: lum_brushed_along */
    struct lum_vec2 stretch;                 /* unit: of highlights, along tangent and bitangent */
    struct lum_rgb sigma_a;                  /* absorption inside a solid, per scene unit */
    float metallic, roughness, ior, specular, transmission, normal_scale, alpha, alpha_cutoff;
    enum lum_alpha_mode alpha_mode;
    float reflects;                   /* lum_material_reflects */
    bool has_maps;                    /* one at least of its textures has an image */
    bool straight;                    /* a solid that bends no light where it is smooth */
    bool thin, unlit, front_emission; /* front_emission: from the side that triangles wind around alone */
    char id[LUM_ID_MAX + 1];
};

/* Asks memory for the texels of all its maps at uv together, so that nobody waits for one after the other. */
void lum_material_ask(const struct lum_material *m, struct lum_vec2 uv);

/* True when the material lets light through or mirrors without spread, so that a deferred method must recurse. Where a
 * texture sets the roughness, of a clear coat too, or how far it is brushed, it is never below LUM_ALPHA_MIN, so that
 * this depends on the material alone. */
bool lum_material_is_specular(const struct lum_material *m);

/* True when microfacets lean farther one way than across: of such a surface lum_surface has the tangent. */
static inline bool lum_material_is_brushed(const struct lum_material *m)
{
    return m->brushed != NULL;
}

/* Ways of scattering that some point of the material may have, whatever its textures say; 0: it reflects nothing. */
enum {
    LUM_SCATTER_DIFFUSE = 1, /* evenly */
    LUM_SCATTER_MIRROR = 2,
    LUM_SCATTER_GLOSS = 4,
    LUM_SCATTER_THROUGH = 8, /* lets light pass */
    LUM_SCATTER_SHEET = 16,  /* lets light through evenly */
};
uint32_t lum_material_scatter(const struct lum_material *m);

/* True when some of what arrives on one side leaves the other evenly. */
static inline bool lum_material_is_sheet(const struct lum_material *m)
{
    return !m->unlit && !lum_rgb_black(m->diffuse_transmittance) &&
           (m->transmission < 1.0f || m->transmission_tex.image) &&
           (m->metallic < 1.0f || m->metallic_roughness_tex.image);
}

/* True when light goes straight through at least some of it, without spread: thin clear or tinted glass, solid glass
 * that is told not to bend it, and what has no interface. Rays that ask how much of a light arrives pass it
 * (lum_trace_light); they are dimmed as a path would be that goes on by LUM_LOBE_TRANSMIT. */
bool lum_material_is_pane(const struct lum_material *m);

/* An index of refraction that is 1 but for rounding: no interface, nothing is reflected or bent there. */
bool lum_ior_is_matched(float ior);

/* Which share of the light that arrives, by luminance, it sends on in the mean over its textures: from this side, and
 * of a sheet from both. Without what goes through glass, coats and fuzz; vertices are taken to be white. In [0, 1]. */
float lum_material_reflects(const struct lum_material *m);

/* What is left of light after distance scene units inside a solid of it (Beer-Lambert); white if it has no inside. */
struct lum_rgb lum_material_transmittance(const struct lum_material *m, float distance);

/* Radiance that the surface emits at uv, given that of white texels (lum_surface.emission); an unlit material: its
 * colour times 1 cd/m2. */
struct lum_rgb lum_material_emission(const struct lum_material *m, struct lum_rgb white, struct lum_vec2 uv,
                                     struct lum_rgb vertex_color);

#endif

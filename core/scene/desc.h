/* Descriptions of what is put into a scene. All pointers are borrowed for the call, and copied.
 *
 * In world space: metres, right-handed, Y up, photometric units. */
#ifndef LUM_CORE_SCENE_DESC_H
#define LUM_CORE_SCENE_DESC_H

#include <stdbool.h>
#include <stdint.h>

#include "core/math/affine.h"
#include "core/math/rgb.h"
#include "core/math/vec.h"
#include "core/scene/light_desc.h"

struct lum_mesh_desc {
    const double *positions; /* 3 * n_vertices, local space, metres. NULL: use positions_f */
    const float *positions_f;
    const float *normals;    /* 3 * n_vertices or NULL: flat shading */
    const float *uvs;        /* 2 * n_vertices or NULL */
    const float *tangents;   /* 4 * n_vertices: along growing u, and the sign of the bitangent; or NULL: by uvs */
    const float *colors;     /* 3 * n_vertices linear, multiplies base_color; or NULL */
    const uint32_t *indices; /* 3 * n_triangles */
    uint32_t n_vertices, n_triangles;
    bool deforming; /* will be put again with the same indices and moved positions: refit, do not rebuild */
};

/* SRGB8, LINEAR8: 4 bytes RGBA a texel. RGB32F: 3 floats; negative ones read as 0, and none as over 1e12. */
enum lum_texel { LUM_TEXEL_SRGB8, LUM_TEXEL_LINEAR8, LUM_TEXEL_RGB32F };
struct lum_image_desc {
    enum lum_texel texel;
    uint32_t width, height;
    const void *pixels; /* first row is the top */
};

enum lum_wrap { LUM_WRAP_REPEAT, LUM_WRAP_MIRROR, LUM_WRAP_CLAMP };
/* A texture reference: an image id and the KHR_texture_transform of it. image NULL or "": none. */
struct lum_texture_desc {
    const char *image;
    float offset[2], scale[2], rotation_rad;
    enum lum_wrap wrap_u, wrap_v;
};

enum lum_alpha_mode { LUM_ALPHA_OPAQUE, LUM_ALPHA_MASK, LUM_ALPHA_BLEND };

/* The textures of a material: X(SLOT, name) stands for the member name_texture, and name_tex of struct lum_material. */
#define LUM_TEXTURES(X)                                                                                                \
    X(BASE_COLOR, base_color)                                                                                          \
    X(METALLIC_ROUGHNESS, metallic_roughness)                                                                          \
    X(EMISSION, emission)                                                                                              \
    X(NORMAL, normal)                                                                                                  \
    X(SPECULAR, specular)                                                                                              \
    X(SPECULAR_COLOR, specular_color)                                                                                  \
    X(TRANSMISSION, transmission)                                                                                      \
    X(DIFFUSE_TRANSMISSION, diffuse_transmission)                                                                      \
    X(ANISOTROPY, anisotropy)                                                                                          \
    X(CLEARCOAT, clearcoat)                                                                                            \
    X(CLEARCOAT_ROUGHNESS, clearcoat_roughness)                                                                        \
    X(CLEARCOAT_NORMAL, clearcoat_normal)
#define LUM_TEXTURE_FIELD(SLOT, name) #name "_texture",

/* The glTF 2.0 metal-roughness model with its dielectric extensions. */
struct lum_material_desc {
    struct lum_rgb base_color; /* 0..1 linear */
    struct lum_texture_desc base_color_texture;
    struct lum_texture_desc metallic_roughness_texture; /* G roughness, B metallic, linear */
    struct lum_texture_desc emission_texture;
    struct lum_texture_desc normal_texture;
    struct lum_texture_desc specular_texture, specular_color_texture; /* alpha how much; and a colour, sRGB */
    struct lum_texture_desc transmission_texture;                     /* R how much, linear */
    struct lum_texture_desc diffuse_transmission_texture;             /* alpha how much */
    struct lum_texture_desc anisotropy_texture;                       /* R, G direction, B strength, linear */
    /* Of a clear coat: R how much there is, G its roughness, linear; and bumps of its own. */
    struct lum_texture_desc clearcoat_texture, clearcoat_roughness_texture, clearcoat_normal_texture;
    float normal_scale, clearcoat_normal_scale;
    float metallic, roughness; /* 0..1; alpha = roughness^2 */
    float ior;                 /* 1..4 */
    float specular;            /* KHR_materials_specular: scales the dielectric F0; 0 = purely diffuse */
    struct lum_rgb specular_color;
    float transmission; /* 0..1: share of the base layer that refracts (a solid) or passes straight on (thin) */
    bool thin;          /* a surface without volume: transmission does not bend */
    struct lum_rgb diffuse_transmittance; /* of a sheet, to its far side, evenly; with base_color at most 1 */
    float diffuse_transmission_share;     /* 0..0.999: base_color is so much less where its texture is 1 than where 0 */
    struct lum_rgb sheen_color;           /* 0..1: of fuzz that stands on all of it */
    float sheen_roughness;                /* 0..1 */
    float clearcoat, clearcoat_roughness; /* 0..1: a clear coat over all of it, how much and how rough */
    float anisotropy;                     /* 0..1: brushed, KHR_materials_anisotropy */
    double anisotropy_rotation_deg;       /* of the stretch of highlights, from the tangent to the bitangent */
    struct lum_rgb attenuation_color;     /* inside a solid, after attenuation_distance_m */
    double attenuation_distance_m;        /* +inf: clear */
    struct lum_rgb emission;              /* chromaticity, luminance 1; times emission_cd_m2 */
    double emission_cd_m2;
    bool front_emission; /* the side that triangles wind around shines alone; else both do */
    enum lum_alpha_mode alpha_mode;
    float alpha, alpha_cutoff;
    bool unlit; /* shown as base_color * 1 cd/m2 ... reflects nothing */
};

/* What an object changes of the light that its surface gives: all zero is as its material says. An object with an
 * amount shines whether or not its material does. */
enum lum_shine_unit { LUM_SHINE_AS_MATERIAL, LUM_SHINE_FLUX, LUM_SHINE_LUMINANCE };
struct lum_shine {
    enum lum_shine_unit unit;
    double amount; /* 0 to 1e12; lm, all that leaves it, or cd/m2 where the emission texture is white */
    bool has_color;
    struct lum_rgb color; /* chromaticity, luminance 1; in place of the material's */
    bool off;
    const char *group; /* as a light's; NULL is "" */
};

struct lum_object_desc {
    const char *mesh, *material;       /* ids that exist */
    struct lum_affined local_to_world; /* finite and invertible */
    bool visible;
    struct lum_shine shine;
};

/* Fog in a box, or everywhere. Where media overlap their coefficients add up; one without coefficients is none. */
struct lum_medium_desc {
    struct lum_rgb sigma_s, sigma_a; /* scattering, absorption: 1/m, 0..1e6 */
    float g;                         /* Henyey-Greenstein: mean cosine of the angle of scattering, -0.99..0.99 */
    bool everywhere;
    struct lum_vec3d lo, hi; /* lo < hi; unless everywhere */
};

struct lum_camera {
    struct lum_vec3d position, target, up; /* metres */
    double vfov_deg;                       /* 1..179 */
    bool
        panorama; /* all around, by equal angles: up is the upper edge, and level with it the middle faces the target */
};

#endif

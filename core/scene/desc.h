/* Descriptions of what is put into a scene. All pointers are borrowed for the call, and copied.
 *
 * In world space: metres, right-handed, Y up, photometric units. */
#ifndef LUM_CORE_SCENE_DESC_H
#define LUM_CORE_SCENE_DESC_H

#include <stdbool.h>
#include <stdint.h>

#include "core/base/status.h"
#include "core/math/affine.h"
#include "core/math/rgb.h"
#include "core/math/vec.h"

struct lum_web;

struct lum_mesh_desc {
    const double *positions; /* 3 * n_vertices, local space, metres. NULL: use positions_f */
    const float *positions_f;
    const float *normals;    /* 3 * n_vertices or NULL: flat shading */
    const float *uvs;        /* 2 * n_vertices or NULL */
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

/* The glTF 2.0 metal-roughness model with its dielectric extensions. */
struct lum_material_desc {
    struct lum_rgb base_color; /* 0..1 linear */
    struct lum_texture_desc base_color_texture;
    struct lum_texture_desc metallic_roughness_texture; /* G roughness, B metallic, linear */
    struct lum_texture_desc emission_texture;
    struct lum_texture_desc normal_texture;
    float normal_scale;
    float metallic, roughness; /* 0..1; alpha = roughness^2 */
    float ior;                 /* 1..4 */
    float specular;            /* KHR_materials_specular: scales the dielectric F0; 0 = purely diffuse */
    struct lum_rgb specular_color;
    float transmission; /* 0..1: share of the base layer that refracts (a solid) or passes straight on (thin) */
    bool thin;          /* a surface without volume: transmission does not bend */
    struct lum_rgb diffuse_transmittance; /* of a sheet, to its far side, evenly; with base_color at most 1 */
    struct lum_rgb sheen_color;           /* 0..1: of fuzz that stands on all of it */
    float sheen_roughness;                /* 0..1 */
    float clearcoat, clearcoat_roughness; /* 0..1: a clear coat over all of it, how much and how rough */
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

/* Every kind of light; what tells it apart is its row (light_kind.h). */
#define LUM_LIGHT_KINDS(X)                                                                                             \
    X(POINT, point)                                                                                                    \
    X(SPOT, spot)                                                                                                      \
    X(IES, ies)                                                                                                        \
    X(DIRECTIONAL, directional)                                                                                        \
    X(QUAD, quad)                                                                                                      \
    X(DISC, disc)                                                                                                      \
    X(SPHERE, sphere)                                                                                                  \
    X(ENVIRONMENT, environment)                                                                                        \
    X(SKY, sky)                                                                                                        \
    X(SUN, sun)
#define LUM_LIGHT_KIND_MEMBER(NAME, name) LUM_LIGHT_##NAME,
enum lum_light_kind { LUM_LIGHT_KINDS(LUM_LIGHT_KIND_MEMBER) LUM_LIGHT_KIND_COUNT };
/* Of a lamp with a web: the flat shape that shines. A disc has the area of the ellipse of its two diameters. */
enum lum_opening { LUM_OPENING_POINT, LUM_OPENING_RECTANGLE, LUM_OPENING_DISC };

/* What a sky's intensity is: luminance of its zenith; lx on the open horizontal plane; or none, and its sun's elevation
 * says how much light that is (core/light/solar.h). */
enum lum_sky_amount { LUM_SKY_ZENITH, LUM_SKY_HORIZONTAL, LUM_SKY_BY_SUN };

struct lum_light_desc {
    enum lum_light_kind kind;
    struct lum_vec3d position;  /* point, spot, ies, disc, sphere: centre; quad: centre */
    struct lum_vec3d direction; /* spot, ies, directional, disc, sun: where light goes; need not be unit */
    struct lum_vec3d u, v;      /* quad: full edges; emits towards cross(u, v). ies: u is, but for what it has
                                 * of the direction, where the web's c is 0 (core/light/web.h) */
    double radius_m;            /* disc, sphere */
    double inner_cone_rad, outer_cone_rad; /* spot: half angles; glTF falloff (smooth in cos) */
    struct lum_rgb color;                  /* chromaticity, luminance 1 */
    const struct lum_web *web;             /* ies: the scene takes a reference of its own */
    enum lum_opening opening;              /* ies; where a side of it is 0, a point */
    double opening_m[2];                   /* along c0, along c90 */
    /* The photometric size, in the unit natural to the kind (records in lm are converted by the caller with
     * lum_light_from_flux): point, spot: cd; ies: cd of its brightest direction; directional, sun: lx on a facing
     * plane; area, environment: cd/m2; sky: as sky_amount says. 0 to 1e12 */
    double intensity;
    const char *image;   /* environment: equirectangular image id, or NULL: constant. A texel of value 1 shines with
                          * intensity cd/m2 times color; a picture in cd/m2 takes intensity 1 */
    double rotation_rad; /* environment: about +Y */
    /* sky: its sun is the first light of kind sun, by id, on or off; where there is none, one that stands 45 degrees
     * high over +Z. While skies are on the first by id shines, and no environment; else the first of those that is. */
    int cie_type;                   /* 1..16 (core/light/cie_sky.h) */
    double ground_albedo;           /* 0..1: of what lies below the horizon */
    enum lum_sky_amount sky_amount; /* what intensity is */
    bool on, camera_visible;        /* camera_visible: area lights, environment and sky seen directly */
    const char *group;              /* mixing group, "" = its own id */
};
/* Intensity (in the kind's natural unit) of a light that emits flux_lm in all: point 4 pi sr; spot and ies by the
 * integral of their falloff; quad, disc, sphere: Lambertian, L = flux / (pi A). LUM_ERR_INVALID for directional and
 * environment, and where so much from so small a light is over 1e12. */
LUM_MUST_USE enum lum_status lum_light_from_flux(const struct lum_light_desc *light, double flux_lm,
                                                 double *ret_intensity, struct lum_error *err);

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
};

#endif

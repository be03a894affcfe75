/* What a record of each type holds. Fields that clients see have a row in fields.c, with unit, range and help. */
#ifndef LUM_PROTOCOL_RECORD_TYPES_H
#define LUM_PROTOCOL_RECORD_TYPES_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "protocol/base/value.h"
#include "protocol/record/bulk.h"
#include "protocol/record/lamps.h"
#include "protocol/record/transform.h"
#include "protocol/record/web.h"

struct lum_record_mesh {
    char shape[24]; /* built-in shape, or "" for explicit arrays */
    double size[3], segments[2], param[4];
    struct lum_floats positions, normals, uvs, tangents, colors;
    struct lum_indices indices;
    bool deforming;
};

struct lum_record_image {
    char asset[LUM_LIMIT_ASSET_BYTES + 1]; /* decoded by the importer; or "" when pixels are given */
    uint32_t width, height;
    char texel[12];  /* "srgb8" "linear8" "rgb32f" */
    uint8_t *pixels; /* a reference (bulk.h); NULL until an asset is decoded */
    size_t n_bytes;
};

struct lum_record_texture {
    lum_id image; /* "": none */
    double offset[2], scale[2], rotation_rad;
    char wrap_u[8], wrap_v[8]; /* "repeat" "mirror" "clamp" */
};

struct lum_record_material {
    double base_color[3];
    struct lum_record_texture base_color_texture, metallic_roughness_texture, emission_texture, normal_texture,
        anisotropy_texture, clearcoat_texture, clearcoat_roughness_texture, clearcoat_normal_texture, specular_texture,
        specular_color_texture, transmission_texture, diffuse_transmission_texture;
    double normal_scale, clearcoat_normal_scale, metallic, roughness, ior, specular, specular_color[3], transmission;
    double diffuse_transmittance[3], diffuse_transmission_share;
    double sheen_color[3], sheen_roughness, clearcoat, clearcoat_roughness;
    double anisotropy, anisotropy_rotation_deg;
    bool thin;
    double attenuation_color[3];
    struct lum_opt attenuation_distance; /* metres; null: clear */
    double emission_color[3], emission_cd_m2;
    char emission_sides[8]; /* "both" "front" */
    char alpha_mode[8];     /* "opaque" "mask" "blend" */
    double alpha, alpha_cutoff;
    bool unlit;
};

struct lum_record_object {
    lum_id mesh, material;
    struct lum_record_transform transform;
    bool visible;
    /* the light of its surface, where that differs from the material's */
    bool on;
    struct lum_opt flux_lm, luminance_cd_m2; /* one at most */
    double color[3];                         /* 0 0 0: none */
    struct lum_opt cct_k;
    lum_id group;
};

struct lum_record_light {
    char kind[16]; /* one of those in its table of fields (fields.c) */
    double position[3], direction[3], roll_deg, u[3], v[3], radius;
    double diameter_deg;                   /* directional, sun */
    double inner_cone_deg, outer_cone_deg; /* spot: half angles */
    struct lum_opt flux_lm, intensity_cd, luminance_cd_m2, illuminance_lx,
        multiplier;                        /* exactly one; ies, sky, sun: at most */
    char asset[LUM_LIMIT_ASSET_BYTES + 1]; /* ies: read by the importer; or "" when the web is given */
    struct lum_record_web *web;            /* a reference; NULL until an asset is read */
    double color[3];
    struct lum_opt cct_k; /* set: replaces color */
    lum_id image;         /* environment */
    double rotation_deg;
    double cie_type, ground_albedo; /* sky */
    char date[12];                  /* sun: "2026-06-21", or "" */
    double time_h, utc_offset_h, latitude_deg, longitude_deg, north_deg, extinction;
    struct lum_opt azimuth_deg, elevation_deg; /* sun: both or none; set: replace place and time */
    lum_id group;
    bool on, camera_visible, as_point;
};

struct lum_record_medium {
    double sigma_s[3], sigma_a[3], g;
    struct lum_record_box box;
};

struct lum_record_camera {
    double position[3], target[3], up[3], vfov_deg;
    char projection[16]; /* perspective panorama */
};

struct lum_record_sensor {
    char kind[12];     /* point line grid observer */
    char quantity[20]; /* plane cylindrical semicylindrical modelling ugr */
    double position[3], u[3], v[3], normal[3], direction[3];
    double directions;
    struct lum_opt spacing_m;
    struct lum_opt floor_m2, target_lx, target_uo, target_ugr, target_dgp;
    char name[128];
};

struct lum_record_patch {
    char protocol[8]; /* sacn artnet */
    double universe, address;
    char channels[8]; /* dim dim16 rgb rgb16 */
    char curve[8];    /* linear square dali */
    lum_id target;    /* a light, an object or a mixing group; there when it is set */
};

struct lum_record_preset {
    char name[128];
    double order;
    double fade_s; /* of a recall that says nothing else */
    struct lum_lamps lamps;
};

struct lum_record_render {
    char method[16];
    double spp, max_depth, shadow_samples, seed, vpls, cache_accuracy;
    bool antialias;
    struct lum_opt exposure_ev; /* EV100: higher is darker; null: automatic */
    char tone_map[12];          /* agx aces reinhard none */
    char glass[16];             /* physical architectural */
    lum_id camera;              /* of views that name none; "": lum_world_camera's choice */
};

struct lum_record_import {
    char asset[LUM_LIMIT_ASSET_BYTES + 1];
    struct lum_record_transform transform;
    /* What the import made, as the model file has it: not placed by the transform yet. Moving the import places it
     * anew, and scene.get compares with it to find later edits. Filled once by the document, before the record is
     * shared. An array in bulk, shared by copies of this record, of references. */
    struct lum_record **made;
    size_t n_made;
};

#endif

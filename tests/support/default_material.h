/* A material for tests to change: white diffuse, roughness 1, ior 1.5, specular 1, no texture. */
#ifndef LUM_TESTS_SUPPORT_DEFAULT_MATERIAL_H
#define LUM_TESTS_SUPPORT_DEFAULT_MATERIAL_H

#include <math.h>

#include "core/scene/desc.h"

static inline struct lum_material_desc lum_material_default(void)
{
    struct lum_texture_desc no_texture = {.scale = {1.0f, 1.0f}};
    return (struct lum_material_desc){
        .base_color = lum_grey(1.0f),
        .base_color_texture = no_texture,
        .metallic_roughness_texture = no_texture,
        .emission_texture = no_texture,
        .normal_texture = no_texture,
        .anisotropy_texture = no_texture,
        .specular_texture = no_texture,
        .specular_color_texture = no_texture,
        .transmission_texture = no_texture,
        .diffuse_transmission_texture = no_texture,
        .clearcoat_texture = no_texture,
        .clearcoat_roughness_texture = no_texture,
        .clearcoat_normal_texture = no_texture,
        .normal_scale = 1.0f,
        .clearcoat_normal_scale = 1.0f,
        .roughness = 1.0f,
        .ior = 1.5f,
        .specular = 1.0f,
        .specular_color = lum_grey(1.0f),
        .attenuation_color = lum_grey(1.0f),
        .attenuation_distance_m = (double)INFINITY,
        .emission = lum_grey(1.0f),
        .alpha = 1.0f,
        .alpha_cutoff = 0.5f,
    };
}

/* Brushed; turn_deg: of its highlights' stretch. */
static inline struct lum_material_desc lum_material_steel(float roughness, float anisotropy, double turn_deg)
{
    struct lum_material_desc m = lum_material_default();
    m.base_color = lum_grey(0.8f);
    m.metallic = 1.0f;
    m.roughness = roughness;
    m.anisotropy = anisotropy;
    m.anisotropy_rotation_deg = turn_deg;
    return m;
}

#endif

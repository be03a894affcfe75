#include "tests/support/materials.h"

#include <math.h>

#include "core/accel/accel.h"
#include "core/material/brushed.h"

struct lum_material plain(float roughness)
{
    return (struct lum_material){
        .base_color = {1.0f, 1.0f, 1.0f},
        .specular_color = {1.0f, 1.0f, 1.0f},
        .roughness = roughness,
        .ior = 1.5f,
        .specular = 1.0f,
        .normal_scale = 1.0f,
        .alpha = 1.0f,
    };
}

struct lum_material matte(void)
{
    struct lum_material m = plain(1.0f);
    m.specular = 0.0f;
    return m;
}

struct lum_material metal(float roughness)
{
    struct lum_material m = plain(roughness);
    m.metallic = 1.0f;
    return m;
}

struct lum_material glass(float roughness, float ior)
{
    struct lum_material m = plain(roughness);
    m.transmission = 1.0f;
    m.ior = ior;
    return m;
}

struct lum_material brushed(struct lum_material m)
{
    enum { STRENGTH = 7 };
    static const struct lum_brushed_table *table; /* for all that a test asks of it */
    if (!table)
        table = lum_brushed_table_create(STRENGTH * 0.1f, -1.0f);
    assert_non_null(table);
    m.brushed = table;
    m.anisotropy = STRENGTH * 0.1f;
    m.stretch = (struct lum_vec2){0.6f, 0.8f};
    return m;
}

/* Textures of one texel. */
static const float most_texels[3] = {0.7f, 0.5f, 0.0f}, white_texels[3] = {1.0f, 1.0f, 1.0f};
static const struct lum_image most = {.texel = LUM_TEXEL_RGB32F, .width = 1, .height = 1, .pixels = most_texels},
                              white = {.texel = LUM_TEXEL_RGB32F, .width = 1, .height = 1, .pixels = white_texels};
static const uint8_t veil_texels[4] = {200, 120, 40, 150}; /* its alpha counts, too */
static const struct lum_image veil = {.texel = LUM_TEXEL_LINEAR8, .width = 1, .height = 1, .pixels = veil_texels};

struct lum_material variant(int i, float roughness)
{
    struct lum_material m = plain(roughness);
    switch (i) {
    case 0:
        return m;
    case 1:
        return metal(roughness);
    case 2:
        return glass(roughness, 1.5f);
    case 3:
        m = glass(roughness, 1.5f);
        m.thin = true;
        return m;
    case 4: /* half of everything */
        m.metallic = m.transmission = m.specular = 0.5f;
        m.base_color = lum_rgb(0.9f, 0.5f, 0.1f);
        return m;
    case 5:
        m.ior = 4.0f;
        m.specular_color = lum_rgb(2.0f, 1.0f, 0.2f);
        return m;
    case 6:
        m = glass(roughness, 2.4f);
        m.transmission = 0.7f;
        m.specular = 0.3f;
        return m;
    case 7:
        m = glass(roughness, 1.0f);
        m.transmission = 0.5f;
        return m;
    case 8:
        return matte();
    case 9: /* paper */
        m = matte();
        m.thin = true;
        m.base_color = lum_rgb(0.6f, 0.5f, 0.0f);
        m.diffuse_transmittance = lum_rgb(0.4f, 0.3f, 0.2f);
        return m;
    case 11: /* lacquer on paint */
        m.roughness = 0.6f;
        m.base_color = lum_rgb(0.9f, 0.5f, 0.1f);
        m.clearcoat = 1.0f;
        m.clearcoat_roughness = roughness;
        return m;
    case 12: /* a mirror over half of everything */
        m.metallic = m.transmission = m.specular = m.clearcoat = 0.5f;
        return m;
    case 13: /* over a matte sheet */
        m = matte();
        m.thin = true;
        m.base_color = m.diffuse_transmittance = lum_grey(0.5f);
        m.clearcoat = m.clearcoat_roughness = 1.0f; /* by textures */
        m.clearcoat_tex.image = &most;
        m.clearcoat_roughness_tex.image = roughness > 0.5f ? &white : &most;
        return m;
    case 14: /* over a metal, or its mirror */
        m.metallic = 1.0f;
        m.clearcoat = 1.0f;
        m.clearcoat_roughness = 0.5f;
        return m;
    case 15: /* velvet */
        m = matte();
        m.base_color = lum_rgb(0.3f, 0.1f, 0.1f);
        m.sheen_color = lum_rgb(1.0f, 0.8f, 0.5f);
        m.sheen_roughness = roughness;
        return m;
    case 16: /* fuzz over half of everything */
        m.metallic = m.transmission = m.specular = 0.5f;
        m.sheen_color = lum_grey(0.7f);
        m.sheen_roughness = 0.5f;
        return m;
    case 17: /* a thin curtain that somebody lacquered */
        m.thin = true;
        m.base_color = m.diffuse_transmittance = lum_grey(0.5f);
        m.sheen_color = lum_grey(1.0f);
        m.sheen_roughness = 0.4f;
        m.clearcoat = 0.6f;
        m.clearcoat_roughness = roughness;
        return m;
    case 18:
        return brushed(metal(roughness));
    case 19: /* plastic */
        m.base_color = lum_rgb(0.9f, 0.5f, 0.1f);
        return brushed(m);
    case 20:
        return brushed(glass(roughness, 1.5f));
    case 21: /* a pane, in part metal */
        m = glass(roughness, 1.5f);
        m.metallic = 0.3f;
        m.thin = true;
        return brushed(m);
    case 22: /* a sheet under its coat and a clear one */
        m.thin = true;
        m.base_color = m.diffuse_transmittance = lum_grey(0.5f);
        m.clearcoat = 0.7f;
        m.clearcoat_roughness = 0.4f;
        return brushed(m);
    case 23: /* the same by textures */
        m.thin = true;
        m.metallic = 0.3f;
        m.transmission = 1.0f;
        m.base_color = lum_rgb(0.1f, 0.2f, 0.05f);
        m.diffuse_transmittance = lum_rgb(0.8f, 0.5f, 0.3f);
        m.diffuse_transmission_share = 0.9f;
        m.specular_color = lum_rgb(3.0f, 5.0f, 9.0f);
        m.specular_tex.image = m.specular_color_tex.image = m.transmission_tex.image =
            m.diffuse_transmission_tex.image = &veil;
        return m;
    default: /* a coated sheet, in part glass, in part metal */
        m.thin = true;
        m.metallic = m.transmission = 0.3f;
        m.base_color = lum_rgb(0.2f, 0.4f, 0.3f);
        m.diffuse_transmittance = lum_rgb(0.8f, 0.6f, 0.0f);
        return m;
    }
}

struct lum_surface surface(bool backface)
{
    struct lum_vec3 up = {0.0f, 0.0f, 1.0f};
    return (struct lum_surface){.ng = up,
                                .ns = up,
                                .backface = backface,
                                .vertex_color = {1.0f, 1.0f, 1.0f},
                                .instance = LUM_NO_OBJECT,
                                .tangent = {1.0f, 0.0f, 0.0f},
                                .bitangent = {0.0f, 1.0f, 0.0f}};
}

struct lum_vec3 direction(double cos_theta, double phi)
{
    double s = sqrt(fmax(0.0, 1.0 - cos_theta * cos_theta));
    return lum_v3((float)(s * cos(phi)), (float)(s * sin(phi)), (float)cos_theta);
}

bool is_transmitted(const struct lum_bsdf_sample *s)
{
    return s->lobe == LUM_LOBE_TRANSMIT || s->lobe == LUM_LOBE_GLOSSY_TRANSMIT;
}

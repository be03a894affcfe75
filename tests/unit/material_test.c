/* Image lookup, textures, normal maps; colour of light sources. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "core/material/bsdf.h"
#include "core/material/ggx.h"
#include "core/material/material.h"
#include "core/math/color.h"
#include "core/scene/surface.h"

static bool near(float a, float b, float tolerance)
{
    return fabsf(a - b) <= tolerance;
}

static void srgb_table_is_the_standard(void **state)
{
    (void)state;
    for (int i = 0; i < 256; i++) {
        double c = i / 255.0, want = c <= 0.04045 ? c / 12.92 : pow((c + 0.055) / 1.055, 2.4);
        assert_true((double)fabsf(lum_srgb8_to_linear[i] - (float)want) <= 1e-7 * want);
    }
    assert_true(lum_srgb8_to_linear[0] == 0.0f && lum_srgb8_to_linear[255] == 1.0f);
}

static const uint8_t grid[4 * 4] = {0, 10, 20, 255, 51, 61, 71, 128, 102, 112, 122, 0, 255, 255, 255, 255};

static struct lum_image grid_image(enum lum_texel texel)
{
    return (struct lum_image){.texel = texel, .width = 2, .height = 2, .pixels = grid};
}

static void texel_centres_are_exact(void **state)
{
    (void)state;
    struct lum_image linear = grid_image(LUM_TEXEL_LINEAR8), srgb = grid_image(LUM_TEXEL_SRGB8);
    for (int i = 0; i < 4; i++) {
        struct lum_vec2 uv = {0.25f + 0.5f * (float)(i % 2), 0.25f + 0.5f * (float)(i / 2)};
        struct lum_texel_value a = lum_image_sample(&linear, uv, LUM_WRAP_REPEAT, LUM_WRAP_CLAMP);
        struct lum_texel_value b = lum_image_sample(&srgb, uv, LUM_WRAP_MIRROR, LUM_WRAP_REPEAT);
        assert_true(near(a.rgb.g, (float)grid[4 * i + 1] / 255.0f, 1e-7f));
        assert_true(b.rgb.g == lum_srgb8_to_linear[grid[4 * i + 1]]);
        assert_true(near(a.a, (float)grid[4 * i + 3] / 255.0f, 1e-7f) && a.a == b.a);
    }
    struct lum_texel_value mid =
        lum_image_sample(&linear, (struct lum_vec2){0.5f, 0.5f}, LUM_WRAP_CLAMP, LUM_WRAP_CLAMP);
    assert_true(near(mid.rgb.r, (0.0f + 51.0f + 102.0f + 255.0f) / 4.0f / 255.0f, 1e-6f));
}

static float red_at(const struct lum_image *image, float u, enum lum_wrap wrap)
{
    return lum_image_sample(image, (struct lum_vec2){u, 0.5f}, wrap, LUM_WRAP_CLAMP).rgb.r;
}

static void borders_wrap(void **state)
{
    (void)state;
    static const float row[3 * 3] = {0, 0, 0, 1, 1, 1, 4, 4, 4};
    struct lum_image image = {.texel = LUM_TEXEL_RGB32F, .width = 3, .height = 1, .pixels = row};
    assert_true(near(red_at(&image, 0.0f, LUM_WRAP_REPEAT), 2.0f, 1e-6f)); /* halfway between the last and the first */
    assert_true(red_at(&image, 0.0f, LUM_WRAP_MIRROR) == 0.0f && red_at(&image, -5.0f, LUM_WRAP_CLAMP) == 0.0f);
    assert_true(red_at(&image, 7.0f, LUM_WRAP_CLAMP) == 4.0f);
    for (float u = -0.95f; u < 1.0f; u += 0.1f) {
        assert_true(near(red_at(&image, u, LUM_WRAP_REPEAT), red_at(&image, u + 3.0f, LUM_WRAP_REPEAT), 1e-5f));
        assert_true(near(red_at(&image, u, LUM_WRAP_MIRROR), red_at(&image, -u, LUM_WRAP_MIRROR), 1e-5f));
        assert_true(near(red_at(&image, u, LUM_WRAP_MIRROR), red_at(&image, u + 2.0f, LUM_WRAP_MIRROR), 1e-5f));
    }
}

/* Any coordinate reads inside the image (the sanitizers watch) and inside its range. */
static void any_coordinate_is_safe(void **state)
{
    (void)state;
    static const float values[] = {0.0f,   -0.0f, 1.0f,   -1.0f, 0.99999994f, -1e-10f,   1e-45f, 1e10f,
                                   -1e10f, 3e38f, -3e38f, NAN,   INFINITY,    -INFINITY, 0.5f,   2.0f};
    struct lum_image image = grid_image(LUM_TEXEL_LINEAR8);
    for (uint32_t w = 1; w <= 2; w++)
        for (size_t i = 0; i < 16 * 16 * 9; i++) {
            image.width = w;
            struct lum_vec2 uv = {values[i % 16], values[i / 16 % 16]};
            struct lum_texel_value v =
                lum_image_sample(&image, uv, (enum lum_wrap)(i / 256 % 3), (enum lum_wrap)(i / 768));
            assert_true(v.rgb.r >= 0.0f && v.rgb.r <= 1.0f && v.a >= 0.0f && v.a <= 1.0f);
        }
}

static void constant_texture_is_exact(void **state)
{
    (void)state;
    static const float grey[3 * 6] = {0.3f, 0.3f, 0.3f, 0.3f, 0.3f, 0.3f, 0.3f, 0.3f, 0.3f,
                                      0.3f, 0.3f, 0.3f, 0.3f, 0.3f, 0.3f, 0.3f, 0.3f, 0.3f};
    struct lum_image image = {.texel = LUM_TEXEL_RGB32F, .width = 3, .height = 2, .pixels = grey};
    for (float u = -1.0f; u < 2.0f; u += 0.0371f)
        assert_true(red_at(&image, u, LUM_WRAP_REPEAT) == 0.3f);
}

static void textures_are_transformed(void **state)
{
    (void)state;
    static const float row[3 * 4] = {0, 0, 0, 1, 1, 1, 2, 2, 2, 3, 3, 3};
    struct lum_image image = {.texel = LUM_TEXEL_RGB32F, .width = 4, .height = 1, .pixels = row};
    struct lum_texture t = {.image = &image, .m = {{0, 1, 0.125f}, {-1, 0, 0.5f}}}; /* u' = v + 1/8 */
    assert_true(near(lum_texture_sample(&t, (struct lum_vec2){0.0f, 0.5f}).rgb.r, 2.0f, 1e-6f));
    t.image = NULL;
    assert_true(lum_texture_sample(&t, (struct lum_vec2){0.0f, 0.5f}).rgb.r == 1.0f);
}

/* ---- the lookup in a material ---- */

static struct lum_surface floor_surface(void)
{
    return (struct lum_surface){
        .ng = {0, 0, 1}, .ns = {0, 0, 1}, .dpdu = {2, 0, 0}, .dpdv = {0, -3, 0}, .vertex_color = {1, 1, 1}};
}

static struct lum_material with_normal_map(const struct lum_image *image)
{
    return (struct lum_material){.base_color = {1, 1, 1},
                                 .normal_tex = {.image = image, .m = {{1, 0, 0}, {0, 1, 0}}},
                                 .normal_scale = 1.0f,
                                 .roughness = 1.0f,
                                 .ior = 1.5f};
}

/* Red leans towards +u and green towards -v (up in the picture), whatever the handedness of uv; behind, all is turned.
 */
static void normal_maps_lean_as_in_gltf(void **state)
{
    (void)state;
    static const float red[3] = {0.8f, 0.5f, 0.9f}, green[3] = {0.5f, 0.8f, 0.9f}, flat[3] = {0.5f, 0.5f, 1.0f};
    struct lum_image image = {.texel = LUM_TEXEL_RGB32F, .width = 1, .height = 1, .pixels = red};
    struct lum_material m = with_normal_map(&image);
    struct lum_surface s = floor_surface();
    struct lum_vec3 up = {0, 0, 1};
    struct lum_bsdf b;
    lum_bsdf_init(&b, &m, &s, up);
    assert_true(near(b.frame.n.x, 0.6f, 1e-6f) && near(b.frame.n.y, 0.0f, 1e-6f) && near(b.frame.n.z, 0.8f, 1e-6f));
    s.backface = true; /* seen from behind: ng and ns already face the eye */
    lum_bsdf_init(&b, &m, &s, up);
    assert_true(near(b.frame.n.x, -0.6f, 1e-6f) && near(b.frame.n.z, 0.8f, 1e-6f));
    s.backface = false;
    image.pixels = green;
    lum_bsdf_init(&b, &m, &s, up);
    assert_true(near(b.frame.n.y, 0.6f, 1e-6f)); /* -dpdv */
    s.dpdv.y = 3.0f;
    lum_bsdf_init(&b, &m, &s, up);
    assert_true(near(b.frame.n.y, -0.6f, 1e-6f));
    m.normal_scale = 0.0f;
    lum_bsdf_init(&b, &m, &s, up);
    assert_true(near(b.frame.n.z, 1.0f, 1e-6f));
    m.normal_scale = 1.0f;
    image.pixels = flat;
    lum_bsdf_init(&b, &m, &s, up);
    assert_true(b.frame.n.z == 1.0f);
    image.pixels = red;
    s.dpdu = s.dpdv = lum_v3(0, 0, 0); /* no uvs: no direction to lean to */
    lum_bsdf_init(&b, &m, &s, up);
    assert_true(near(b.frame.n.z, 1.0f, 1e-6f));
}

static void parameters_multiply(void **state)
{
    (void)state;
    static const float half[3] = {0.5f, 0.5f, 0.5f};
    struct lum_image image = {.texel = LUM_TEXEL_RGB32F, .width = 1, .height = 1, .pixels = half};
    struct lum_texture tex = {.image = &image, .m = {{1, 0, 0}, {0, 1, 0}}};
    struct lum_material m = {.base_color = {0.8f, 0.4f, 0.2f},
                             .base_color_tex = tex,
                             .emission_tex = tex,
                             .metallic_roughness_tex = tex,
                             .roughness = 1.0f,
                             .ior = 1.5f};
    struct lum_surface s = floor_surface();
    s.vertex_color = lum_rgb(0.5f, 1.0f, 4.0f);
    s.emission = lum_rgb(100, 200, 300);
    struct lum_bsdf b;
    lum_bsdf_init(&b, &m, &s, s.ng);
    assert_true(near(b.diffuse.r, 0.2f, 1e-7f) && near(b.diffuse.g, 0.2f, 1e-7f) && near(b.diffuse.b, 0.4f, 1e-7f));
    assert_true(b.emission.r == 50.0f && b.emission.g == 100.0f && b.emission.b == 150.0f);
    assert_true(b.alpha == 0.25f);
    m.roughness = 0.0f; /* a roughness texture makes no perfect mirror */
    lum_bsdf_init(&b, &m, &s, s.ng);
    assert_true(b.alpha == LUM_ALPHA_MIN);
    assert_false(lum_material_is_specular(&m));
    m.base_color = lum_rgb(10.0f, NAN, -1.0f); /* never above white, never not a number */
    lum_bsdf_init(&b, &m, &s, s.ng);
    assert_true(b.diffuse.r == 1.0f && b.diffuse.g <= 1.0f && b.diffuse.b == 0.0f);
}

/* ---- colour of light sources ---- */

static void chromaticities_are_the_published_ones(void **state)
{
    (void)state;
    /* Planckian: CIE 15 (illuminant A), and the locus at 1000, 2000 and 4000 K (Wyszecki & Stiles 1982, table
     * 1(3.3.4)); daylight: D50, D65, D75 at 1.4388 / 1.438 times their nominal temperature. */
    static const struct {
        double kelvin;
        float x, y;
    } want[] = {{1000, 0.6528f, 0.3444f}, {2000, 0.5267f, 0.4133f}, {2856, 0.4476f, 0.4074f}, {4000, 0.3805f, 0.3768f},
                {5003, 0.3457f, 0.3585f}, {6504, 0.3127f, 0.3290f}, {7504, 0.2990f, 0.3149f}};
    for (size_t i = 0; i < LUM_ARRAY_LEN(want); i++) {
        struct lum_vec2 c = lum_cct_chromaticity(want[i].kelvin);
        if (!near(c.x, want[i].x, 4e-4f) || !near(c.y, want[i].y, 4e-4f)) /* Krystek: 1e-4 in uv */
            fail_msg("%g K: %g %g, not %g %g", want[i].kelvin, (double)c.x, (double)c.y, (double)want[i].x,
                     (double)want[i].y);
    }
}

static void light_colours_are_normalised(void **state)
{
    (void)state;
    struct lum_rgb white = lum_cct_to_rgb(6504.0);
    assert_true(near(white.r, 1.0f, 2e-3f) && near(white.g, 1.0f, 2e-3f) && near(white.b, 1.0f, 2e-3f));
    float ratio = 0.0f;
    for (double k = 500.0; k < 50000.0; k *= 1.01) {
        struct lum_rgb c = lum_cct_to_rgb(k);
        assert_true(lum_rgb_finite(c) && c.r >= 0.0f && c.g >= 0.0f && c.b >= 0.0f);
        assert_true(near(lum_luminance(c), 1.0f, 1e-6f));
        assert_true(c.b / c.r >= ratio); /* hotter is bluer, through both joints */
        ratio = c.b / c.r;
    }
    assert_true(lum_rgb_finite(lum_cct_to_rgb(NAN)));
}

static void white_balance_makes_its_light_white(void **state)
{
    (void)state;
    float m[3][3];
    for (double k = 2000.0; k <= 25000.0; k *= 1.07) {
        struct lum_rgb c = lum_cct_to_rgb(k);
        lum_white_balance(k, m);
        /* The standard's two matrices have 4 and 7 digits, and blue is raised up to 20 times: 1e-5 each. */
        for (int i = 0; i < 3; i++)
            if (!near(m[i][0] * c.r + m[i][1] * c.g + m[i][2] * c.b, 1.0f, 1e-4f))
                fail_msg("%g K: channel %d of its white is %g", k, i,
                         (double)(m[i][0] * c.r + m[i][1] * c.g + m[i][2] * c.b));
    }
    lum_white_balance(6504.0, m);
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++)
            assert_true(near(m[i][j], i == j ? 1.0f : 0.0f, 2e-3f)); /* as close as its chromaticity is to D65's */
}

/* Of a matte surface it is its colour, of a metal, too; what is clear or not lit reflects nothing but what its
 * interface does. Textures count by the means of their images, of which every texel counts as much; a coat takes from
 * the base what it reflects itself, and a sheet sends to both sides. */
static void reflected_share_is_of_colours_and_textures(void **state)
{
    (void)state;
    struct lum_image image = grid_image(LUM_TEXEL_LINEAR8);
    image.mean = lum_image_mean(&image);
    assert_true(near(image.mean.r, (0.0f + 51.0f + 102.0f + 255.0f) / 4.0f / 255.0f, 1e-5f));
    assert_true(near(image.mean.b, (20.0f + 71.0f + 122.0f + 255.0f) / 4.0f / 255.0f, 1e-5f));
    struct lum_material m = {.base_color = {0.2f, 0.5f, 0.8f}, .specular_color = {1, 1, 1}, .ior = 1.5f};
    assert_true(near(lum_material_reflects(&m), lum_luminance(m.base_color), 1e-6f));
    m.specular = 1.0f; /* 4 % at the interface */
    assert_true(near(lum_material_reflects(&m), 0.96f * lum_luminance(m.base_color) + 0.04f, 1e-6f));
    m.metallic = 1.0f;
    assert_true(near(lum_material_reflects(&m), lum_luminance(m.base_color), 1e-6f));
    m.metallic = 0.0f;
    m.transmission = 1.0f;
    assert_true(near(lum_material_reflects(&m), 0.04f, 1e-6f));
    m.transmission = m.specular = 0.0f;
    m.base_color_tex.image = &image;
    assert_true(near(lum_material_reflects(&m), lum_luminance(lum_rgb_mul(m.base_color, image.mean)), 1e-6f));
    m.base_color_tex.image = NULL;
    m.diffuse_transmittance = lum_grey(0.1f);
    assert_true(near(lum_material_reflects(&m), lum_luminance(m.base_color) + 0.1f, 1e-6f));
    m.unlit = true;
    assert_true(lum_material_reflects(&m) == 0.0f);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(white_balance_makes_its_light_white),
        cmocka_unit_test(srgb_table_is_the_standard),
        cmocka_unit_test(texel_centres_are_exact),
        cmocka_unit_test(borders_wrap),
        cmocka_unit_test(any_coordinate_is_safe),
        cmocka_unit_test(constant_texture_is_exact),
        cmocka_unit_test(textures_are_transformed),
        cmocka_unit_test(normal_maps_lean_as_in_gltf),
        cmocka_unit_test(parameters_multiply),
        cmocka_unit_test(reflected_share_is_of_colours_and_textures),
        cmocka_unit_test(chromaticities_are_the_published_ones),
        cmocka_unit_test(light_colours_are_normalised),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

/* Environment images: orientation, distribution, energy. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "core/light/environment.h"
#include "core/light/light.h"
#include "core/light/sample.h"
#include "core/material/material.h"
#include "core/math/sampler.h"
#include "core/scene/snapshot.h"
#include "tests/numeric/stats.h"

enum { W = 32, H = 16 };

static struct lum_vec3 direction(double cos_y, double phi)
{
    double s = sqrt(fmax(0.0, 1.0 - cos_y * cos_y));
    return lum_v3((float)(s * cos(phi)), (float)cos_y, (float)(s * sin(phi)));
}

static struct lum_image image_of(const float *pixels, uint32_t w, uint32_t h)
{
    return (struct lum_image){.texel = LUM_TEXEL_RGB32F, .width = w, .height = h, .pixels = pixels};
}

/* A sky with a black half, a gradient, and a sun 1e5 times as bright. */
static void fill_sky(float *pixels)
{
    for (int y = 0; y < H; y++)
        for (int x = 0; x < W; x++) {
            float v = x < W / 2 ? 0.0f : 0.1f * (float)(x % 7) + (float)y / H;
            if (x == 20 && y == 3)
                v = 1e5f;
            pixels[3 * (y * W + x)] = v;
            pixels[3 * (y * W + x) + 1] = 0.9f * v;
            pixels[3 * (y * W + x) + 2] = 0.5f * v;
        }
}

/* Texel centres look where the header says: the middle of the picture along +X, u towards +Z, the first row to +Y. */
static void picture_stands_upright(void **state)
{
    (void)state;
    float pixels[4 * 4 * 3] = {0};
    struct lum_image image = image_of(pixels, 4, 4);
    struct lum_env_map *map = lum_env_map_create(&image);
    assert_non_null(map);
    for (int y = 0; y < 4; y++)
        for (int x = 0; x < 4; x++)
            pixels[3 * (4 * y + x) + 1] = (float)(4 * y + x);
    for (int y = 0; y < 4; y++)
        for (int x = 0; x < 4; x++) {
            struct lum_vec3 d = direction(cos((y + 0.5) / 4.0 * LUM_PI_D), ((x + 0.5) / 4.0 - 0.5) * 2.0 * LUM_PI_D);
            assert_true(fabsf(lum_env_map_radiance(map, d).g - (float)(4 * y + x)) < 1e-4f);
        }
    /* between columns 1 and 2 is +X; a little towards +Z is nearer to column 2 */
    assert_true(lum_env_map_radiance(map, direction(0.38, 0.1)).g > lum_env_map_radiance(map, direction(0.38, -0.1)).g);
    assert_true(lum_env_map_radiance(map, lum_v3(0, 1, 0)).g <= 3.0f);
    assert_true(lum_env_map_radiance(map, lum_v3(0, -1, 0)).g >= 12.0f);
    lum_env_map_destroy(map);
}

static void samples_follow_the_pdf(void **state)
{
    (void)state;
    enum { n = 1 << 18 };
    static float pixels[W * H * 3];
    static struct chi2_cell cell[W * H];
    fill_sky(pixels);
    for (int round = 0; round < 2; round++) {
        if (round == 1) /* without the sun, so that the rest of the sky gets samples */
            pixels[3 * (3 * W + 20)] = pixels[3 * (3 * W + 20) + 1] = pixels[3 * (3 * W + 20) + 2] = 0.5f;
        struct lum_image image = image_of(pixels, W, H);
        struct lum_env_map *map = lum_env_map_create(&image);
        assert_non_null(map);
        double total = 0.0;
        for (int i = 0; i < W * H; i++) { /* the pdf is constant over a texel */
            double top = cos(LUM_PI_D * (i / W) / H), bottom = cos(LUM_PI_D * (i / W + 1) / H);
            struct lum_vec3 d = direction(0.5 * (top + bottom), ((i % W + 0.5) / W - 0.5) * 2.0 * LUM_PI_D);
            double p = (double)lum_env_map_pdf(map, d) * 2.0 * LUM_PI_D / W * (top - bottom);
            cell[i] = (struct chi2_cell){p * n, 0.0};
            total += p;
        }
        assert_true(fabs(total - 1.0) < 1e-5);
        struct rng r = {1};
        for (int i = 0; i < n; i++) {
            struct lum_vec2 u = {(float)(rng_u64(&r) >> 40) * 0x1p-24f, (float)(rng_u64(&r) >> 40) * 0x1p-24f};
            struct lum_vec3 d;
            float pdf;
            assert_true(lum_env_map_sample(map, u, &d, &pdf));
            assert_true(pdf > 0.0f && fabsf(lum_length(d) - 1.0f) < 1e-6f);
            int y = (int)fmin(acos((double)d.y) / LUM_PI_D * H, H - 1);
            int x = (int)fmin((0.5 + atan2((double)d.z, (double)d.x) / (2.0 * LUM_PI_D)) * W, W - 1);
            cell[y * W + x].observed += 1.0;
        }
        double p = chi2_p_value(cell, W * H);
        if (p < sidak(0.01, 2))
            fail_msg("round %d: p = %g", round, p);
        lum_env_map_destroy(map);
    }
}

/* The mean luminance is exact: it equals quadrature of what is seen, and the estimate by samples. Every direction with
 * light can be sampled, at a bounded weight: bilinear over its mean is at most 64. */
static void energy_is_kept(void **state)
{
    (void)state;
    static float pixels[W * H * 3];
    fill_sky(pixels);
    struct lum_image image = image_of(pixels, W, H);
    struct lum_env_map *map = lum_env_map_create(&image);
    assert_non_null(map);
    enum { sub = 8, w = W * sub, h = H * sub };
    double seen = 0.0, mean = lum_env_map_mean_luminance(map);
    for (int i = 0; i < w * h; i++) {
        double top = cos(LUM_PI_D * (i / w) / h), bottom = cos(LUM_PI_D * (i / w + 1) / h);
        struct lum_vec3 d = direction(0.5 * (top + bottom), ((i % w + 0.5) / w - 0.5) * 2.0 * LUM_PI_D);
        double y = (double)lum_luminance(lum_env_map_radiance(map, d)), pdf = (double)lum_env_map_pdf(map, d);
        seen += y * 0.5 * (top - bottom) / w;
        if (y > 0.0 && !(pdf * mean * 4.0 * LUM_PI_D * 70.0 > y))
            fail_msg("luminance %g is sampled with pdf %g", y, pdf);
    }
    assert_true(fabs(mean / seen - 1.0) <
                0.01); /* rows: the bilinear mean is taken as even over a texel's solid angle */
    double estimate = 0.0;
    enum { n = 1 << 16 };
    for (uint32_t i = 0; i < n; i++) {
        struct lum_sampler q = lum_sampler_at(0, 0, i, 0);
        struct lum_vec3 d;
        float pdf;
        assert_true(lum_env_map_sample(map, lum_sampler_2d(&q, 0), &d, &pdf));
        estimate += (double)lum_luminance(lum_env_map_radiance(map, d)) / (double)pdf / n / (4.0 * LUM_PI_D);
    }
    assert_true(fabs(estimate / seen - 1.0) < 0.005);
    lum_env_map_destroy(map);
}

static void constant_image_is_constant(void **state)
{
    (void)state;
    static float pixels[W * H * 3];
    for (int i = 0; i < W * H * 3; i++)
        pixels[i] = 3.0f;
    struct lum_image image = image_of(pixels, W, H);
    struct lum_env_map *map = lum_env_map_create(&image);
    assert_non_null(map);
    assert_true(fabs(lum_env_map_mean_luminance(map) - 3.0) < 1e-6);
    struct rng r = {3};
    for (int i = 0; i < 10000; i++) {
        struct lum_vec3 d;
        float pdf;
        assert_true(lum_env_map_sample(map, (struct lum_vec2){(float)rng_unit(&r), (float)rng_unit(&r)}, &d, &pdf));
        /* a CDF step of 1/32 of a row of 1/100 at the pole is known to 2^-24 */
        assert_true(fabsf(pdf * 4.0f * LUM_PI - 1.0f) < 1e-4f);
        assert_true(lum_env_map_radiance(map, d).r == 3.0f);
    }
    lum_env_map_destroy(map);
}

/* The mean over a texel keeps 9/16 of a lone bright one. */
static void suns_are_told_from_even_skies(void **state)
{
    (void)state;
    static float pixels[W * H * 3];
    static const float sun[] = {1.0f, 2.0f, 1e3f};
    static const bool even[] = {true, true, false};
    for (int i = 0; i < 3; i++) {
        for (int k = 0; k < W * H * 3; k++)
            pixels[k] = 1.0f;
        for (int c = 0; c < 3; c++)
            pixels[3 * (3 * W + 20) + c] = sun[i];
        struct lum_image image = image_of(pixels, W, H);
        struct lum_env_map *map = lum_env_map_create(&image);
        assert_non_null(map);
        double peak = lum_env_map_peak(map) * lum_env_map_mean_luminance(map);
        assert_true(fabs(peak - (1.0 + 0.5625 * ((double)sun[i] - 1.0))) < 1e-5 * peak);
        struct lum_light light = {.kind = &lum_emitter_environment, .env = map};
        assert_true(lum_light_is_even_sky(&light) == even[i]);
        lum_env_map_destroy(map);
    }
    struct lum_light constant = {.kind = &lum_emitter_environment}, point = {.kind = &lum_emitter_point};
    assert_true(lum_light_is_even_sky(&constant));
    assert_false(lum_light_is_even_sky(&point));
}

static void black_image_is_never_sampled(void **state)
{
    (void)state;
    static float pixels[W * H * 3];
    struct lum_image image = image_of(pixels, W, H);
    struct lum_env_map *map = lum_env_map_create(&image);
    assert_non_null(map);
    struct lum_vec3 d;
    float pdf;
    assert_false(lum_env_map_sample(map, (struct lum_vec2){0.5f, 0.5f}, &d, &pdf));
    assert_true(lum_env_map_pdf(map, lum_v3(0, 1, 0)) == 0.0f && lum_env_map_mean_luminance(map) == 0.0);
    lum_env_map_destroy(map);
}

/* Images of one texel and single rows or columns; all of the square, its corners included; poles and axes as
 * directions. */
static void extremes_are_finite(void **state)
{
    (void)state;
    static float pixels[64 * 3];
    for (int i = 0; i < 64 * 3; i++)
        pixels[i] = i % 5 ? 0.0f : 1e30f;
    static const uint32_t sizes[][2] = {{1, 1}, {1, 8}, {8, 1}, {2, 2}, {8, 8}};
    static const float us[] = {0.0f, 0x1p-24f, 0.5f, 0.99999994f};
    static const struct lum_vec3 ds[] = {{0, 1, 0},      {0, -1, 0}, {1, 0, 0}, {-1, 0, 0},
                                         {-1, 0, -0.0f}, {0, 0, 1},  {0, 0, 0}};
    for (size_t k = 0; k < LUM_ARRAY_LEN(sizes); k++) {
        struct lum_image image = image_of(pixels, sizes[k][0], sizes[k][1]);
        struct lum_env_map *map = lum_env_map_create(&image);
        assert_non_null(map);
        for (int i = 0; i < 16; i++) {
            struct lum_vec3 d;
            float pdf;
            assert_true(lum_env_map_sample(map, (struct lum_vec2){us[i % 4], us[i / 4]}, &d, &pdf));
            assert_true(lum_v3_finite(d) && isfinite(pdf) && pdf > 0.0f);
        }
        for (size_t i = 0; i < LUM_ARRAY_LEN(ds); i++) {
            float pdf = lum_env_map_pdf(map, ds[i]);
            assert_true(isfinite(pdf) && pdf >= 0.0f && lum_rgb_finite(lum_env_map_radiance(map, ds[i])));
        }
        lum_env_map_destroy(map);
    }
}

/* The light turns the picture by its frame: sampled and looked up radiance agree, and follow the rotation. */
static void light_is_rotated(void **state)
{
    (void)state;
    static float pixels[W * H * 3];
    fill_sky(pixels);
    struct lum_image image = image_of(pixels, W, H);
    struct lum_env_map *map = lum_env_map_create(&image);
    assert_non_null(map);
    float c = cosf(0.7f), s = sinf(0.7f);
    struct lum_light l = {.kind = &lum_emitter_environment,
                          .power = {2.0f, 2.0f, 2.0f},
                          .on = true,
                          .env = map,
                          .frame = {{c, 0, -s}, {0, 1, 0}, {s, 0, c}}};
    struct lum_snapshot snapshot = {.lights = {.lights = &l, .n_lights = 1, .environment = 0}};
    struct lum_vec3 local = {0.6f, 0.0f, 0.8f}, turned = lum_frame_to_scene(&l.frame, local);
    assert_true(fabsf(lum_lights_background(&snapshot.lights, turned, false).g -
                      2.0f * lum_env_map_radiance(map, local).g) < 1e-3f);
    struct rng r = {5};
    for (int i = 0; i < 10000; i++) {
        struct lum_light_sample ls;
        struct lum_vec2 u = {(float)rng_unit(&r) * 0.999f, (float)rng_unit(&r) * 0.999f};
        struct lum_vec3 o = {0, 0, 0};
        assert_true(lum_light_sample_at(&snapshot, 0, o, u, &ls));
        struct lum_rgb seen = lum_lights_background(&snapshot.lights, ls.wi, false);
        /* the direction is turned there and back: 2^-22 of an angle, times the slope of the sun: 1e5 over a texel of
         * 0.2 */
        assert_true(fabsf(seen.g - ls.radiance.g) <= 0.5f);
        assert_true(ls.distance == INFINITY);
    }
    lum_env_map_destroy(map);
}

static void allocation_may_fail(void **state)
{
    (void)state;
    static float pixels[W * H * 3];
    struct lum_image image = image_of(pixels, W, H);
    uint64_t k = 1;
    for (; k < 100; k++) {
        lum_alloc_fail_after(k);
        struct lum_env_map *map = lum_env_map_create(&image);
        lum_alloc_fail_after(0);
        lum_env_map_destroy(map);
        if (map)
            break;
    }
    assert_true(k > 1 && k < 100);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(picture_stands_upright),
        cmocka_unit_test(samples_follow_the_pdf),
        cmocka_unit_test(energy_is_kept),
        cmocka_unit_test(constant_image_is_constant),
        cmocka_unit_test(suns_are_told_from_even_skies),
        cmocka_unit_test(black_image_is_never_sampled),
        cmocka_unit_test(extremes_are_finite),
        cmocka_unit_test(light_is_rotated),
        cmocka_unit_test(allocation_may_fail),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

/* Where a picture is off: closed forms of noise that is known, place by place. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "core/film/error_map.h"
#include "core/math/sampler.h"

enum { W = 197, H = 130 };

static void make_film(struct lum_film *f)
{
    assert_int_equal(lum_film_init(f, W, H, NULL), LUM_OK);
}

/* Uniform of mean 0 and deviation 1, independent: a sampler's numbers are spread better than that. */
static float noise_at(uint32_t x, uint32_t y, uint32_t sample)
{
    uint32_t bits = lum_hash_u32(sample * W * H + y * W + x);
    return sqrtf(12.0f) * ((float)(bits >> 8) * 0x1p-24f - 0.5f);
}

/* 16 samples of deviation 1 on the left and 4 on the right: the picture is off by 1/4 and 1, where the light is 10 and
 * 100. A cell is seen through the 24 x 24 pixels around it: the mean of so many squares, of which each has at most
 * twice the variance of a normal variable's, is right to sqrt(2 / 576) = 6 % of itself by a standard deviation, and to
 * a quarter by four; fewer pixels at the picture's border: 40 %. */
static void noise_is_found_where_it_is(void **state)
{
    (void)state;
    struct lum_film f;
    struct lum_error_map map;
    uint64_t bad = 0;
    make_film(&f);
    for (uint32_t sample = 0; sample < 16; sample++)
        for (uint32_t y = 0; y < H; y++)
            for (uint32_t x = 0; x < W; x++)
                lum_film_add(&f, x, y, sample,
                             lum_grey(x < 96 ? 10.0f + noise_at(x, y, sample) : 100.0f + 4.0f * noise_at(x, y, sample)),
                             &bad);
    assert_int_equal(lum_error_map_init(&map, &f, NULL), LUM_OK);
    lum_error_map_add_halves(&map, &f);
    lum_error_map_settle(&map);
    for (uint32_t y = 0; y < H; y++)
        for (uint32_t x = 0; x < W; x++) {
            if (x + 16 > 96 && x < 96 + 16)
                continue; /* windows of both sides */
            bool left = x < 96, inside = x >= 12 && x < W - 16 && y >= 12 && y < H - 16;
            double rms = left ? 0.25 : 1.0, light = left ? 10.0 : 100.0, room = inside ? 0.25 : 0.4;
            double got = (double)lum_error_map_at(&map, map.rms, x, y);
            if (!(fabs(got * got / (rms * rms) - 1.0) < room))
                fail_msg("at %u, %u: %g, not %g", x, y, got, rms);
            double rel = (double)lum_error_map_at(&map, map.rel, x, y);
            /* Black is taken for a tenth of the mean; here nothing is. The light around is right to .25 / 24. */
            assert_true(fabs(rel * light / got - 1.0) < 0.02);
        }
    lum_error_map_finish(&map);
    lum_film_finish(&f);
}

/* Few pixels, drawn with chances that differ, stand for as many as their weight says: half of them have an error of 3
 * and the chance 3/4, the others one of 1. */
static void weights_count(void **state)
{
    (void)state;
    struct lum_film f;
    struct lum_error_map map;
    make_film(&f);
    assert_int_equal(lum_error_map_init(&map, &f, NULL), LUM_OK);
    for (uint32_t i = 0; i < 4000; i++) {
        struct lum_sampler s = lum_sampler_at(i, 0, 0, 1);
        struct lum_vec2 at = lum_sampler_2d(&s, 0);
        bool far = lum_sampler_1d(&s, 2) < 0.75f;
        lum_error_map_add(&map, (uint32_t)(at.x * W) % W, (uint32_t)(at.y * H) % H, far ? 9.0 : 1.0,
                          far ? 0.5 / 0.75 : 0.5 / 0.25);
    }
    lum_error_map_settle(&map);
    double sum = 0.0;
    for (uint32_t i = 0; i < map.nx * map.ny; i++)
        sum += (double)map.rms[i] * (double)map.rms[i] / (map.nx * map.ny);
    /* 5 in the mean; windows of about 100 pixels, 40 of the picture: the ratio's deviation is below 10 % in each, and
     * 2 % of their mean. Those of few pixels choose by what they find, which costs some per cent more. */
    assert_true(fabs(sum / 5.0 - 1.0) < 0.1);
    assert_true(isnan(map.rel[0])); /* black: there is nothing to compare with */
    lum_error_map_finish(&map);
    lum_film_finish(&f);
}

/* Nothing is known of a picture without samples in both halves; estimates below 0 and those that are no number do no
 * harm; what is not sure is not called small. */
static void what_is_not_known_is_not_said(void **state)
{
    (void)state;
    struct lum_film f;
    struct lum_error_map map;
    uint64_t bad = 0;
    make_film(&f);
    for (uint32_t i = 0; i < W * H; i++)
        lum_film_add(&f, i % W, i / W, 0, lum_grey(1.0f), &bad);
    assert_int_equal(lum_error_map_init(&map, &f, NULL), LUM_OK);
    lum_error_map_add_halves(&map, &f);
    lum_error_map_settle(&map);
    for (uint32_t i = 0; i < map.nx * map.ny; i++)
        assert_true(isnan(map.rms[i]) && isnan(map.rel[i]));
    lum_error_map_finish(&map);

    assert_int_equal(lum_error_map_init(&map, &f, NULL), LUM_OK);
    lum_error_map_add(&map, 100, 60, NAN, 1.0);
    lum_error_map_add(&map, 100, 60, -4.0, 1.0);
    lum_error_map_add(&map, 101, 60, INFINITY, 1.0);
    lum_error_map_settle(&map);
    float at = lum_error_map_at(&map, map.rms, 100, 60);
    assert_true(fabsf(at - 2.0f) < 1e-6f); /* 0 and a deviation of 4 */
    lum_error_map_finish(&map);
    lum_film_finish(&f);
}

static void without_memory_there_is_no_map(void **state)
{
    (void)state;
    struct lum_film f;
    struct lum_error_map map;
    struct lum_error err;
    make_film(&f);
    for (uint64_t n = 1; n <= 3; n++) {
        lum_alloc_fail_after(n);
        assert_int_equal(lum_error_map_init(&map, &f, &err), LUM_ERR_NOMEM);
        lum_alloc_fail_after(0);
        assert_null(map.sums);
    }
    lum_film_finish(&f);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(noise_is_found_where_it_is),
        cmocka_unit_test(weights_count),
        cmocka_unit_test(what_is_not_known_is_not_said),
        cmocka_unit_test(without_memory_there_is_no_map),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

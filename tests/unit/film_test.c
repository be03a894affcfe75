/* Film sums and gate, error estimate from the halves, exposure and tone maps on hard input (NOTES H30, H34). */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include <float.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/film/film.h"
#include "core/math/color.h"

static void gate_drops_and_counts(void **state)
{
    (void)state;
    struct lum_film f;
    assert_int_equal(lum_film_init(&f, 3, 2, NULL), LUM_OK);
    uint64_t bad = 0;
    lum_film_add(&f, 1, 1, 0, lum_rgb(2, 4, 6), &bad);
    lum_film_add(&f, 1, 1, 1, lum_rgb(NAN, 0, 0), &bad);
    lum_film_add(&f, 1, 1, 1, lum_rgb(0, INFINITY, 0), &bad);
    lum_film_add(&f, 1, 1, 1, lum_rgb(0, 0, -INFINITY), &bad);
    assert_int_equal(bad, 3);
    lum_film_add(&f, 1, 1, 1, lum_rgb(4, 8, 12), &bad);
    struct lum_rgb m = lum_film_mean(&f, 1, 1);
    assert_true(m.r == 3 && m.g == 6 && m.b == 9);
    m = lum_film_mean(&f, 0, 0);
    assert_true(m.r == 0 && m.g == 0 && m.b == 0);
    assert_true(isnan(lum_film_error(&f).bound));
    lum_film_set(&f, 1, 1, lum_rgb(1, 2, 3), &bad);
    m = lum_film_mean(&f, 1, 1);
    assert_true(m.r == 1 && m.g == 2 && m.b == 3 && f.n[0][4] == 1 && f.n[1][4] == 0 && f.half[1][3 * 4] == 0);
    lum_film_set(&f, 1, 1, lum_rgb(1, NAN, 3), &bad);
    assert_true(bad == 4 && f.n[0][4] + f.n[1][4] == 0 && f.half[0][3 * 4] == 0);
    lum_film_add(&f, 1, 1, 1, lum_rgb(4, 8, 12), &bad);
    lum_film_reset_pixel(&f, 1, 1);
    assert_int_equal(f.n[0][4] + f.n[1][4], 0);
    lum_film_finish(&f);
}

/* After an even number of samples each half has as many of each pixel, after one every second column. */
static void halves_take_turns(void **state)
{
    (void)state;
    struct lum_film f;
    uint64_t bad = 0;
    assert_int_equal(lum_film_init(&f, 4, 2, NULL), LUM_OK);
    for (uint32_t sample = 0; sample < 4; sample++) {
        for (uint32_t i = 0; i < 8; i++)
            lum_film_add(&f, i % 4, i / 4, sample, lum_grey(1.0f), &bad);
        for (uint32_t i = 0; i < 8; i++) {
            uint32_t first = sample % 2 == 0 && i % 2 == 0, second = sample % 2 == 0 && i % 2 == 1;
            assert_int_equal(f.n[0][i], (sample + 1) / 2 + first);
            assert_int_equal(f.n[1][i], (sample + 1) / 2 + second);
        }
    }
    lum_film_finish(&f);
}

static void long_sums_do_not_stick(void **state)
{
    (void)state;
    struct lum_film f;
    assert_int_equal(lum_film_init(&f, 1, 1, NULL), LUM_OK);
    uint64_t bad = 0;
    for (uint32_t i = 0; i < 40000000u; i++) /* a float sum of 1 sticks at 2^24 = 1.68e7 */
        lum_film_add(&f, 0, 0, i & ~1u, lum_grey(1.0f), &bad);
    assert_true(f.half[0][0] == 4e7);
    lum_film_finish(&f);
}

/* Samples of known variance: the estimate must lie within its own standard error of the truth. */
static void halves_measure_the_error(void **state)
{
    (void)state;
    enum { SIDE = 64, SPP = 16 };
    struct lum_film f;
    assert_int_equal(lum_film_init(&f, SIDE, SIDE, NULL), LUM_OK);
    uint64_t bad = 0, rng = 1;
    for (uint32_t y = 0; y < SIDE; y++)
        for (uint32_t x = 0; x < SIDE; x++)
            for (uint32_t s = 0; s < SPP; s++) {
                rng = rng * 6364136223846793005u + 1442695040888963407u;
                float u = (float)(rng >> 40) * 0x1p-24f; /* uniform in [0,1): mean 1/2, variance 1/12 */
                lum_film_add(&f, x, y, s, lum_grey(u), &bad);
            }
    double truth = sqrt(1.0 / 12.0 / SPP) / 0.5;
    /* Each pixel's (A-B)^2/4 is nearly chi^2 with one degree of freedom: its mean over N pixels has relative deviation
     * sqrt(2/N), its root half of that; four of those. */
    double tolerance = 4.0 * 0.5 * sqrt(2.0 / (SIDE * SIDE));
    double got = lum_film_error(&f).rel;
    if (!(fabs(got / truth - 1.0) < tolerance))
        fail_msg("estimated %g, true %g, relative tolerance %g", got, truth, tolerance);
    lum_film_finish(&f);
}

static void tone_maps_survive_hard_input(void **state)
{
    (void)state;
    const float hard[] = {0.0f,  -0.0f,   1e-38f, 1e-45f,   0.18f,    1.0f,      65504.0f,
                          1e30f, FLT_MAX, -1.0f,  -FLT_MAX, INFINITY, -INFINITY, NAN};
    for (int tone = LUM_TONE_AGX; tone <= LUM_TONE_NONE; tone++) {
        uint8_t c[3];
        for (size_t i = 0; i < LUM_ARRAY_LEN(hard); i++)
            for (size_t j = 0; j < LUM_ARRAY_LEN(hard); j++)
                lum_tone_pixel(lum_rgb(hard[i], hard[j], 0.5f), 1.0, (enum lum_tone_map)tone,
                               c); /* UBSan watches the casts */
        lum_tone_pixel(lum_grey(NAN), 1.0, (enum lum_tone_map)tone, c);
        assert_int_equal(c[0] + c[1] + c[2], 0);
        lum_tone_pixel(lum_grey(0.0f), 1.0, (enum lum_tone_map)tone, c);
        assert_int_equal(c[0] + c[1] + c[2], 0);
        lum_tone_pixel(lum_grey(INFINITY), 1.0, (enum lum_tone_map)tone, c);
        assert_true(c[0] >= 254 && c[1] >= 254 && c[2] >= 254);
    }
}

static void tone_maps_are_monotone_on_grey(void **state)
{
    (void)state;
    for (int tone = LUM_TONE_AGX; tone <= LUM_TONE_NONE; tone++) {
        uint8_t before[3] = {0, 0, 0}, c[3];
        for (int i = -400; i <= 400; i++) {
            float v = exp2f((float)i / 20.0f);
            lum_tone_pixel(lum_grey(v), 1.0, (enum lum_tone_map)tone, c);
            for (int k = 0; k < 3; k++)
                if (c[k] < before[k])
                    fail_msg("%s at %g: %d after %d", lum_tone_map_names[tone], (double)v, c[k], before[k]);
            memcpy(before, c, sizeof c);
        }
        assert_true(before[0] >= 254);
    }
}

static void none_is_exactly_srgb(void **state)
{
    (void)state;
    for (int code = 0; code < 256; code++) {
        double e = code / 255.0, v = e <= 0.04045 ? e / 12.92 : pow((e + 0.055) / 1.055, 2.4);
        uint8_t c[3];
        lum_tone_pixel(lum_grey((float)(v * 3.0)), 3.0, LUM_TONE_NONE, c);
        assert_int_equal(c[0], code);
    }
}

static void balance_is_off_unless_asked_for(void **state)
{
    (void)state;
    enum { N = 70 }; /* more than a span */
    struct lum_film f;
    uint64_t bad = 0;
    uint8_t off[4 * N], on[4 * N], want[3];
    const struct lum_rgb warm = lum_cct_to_rgb(3000.0);
    assert_int_equal(lum_film_init(&f, N, 1, NULL), LUM_OK);
    for (uint32_t x = 0; x < N; x++)
        lum_film_add(&f, x, 0, 0, lum_rgb_scale(warm, (float)x / N), &bad);
    struct lum_display d = {.ev100 = -log2(1.2), .tone = LUM_TONE_AGX, .balance = {{NAN}}};
    lum_film_resolve(&f, 0, 0, N, 1, &d, off, sizeof off);
    d.balanced = true;
    lum_white_balance(3000.0, d.balance);
    lum_film_resolve(&f, 0, 0, N, 1, &d, on, sizeof on);
    for (uint32_t x = 0; x < N; x++) {
        lum_tone_pixel(lum_film_mean(&f, x, 0), lum_exposure_white(d.ev100), LUM_TONE_AGX, want);
        assert_memory_equal(off + 4 * x, want, 3);
        assert_true(abs(on[4 * x] - on[4 * x + 1]) <= 1 && abs(on[4 * x + 2] - on[4 * x + 1]) <= 1); /* grey */
    }
    assert_true(off[4 * (N - 1)] > off[4 * (N - 1) + 2] + 20);
    lum_film_finish(&f);
}

static double auto_of(uint32_t w, uint32_t h, float value, float first)
{
    struct lum_film f;
    assert_int_equal(lum_film_init(&f, w, h, NULL), LUM_OK);
    uint64_t bad = 0;
    for (uint32_t y = 0; y < h; y++)
        for (uint32_t x = 0; x < w; x++)
            lum_film_add(&f, x, y, 0, lum_grey(x + y ? value : first), &bad);
    double ev = lum_exposure_auto(&f);
    lum_film_finish(&f);
    return ev;
}

static void auto_exposure_guards(void **state)
{
    (void)state;
    assert_true(auto_of(4, 4, 0.0f, 0.0f) == 0.0); /* black */
    double one = auto_of(1, 1, 0.0f, 100.0f);
    /* An even picture lands on 18 % of display white. */
    assert_true(fabs(100.0 / lum_exposure_white(one) - 0.18) < 1e-6);
    double equal = auto_of(8, 8, 100.0f, 100.0f);
    assert_true(fabs(equal - one) < 1e-9);
    assert_true(isfinite(auto_of(8, 8, 0.0f, 1e6f)));
    assert_true(isfinite(auto_of(8, 8, 1e-38f, 1e-38f)));
    assert_true(isfinite(auto_of(8, 8, FLT_MAX, FLT_MAX)));
    /* Pixels that are black by chance: one lit pixel of a block of 64 exposes for the block's mean, 6 stops below. */
    assert_true(fabs(auto_of(8, 8, 0.0f, 100.0f) - (one - 6.0)) < 1e-9);
    /* Black blocks have no say: one of four lit exposes as the lit one alone. */
    assert_true(fabs(auto_of(16, 16, 0.0f, 100.0f) - (one - 6.0)) < 1e-9);
}

static void film_survives_short_memory(void **state)
{
    (void)state;
    for (uint64_t k = 1; k <= 4; k++) {
        struct lum_film f = {.w = 77};
        lum_alloc_fail_after(k);
        assert_int_equal(lum_film_init(&f, 8, 8, NULL), LUM_ERR_NOMEM);
        assert_int_equal(f.w, 77);
    }
    lum_alloc_fail_after(0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(gate_drops_and_counts),        cmocka_unit_test(halves_take_turns),
        cmocka_unit_test(long_sums_do_not_stick),       cmocka_unit_test(halves_measure_the_error),
        cmocka_unit_test(tone_maps_survive_hard_input), cmocka_unit_test(tone_maps_are_monotone_on_grey),
        cmocka_unit_test(none_is_exactly_srgb),         cmocka_unit_test(balance_is_off_unless_asked_for),
        cmocka_unit_test(auto_exposure_guards),         cmocka_unit_test(film_survives_short_memory),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

/* Blocks against closed forms. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "core/math/sampler.h"
#include "core/metric/blocks.h"

enum { W = 600, H = 400, N = W * H, BLOCKS = 24 * 16 };
static float x[N], r[N], half[2][N];
static double ratios[BLOCKS];

static void assert_near(double value, double expected, double tolerance)
{
    if (!(fabs(value - expected) <= tolerance))
        fail_msg("%.17g is not %.17g within %g", value, expected, tolerance);
}

static struct lum_blocks_result compare(bool with_halves)
{
    struct lum_blocks_result result;
    struct lum_error err;
    struct lum_blocks_input in = {.w = W, .h = H, .x = x, .r = r};
    if (with_halves)
        in.r_halves[0] = half[0], in.r_halves[1] = half[1];
    assert_int_equal(lum_blocks_compare(&in, ratios, &result, &err), LUM_OK);
    return result;
}

static uint32_t block_of(size_t i)
{
    return (uint32_t)(i / W / 25 * 24 + i % W / 25);
}

/* Uniform in [-1, 1): variance 1/3. */
static float noise(size_t i, uint32_t seed)
{
    return (float)(lum_hash_combine(lum_hash_u32((uint32_t)i), seed) >> 8) * 0x1p-23f - 1.0f;
}

static void assert_grid(uint32_t w, uint32_t h, uint32_t side, uint32_t nx, uint32_t ny)
{
    struct lum_blocks_grid g = lum_blocks_grid(w, h);
    if (g.side != side || g.nx != nx || g.ny != ny)
        fail_msg("%u x %u: %u x %u blocks of %u, not %u x %u of %u", w, h, g.nx, g.ny, g.side, nx, ny, side);
    assert_int_equal(lum_blocks_begin(&g, nx, nx, w), w);
    assert_true(lum_blocks_begin(&g, nx - 1, nx, w) < w);
    assert_true(lum_blocks_begin(&g, ny - 1, ny, h) < h);
}

static void test_grid(void **state)
{
    (void)state;
    assert_grid(600, 400, 25, 24, 16);
    assert_grid(1440, 900, 60, 24, 15);
    assert_grid(610, 412, 25, 24, 16); /* 10 and 12 pixels join the last */
    assert_grid(605, 413, 25, 24, 17); /* 13 are a block of their own */
    assert_grid(1, 1, 1, 1, 1);
    assert_grid(600, 3, 25, 24, 1);
    assert_grid(3, 600, 1, 3, 600);
}

/* Blocks k = 0 .. 383 of x are (k + 1) / 128 times those of r: their percentiles are those of an arithmetic sequence,
 * and all are exact in float. */
static void test_sequence(void **state)
{
    (void)state;
    for (size_t i = 0; i < N; i++) {
        r[i] = 64.0f;
        x[i] = 0.5f * (float)(block_of(i) + 1);
    }
    struct lum_blocks_result m = compare(false);
    assert_int_equal(m.n_counted, BLOCKS);
    assert_int_equal(m.n_dark + m.n_nonfinite, 0);
    for (uint32_t k = 0; k < BLOCKS; k++)
        assert_near(ratios[k], (k + 1) / 128.0, 0.0);
    assert_near(m.lowest, 1.0 / 128.0, 0.0);
    assert_near(m.highest, 3.0, 0.0);
    assert_near(m.mean, 192.5 / 128.0, 1e-14);
    assert_near(m.median, 192.5 / 128.0, 1e-14);
    assert_near(m.p5, (1.0 + 0.05 * 383.0) / 128.0, 1e-14);
    assert_near(m.p25, (1.0 + 0.25 * 383.0) / 128.0, 1e-14);
    assert_near(m.p75, (1.0 + 0.75 * 383.0) / 128.0, 1e-14);
    assert_near(m.p95, (1.0 + 0.95 * 383.0) / 128.0, 1e-14);
    assert_near(m.mean_stderr, 0.0, 0.0); /* a flat reference has no noise */
    assert_near(m.stderr_p95, 0.0, 0.0);
}

/* The mean of the whole weighs blocks by their light, the median does not. */
static void test_mean_is_of_the_picture(void **state)
{
    (void)state;
    for (size_t i = 0; i < N; i++) {
        bool bright = block_of(i) == 7;
        r[i] = bright ? 383.0f : 1.0f;
        x[i] = bright ? 2.0f * r[i] : r[i];
    }
    struct lum_blocks_result m = compare(false);
    assert_near(m.mean, 1.5, 1e-14);
    assert_near(m.median, 1.0, 0.0);
    assert_near(m.highest, 2.0, 0.0);
}

/* One block at twice the threshold and one at half of it, both wrong by a factor of ten: the first counts. */
static void test_dark_blocks(void **state)
{
    (void)state;
    for (size_t i = 0; i < N; i++) {
        uint32_t k = block_of(i);
        r[i] = k == 3 ? 2.0f : k == 200 ? 0.5f : 512.0f;
        x[i] = k == 3 || k == 200 ? 10.0f * r[i] : r[i];
    }
    struct lum_blocks_result m = compare(false);
    assert_int_equal(m.n_dark, 1);
    assert_int_equal(m.n_counted, BLOCKS - 1);
    assert_near(m.highest, 10.0, 0.0);
    assert_true(isnan(ratios[200]));
    for (size_t i = 0; i < N; i++)
        r[i] = 0.0f;
    m = compare(false);
    assert_int_equal(m.n_dark, BLOCKS);
    assert_true(isnan(m.mean) && isnan(m.median) && isnan(m.mean_stderr));
}

static void test_nonfinite_pixels(void **state)
{
    (void)state;
    for (size_t i = 0; i < N; i++)
        x[i] = r[i] = 1.0f;
    x[0] = NAN;
    r[5] = INFINITY;
    struct lum_blocks_result m = compare(false);
    assert_int_equal(m.n_nonfinite, 2);
    assert_near(m.mean, 1.0, 0.0);
    assert_near(ratios[0], 1.0, 0.0);
}

/* Halves 1 + u and 1 + v, u and v uniform in [-1, 1): the mean of n pixels has the variance 1/6 / n, and the estimate
 * from n squares of relative standard error d (Var((u - v)^2 / 4) / (1/6)^2 = 7/5) has sqrt(1.4 / n) of error in the
 * variance, half as much in its root. Five of those are allowed. x is 1: its ratios to r spread by just that standard
 * error. */
static void test_error_from_halves(void **state)
{
    (void)state;
    double spread = 0.0, n = 625.0, expected = sqrt(1.0 / 6.0 / n);
    for (size_t i = 0; i < N; i++) {
        half[0][i] = 1.0f + noise(i, 1);
        half[1][i] = 1.0f + noise(i, 2);
        r[i] = 0.5f * (half[0][i] + half[1][i]);
        x[i] = 1.0f;
    }
    struct lum_blocks_result m = compare(true);
    assert_near(m.mean_stderr, sqrt(1.0 / 6.0 / N), 5.0 * 0.5 * sqrt(1.4 / N) * sqrt(1.0 / 6.0 / N));
    /* the median of 384 estimates: that of one, but for its own error of 1.25 sigma / sqrt(384), and the ratio's second
     * order */
    assert_near(m.stderr_median, expected,
                (5.0 * 1.25 / sqrt(384.0) + 0.05) * 0.5 * sqrt(1.4 / n) * expected + expected * expected);
    for (int k = 0; k < BLOCKS; k++)
        spread += (ratios[k] - 1.0) * (ratios[k] - 1.0) / BLOCKS;
    /* a root mean square of 384 normal values: 1 / sqrt(2 * 384) of itself */
    assert_near(sqrt(spread), expected, 5.0 / sqrt(768.0) * expected);
}

/* Without halves: at least the noise there is, on a flat picture that itself but for its own error, more on a slope. */
static void test_error_without_halves(void **state)
{
    (void)state;
    double expected = sqrt(1.0 / 12.0 / N); /* 1 + u / 2 */
    for (size_t i = 0; i < N; i++)
        r[i] = 1.0f + 0.5f * noise(i, 3), x[i] = 1.0f;
    struct lum_blocks_result flat = compare(false);
    /* N / 2 squares (u - v)^2, relative standard deviation sqrt(7/5); 384 pixels are counted twice: 1/1250 of the root
     */
    assert_near(flat.mean_stderr, expected, (5.0 * 0.5 * sqrt(2.8 / N) + 1.0 / 1250.0 + 1e-3) * expected);
    for (size_t i = 0; i < N; i++)
        r[i] = 1.0f + (float)(i % W) / 8.0f, x[i] = 1.0f; /* no noise */
    struct lum_blocks_result slope = compare(false);
    assert_true(slope.mean_stderr > 0.0);
    /* differences of 1/8 in a row, none where it turns: 300 of 312 pairs and the odd one lie in rows */
    assert_true(slope.mean_stderr <= sqrt(N / 2.0 + BLOCKS) / 8.0 / (N * (1.0 + 599.0 / 16.0)) * (1.0 + 1e-9));
}

/* Two pictures of 3 x 2 have blocks of one pixel: without halves nothing is known of their noise. */
static void test_single_pixels(void **state)
{
    (void)state;
    const float a[6] = {1, 2, 3, 4, 5, 6}, b[6] = {2, 2, 2, 2, 2, 2};
    struct lum_blocks_result m;
    struct lum_error err;
    struct lum_blocks_input in = {.w = 3, .h = 2, .x = a, .r = b};
    assert_int_equal(lum_blocks_compare(&in, NULL, &m, &err), LUM_OK);
    assert_near(m.median, 1.75, 0.0);
    assert_true(isnan(m.mean_stderr) && isnan(m.stderr_median));
    in.r_halves[0] = in.r_halves[1] = b;
    assert_int_equal(lum_blocks_compare(&in, NULL, &m, &err), LUM_OK);
    assert_near(m.mean_stderr, 0.0, 0.0);
}

static void test_no_memory(void **state)
{
    (void)state;
    struct lum_blocks_result m;
    struct lum_error err;
    struct lum_blocks_input in = {.w = W, .h = H, .x = x, .r = r};
    for (int k = 1; k <= 2; k++) {
        lum_alloc_fail_after((uint64_t)k);
        assert_int_equal(lum_blocks_compare(&in, NULL, &m, &err), LUM_ERR_NOMEM);
    }
    lum_alloc_fail_after(0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_grid),
        cmocka_unit_test(test_sequence),
        cmocka_unit_test(test_mean_is_of_the_picture),
        cmocka_unit_test(test_dark_blocks),
        cmocka_unit_test(test_nonfinite_pixels),
        cmocka_unit_test(test_error_from_halves),
        cmocka_unit_test(test_error_without_halves),
        cmocka_unit_test(test_single_pixels),
        cmocka_unit_test(test_no_memory),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

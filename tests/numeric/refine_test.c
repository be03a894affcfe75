/* From the fast frame to the truth: the blend's weights and errors, on made-up frames and samples whose truth is known.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "core/render/refine.h"

#define W 80u
#define H 64u
#define TRUTH 10.0

struct rig {
    struct lum_tiling tiling;
    struct lum_refinement r;
    struct lum_film film;
};

static double noise(uint32_t i, uint32_t sample)
{
    /* uniform with variance 1 */
    struct lum_sampler s = lum_sampler_halves(i % W, i / W, sample, 7);
    return ((double)lum_sampler_1d(&s, 0) - 0.5) * sqrt(12.0);
}

/* The frame is TRUTH + bias; each half is one sample of TRUTH with standard deviation sd. */
static void rig_init(struct rig *g, double bias, double sd)
{
    struct lum_error err;
    uint64_t nonfinite = 0;
    *g = (struct rig){.tiling = lum_tiling_make(W, H, LUM_TILE_SIDE)};
    assert_int_equal(lum_film_init(&g->film, W, H, &err), LUM_OK);
    assert_int_equal(lum_refine_init(&g->r, &g->tiling, &err), LUM_OK);
    for (uint32_t i = 0; i < W * H; i++)
        lum_film_add(&g->film, i % W, i / W, 0, lum_grey((float)(TRUTH + bias)), &nonfinite);
    lum_refine_begin(&g->r, &g->tiling);
    lum_refine_take(&g->r, &g->tiling, &g->film);
    for (uint32_t i = 0; i < W * H; i++)
        for (uint32_t k = 0; k < 2; k++)
            lum_film_add(&g->r.truth, i % W, i / W, k, lum_grey((float)(TRUTH + sd * noise(i, k))), &nonfinite);
    lum_refine_blend(&g->r, &g->tiling, &g->film, &nonfinite);
    assert_int_equal(nonfinite, 0);
}

static void rig_finish(struct rig *g)
{
    lum_refine_finish(&g->r);
    lum_film_finish(&g->film);
}

static double mean_square_error(const struct rig *g)
{
    double sum = 0.0;
    for (uint32_t i = 0; i < W * H; i++) {
        double d = (double)lum_film_mean(&g->film, i % W, i / W).g - TRUTH;
        sum += d * d;
    }
    return sum / (W * H);
}

/* bias b against noise of variance v of the mean: weight b^2 / (b^2 + 16 v), here .25 / (.25 + .5). Both are measured
 * over 3 x 3 tiles (2304 pixels; 4 at a corner, 1024): the mean of (b - A)(b - B) has a standard deviation of sqrt((2
 * b^2 sd^2 + sd^4) / n), 0.006 of 0.25 at the corner, and v one of sqrt(2 / n), 0.0014 of 0.031; 4 of both move the
 * weight by 0.06. */
static void weight_is_that_of_the_measured_errors(void **state)
{
    (void)state;
    struct rig g;
    rig_init(&g, 0.5, 0.25);
    for (uint32_t t = 0; t < g.tiling.n; t++)
        assert_true(fabsf(g.r.errors[t].weight - 1.0f / 3.0f) < 0.06f);
    rig_finish(&g);
}

/* w^2 v + (1 - w)^2 b^2 = 0.1146. Weights that are off by 0.06 at most, mostly by a third of that: by 0.012. */
static void blend_knows_its_error(void **state)
{
    (void)state;
    struct rig g;
    rig_init(&g, 0.5, 0.25);
    double mse = mean_square_error(&g), said = g.r.error_rel * TRUTH;
    assert_true(fabs(mse - 0.1146) < 0.012);
    assert_true(fabs(said * said - mse) < 0.012);
    rig_finish(&g);
}

static void samples_take_over_in_the_end(void **state)
{
    (void)state;
    struct rig g;
    rig_init(&g, 0.5, 1e-3);
    assert_true(mean_square_error(&g) < 1e-5);
    rig_finish(&g);
    rig_init(&g, 0.0, 1e-3); /* even from a perfect frame, which is never believed in */
    for (uint32_t t = 0; t < g.tiling.n; t++)
        assert_true(g.r.errors[t].weight > 0.99f);
    rig_finish(&g);
}

/* A good frame stays while the samples are noise: at most 1 % of TRUTH is believed to be its error, so the weight is at
 * most 0.01 / (0.01 + v); the measured error adds 4 standard deviations of sd^2 / sqrt(1024): 0.125 sd^2. */
static void noise_does_not_show(void **state)
{
    (void)state;
    struct rig g;
    rig_init(&g, 0.0, 1.0);
    for (uint32_t t = 0; t < g.tiling.n; t++)
        assert_true(g.r.errors[t].weight < 0.22f);
    double mse = mean_square_error(&g), said = g.r.error_rel * TRUTH;
    assert_true(mse < 0.05 * 0.5);
    /* What is said counts the noise that was let in, however small the frame's measured error. Both are means over 5120
     * pixels, with a relative standard deviation of 2 %, a few times that for uneven weights. */
    assert_true(said * said > 0.5 * mse);
    rig_finish(&g);
}

static void black_stays_black(void **state)
{
    (void)state;
    struct rig g;
    rig_init(&g, -TRUTH, 0.0); /* a black frame of a lit scene */
    assert_true(mean_square_error(&g) < 1e-9);
    uint64_t nonfinite = 0;
    for (uint32_t i = 0; i < W * H; i++) {
        g.r.frame[i] = lum_grey(0.0f);
        lum_film_reset_pixel(&g.r.truth, i % W, i / W);
        for (uint32_t k = 0; k < 2; k++)
            lum_film_add(&g.r.truth, i % W, i / W, k, lum_grey(0.0f), &nonfinite);
    }
    lum_refine_blend(&g.r, &g.tiling, &g.film, &nonfinite);
    assert_int_equal(nonfinite, 0);
    assert_true(g.r.error_rel == 0.0);
    assert_true(lum_film_mean(&g.film, 3, 3).g == 0.0f);
    rig_finish(&g);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(weight_is_that_of_the_measured_errors),
        cmocka_unit_test(blend_knows_its_error),
        cmocka_unit_test(samples_take_over_in_the_end),
        cmocka_unit_test(noise_does_not_show),
        cmocka_unit_test(black_stays_black),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

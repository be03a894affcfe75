/* Time to an error and error at a time, where both are known in closed form. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include <math.h>

#include "core/render/forecast.h"

#define FIRST_MS 300.0 /* of what comes before the samples */
#define SAMPLE_MS 40.0
#define SURELY 1.25  /* bound over estimate */
#define ROUNDED 1e-9 /* logarithms and powers of double */

static double time_after(double n)
{
    return FIRST_MS + SAMPLE_MS * n;
}

/* A picture whose bound is at1 n^-slope, up to n samples; noise of these alone is `noise` n^-1/2, or the same. */
static struct lum_forecast refined(double at1, double slope, double noise, uint32_t n)
{
    struct lum_forecast f;
    lum_forecast_begin(&f);
    for (uint32_t i = 0; i <= n; i++) {
        double bound = at1 * pow(i, -slope);
        struct lum_forecast_point p = {i, time_after(i), bound / SURELY, bound, noise / sqrt(i)};
        if (noise == at1) /* noise alone */
            p.noise = bound;
        if (i == 0)
            p.rel = p.bound = p.noise = (double)NAN;
        lum_forecast_add(&f, &p);
    }
    return f;
}

static void assert_near(double is, double should, double relative)
{
    if (!(fabs(is - should) <= relative * fabs(should)))
        fail_msg("%.12g instead of %.12g", is, should);
}

/* Of noise alone the error e is reached after (at1 / e)^(1 / slope) samples; no sooner than if the estimate fell as 1 /
 * n from now on, and no later than by 1 / sqrt(n), if the estimate were as far above what it says as the bound is. */
static void noise_falls_as_it_did(void **state)
{
    (void)state;
    const double errors[] = {0.05, 0.02, 0.01, 0.001};
    for (double slope = 0.5; slope <= 1.0; slope += 0.125) {
        struct lum_forecast f = refined(0.4, slope, 0.4, 16);
        double now = 0.4 * pow(16.0, -slope);
        for (size_t i = 0; i < sizeof errors / sizeof *errors; i++) {
            double e = errors[i] < now ? errors[i] : now, n = 16.0 * pow(now / e, 1.0 / slope);
            double least = fmax(now / SURELY / e, 1.0), most = e < now ? pow(now * SURELY / e, 2.0) : 1.0;
            struct lum_forecast_range t = lum_forecast_until(&f, errors[i]), at = lum_forecast_error(&f, time_after(n));
            assert_near(t.likely, time_after(n), ROUNDED);
            assert_near(t.least, time_after(16.0 * least), ROUNDED);
            assert_near(t.most, time_after(16.0 * most), ROUNDED);
            assert_near(at.likely, e, ROUNDED);
            assert_near(at.least, now / SURELY * 16.0 / n, ROUNDED);
            assert_near(at.most, now * SURELY * sqrt(16.0 / n), ROUNDED);
        }
    }
}

/* An error that falls as n^-1/4 is on its way to the samples' own, and is there when that is less. */
static void a_corrected_frame_ends_with_its_samples(void **state)
{
    (void)state;
    struct lum_forecast f = refined(0.1, 0.25, 1.0, 64); /* equal after (1 / 0.1)^4 = 10000 samples, at 0.01 */
    assert_near(lum_forecast_until(&f, 0.02).likely, time_after(pow(0.1 / 0.02, 4.0)), 1e-6);
    assert_near(lum_forecast_until(&f, 0.005).likely, time_after(pow(1.0 / 0.005, 2.0)), 1e-6);
    assert_near(lum_forecast_until(&f, 0.005).most, time_after(pow(SURELY / 0.005, 2.0)), ROUNDED);
    assert_near(lum_forecast_error(&f, time_after(625.0)).likely, 0.02, 1e-6);
    assert_near(lum_forecast_error(&f, time_after(40000.0)).likely, 0.005, 1e-6);
}

/* An error that does not fall is never reached, unless the noise of samples is known to end it. */
static void a_floor_is_never_passed(void **state)
{
    (void)state;
    struct lum_forecast f = refined(0.1, 0.0, (double)NAN, 64);
    assert_true(isinf(lum_forecast_until(&f, 0.05).likely) && isinf(lum_forecast_until(&f, 0.05).most));
    assert_near(lum_forecast_error(&f, 1e9).likely, 0.1, ROUNDED);
    assert_near(lum_forecast_until(&f, 0.1).most, time_after(64.0), ROUNDED); /* it is under that now */
    f = refined(0.1, 0.0, 2.0, 64);
    assert_near(lum_forecast_until(&f, 0.05).likely, time_after(1600.0), 1e-6);
}

/* Bounds that leap as bright samples are found: of n^-1/2 +- 20 %, for any draw, the range holds what was to come. */
static void leaps_stay_in_the_range(void **state)
{
    (void)state;
    for (uint32_t seed = 0; seed < 50; seed++) {
        struct lum_forecast f;
        uint32_t random = 2654435761u * (seed + 1);
        lum_forecast_begin(&f);
        for (uint32_t i = 1; i <= 200; i++) {
            random = random * 1664525u + 1013904223u;
            double leap = 1.0 + 0.2 * (2.0 * (random >> 8) / 16777216.0 - 1.0), noise = 0.4 * leap / sqrt(i);
            lum_forecast_add(&f, &(struct lum_forecast_point){i, time_after(i), noise / SURELY, noise, noise});
            struct lum_forecast_range t = lum_forecast_until(&f, 0.01);
            if (i >= 2 && !(t.least <= time_after(1600.0) && time_after(1600.0) <= t.most))
                fail_msg("after %u samples: %g to %g ms", i, t.least, t.most);
        }
    }
}

/* A sample costs what it cost of late; what it cost before tells how sure that is. */
static void samples_cost_what_they_did(void **state)
{
    (void)state;
    struct lum_forecast f;
    lum_forecast_begin(&f);
    assert_true(isnan(lum_forecast_samples(&f, 5.0).likely));
    for (uint32_t i = 0; i <= 16; i++)
        lum_forecast_add(
            &f, &(struct lum_forecast_point){
                    .n = i, .ms = i <= 8 ? 10.0 * i : 80.0 + 20.0 * (i - 8), .rel = (double)NAN, .bound = (double)NAN});
    struct lum_forecast_range t = lum_forecast_samples(&f, 116.0);
    assert_near(t.likely, 240.0 + 100.0 * 20.0, ROUNDED);
    assert_near(t.least, 240.0 + 100.0 * 10.0, ROUNDED);
    assert_near(t.most, 240.0 + 100.0 * 20.0, ROUNDED);
    assert_true(isnan(lum_forecast_until(&f, 0.1).likely) && isnan(lum_forecast_error(&f, 1e6).likely));
}

/* However long a picture is refined, and whatever passes bring no sample. */
static void it_holds_few_points(void **state)
{
    (void)state;
    struct lum_forecast f;
    lum_forecast_begin(&f);
    for (uint32_t i = 1; i <= 65536; i++)
        for (uint32_t k = 0; k < 2; k++)
            lum_forecast_add(
                &f, &(struct lum_forecast_point){i, time_after(i), 0.3 / sqrt(i), 0.4 / sqrt(i), 0.4 / sqrt(i)});
    assert_true(f.n_points <= LUM_FORECAST_POINTS);
    assert_true(f.points[f.n_points - 1].n == 65536.0);
    assert_near(lum_forecast_until(&f, 1e-4).likely, time_after(1.6e7), 1e-6);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(noise_falls_as_it_did),      cmocka_unit_test(a_corrected_frame_ends_with_its_samples),
        cmocka_unit_test(a_floor_is_never_passed),    cmocka_unit_test(leaps_stay_in_the_range),
        cmocka_unit_test(samples_cost_what_they_did), cmocka_unit_test(it_holds_few_points),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

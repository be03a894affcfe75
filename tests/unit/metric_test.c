/* Metrics against closed forms. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "core/math/color.h"
#include "core/metric/heat.h"
#include "core/metric/lab.h"
#include "core/metric/metric.h"

enum { N = 1000 };

static void assert_near(double value, double expected, double tolerance)
{
    if (!(fabs(value - expected) <= tolerance))
        fail_msg("%.17g is not %.17g within %g", value, expected, tolerance);
}

static struct lum_metric_result compare_ratio(float ratio, double epsilon)
{
    static float x[N], r[N];
    for (int i = 0; i < N; i++) {
        r[i] = 0.5f + (float)i;
        x[i] = ratio * r[i];
    }
    return lum_metric_compare(&(struct lum_metric_input){x, r, N, epsilon});
}

/* x = k r: every relative square is (k-1)^2, every symmetric term |k-1|/(k+1). The tolerance is that of x being rounded
 * to float: 6e-8 relative in x, so 2 * 6e-8 k/(k-1) in the square. */
static void test_constant_ratio(void **state)
{
    (void)state;
    assert_near(compare_ratio(1.1f, 0.0).relmse, 0.01, 0.01 * 2e-6);
    assert_near(compare_ratio(3.0f, 0.0).smape, 0.5, 1e-7);
    assert_near(compare_ratio(1.0f, 0.0).rmse, 0.0, 0.0);
}

static void test_constant_offset(void **state)
{
    (void)state;
    float r[4] = {0.0f, 1.0f, 2.0f, 1024.0f}, x[4];
    for (int i = 0; i < 4; i++)
        x[i] = r[i] + 0.25f; /* exact */
    struct lum_metric_result m = lum_metric_compare(&(struct lum_metric_input){x, r, 4, 0.01});
    assert_near(m.rmse, 0.25, 1e-15);
}

/* The epsilon bounds what a black reference pixel adds: x^2 / epsilon. */
static void test_black_reference(void **state)
{
    (void)state;
    float r = 0.0f, x = 0.5f;
    struct lum_metric_result m = lum_metric_compare(&(struct lum_metric_input){&x, &r, 1, 0.01});
    assert_near(m.relmse, 25.0, 1e-12);
    assert_near(m.smape, 0.5 / 0.51, 1e-12);
}

static void test_nonfinite_is_counted(void **state)
{
    (void)state;
    float r[3] = {1.0f, 1.0f, NAN}, x[3] = {2.0f, INFINITY, 1.0f};
    struct lum_metric_result m = lum_metric_compare(&(struct lum_metric_input){x, r, 3, 0.0});
    assert_int_equal(m.n_nonfinite, 2);
    assert_near(m.rmse, 1.0, 0.0);
    m = lum_metric_compare(&(struct lum_metric_input){x + 1, r + 1, 1, 0.0});
    assert_true(isnan(m.rmse) && isnan(m.relmse) && isnan(m.smape));
}

/* Each step is as much lighter as the others: 98 / 255 of L*, but for 8 bits, whose steps are at most 0.6 where it is
 * dark and each of three channels half a step off. Inside the gamut nothing was cut: the table's a and b come back. */
static void test_heat_is_even_in_lightness(void **state)
{
    (void)state;
    struct lum_heat heat;
    uint8_t c[3];
    lum_heat_init(&heat);
    for (uint32_t i = 0; i < LUM_HEAT_COLORS; i++) {
        float rgb[3];
        for (int k = 0; k < 3; k++)
            rgb[k] = lum_srgb8_to_linear[heat.srgb[i][k]];
        struct lum_lab lab = lum_lab_of(rgb);
        double t = i / 255.0, chroma = 65.0 * pow(sin(3.14159265358979324 * t), 0.75);
        assert_near((double)lab.l, 98.0 * t, 0.6);
        assert_near(hypot((double)lab.a, (double)lab.b), chroma, 2.0);
    }
    lum_heat_color(&heat, -1.0, c);
    assert_memory_equal(c, heat.srgb[0], 3);
    lum_heat_color(&heat, 2.0, c);
    assert_memory_equal(c, heat.srgb[LUM_HEAT_COLORS - 1], 3);
    lum_heat_color(&heat, (double)NAN, c);
    for (uint32_t i = 0; i < LUM_HEAT_COLORS; i++)
        assert_memory_not_equal(c, heat.srgb[i], 3);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_constant_ratio),
        cmocka_unit_test(test_constant_offset),
        cmocka_unit_test(test_black_reference),
        cmocka_unit_test(test_nonfinite_is_counted),
        cmocka_unit_test(test_heat_is_even_in_lightness),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

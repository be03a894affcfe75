/* What values of a desk's channels are in light. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include <cmocka.h>

#include "server/world/patches.h"

static double light_of(enum lum_patch_curve curve, enum lum_patch_channels channels, unsigned coarse, unsigned fine)
{
    struct lum_patch p = {.curve = curve, .channels = channels};
    uint8_t slots[512] = {(uint8_t)coarse, (uint8_t)fine};
    lum_patch_read(&p, slots, 512);
    return (double)p.value[0];
}

static double one(enum lum_patch_curve curve, unsigned value)
{
    return light_of(curve, LUM_PATCH_DIM, value, 0);
}

/* IEC 62386-102, 9.3: X = 10^((n - 1) / (253 / 3) - 1) percent of level n. */
static void levels_of_dali_are_even_ratios(void **state)
{
    (void)state;
    assert_true(one(LUM_CURVE_DALI, 0) == 0.0);
    assert_true(fabs(one(LUM_CURVE_DALI, 255) - 1.0) < 1e-6);
    assert_true(fabs(one(LUM_CURVE_DALI, 1) - 0.001) < 1e-9); /* below level 1 there is none */
    for (unsigned v = 2; v < 256; v++) {
        double level = 254.0 * v / 255.0, want = pow(10.0, (level - 1.0) * 3.0 / 253.0 - 3.0);
        assert_true(fabs(one(LUM_CURVE_DALI, v) - want) < 1e-5 * want); /* an exponent of up to 7, in floats */
        assert_true(v == 2 || one(LUM_CURVE_DALI, v) > one(LUM_CURVE_DALI, v - 1));
    }
    /* known from the standard's table: level 85 is 1 %, 170 is 10 % */
    double at85 = light_of(LUM_CURVE_DALI, LUM_PATCH_DIM16, 85 * 65535 / 254 / 256, 85 * 65535 / 254 % 256),
           at170 = light_of(LUM_CURVE_DALI, LUM_PATCH_DIM16, 170 * 65535 / 254 / 256, 170 * 65535 / 254 % 256);
    assert_true(fabs(at85 - 0.00991) < 1e-4 && fabs(at170 - 0.1010) < 1e-3);
}

static void other_curves_begin_at_nothing_and_end_at_all(void **state)
{
    (void)state;
    for (int curve = LUM_CURVE_LINEAR; curve <= LUM_CURVE_DALI; curve++)
        for (int channels = LUM_PATCH_DIM; channels <= LUM_PATCH_RGB16; channels++) {
            assert_true(light_of((enum lum_patch_curve)curve, (enum lum_patch_channels)channels, 0, 0) == 0.0);
            assert_true(fabs(light_of((enum lum_patch_curve)curve, (enum lum_patch_channels)channels, 255, 255) - 1.0) <
                        1e-6);
        }
    assert_true(fabs(one(LUM_CURVE_LINEAR, 51) - 0.2) < 1e-6 && fabs(one(LUM_CURVE_SQUARE, 51) - 0.04) < 1e-6);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(levels_of_dali_are_even_ratios),
        cmocka_unit_test(other_curves_begin_at_nothing_and_end_at_all),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

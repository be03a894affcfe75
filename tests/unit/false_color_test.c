/* False colour: round values within the scale, colours that are even and told apart by all eyes. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include <math.h>
#include <string.h>

#include "core/film/false_color.h"

static const float some[] = {0.0f, 20.0f, 100.0f, 350.0f, 480.0f, NAN, -1.0f};

static struct lum_scale scale_of(enum lum_scale_kind kind, bool smooth, double min, double max)
{
    struct lum_scale s;
    const struct lum_false_color want = {.scale = kind, .smooth = smooth, .min = min, .max = max};
    assert_true(lum_scale_make(&want, some, sizeof some / sizeof *some, &s));
    return s;
}

static void assert_limits(const struct lum_scale *s, const double *want, uint32_t n)
{
    assert_int_equal(s->n_limits, n);
    for (uint32_t i = 0; i < n; i++)
        if (fabs(s->limits[i] / want[i] - 1.0) > 1e-12)
            fail_msg("limit %u is %.17g, not %g", i, s->limits[i], want[i]);
}

/* EN 12464-1's scale of illuminance in decades; tenths or so in even steps. */
static void limits_are_round(void **state)
{
    (void)state;
    static const double log_limits[] = {20, 30, 50, 75, 100, 150, 200, 300, 500},
                        linear[] = {50, 100, 150, 200, 250, 300, 350, 400, 450, 500};
    static const double given[] = {100, 150, 200, 300, 500, 750, 1000}, wide[] = {1, 10, 100, 1e3, 1e4, 1e5, 1e6},
                        narrow[] = {300, 310, 320, 330, 340, 350, 360, 370, 380, 390, 400};
    struct lum_scale s = scale_of(LUM_SCALE_LOG, false, (double)NAN, (double)NAN);
    assert_limits(&s, log_limits, 9);
    s = scale_of(LUM_SCALE_LINEAR, false, (double)NAN, (double)NAN);
    assert_limits(&s, linear, 10);
    s = scale_of(LUM_SCALE_LOG, false, 100, 1000);
    assert_limits(&s, given, 7);
    s = scale_of(LUM_SCALE_LOG, false, 1, 1e6);
    assert_limits(&s, wide, 7);
    s = scale_of(LUM_SCALE_LOG, false, 300, 400);
    assert_limits(&s, narrow, 11);
    s = scale_of(LUM_SCALE_LINEAR, false, 300, 400);
    assert_limits(&s, narrow, 11);
}

static void values_have_the_colour_of_their_step(void **state)
{
    (void)state;
    struct lum_scale s = scale_of(LUM_SCALE_LOG, false, 100, 1000);
    assert_int_equal(s.n_colors, s.n_limits + 1);
    assert_int_equal(lum_scale_color(&s, 0.0), 0);
    assert_int_equal(lum_scale_color(&s, 99.9), 0);
    assert_int_equal(lum_scale_color(&s, 100.0), 1);
    assert_int_equal(lum_scale_color(&s, 499.0), 4);
    assert_int_equal(lum_scale_color(&s, 1e9), s.n_colors - 1);
    s = scale_of(LUM_SCALE_LOG, true, 10, 1000); /* its middle is that of decades */
    assert_int_equal(s.n_colors, LUM_SCALE_COLORS);
    assert_int_equal(lum_scale_color(&s, 0.0), 0);
    assert_int_equal(lum_scale_color(&s, 100.0), LUM_SCALE_COLORS / 2);
    assert_int_equal(lum_scale_color(&s, 1e9), LUM_SCALE_COLORS - 1);
    s = scale_of(LUM_SCALE_LINEAR, true, 0, 1000);
    assert_int_equal(lum_scale_color(&s, 500.0), LUM_SCALE_COLORS / 2);
}

/* Any ends, any values: limits rise, lie within, and are few; what has no value says nothing. */
static void scales_of_anything(void **state)
{
    (void)state;
    static const double ends[] = {NAN, 1e-9, 0.3, 7, 99, 1e4, 1e12};
    for (int kind = 0; kind < 2; kind++)
        for (size_t i = 0; i < 7; i++)
            for (size_t k = 0; k < 7; k++) {
                if (ends[k] <= ends[i])
                    continue;
                struct lum_scale s = scale_of((enum lum_scale_kind)kind, i % 2, ends[i], ends[k]);
                assert_true(s.max > s.min && s.n_limits >= 1 && s.n_limits <= LUM_SCALE_LIMITS);
                for (uint32_t l = 0; l < s.n_limits; l++) {
                    assert_true(l == 0 || s.limits[l] > s.limits[l - 1]);
                    assert_true(s.limits[l] >= s.min * (1 - 1e-8) && s.limits[l] <= s.max * (1 + 1e-8));
                }
            }
    struct lum_scale unused;
    const struct lum_false_color want = {.min = (double)NAN, .max = (double)NAN};
    const float dark[] = {0.0f, NAN, -3.0f};
    assert_false(lum_scale_make(&want, dark, 3, &unused));
    assert_false(lum_scale_make(&want, NULL, 0, &unused));
}

/* ---- to the eye ---- */

static double linear(uint8_t code)
{
    double v = code / 255.0;
    return v <= 0.04045 ? v / 12.92 : pow((v + 0.055) / 1.055, 2.4);
}

/* OKLab of linear Rec.709: distances are differences to the eye. */
static void to_oklab(const double c[3], double ret_lab[3])
{
    double l = cbrt(0.4122214708 * c[0] + 0.5363325363 * c[1] + 0.0514459929 * c[2]);
    double m = cbrt(0.2119034982 * c[0] + 0.6806995451 * c[1] + 0.1073969566 * c[2]);
    double s = cbrt(0.0883024619 * c[0] + 0.2817188376 * c[1] + 0.6299787005 * c[2]);
    ret_lab[0] = 0.2104542553 * l + 0.7936177850 * m - 0.0040720468 * s;
    ret_lab[1] = 1.9779984951 * l - 2.4285922050 * m + 0.4505937099 * s;
    ret_lab[2] = 0.0259040371 * l + 0.7827717662 * m - 0.8086757660 * s;
}

/* Machado, Oliveira and Fernandes 2009: what those see who lack a kind of cone; first, who lack none. */
static const double eyes[][3][3] = {
    {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}},
    {{0.152286, 1.052583, -0.204868}, {0.114503, 0.786281, 0.099216}, {-0.003882, -0.048116, 1.051998}},
    {{0.367322, 0.860646, -0.227968}, {0.280085, 0.672501, 0.047413}, {-0.011820, 0.042940, 0.968881}},
    {{1.255528, -0.076749, -0.178779}, {-0.078411, 0.930809, 0.147602}, {0.004733, 0.691367, 0.303900}}};

static void seen_by(const double eye[3][3], const uint8_t rgb[3], double ret_lab[3])
{
    double c[3], seen[3];
    for (int k = 0; k < 3; k++)
        c[k] = linear(rgb[k]);
    for (int k = 0; k < 3; k++)
        seen[k] = fmin(fmax(eye[k][0] * c[0] + eye[k][1] * c[1] + eye[k][2] * c[2], 0.0), 1.0);
    to_oklab(seen, ret_lab);
}

/* More is lighter, to every eye; twelve steps are told apart (0.02 is what is just noticed), and to most eyes alike. */
static void colours_are_even_and_told_apart_by_all(void **state)
{
    (void)state;
    enum { STEPS = 12 };
    for (size_t e = 0; e < sizeof eyes / sizeof *eyes; e++) {
        double before[3] = {0}, least = INFINITY, most = 0.0;
        for (int i = 0; i < STEPS; i++) {
            uint8_t rgb[3];
            double lab[3];
            lum_palette_color(LUM_PALETTE_EVEN, (double)i / (STEPS - 1), rgb);
            seen_by(eyes[e], rgb, lab);
            if (i > 0) {
                double d = sqrt(pow(lab[0] - before[0], 2) + pow(lab[1] - before[1], 2) + pow(lab[2] - before[2], 2));
                assert_true(lab[0] > before[0]);
                least = fmin(least, d);
                most = fmax(most, d);
            }
            memcpy(before, lab, sizeof before);
        }
        print_message("eye %zu: steps of %.3f to %.3f\n", e, least, most);
        assert_true(least >= 0.04);
        if (e == 0)
            assert_true(most <= 2.0 * least);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(limits_are_round),
        cmocka_unit_test(values_have_the_colour_of_their_step),
        cmocka_unit_test(scales_of_anything),
        cmocka_unit_test(colours_are_even_and_told_apart_by_all),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

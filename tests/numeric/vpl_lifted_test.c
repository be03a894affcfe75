/* What a lifted VPL leaves out, and gives back, against closed forms: rays from it meet a wall, or a disc. */
#include "core/vpl/lifted.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "core/base/base.h"
#include "core/math/warp.h"

/* A VPL in the origin that faces y. Rays are SIDE^2, by strata: means of smooth ratios are good to a thousandth. */
enum { SIDE = 1024 };

#define SCENE_RADIUS 1.0f
static const struct lum_vec3 up = {0, 1, 0};

static float lift_of(uint32_t k)
{
    return ldexpf(LUM_VPL_LIFT_WIDEST * SCENE_RADIUS, -(int)k);
}

static struct lum_vec3 ray_of(uint32_t i)
{
    struct lum_vec2 u = {((float)(i % SIDE) + 0.5f) / SIDE, ((float)(i / SIDE) + 0.5f) / SIDE};
    struct lum_frame frame = lum_frame_from_normal(up);
    return lum_frame_to_scene(&frame, lum_warp_cosine(u));
}

/* Sums over rays that meet a disc of this radius (INFINITY: a wall) at distance g, face to face. */
static struct lum_vpl_kept opposite_disc(float radius, float g)
{
    struct lum_vpl_kept all = {0};
    for (uint32_t row = 0; row < SIDE; row++) {
        struct lum_vpl_kept sum = {0};
        for (uint32_t i = row * SIDE; i < (row + 1) * SIDE; i++) {
            struct lum_vec3 d = ray_of(i);
            float t = g / d.y, x = t * d.x, z = t * d.z;
            if (x * x + z * z < radius * radius)
                lum_vpl_kept_add(&sum, SCENE_RADIUS, up, d, t, i % 2 ? up : lum_v3_neg(up));
            else
                lum_vpl_kept_add_miss(&sum);
        }
        lum_vpl_kept_add_all(&all, &sum);
    }
    return all;
}

static double lifted_height(double h, double m)
{
    return sqrt(h * h + pow(m, 4) / (h * h + m * m));
}

/* An endless wall gets all that there is, as long as no ratio is cut off, and nothing is to give back. */
static void walls_get_all(void **state)
{
    (void)state;
    for (uint32_t k = 0; k < LUM_VPL_LIFTS; k++) {
        struct lum_vpl_kept all = opposite_disc(INFINITY, lift_of(k));
        if (!(fabsf(all.light[k] / all.n - 1.0f) < 2e-3f))
            fail_msg("lifted by %g: %g of the light", (double)lift_of(k), (double)(all.light[k] / all.n));
        assert_true(lum_vpl_gain(&all, SCENE_RADIUS, lift_of(k)) < 0.02f);
    }
}

/* A disc of radius a gets a^2 / (a^2 + g^2), and lifted to height b a^2 / (a^2 + b^2). */
static void discs_lose_by_their_closed_form(void **state)
{
    (void)state;
    const double g = 0.01, a = 0.02;
    struct lum_vpl_kept all = opposite_disc((float)a, (float)g);
    for (uint32_t k = 0; k < LUM_VPL_LIFTS; k++) {
        double b = lifted_height(g, (double)lift_of(k)), want = 1 - a * a / (a * a + g * g) + a * a / (a * a + b * b);
        if (!(fabs((double)(all.light[k] / all.n) - want) < 3e-3))
            fail_msg("lifted by %g: %g, expected %g", (double)lift_of(k), (double)(all.light[k] / all.n), want);
    }
}

/* What lifting by m loses of a disc, a^2 / (a^2 + g^2) - a^2 / (a^2 + b^2), and the mean of s = r / (d^2 + r) over the
 * rays that meet it, r = b^2 - g^2 being the rise: with x = sin^2 of their angle, which is even, d^2 = g^2 / (1 - x),
 * so that s is r (1 - x) / (g^2 + r (1 - x)), whose integral from 0 to X = a^2 / (a^2 + g^2) is X - g^2 / r ln ((g^2 +
 * r) / (g^2 + r (1 - X))). */
static struct lum_vpl_lost lost_of_disc(double a, double g, double m)
{
    double x = a * a / (a * a + g * g), b = lifted_height(g, m), r = b * b - g * g;
    return (struct lum_vpl_lost){.lost = (float)(x - a * a / (a * a + b * b)),
                                 .beside = (float)(x - g * g / r * log((g * g + r) / (g * g + r * (1 - x))))};
}

/* At the lifts that are known, on a straight line between them, and as at the last ones beyond. Of wider discs what the
 * rim gets is many times its own light, and rings of rays, 2 / SIDE apart, do not say where it is so well. */
static void lost_and_beside_are_closed_forms(void **state)
{
    (void)state;
    const double g = 0.01, widths[] = {0.005, 0.01, 0.02};
    const float last = (float)LUM_VPL_LIFTS - 1.0f;
    for (size_t i = 0; i < LUM_ARRAY_LEN(widths); i++) {
        struct lum_vpl_kept all = opposite_disc((float)widths[i], (float)g);
        for (float at = -0.5f; at < last + 1.0f; at += 0.25f) {
            float within = lum_clamp(at, 0.0f, last), k = lum_min(floorf(within), last - 1.0f);
            float wide = LUM_VPL_LIFT_WIDEST * SCENE_RADIUS * exp2f(-k);
            float part = 2.0f - exp2f(1.0f - (within - k)); /* of the way from m = wide to wide / 2 */
            struct lum_vpl_lost w = lost_of_disc(widths[i], g, (double)wide);
            struct lum_vpl_lost n = lost_of_disc(widths[i], g, 0.5 * (double)wide);
            struct lum_vpl_lost got = lum_vpl_lost_of(&all, SCENE_RADIUS, LUM_VPL_LIFT_WIDEST * exp2f(-at));
            float lost = w.lost + part * (n.lost - w.lost), beside = w.beside + part * (n.beside - w.beside);
            if (!(fabsf(got.lost - lost) < 3e-3f && fabsf(got.beside - beside) < 3e-3f))
                fail_msg("disc of %g, lift %g: lost %g, not %g; beside %g, not %g", widths[i], (double)at,
                         (double)got.lost, (double)lost, (double)got.beside, (double)beside);
        }
    }
}

/* What a VPL lifted by m, with this gain, gives the disc, ring by ring, over its flux: the term of
 * core/cache/vpl_sum.c for what it faces, times 1 + gain s. */
static double given(double a, double g, double m, double gain)
{
    enum { RINGS = 4000 };
    double sum = 0.0, rise = pow(m, 4) / (g * g + m * m);
    for (uint32_t i = 0; i < RINGS; i++) {
        double r = (i + 0.5) / RINGS * a, d2 = r * r + g * g + rise;
        sum += (g * g + rise) / (d2 * d2) * (1.0 + gain * rise / d2) * 2.0 * r * a / RINGS;
    }
    return sum;
}

/* With the gain, what is beside a VPL gets what it should: for lifts between those that were looked at, too, within
 * what a straight line between them leaves. Where it is far too narrow the gain has its limit, and less is there, but
 * more than without. */
static void gain_gives_back_what_is_lost(void **state)
{
    (void)state;
    const double g = 0.02, widths[] = {0.02, 0.04, 0.1, 0.3};
    for (size_t i = 0; i < LUM_ARRAY_LEN(widths); i++) {
        double a = widths[i], want = a * a / (a * a + g * g);
        struct lum_vpl_kept all = opposite_disc((float)a, (float)g);
        for (float at = 0.0f; at < 4.1f; at += 0.25f) {
            double between = fmodf(at, 1.0f) > 0.0f ? 0.08 : 0.02;
            float m = LUM_VPL_LIFT_WIDEST * SCENE_RADIUS * exp2f(-at), gain = lum_vpl_gain(&all, SCENE_RADIUS, m);
            double without = given(a, g, (double)m, 0.0) / want, with = given(a, g, (double)m, (double)gain) / want;
            bool limited = gain >= LUM_VPL_GAIN_MAX;
            if (limited ? !(with > without && with < 1.0) : !(fabs(with - 1.0) < between))
                fail_msg("disc of %g, lifted by %g: %g of its light, without gain %g", a, (double)m, with, without);
        }
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(walls_get_all),
        cmocka_unit_test(discs_lose_by_their_closed_form),
        cmocka_unit_test(lost_and_beside_are_closed_forms),
        cmocka_unit_test(gain_gives_back_what_is_lost),
    };
    return cmocka_run_group_tests_name("numeric.vpl_lifted", tests, NULL, NULL);
}

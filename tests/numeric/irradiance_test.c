/* What closed forms of unshadowed light are made of: angles, and far quads. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "core/light/irradiance.h"
#include "core/math/angle.h"
#include "core/math/sampler.h"

static void angles_are_those_of_atan2(void **state)
{
    (void)state;
    for (int i = 0; i <= 100000; i++) {
        double a = LUM_PI_D * i / 100000, scale = exp2(i % 40 - 20), s = scale * sin(a), c = scale * cos(a);
        double want = atan2(fabs(s), c), got = lum_angle(fabs(s), c);
        if (!(fabs(got - want) <= 1.5e-13 * want)) /* 1.2e-13 of the series, the rest is rounding */
            fail_msg("angle %.17g is taken for %.17g", want, got);
    }
    assert_true(lum_angle(1e-200, 1.0) == 1e-200);
    assert_true(lum_angle(0.0, 1.0) == 0.0 && lum_angle(0.0, -1.0) == LUM_PI_D);
}

static float signed_1d(struct lum_sampler *s, uint32_t pair)
{
    return 2.0f * lum_sampler_1d(s, pair) - 1.0f;
}

/* Anywhere in front of a quad of any proportion, from as near as the rule serves. */
static struct lum_light far_quad(uint32_t sample, struct lum_vec3 *ret_p, struct lum_vec3 *ret_n)
{
    struct lum_sampler s = {7, sample};
    float a = 0.05f + lum_sampler_1d(&s, 0), b = 0.05f + lum_sampler_1d(&s, 1);
    struct lum_light l = {
        .kind = &lum_emitter_quad, .u = {a, 0, 0}, .v = {0, 0, b}, .n = {0, -1, 0}, .area = 4.0f * a * b};
    struct lum_vec3 d = lum_normalize(lum_v3(signed_1d(&s, 2), -lum_sampler_1d(&s, 3), signed_1d(&s, 4)));
    *ret_p = lum_v3_mul(d, (4.01f + 4.0f * lum_sampler_1d(&s, 5)) * sqrtf(a * a + b * b));
    *ret_n = lum_normalize(lum_v3(signed_1d(&s, 6), signed_1d(&s, 7), signed_1d(&s, 8)));
    return l;
}

/* A quad is the sum of its 4 x 4 parts, whose error is 4^-6 as large. */
static void far_quads_are_the_sum_of_their_parts(void **state)
{
    (void)state;
    for (uint32_t i = 0; i < 20000; i++) {
        struct lum_vec3 p, n;
        struct lum_light l = far_quad(i, &p, &n);
        float whole_sr, part_sr;
        double sum_sr = 0.0;
        if (!lum_quad_far(&l, p, &whole_sr))
            continue; /* in its plane */
        for (int k = 0; k < 16; k++) {
            struct lum_light piece = l;
            piece.u = lum_v3_mul(l.u, 0.25f);
            piece.v = lum_v3_mul(l.v, 0.25f);
            piece.area = l.area / 16;
            piece.p = lum_v3_add(lum_v3_mul(l.u, 0.5f * (float)(k % 4) - 0.75f),
                                 lum_v3_mul(l.v, 0.5f * (float)(k / 4) - 0.75f));
            assert_true(lum_quad_far(&piece, p, &part_sr));
            sum_sr += (double)part_sr;
        }
        double off = (double)whole_sr / sum_sr - 1.0;
        if (!(fabs(off) < 2e-4))
            fail_msg("sample %u: the solid angle is off by %g", i, off);
    }
}

/* Points that are looked at together, some before the light, some behind it or with it half below the horizon. */
static void points_do_not_mix(void **state)
{
    (void)state;
    enum { N = 1003 };
    struct lum_light l;
    struct lum_vec3 p[N], n[N];
    struct lum_irradiance together[N], alone;
    for (uint32_t i = 0; i < N; i++) {
        l = far_quad(i, &p[i], &n[i]);
        p[i] = lum_v3_mul(p[i], i % 3 == 0 ? -0.2f : 0.2f);
    }
    lum_light_irradiance(&l, N, p, n, together);
    for (uint32_t i = 0; i < N; i++) {
        lum_light_irradiance(&l, 1, &p[i], &n[i], &alone);
        if (!(alone.cosine_integral == together[i].cosine_integral && alone.mean_cos == together[i].mean_cos))
            fail_msg("point %u: %.9g alone, %.9g with others", i, (double)alone.cosine_integral,
                     (double)together[i].cosine_integral);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(angles_are_those_of_atan2),
        cmocka_unit_test(far_quads_are_the_sum_of_their_parts),
        cmocka_unit_test(points_do_not_mix),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

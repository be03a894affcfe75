/* What materials come to at their limits: Fresnel, mirrors, slabs, equal media, sides. */
#include <math.h>
#include <string.h>

#include "core/math/sampler.h"
#include "tests/numeric/stats.h"
#include "tests/support/materials.h"

/* ---- Fresnel ---- */

static void fresnel_is_a_fraction(void **state)
{
    (void)state;
    for (int i = 0; i < 1000; i++) {
        float eta = (float)pow(10.0, -1.0 + 2.0 * i / 999.0);
        for (int k = 0; k < 1000; k++) {
            float f = lum_fresnel_dielectric((float)k / 999.0f, eta);
            if (!(f >= 0.0f && f <= 1.0f))
                fail_msg("F(%d / 999, %g) = %g", k, (double)eta, (double)f);
        }
    }
    static const float hostile[] = {0.0f, -1.0f, NAN, INFINITY, 1e38f, 1e-38f};
    for (size_t i = 0; i < LUM_ARRAY_LEN(hostile); i++)
        for (size_t k = 0; k < LUM_ARRAY_LEN(hostile); k++) {
            float f = lum_fresnel_dielectric(hostile[i], hostile[k]);
            assert_true(f >= 0.0f && f <= 1.0f);
        }
}

static void fresnel_has_its_closed_forms(void **state)
{
    (void)state;
    for (double n = 1.05; n <= 4.0; n += 0.05) {
        double f0 = pow((n - 1.0) / (n + 1.0), 2.0);
        /* rounding of 1 - eta, amplified by 1 / (n - 1) */
        assert_true(fabs((double)lum_fresnel_dielectric(1.0f, (float)(1.0 / n)) - f0) < 1e-6);
        assert_true(fabs((double)lum_fresnel_dielectric(1.0f, (float)n) - f0) < 1e-6);
        assert_true(lum_fresnel_dielectric(0.0f, (float)(1.0 / n)) == 1.0f);
        double critical = sqrt(1.0 - 1.0 / (n * n));
        assert_true(lum_fresnel_dielectric((float)(critical * 0.999), (float)n) == 1.0f);
        assert_true(lum_fresnel_dielectric((float)(critical * 1.01), (float)n) < 1.0f);
        /* Brewster's angle tan = n: half of the reflection of the s polarisation alone, ((n^2 - 1) / (n^2 + 1))^2 */
        double s = (n * n - 1.0) / (n * n + 1.0), cos_b = 1.0 / sqrt(1.0 + n * n);
        assert_true(fabs((double)lum_fresnel_dielectric((float)cos_b, (float)(1.0 / n)) - 0.5 * s * s) < 1e-6);
    }
    assert_true(lum_fresnel_dielectric(0.0f, 1.0f) == 0.0f);
}

/* Stokes: seen along the reversed refracted ray the interface reflects the same. */
static void fresnel_reverses(void **state)
{
    (void)state;
    for (double n = 1.1; n < 4.0; n += 0.1)
        for (double c = 0.05; c <= 1.0; c += 0.01) {
            double cos_t = sqrt(1.0 - (1.0 - c * c) / (n * n));
            double there = (double)lum_fresnel_dielectric((float)c, (float)(1.0 / n));
            double back = (double)lum_fresnel_dielectric((float)cos_t, (float)n);
            /* inside, the cosine's rounding is amplified by n^2 cos_t / c */
            assert_true(fabs(there - back) < 1e-6 * n * n / c);
        }
}

/* ---- limits ---- */

/* Rough metal tends to the mirror: energy and mean direction get nearer with every step of alpha. */
static void mirror_is_the_limit(void **state)
{
    (void)state;
    struct lum_surface s = surface(false);
    struct lum_vec3 wo = direction(0.6, 0.0), mirror = lum_v3(-wo.x, -wo.y, wo.z);
    double before = INFINITY;
    for (double alpha = 0.5; alpha > 5e-4; alpha *= 0.5) {
        struct lum_material m = metal((float)sqrt(alpha));
        struct lum_bsdf b;
        lum_bsdf_init(&b, &m, &s, wo);
        double energy = 0.0, spread = 0.0;
        enum { n = 4096 };
        for (uint32_t i = 0; i < n; i++) {
            struct lum_sampler q = lum_sampler_at(1, 0, i, 17);
            struct lum_bsdf_sample bs;
            if (!lum_bsdf_sample(&b, wo, lum_sampler_2d(&q, 0), 0.5f, &bs))
                continue;
            energy += (double)bs.weight.g / n;
            spread += (double)bs.weight.g * (double)lum_length(lum_v3_sub(bs.wi, mirror)) / n;
        }
        double distance = (1.0 - energy) + spread;
        if (distance > before)
            fail_msg("alpha %g is farther from the mirror (%g) than twice that (%g)", alpha, distance, before);
        before = distance;
    }
    assert_true(before == 0.0 || before < 5e-3);
}

/* L out of a slab of clear glass in a uniform field: 1, by following radiance through both faces. */
static void slab_keeps_the_field(void **state)
{
    (void)state;
    for (int k = 0; k < 4; k++) {
        struct lum_material m = glass(0.0f, k == 3 ? 2.4f : 1.5f);
        double cos_o = k == 0 ? 1.0 : k == 1 ? 0.5 : 0.05;
        struct mean sum = {0};
        for (uint32_t i = 0; i < 20000; i++) {
            struct lum_vec3 wo = direction(cos_o, 0.2);
            double weight = 1.0;
            bool inside = false, out = false;
            for (uint32_t bounce = 0; bounce < 200 && !out; bounce++) {
                struct lum_surface s = surface(inside);
                if (wo.z < 0.0f)
                    s.ng = s.ns = lum_v3_neg(s.ng);
                struct lum_bsdf b;
                struct lum_bsdf_sample bs;
                struct lum_sampler q = lum_sampler_at(0, 0, i, 3);
                lum_bsdf_init(&b, &m, &s, wo);
                assert_true(
                    lum_bsdf_sample(&b, wo, lum_sampler_2d(&q, 2 * bounce), lum_sampler_1d(&q, 2 * bounce + 1), &bs));
                weight *= (double)bs.weight.g;
                inside = inside != is_transmitted(&bs);
                out = !inside;
                wo = lum_v3_neg(bs.wi); /* the next face sees what goes on along wi */
            }
            mean_add(&sum, weight);
        }
        /* weights are 1 up to the rounding of eta^2 and 1 / eta^2 */
        assert_true(fabs(sum.mean - 1.0) < 1e-5);
    }
}

static void equal_media_are_not_there(void **state)
{
    (void)state;
    struct rng r = {4};
    for (int i = 0; i < 20000; i++) {
        struct lum_material m = glass((float)rng_unit(&r), 1.0f);
        m.thin = i % 2;
        struct lum_surface s = surface((i / 2) % 2);
        struct lum_vec3 wo = direction(1.0 - rng_unit(&r), 6.0 * rng_unit(&r)), back = lum_v3_neg(wo);
        struct lum_bsdf b;
        struct lum_bsdf_sample bs;
        lum_bsdf_init(&b, &m, &s, wo);
        assert_true(lum_bsdf_sample(&b, wo, (struct lum_vec2){(float)rng_unit(&r), 0.3f}, (float)rng_unit(&r), &bs));
        assert_true(bs.lobe == LUM_LOBE_TRANSMIT && bs.pdf_sa == 0.0f);
        assert_memory_equal(&bs.wi, &back, sizeof back);
        assert_true(bs.weight.r == 1.0f && bs.weight.g == 1.0f && bs.weight.b == 1.0f);
    }
}

/* All delta lobes of clear glass together return what arrives; metal has one, rough surfaces none. */
static void delta_lobes_share_the_light(void **state)
{
    (void)state;
    struct rng r = {10};
    for (int i = 0; i < 10000; i++) {
        struct lum_material m = glass(0.0f, (float)(1.0 + 2.0 * rng_unit(&r)));
        m.thin = i % 3 == 0;
        struct lum_surface s = surface(i % 2);
        struct lum_vec3 wo = direction(1.0 - rng_unit(&r), 6.0 * rng_unit(&r));
        struct lum_bsdf b;
        struct lum_bsdf_sample lobe[2];
        lum_bsdf_init(&b, &m, &s, wo);
        uint32_t n = lum_bsdf_delta_lobes(&b, wo, lobe);
        double sum = 0.0;
        for (uint32_t k = 0; k < n; k++) {
            double bent = is_transmitted(&lobe[k]) && !m.thin ? (double)(b.eta * b.eta) : 1.0;
            sum += (double)lobe[k].weight.g / bent;
        }
        assert_true(fabs(sum - 1.0) < 1e-5);
        m = i % 2 ? metal(0.0f) : plain(0.5f);
        lum_bsdf_init(&b, &m, &s, wo);
        assert_int_equal(lum_bsdf_delta_lobes(&b, wo, lobe), i % 2);
    }
}

/* ---- haze ---- */

#define HAZE_DEG 2.5 /* ASTM D1003 */

/* Of light that comes along the normal and passes, what leaves by more than HAZE_DEG: the BSDF over rings around the
 * normal. Half the angle of a ring has tan^2 = alpha^2 u / (1 - u), at even steps of u: GGX has as much in each. */
static double haze_of(const struct lum_material *m)
{
    enum { RINGS = 20000 };
    struct lum_surface s = surface(false);
    struct lum_vec3 up = {0.0f, 0.0f, 1.0f};
    struct lum_bsdf b;
    double alpha2 = pow((double)m->roughness, 4.0), last = 1.0 / (1.0 + alpha2), all = 0.0, hazy = 0.0;
    lum_bsdf_init(&b, m, &s, up);
    lum_bsdf_add_far_side(&b);
    for (int i = 0; i < RINGS; i++) {
        double theta[3];
        for (int k = 0; k < 3; k++) { /* its edges, and its middle */
            double u = last * (i + 0.5 * k) / RINGS;
            theta[k] = 2.0 * atan(sqrt(alpha2 * u / (1.0 - u)));
        }
        float pdf;
        double sr = 4.0 * LUM_PI_D * sin(0.5 * (theta[0] + theta[2])) * sin(0.5 * (theta[2] - theta[0]));
        double ring = sr * (double)lum_bsdf_eval(&b, up, direction(-cos(theta[1]), 0.3), &pdf).g;
        all += ring;
        hazy += theta[1] > HAZE_DEG * LUM_PI_D / 180.0 ? ring : 0.0;
    }
    return hazy / all;
}

/* Facets of a thin pane that lean by more than half the angle send light out of the cone: of GGX alpha^2 / (alpha^2 +
 * tan^2), which the browser's panel takes roughness from. What shadowing and Fresnel take of wide angles comes by
 * several facets, evenly, and of that sin^2 = 0.0019 goes into the cone again. */
static void haze_of_thin_panes_is_a_closed_form(void **state)
{
    (void)state;
    double worst = 0.0, tan_half = tan(0.5 * HAZE_DEG * LUM_PI_D / 180.0);
    for (int tinted = 0; tinted < 2; tinted++)
        for (float roughness = 0.035f; roughness <= 1.0f; roughness *= 1.1f) {
            struct lum_material m = glass(roughness, tinted ? 1.3f : 1.5f);
            m.thin = true;
            m.base_color = lum_grey(tinted ? 0.4f : 1.0f);
            double alpha2 = pow((double)roughness, 4.0), want = alpha2 / (alpha2 + tan_half * tan_half);
            double got = haze_of(&m);
            worst = fmax(worst, fabs(got - want));
            if (fabs(got - want) > pow(sin(HAZE_DEG * LUM_PI_D / 180.0), 2.0))
                fail_msg("roughness %g: haze %.5f, closed form %.5f", (double)roughness, got, want);
        }
    print_message("farthest from it: %.5f\n", worst);
}

/* ---- sides ---- */

/* With a bent normal nothing goes through the surface, and wo stays above the frame. */
static void light_stays_on_its_geometric_side(void **state)
{
    (void)state;
    struct rng r = {8};
    for (int i = 0; i < 200000; i++) {
        struct lum_material m = variant(i % N_VARIANTS, (float)rng_unit(&r));
        struct lum_surface s = surface(false);
        s.ns = direction(rng_unit(&r), 6.3 * rng_unit(&r));
        struct lum_vec3 wo = direction(1e-6 + rng_unit(&r), 6.3 * rng_unit(&r));
        struct lum_bsdf b;
        struct lum_bsdf_sample bs;
        lum_bsdf_init(&b, &m, &s, wo);
        assert_true(lum_dot(b.frame.n, wo) > 0.0f);
        if (lum_bsdf_sample(&b, wo, (struct lum_vec2){(float)rng_unit(&r), (float)rng_unit(&r)}, (float)rng_unit(&r),
                            &bs))
            assert_true(is_transmitted(&bs) ? bs.wi.z < 0.0f : bs.wi.z > 0.0f);
        struct lum_vec3 below = direction(-rng_unit(&r), 6.3 * rng_unit(&r));
        float pdf;
        struct lum_rgb f = lum_bsdf_eval(&b, wo, below, &pdf);
        if (m.transmission == 0.0f)
            assert_true(lum_rgb_black(f) && pdf == 0.0f);
    }
}

static void wrong_side_is_turned(void **state)
{
    (void)state;
    struct lum_material m = plain(0.5f);
    struct lum_surface s = surface(false);
    struct lum_vec3 down = {0.0f, 0.0f, -1.0f}, flat = {1.0f, 0.0f, 0.0f};
    struct lum_bsdf b;
    float pdf;
    lum_bsdf_init(&b, &m, &s, down);
    assert_true(lum_bsdf_eval(&b, down, down, &pdf).g > 0.0f && pdf > 0.0f);
    lum_bsdf_init(&b, &m, &s, flat);
    struct lum_bsdf_sample bs;
    assert_false(lum_bsdf_sample(&b, flat, (struct lum_vec2){0.5f, 0.5f}, 0.5f, &bs));
    assert_true(lum_rgb_black(lum_bsdf_eval(&b, flat, s.ng, &pdf)) && pdf == 0.0f);
}

static void unlit_shines_and_reflects_nothing(void **state)
{
    (void)state;
    struct lum_material m = plain(0.5f);
    m.unlit = true;
    m.base_color = lum_rgb(0.2f, 0.4f, 0.6f);
    struct lum_surface s = surface(false);
    s.vertex_color = lum_rgb(0.5f, 0.5f, 0.5f);
    struct lum_bsdf b;
    struct lum_bsdf_sample bs;
    lum_bsdf_init(&b, &m, &s, s.ng);
    assert_true(b.emission.r == 0.1f && b.emission.g == 0.2f && b.emission.b == 0.3f);
    assert_false(lum_bsdf_sample(&b, s.ng, (struct lum_vec2){0.5f, 0.5f}, 0.5f, &bs));
    assert_false(lum_material_is_specular(&m));
}

static void specular_materials_are_named(void **state)
{
    (void)state;
    struct lum_material m = matte();
    assert_false(lum_material_is_specular(&m));
    m.roughness = 0.0f;
    assert_false(lum_material_is_specular(&m)); /* no coat */
    m = plain(0.03f);
    assert_true(lum_material_is_specular(&m));
    m = plain(0.04f);
    assert_false(lum_material_is_specular(&m));
    m = glass(1.0f, 1.5f);
    assert_true(lum_material_is_specular(&m));
    m.metallic = 1.0f;
    assert_false(lum_material_is_specular(&m));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(fresnel_is_a_fraction),
        cmocka_unit_test(fresnel_has_its_closed_forms),
        cmocka_unit_test(fresnel_reverses),
        cmocka_unit_test(mirror_is_the_limit),
        cmocka_unit_test(slab_keeps_the_field),
        cmocka_unit_test(equal_media_are_not_there),
        cmocka_unit_test(delta_lobes_share_the_light),
        cmocka_unit_test(haze_of_thin_panes_is_a_closed_form),
        cmocka_unit_test(light_stays_on_its_geometric_side),
        cmocka_unit_test(wrong_side_is_turned),
        cmocka_unit_test(unlit_shines_and_reflects_nothing),
        cmocka_unit_test(specular_materials_are_named),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

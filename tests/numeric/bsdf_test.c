/* Materials as distributions: sampling against density, energy, reciprocity, hostile input. */
#include <math.h>
#include <string.h>

#include "core/math/sampler.h"
#include "tests/numeric/stats.h"
#include "tests/support/effort.h"
#include "tests/support/materials.h"

/* With the far side of sheets. */
static void whole_bsdf(struct lum_bsdf *ret_bsdf, const struct lum_material *m, const struct lum_surface *s,
                       struct lum_vec3 wo)
{
    lum_bsdf_init(ret_bsdf, m, s, wo);
    lum_bsdf_add_far_side(ret_bsdf);
}

/* ---- sampling against pdf ---- */

enum { ROWS = 16, COLUMNS = 24, SAMPLES = 50000 };

/* Samples expected in cell i: midpoint rule on sub x sub points. */
static double expected_by(const struct lum_bsdf *b, struct lum_vec3 wo, int i, int sub)
{
    double sum = 0.0;
    for (int k = 0; k < sub * sub; k++) {
        double theta = (i / COLUMNS + (k / sub + 0.5) / sub) / ROWS * LUM_PI_D;
        double phi = (i % COLUMNS + (k % sub + 0.5) / sub) / COLUMNS * 2.0 * LUM_PI_D;
        float pdf;
        lum_bsdf_eval(b, wo, direction(cos(theta), phi), &pdf);
        sum += (double)pdf * sin(theta);
    }
    return sum * 2.0 * LUM_PI_D * LUM_PI_D / (ROWS * COLUMNS * sub * sub) * SAMPLES;
}

/* Doubled until it changes by far less than the cell's own statistical error. (Refraction ends along a line of equal
 * theta, where convergence is slow.) */
static double expected_in(const struct lum_bsdf *b, struct lum_vec3 wo, int i)
{
    double before = expected_by(b, wo, i, 6);
    for (int sub = 12; sub <= 192; sub *= 2) {
        double now = expected_by(b, wo, i, sub), change = fabs(now - before);
        before = now;
        if (change < 0.05 * sqrt(now) + 0.01)
            break;
    }
    return before;
}

/* Sampled directions against the integral of the pdf over cells of theta and phi; what was absorbed has a cell of its
 * own, which must hold 1 - the integral. Delta samples count as absorbed. */
static double sampling_p_value(const struct lum_material *m, bool backface, double cos_o, struct rng *r)
{
    static struct chi2_cell cell[ROWS * COLUMNS + 1];
    struct lum_surface s = surface(backface);
    struct lum_vec3 wo = direction(cos_o, 0.4);
    struct lum_bsdf b;
    whole_bsdf(&b, m, &s, wo);
    double total = 0.0, lost = 0.0;
    for (int i = 0; i < ROWS * COLUMNS; i++) {
        cell[i] = (struct chi2_cell){expected_in(&b, wo, i), 0.0};
        total += cell[i].expected;
    }
    for (int i = 0; i < SAMPLES; i++) {
        struct lum_vec2 u = {(float)rng_unit(r), (float)rng_unit(r)};
        struct lum_bsdf_sample bs;
        if (!lum_bsdf_sample(&b, wo, u, (float)rng_unit(r), &bs) || bs.pdf_sa == 0.0f) {
            lost += 1.0;
            continue;
        }
        int row = (int)fmin(acos((double)bs.wi.z) / LUM_PI_D * ROWS, ROWS - 1);
        double phi = atan2((double)bs.wi.y, (double)bs.wi.x) / (2.0 * LUM_PI_D);
        int column = (int)fmin((phi < 0.0 ? phi + 1.0 : phi) * COLUMNS, COLUMNS - 1);
        cell[row * COLUMNS + column].observed += 1.0;
    }
    cell[ROWS * COLUMNS] = (struct chi2_cell){fmax(SAMPLES - total, 0.0), lost};
    return chi2_p_value(cell, ROWS * COLUMNS + 1);
}

static void samples_follow_the_pdf(void **state)
{
    (void)state;
    static const float roughness[] = {0.3f, 0.8f};
    static const double cosines[] = {0.95, 0.5, 0.08};
    int tests = N_VARIANTS * 2 * 2 * 3;
    struct rng r = {1};
    for (int v = 0; v < N_VARIANTS; v += TEST_STRIDE)
        for (int back = 0; back < 2; back++)
            for (int k = 0; k < 2; k++)
                for (int c = 0; c < 3; c++) {
                    struct lum_material m = variant(v, roughness[k]);
                    double p = sampling_p_value(&m, back, cosines[c], &r);
                    if (p < sidak(0.01, tests))
                        fail_msg("material %d, roughness %g, cos %g, back %d: p = %g", v, (double)roughness[k],
                                 cosines[c], back, p);
                }
}

/* E over samples of 1 / pdf = the solid angle where the pdf is not 0: with samples of the base it is 2 pi. Also the
 * weight of every sample is f |cos| / pdf of its own direction. */
static void weights_are_value_over_pdf(void **state)
{
    (void)state;
    struct rng r = {5};
    for (int i = 0; i < TEST_EFFORT(100000); i++) {
        struct lum_material m = variant(i % N_VARIANTS, (float)rng_unit(&r));
        struct lum_surface s = surface(i % 2);
        struct lum_vec3 wo = direction(rng_unit(&r), 1.0);
        struct lum_bsdf b;
        struct lum_bsdf_sample bs;
        whole_bsdf(&b, &m, &s, wo);
        if (!lum_bsdf_sample(&b, wo, (struct lum_vec2){(float)rng_unit(&r), (float)rng_unit(&r)}, (float)rng_unit(&r),
                             &bs))
            continue;
        float pdf;
        struct lum_rgb f = lum_bsdf_eval(&b, wo, bs.wi, &pdf);
        if (bs.pdf_sa == 0.0f) {
            assert_true(bs.lobe == LUM_LOBE_REFLECT || bs.lobe == LUM_LOBE_TRANSMIT);
            continue;
        }
        assert_true(pdf == bs.pdf_sa);
        assert_true(fabsf(f.g - bs.weight.g * pdf) <= 1e-5f * f.g);
    }
}

/* Many directions at once are each as it is alone. A facet's normal is off by 2^-23, which next to a peak alpha = 0.04
 * wide is 2 * 2^-23 / 0.04 = 6e-6 of the value, and twice that where both are. */
static void many_directions_are_each_alone(void **state)
{
    (void)state;
    enum { N = 7 };
    struct rng r = {9};
    for (int i = 0; i < 20000; i++) {
        struct lum_material m = variant(i % N_VARIANTS, 0.2f + 0.8f * (float)rng_unit(&r));
        struct lum_surface s = surface(i % 2);
        struct lum_vec3 wo = direction(rng_unit(&r), 1.0), wi[N];
        struct lum_rgb gloss[N];
        float pdf[N];
        struct lum_bsdf b;
        whole_bsdf(&b, &m, &s, wo);
        for (int k = 0; k < N; k++)
            wi[k] = direction(2.0 * rng_unit(&r) - 1.0, 6.3 * rng_unit(&r));
        lum_bsdf_eval_gloss(&b, wo, N, wi, gloss, pdf);
        for (int k = 0; k < N; k++) {
            struct lum_bsdf_value v = lum_bsdf_eval_parts(&b, wo, wi[k]);
            if (!(fabsf(gloss[k].r - v.gloss.r) <= 2e-5f * v.gloss.r &&
                  fabsf(gloss[k].g - v.gloss.g) <= 2e-5f * v.gloss.g &&
                  fabsf(gloss[k].b - v.gloss.b) <= 2e-5f * v.gloss.b &&
                  fabsf(pdf[k] - v.gloss_pdf_sa) <= 2e-5f * v.gloss_pdf_sa))
                fail_msg("case %d, direction %d: %.9g, pdf %.9g; alone %.9g, %.9g", i, k, (double)gloss[k].g,
                         (double)pdf[k], (double)v.gloss.g, (double)v.gloss_pdf_sa);
        }
    }
}

/* ---- energy ---- */

/* Energy returned of what arrives from wo: weights with the eta^2 of radiance taken out again. */
static struct mean albedo(const struct lum_material *m, bool backface, double cos_o, uint32_t n)
{
    struct lum_surface s = surface(backface);
    struct lum_vec3 wo = direction(cos_o, 0.3);
    struct lum_bsdf b;
    whole_bsdf(&b, m, &s, wo);
    struct mean sum = {0};
    for (uint32_t i = 0; i < n; i++) {
        struct lum_sampler q = lum_sampler_at(0, 0, i, 17);
        struct lum_bsdf_sample bs;
        if (!lum_bsdf_sample(&b, wo, lum_sampler_2d(&q, 0), lum_sampler_1d(&q, 1), &bs)) {
            mean_add(&sum, 0.0);
            continue;
        }
        bool bent = is_transmitted(&bs) && !b.thin;
        mean_add(&sum, (double)lum_rgb_max(bs.weight) / (bent ? (double)(b.eta * b.eta) : 1.0));
    }
    return sum;
}

/* A surface in a uniform field never returns more than arrives: 1.01 as pbrt allows, and 4 standard errors. */
static void no_material_creates_energy(void **state)
{
    (void)state;
    static const double cosines[] = {1.0, 0.7, 0.3, 0.1, 0.02, 0.003, 1e-4, 1e-6};
    static const double alphas[] = {1e-6, 0.99e-3, 1.01e-3, 2e-3, 5e-3, 0.02, 0.1, 0.3, 1.0};
    double worst = 0.0;
    for (int v = 0; v < N_VARIANTS; v++)
        for (int back = 0; back < 2; back++)
            for (size_t a = 0; a < LUM_ARRAY_LEN(alphas); a++)
                for (size_t c = 0; c < LUM_ARRAY_LEN(cosines); c++) {
                    struct lum_material m = variant(v, (float)sqrt(alphas[a]));
                    struct mean e = albedo(&m, back, cosines[c], 2048);
                    worst = fmax(worst, e.mean - 4.0 * mean_stderr(&e));
                    if (e.mean > 1.01 + 4.0 * mean_stderr(&e))
                        fail_msg("material %d, alpha %g, cos %g, back %d: albedo %.4f +- %.4f", v, alphas[a],
                                 cosines[c], back, e.mean, mean_stderr(&e));
                }
    print_message("highest albedo, less 4 standard errors: %.4f\n", worst);
}

/* Nothing is lost either: a white metal, a white base under a coat, a coated sheet that reflects half of it and
 * transmits the rest, thin glass, and all but the metal and the glass under a clear coat or fuzz stay white at any
 * roughness, and so do mixes of metal and base, with a coat and without. Exact but for the table, whose error of at
 * most 0.01 is that of light that was scattered once. */
static void white_stays_white(void **state)
{
    (void)state;
    double worst = 0.0;
    for (int kind = 0; kind < 15; kind++)
        for (float roughness = 0.0f; roughness <= 1.0f; roughness += 0.1f)
            for (double cos_o = 0.05; cos_o <= 1.0; cos_o += 0.19) {
                struct lum_material m = kind == 1 ? metal(roughness) : plain(roughness);
                if (kind == 2 || kind == 6 || kind == 9)
                    m.base_color = m.diffuse_transmittance = lum_grey(0.5f);
                if (kind >= 13) {
                    m.transmission = kind == 13 ? 1.0f : 0.5f;
                    m.thin = true;
                } else if (kind >= 10)
                    m.metallic = kind == 12 ? 0.2f : 0.5f;
                if (kind == 5 || kind == 8 || kind == 11)
                    m.specular = 0.0f;
                m.clearcoat = kind > 2 && kind < 7 ? 1.0f : 0.0f;
                m.sheen_color = lum_grey(kind >= 7 && kind < 10 ? 1.0f : 0.0f);
                m.sheen_roughness = roughness;
                m.clearcoat_roughness = kind == 3 ? 0.0f : roughness;
                struct mean e = albedo(&m, false, cos_o, 4096);
                worst = fmax(worst, fabs(e.mean - 1.0));
                if (fabs(e.mean - 1.0) > 0.01 + 4.0 * mean_stderr(&e))
                    fail_msg("kind %d, roughness %g, cos %g: %.4f +- %.4f", kind, (double)roughness, cos_o, e.mean,
                             mean_stderr(&e));
            }
    print_message("farthest from white: %.4f\n", worst);
}

/* Nor is it where facets lean one way, from wherever it comes: a white metal, a coated base, a coated sheet, thin
 * glass. Within the table of those. */
static void white_stays_white_where_it_is_brushed(void **state)
{
    (void)state;
    double worst = 0.0;
    for (int kind = 0; kind < 4; kind++)
        for (float roughness = 0.0f; roughness <= 1.0f; roughness += 0.1f)
            for (double cos_o = 0.05; cos_o <= 1.0; cos_o += 0.19)
                for (int azimuth = 0; azimuth < 4; azimuth++) {
                    struct lum_material m = brushed(kind == 0 ? metal(roughness) : plain(roughness));
                    m.base_color = lum_grey(kind == 2 ? 0.5f : 1.0f);
                    m.diffuse_transmittance = lum_grey(kind == 2 ? 0.5f : 0.0f);
                    m.transmission = kind == 3 ? 1.0f : 0.0f;
                    m.thin = kind == 3;
                    m.stretch =
                        (struct lum_vec2){cosf(0.3f + 0.5f * (float)azimuth), sinf(0.3f + 0.5f * (float)azimuth)};
                    struct mean e = albedo(&m, false, cos_o, 4096);
                    worst = fmax(worst, fabs(e.mean - 1.0));
                    if (fabs(e.mean - 1.0) > 0.02 + 4.0 * mean_stderr(&e))
                        fail_msg("kind %d, roughness %g, cos %g, azimuth %d: %.4f +- %.4f", kind, (double)roughness,
                                 cos_o, azimuth, e.mean, mean_stderr(&e));
                }
    print_message("farthest from white: %.4f\n", worst);
}

/* What a clear coat takes of light that reaches a metal at other angles than it leaves is lost: little, and of a mirror
 * nothing. */
static void metal_under_a_clear_coat_stays_bright(void **state)
{
    (void)state;
    double least = 1.0;
    for (float roughness = 0.0f; roughness <= 1.0f; roughness += 0.1f)
        for (float clear = 0.0f; clear <= 1.0f; clear += 0.25f)
            for (double cos_o = 0.05; cos_o <= 1.0; cos_o += 0.19) {
                struct lum_material m = metal(roughness);
                m.clearcoat = 1.0f;
                m.clearcoat_roughness = clear;
                struct mean e = albedo(&m, false, cos_o, 4096);
                double slack = 0.01 + 4.0 * mean_stderr(&e);
                least = fmin(least, e.mean);
                if (e.mean > 1.0 + slack || e.mean < (roughness == 0.0f ? 1.0 : 0.95) - slack)
                    fail_msg("roughness %g and %g, cos %g: %.4f +- %.4f", (double)roughness, (double)clear, cos_o,
                             e.mean, mean_stderr(&e));
            }
    print_message("darkest: %.4f\n", least);
}

static void matte_weight_is_its_albedo_exactly(void **state)
{
    (void)state;
    struct rng r = {2};
    struct lum_material m = matte();
    struct lum_surface s = surface(false);
    for (int i = 0; i < TEST_EFFORT(200000); i++) {
        if (i == TEST_EFFORT(100000))
            m.base_color = lum_rgb(0.1f, 0.3f, 0.7f);
        struct lum_vec3 wo = direction(1.0 - rng_unit(&r), 6.0 * rng_unit(&r));
        struct lum_bsdf b;
        struct lum_bsdf_sample bs;
        whole_bsdf(&b, &m, &s, wo);
        struct lum_vec2 u = {(float)(rng_u64(&r) >> 40) * 0x1p-24f, (float)(rng_u64(&r) >> 40) * 0x1p-24f};
        if (!lum_bsdf_sample(&b, wo, u, (float)(rng_u64(&r) >> 40) * 0x1p-24f, &bs)) {
            assert_true(u.x == 0.0f || u.y == 0.0f); /* the rim of the disc, where the cosine is 0 */
            continue;
        }
        assert_memory_equal(&bs.weight, &m.base_color, sizeof bs.weight);
    }
}

/* ---- reciprocity ---- */

/* f(wo, wi) = f(wi, wo); across an interface f / n^2 of the side it goes to (radiance): Walter et al. 2007. */
static void scattering_is_reciprocal(void **state)
{
    (void)state;
    struct rng r = {9};
    int transmitted = 0;
    for (int i = 0; i < TEST_EFFORT(200000); i++) {
        struct lum_material m = variant(i % N_VARIANTS, (float)(0.2 + 0.8 * rng_unit(&r)));
        bool back = (i / N_VARIANTS) % 2;
        struct lum_vec3 wo = direction(0.02 + 0.98 * rng_unit(&r), 6.3 * rng_unit(&r));
        struct lum_vec3 wi = direction(0.02 + 0.98 * rng_unit(&r), 6.3 * rng_unit(&r));
        bool through = i % 3 == 0;
        if (through)
            wi = lum_v3_neg(wi);
        struct lum_surface s_o = surface(back), s_i = surface(back != through);
        if (through)
            s_i.ng = s_i.ns = lum_v3_neg(s_i.ng);
        struct lum_bsdf b_o, b_i;
        float pdf;
        whole_bsdf(&b_o, &m, &s_o, wo);
        whole_bsdf(&b_i, &m, &s_i, wi);
        struct lum_rgb f_o = lum_bsdf_eval(&b_o, wo, wi, &pdf), f_i = lum_bsdf_eval(&b_i, wi, wo, &pdf);
        double a = (double)f_o.g / fabs((double)wi.z), b = (double)f_i.g / fabs((double)wo.z);
        if (through && !m.thin)
            a /= (double)(b_o.eta * b_o.eta);
        transmitted += through && a > 0.0;
        /* half vectors are exact to some 2^-21, alpha^2 >= 2^-9.3: 2^-11 relative in D. Near the critical angle
         * 1 - F falls as the root of what is left: it is known to 2^-11 */
        if (fabs(a - b) > 2e-3 * fmax(a, b) + (through ? 1e-3 : 1e-5))
            fail_msg("material %d (back %d): wo %g %g %g, wi %g %g %g: %g and %g", i % N_VARIANTS, back, (double)wo.x,
                     (double)wo.y, (double)wo.z, (double)wi.x, (double)wi.y, (double)wi.z, a, b);
    }
    assert_true(transmitted > TEST_EFFORT(1000));
}

/* ---- hostile input ---- */

static float pick_hostile(struct rng *r, const float *values, size_t n)
{
    return rng_unit(r) < 0.5 ? (float)rng_unit(r) : values[rng_u64(r) % n];
}

static struct lum_vec3 pick_direction(struct rng *r, struct lum_vec3 n)
{
    switch (rng_u64(r) % 8) {
    case 0:
        return n;
    case 1:
        return lum_v3_neg(n);
    case 2: { /* in the surface, up to rounding */
        struct lum_frame f = lum_frame_from_normal(n);
        return rng_unit(r) < 0.5 ? f.t : lum_normalize(lum_v3_mad(f.b, n, 1e-7f));
    }
    default:
        return direction(2.0 * rng_unit(r) - 1.0, 6.3 * rng_unit(r));
    }
}

static void nothing_is_ever_not_finite(void **state)
{
    (void)state;
    static const float unit_values[] = {0.0f, 1.0f, 1e-30f, 0.0316227f, 0.0316228f, 0.99999994f, NAN, 2.0f, -1.0f};
    static const float iors[] = {1.0f, 1.0000001f, 1.0001f, 1.00025f, 4.0f, 0.0f, NAN, 100.0f};
    struct rng r = {6};
    uint64_t bad = 0;
    for (int i = 0; i < TEST_EFFORT(1000000); i++) {
        size_t n = LUM_ARRAY_LEN(unit_values);
        struct lum_material m = plain(pick_hostile(&r, unit_values, n));
        m.metallic = pick_hostile(&r, unit_values, n);
        m.transmission = pick_hostile(&r, unit_values, n);
        m.specular = pick_hostile(&r, unit_values, n);
        m.base_color.g = pick_hostile(&r, unit_values, n);
        m.diffuse_transmittance.r = pick_hostile(&r, unit_values, n);
        m.sheen_color.r = i % 3 ? pick_hostile(&r, unit_values, n) : 0.0f;
        m.sheen_roughness = pick_hostile(&r, unit_values, n);
        m.clearcoat = i % 2 ? pick_hostile(&r, unit_values, n) : 0.0f;
        m.clearcoat_roughness = pick_hostile(&r, unit_values, n);
        if (i % 4 == 3) {
            m = brushed(m);
            m.anisotropy = pick_hostile(&r, unit_values, n);
        }
        m.specular_color.b = pick_hostile(&r, unit_values, n);
        m.ior = pick_hostile(&r, iors, LUM_ARRAY_LEN(iors));
        m.thin = rng_u64(&r) & 1;
        struct lum_surface s = surface(rng_u64(&r) & 1);
        s.ng = direction(2.0 * rng_unit(&r) - 1.0, 6.3 * rng_unit(&r));
        s.ns = pick_direction(&r, s.ng);
        if (rng_u64(&r) % 4 == 0)
            s.tangent = pick_direction(&r, s.ng);
        if (rng_u64(&r) % 16 == 0)
            s.ns = lum_v3(0.0f, 0.0f, 0.0f);
        struct lum_vec3 wo = pick_direction(&r, s.ng), wi = pick_direction(&r, s.ng);
        struct lum_bsdf b;
        struct lum_bsdf_sample bs = {0};
        whole_bsdf(&b, &m, &s, wo);
        float pdf;
        struct lum_rgb f = lum_bsdf_eval(&b, wo, wi, &pdf);
        bool ok = lum_rgb_finite(f) && isfinite(pdf) && pdf >= 0.0f && f.r >= 0.0f && f.g >= 0.0f && f.b >= 0.0f;
        struct lum_rgb gloss;
        float gloss_pdf;
        lum_bsdf_eval_gloss(&b, wo, 1, &wi, &gloss, &gloss_pdf);
        ok = ok && lum_rgb_finite(gloss) && isfinite(gloss_pdf) && gloss_pdf >= 0.0f && gloss.g >= 0.0f;
        struct lum_vec2 u = {pick_hostile(&r, unit_values, 3), pick_hostile(&r, unit_values, 3)};
        u.x = u.x < 1.0f ? u.x : 0.99999994f, u.y = u.y < 1.0f ? u.y : 0.99999994f;
        if (lum_bsdf_sample(&b, wo, u, (float)rng_unit(&r) * 0.99999994f, &bs))
            ok = ok && lum_v3_finite(bs.wi) && lum_rgb_finite(bs.weight) && isfinite(bs.pdf_sa) &&
                 fabsf(lum_length(bs.wi) - 1.0f) < 1e-4f;
        struct lum_rgb a = lum_bsdf_albedo(&b);
        ok = ok && lum_rgb_finite(a) && lum_rgb_max(a) <= 1.0f;
        if (!ok && bad++ == 0)
            print_message("case %d: roughness %g metallic %g transmission %g ior %g: f %g pdf %g weight %g\n", i,
                          (double)m.roughness, (double)m.metallic, (double)m.transmission, (double)m.ior, (double)f.g,
                          (double)pdf, (double)bs.weight.g);
    }
    assert_int_equal(bad, 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(samples_follow_the_pdf),
        cmocka_unit_test(weights_are_value_over_pdf),
        cmocka_unit_test(many_directions_are_each_alone),
        cmocka_unit_test(no_material_creates_energy),
        cmocka_unit_test(white_stays_white),
        cmocka_unit_test(white_stays_white_where_it_is_brushed),
        cmocka_unit_test(metal_under_a_clear_coat_stays_bright),
        cmocka_unit_test(matte_weight_is_its_albedo_exactly),
        cmocka_unit_test(scattering_is_reciprocal),
        cmocka_unit_test(nothing_is_ever_not_finite),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

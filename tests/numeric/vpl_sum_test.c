/* The lifted sum of virtual point lights: against closed forms, its gradient against differences, and its order. */
#include "core/cache/vpl_sum.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include <string.h>

#include "core/base/base.h"
#include "core/math/sampler.h"

/* A set of `n` slots by hand, all of them seen. */
struct fake {
    struct lum_vpl_set set;
    float *memory;
    uint64_t *all;
};

static void fake_begin(struct fake *f, uint32_t n)
{
    size_t padded = (n + 15u) & ~15u;
    *f = (struct fake){.set = {.n = n, .n_bounced = n}};
    f->memory = lum_calloc(padded * 11, sizeof *f->memory);
    f->all = lum_calloc(lum_vpl_words(n), sizeof *f->all);
    assert_true(f->memory && f->all);
    float **arrays[] = {&f->set.px,      &f->set.py,     &f->set.pz,        &f->set.nx,
                        &f->set.ny,      &f->set.nz,     &f->set.flux[0],   &f->set.flux[1],
                        &f->set.flux[2], &f->set.radius, &f->set.importance};
    for (size_t i = 0; i < LUM_ARRAY_LEN(arrays); i++)
        *arrays[i] = f->memory + i * padded;
}

static void fake_put(struct fake *f, uint32_t i, struct lum_vec3 p, struct lum_vec3 n, struct lum_rgb flux)
{
    f->set.px[i] = p.x, f->set.py[i] = p.y, f->set.pz[i] = p.z;
    f->set.nx[i] = n.x, f->set.ny[i] = n.y, f->set.nz[i] = n.z;
    f->set.flux[0][i] = flux.r, f->set.flux[1][i] = flux.g, f->set.flux[2][i] = flux.b;
    f->set.radius[i] = 1.0f;
    f->set.importance[i] = lum_luminance(flux);
    f->all[i / 64] |= UINT64_C(1) << i % 64;
}

static void fake_end(struct fake *f)
{
    lum_free(f->memory);
    lum_free(f->all);
}

static float random_unit(uint32_t i, uint32_t salt)
{
    return (float)(lum_hash_combine(lum_hash_u32(i), salt) >> 8) * 0x1p-24f;
}

static struct lum_vec3 random_vector(uint32_t i, uint32_t salt)
{
    return lum_v3(2.0f * random_unit(i, salt) - 1.0f, 2.0f * random_unit(i, salt + 1) - 1.0f,
                  2.0f * random_unit(i, salt + 2) - 1.0f);
}

static struct lum_vpl_sum sum_at(const struct fake *f, struct lum_vec3 p, struct lum_vec3 n, float lift)
{
    struct lum_receiver at = {p, n, n};
    uint64_t faces[LUM_VPL_MAX / 64];
    struct lum_vpl_sum sum;
    for (uint32_t w = 0; w < lum_vpl_words(f->set.n); w++)
        faces[w] = lum_vpl_faces(&f->set, &at, w);
    lum_vpl_sum_visible(&f->set, &at, faces, NULL, lift, 0.0f, 1, NULL, false, &sum);
    return sum;
}

/* ---- closed forms ---- */

#define SIDE 256u
#define HALF 64.0

/* A square of radiance 1 in the plane y = 0, as SIDE^2 VPLs. Flux of one: pi * area (vpl.h). */
static void make_wall(struct fake *f)
{
    fake_begin(f, SIDE * SIDE);
    const double cell = 2.0 * HALF / SIDE;
    for (uint32_t i = 0; i < SIDE * SIDE; i++) {
        double x = (i % SIDE + 0.5) * cell - HALF, z = ((double)(i / SIDE) + 0.5) * cell - HALF;
        fake_put(f, i, lum_v3((float)x, 0.0f, (float)z), lum_v3(0, 1, 0), lum_grey((float)(LUM_PI_D * cell * cell)));
    }
}

/* Irradiance from a square of half side a and radiance 1, seen from height h above its middle by a surface parallel to
 * it: four times the corner formula for x = y = a / h. */
static double parallel_irradiance(double a, double h)
{
    double x = a / h, r = sqrt(1.0 + x * x);
    return 4.0 * x / r * atan(x / r);
}

/* And by a surface at right angles to it, through its middle: half of the square is before it. Corner formula for a
 * rectangle a wide and a deep, twice: 1/2 (atan(a/h) - h / sqrt(h^2 + a^2) atan(a / sqrt(h^2 + a^2))). */
static double upright_irradiance(double a, double h)
{
    double r = sqrt(h * h + a * a);
    return atan(a / h) - h / r * atan(a / r);
}

/* However near the wall, it gives what it gives at the lifted point: nothing is lost. The lift is 4 cells, so that the
 * midpoint rule is good to the share (cell / lift)^2 / 24 of the second difference, which is about 1: 0.3 %. */
static void wall_keeps_its_energy(void **state)
{
    (void)state;
    struct fake f;
    make_wall(&f);
    const double lift = 4.0 * 2.0 * HALF / SIDE, heights[] = {1e-4, 0.01, 0.1, 0.5, 1.0, 4.0, 16.0};
    for (size_t i = 0; i < LUM_ARRAY_LEN(heights); i++) {
        double h = heights[i], lifted = sqrt(h * h + pow(lift, 4) / (h * h + lift * lift));
        double above = (double)sum_at(&f, lum_v3(0, (float)h, 0), lum_v3(0, -1, 0), (float)lift).irradiance.g;
        double beside = (double)sum_at(&f, lum_v3(0, (float)h, 0), lum_v3(1, 0, 0), (float)lift).irradiance.g;
        if (!(fabs(above / parallel_irradiance(HALF, lifted) - 1.0) < 3e-3))
            fail_msg("height %g: %g, expected %g", h, above, parallel_irradiance(HALF, lifted));
        if (!(fabs(beside / upright_irradiance(HALF, lifted) - 1.0) < 3e-3))
            fail_msg("upright at height %g: %g, expected %g", h, beside, upright_irradiance(HALF, lifted));
        /* the share of the true irradiance that is there: all of an endless wall's; here it is 64 lifts wide */
        assert_true(above / parallel_irradiance(HALF, h) > 0.98);
    }
    fake_end(&f);
}

/* ---- gradient ---- */

/* Central differences over 2 h. Their own error is h^2 / 6 times the third derivative, which is at most 4 * 5 * 6 /
 * lift^3 of the value for a term that falls as r^-4, and twice that with the cosines; rounding of the two sums adds
 * 2^-22 / h. With h = 2^-9 and lift 1 both are near 1.5e-4 of the irradiance: three times their sum is let pass. Where
 * the lifted VPL passes the horizon there is a kink: not looked at. */
static void gradient_is_the_difference(void **state)
{
    (void)state;
    struct fake f;
    const float step = 0x1p-9f;
    const struct lum_vec3 axes[3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
    uint32_t looked_at = 0;
    fake_begin(&f, 1);
    for (uint32_t round = 0; round < 5000; round++) {
        fake_put(&f, 0, lum_v3_mul(random_vector(round, 1), 5.0f), lum_normalize(random_vector(round, 4)), lum_grey(1));
        struct lum_vec3 p = random_vector(round, 7), n = lum_normalize(random_vector(round, 21));
        struct lum_vpl_sum here = sum_at(&f, p, n, 1.0f);
        for (int k = 0; k < 3; k++) {
            double low = (double)sum_at(&f, lum_v3_mad(p, axes[k], -step), n, 1.0f).irradiance.g;
            double high = (double)sum_at(&f, lum_v3_mad(p, axes[k], step), n, 1.0f).irradiance.g;
            if (!(low > 0.0) || !(high > 0.0))
                continue;
            looked_at++;
            double expected = (high - low) / (2.0 * (double)step), got = (double)here.gradient[k].g;
            if (!(fabs(got - expected) < 1e-3 * (double)here.irradiance.g + 1e-6))
                fail_msg("round %u, axis %d: %g, difference %g", round, k, got, expected);
        }
    }
    assert_true(looked_at > 1000);
    fake_end(&f);
}

/* ---- who counts ---- */

static void only_who_faces_counts(void **state)
{
    (void)state;
    struct fake f;
    fake_begin(&f, 5);
    const struct lum_vec3 up = {0, 1, 0}, down = {0, -1, 0};
    fake_put(&f, 0, lum_v3(0, 2, 0), down, lum_grey(1)); /* above, looks down */
    fake_put(&f, 1, lum_v3(0, 2, 0), up, lum_grey(1));   /* above, looks away */
    fake_put(&f, 2, lum_v3(0, -2, 0), up, lum_grey(1));  /* below */
    fake_put(&f, 3, lum_v3(3, 0, 0), up, lum_grey(1));   /* in the plane */
    fake_put(&f, 4, lum_v3(1, 2, 0), down, lum_grey(0)); /* black, but it may be switched on */
    struct lum_receiver at = {lum_v3(0, 0, 0), up, up};
    assert_int_equal(lum_vpl_faces(&f.set, &at, 0), 1u | 1u << 4);
    at.ng = lum_normalize(lum_v3(-1, 0.1f, 0)); /* a shading normal may look at what lies behind the surface */
    assert_int_equal(lum_vpl_faces(&f.set, &at, 0), 1u);
    uint64_t none = 0;
    struct lum_vpl_sum sum;
    lum_vpl_sum_visible(&f.set, &at, &none, NULL, 1.0f, 0.0f, 1, NULL, false, &sum);
    assert_true(lum_rgb_black(sum.irradiance));
    fake_end(&f);
}

/* On a VPL, and at every distance down to it: finite, and never more than flux / (pi lift^2). */
static void near_is_finite(void **state)
{
    (void)state;
    struct fake f;
    fake_begin(&f, 1);
    fake_put(&f, 0, lum_v3(0, 0, 0), lum_v3(0, 1, 0), lum_grey(1));
    for (uint32_t i = 0; i < 1000; i++) {
        struct lum_vec3 p = lum_v3_mul(random_vector(i, 3), ldexpf(1.0f, -(int)(i % 140)));
        struct lum_vpl_sum sum = sum_at(&f, p, lum_normalize(random_vector(i, 9)), 0.5f);
        assert_true(lum_rgb_finite(sum.irradiance) && sum.irradiance.g >= 0.0f);
        assert_true(sum.irradiance.g <= 1.0001f * LUM_INV_PI / 0.25f);
        for (int k = 0; k < 3; k++)
            if (!lum_rgb_finite(sum.gradient[k]))
                fail_msg("%u: %g %g %g", i, (double)sum.gradient[k].r, (double)p.x, (double)p.y);
    }
    fake_end(&f);
}

/* ---- some for all ---- */

/* A ceiling of 1,024 VPLs of uneven flux, and a floor below on which cells of space differ: with 64 of them drawn the
 * mean over places is that of the sums over all. Draws of n with chances in proportion to what they bring have a
 * relative variance of at most 1 / n each, so the mean over 400 places is off by 1 / sqrt(64 * 400) = 0.6 %; four times
 * that. And as many rays as asked for: from n to 1.5 n on average. */
static void some_stand_for_all(void **state)
{
    (void)state;
    enum { SIDE_N = 32, PLACES = 20, ASKED = 64 };
    struct fake f;
    fake_begin(&f, SIDE_N * SIDE_N);
    for (uint32_t i = 0; i < SIDE_N * SIDE_N; i++) {
        float x = (float)(i % SIDE_N) * 2.0f - 31.0f, z = (float)(i / SIDE_N) * 2.0f - 31.0f, flux = random_unit(i, 3);
        fake_put(&f, i, lum_v3(x, 10.0f, z), lum_v3(0, -1, 0), lum_grey(flux * flux * flux));
    }
    double whole = 0.0, drawn = 0.0, n_drawn = 0.0;
    for (uint32_t i = 0; i < PLACES * PLACES; i++) {
        struct lum_receiver at = {lum_v3((float)(i % PLACES) * 2.0f - 19.0f, 0.0f, (float)(i / PLACES) * 2.0f - 19.0f),
                                  lum_v3(0, 1, 0), lum_v3(0, 1, 0)};
        uint64_t bits[SIDE_N * SIDE_N / 64];
        struct lum_vpl_sum sum;
        lum_vpl_sum_visible(&f.set, &at, f.all, NULL, 1.0f, 0.0f, 1, NULL, false, &sum);
        whole += (double)sum.irradiance.g;
        float step = lum_vpl_draw(&f.set, &at, 1.0f, ASKED, 1, bits);
        assert_true(step > 0.0f);
        lum_vpl_sum_visible(&f.set, &at, bits, NULL, 1.0f, step, 1, NULL, false, &sum);
        drawn += (double)sum.irradiance.g;
        for (uint32_t w = 0; w < SIDE_N * SIDE_N / 64; w++)
            n_drawn += __builtin_popcountll(bits[w]);
    }
    n_drawn /= PLACES * PLACES;
    if (!(fabs(drawn / whole - 1.0) < 4.0 / sqrt(ASKED * PLACES * PLACES)))
        fail_msg("those drawn bring %g of all", drawn / whole);
    if (!(n_drawn > 0.95 * ASKED && n_drawn < 1.5 * ASKED))
        fail_msg("%g are drawn, %d asked for", n_drawn, ASKED);
    uint64_t all[SIDE_N * SIDE_N / 64];
    struct lum_receiver at = {lum_v3(0, 0, 0), lum_v3(0, 1, 0), lum_v3(0, 1, 0)};
    assert_true(lum_vpl_draw(&f.set, &at, 1.0f, SIDE_N * SIDE_N, 1, all) == 0.0f);
    assert_memory_equal(all, f.all, sizeof all);
    fake_end(&f);
}

/* What is drawn of a block brings what its chances add up to, but for less than one draw: here flux is importance, so
 * that one draw is worth step / pi. Sums of 32 floats are off by less than 2^-18 of that. */
static void a_block_brings_what_it_should(void **state)
{
    (void)state;
    enum { N = 1000, WORDS = (N + 63) / 64 };
    struct fake f;
    fake_begin(&f, N); /* the last block is not full */
    for (uint32_t i = 0; i < N; i++) {
        float flux = random_unit(i, 5);
        fake_put(&f, i, lum_v3(30.0f * random_unit(i, 6) - 15.0f, 8.0f, 30.0f * random_unit(i, 7) - 15.0f),
                 lum_v3(0, -1, 0), lum_grey(flux * flux));
    }
    uint32_t looked_at = 0;
    for (uint32_t place = 0; place < 50; place++) {
        struct lum_receiver at = {lum_v3(20.0f * random_unit(place, 8) - 10.0f, 0.0f, 1.0f), lum_v3(0, 1, 0),
                                  lum_v3(0, 1, 0)};
        uint64_t bits[WORDS];
        float step = lum_vpl_draw(&f.set, &at, 1.0f, 64, 1, bits);
        for (uint32_t k = 0; k < N; k += LUM_DRAW_BLOCK) {
            uint64_t block[WORDS] = {0}, drawn[WORDS] = {0};
            struct lum_vpl_sum whole, some;
            block[k / 64] = f.all[k / 64] & UINT64_C(0xffffffff) << k % 64;
            drawn[k / 64] = block[k / 64] & bits[k / 64];
            lum_vpl_sum_visible(&f.set, &at, block, NULL, 1.0f, 0.0f, 1, NULL, false, &whole);
            lum_vpl_sum_visible(&f.set, &at, drawn, NULL, 1.0f, step, 1, NULL, false, &some);
            float off = fabsf(some.irradiance.g - whole.irradiance.g), draw = step * LUM_INV_PI;
            if (!(off <= draw * (1.0f + 0x1p-18f)))
                fail_msg("place %u, block %u: off by %g draws", place, k, (double)(off / draw));
            looked_at += drawn[k / 64] != 0;
        }
    }
    assert_true(looked_at > 1000);
    fake_end(&f);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(wall_keeps_its_energy), cmocka_unit_test(gradient_is_the_difference),
        cmocka_unit_test(only_who_faces_counts), cmocka_unit_test(near_is_finite),
        cmocka_unit_test(some_stand_for_all),    cmocka_unit_test(a_block_brings_what_it_should),
    };
    return cmocka_run_group_tests_name("numeric.vpl_sum", tests, NULL, NULL);
}

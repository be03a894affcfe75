/* FLIP and HDR-FLIP: golden values, and what must hold of any pictures. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include <cmocka.h>

#include "core/metric/blur.h"
#include "core/metric/flip.h"
#include "core/metric/lab.h"
#include "tests/unit/metric_golden.h"

/* What the task allows; rounding of EXR values to half moves HDR-FLIP by less than 1e-5. */
#define GOLDEN_TOLERANCE 0.0005

enum { W = 48, H = 40, N = W * H };
struct picture {
    float rgb[3][N];
};

static void assert_near(const char *what, double value, double expected, double tolerance)
{
    if (!(fabs(value - expected) <= tolerance))
        fail_msg("%s: %.9g is not %.9g within %g", what, value, expected, tolerance);
}

static struct lum_flip_input pair(const struct picture *x, const struct picture *r)
{
    return (struct lum_flip_input){
        W, H, {x->rgb[0], x->rgb[1], x->rgb[2]}, {r->rgb[0], r->rgb[1], r->rgb[2]}, LUM_FLIP_PIXELS_PER_DEGREE};
}

static double flip(const struct picture *x, const struct picture *r, float *ret_map)
{
    struct lum_flip_input in = pair(x, r);
    struct lum_flip_result result;
    struct lum_error err;
    if (lum_flip_compare(&in, ret_map, &result, &err))
        fail_msg("%s", err.text);
    return result.mean;
}

static double hdrflip(const struct picture *x, const struct picture *r, struct lum_hdrflip_exposures *ret_exposures)
{
    struct lum_flip_input in = pair(x, r);
    struct lum_flip_result result;
    struct lum_error err;
    if (lum_hdrflip_compare(&in, NULL, &result, ret_exposures, &err))
        fail_msg("%s", err.text);
    assert_true(result.mean >= 0.0 && result.mean <= result.max && result.max <= 1.0);
    return result.mean;
}

/* Noise of its own for each seed, in [0, scale). */
static void fill(struct picture *p, uint32_t seed, float scale)
{
    for (int k = 0; k < 3; k++)
        for (int i = 0; i < N; i++) {
            seed = seed * 1664525u + 1013904223u;
            p->rgb[k][i] = scale * (float)(seed >> 8) / 16777216.0f;
        }
}

static void paint(struct picture *p, float r, float g, float b)
{
    const float c[3] = {r, g, b};
    for (int k = 0; k < 3; k++)
        for (int i = 0; i < N; i++)
            p->rgb[k][i] = c[k];
}

static void check_golden(const struct golden_flip *g, bool hdr)
{
    static struct golden x, r;
    struct lum_flip_result result;
    struct lum_error err;
    golden_read(g->x, &x);
    golden_read(g->r, &r);
    struct lum_flip_input in = {
        GOLDEN_W, GOLDEN_H, {x.rgb[0], x.rgb[1], x.rgb[2]}, {r.rgb[0], r.rgb[1], r.rgb[2]}, LUM_FLIP_PIXELS_PER_DEGREE};
    struct lum_hdrflip_exposures e = {1.0528, 3.4936, 3};
    enum lum_status st =
        hdr ? lum_hdrflip_compare(&in, NULL, &result, &e, &err) : lum_flip_compare(&in, NULL, &result, &err);
    if (st)
        fail_msg("%s", err.text);
    assert_near(g->x, result.mean, g->mean, GOLDEN_TOLERANCE);
    assert_near(g->x, result.weighted_median, g->weighted_median, GOLDEN_TOLERANCE);
    assert_near(g->x, result.max, g->max, GOLDEN_TOLERANCE);
    assert_near("first exposure", e.start, 1.0528, 1e-3); /* a half is within 2^-11: 7e-4 stops */
    assert_near("last exposure", e.stop, 3.4936, 1e-3);
    assert_int_equal(e.n, 3);
}

static void golden_values(void **state)
{
    (void)state;
    for (size_t i = 0; i < LUM_ARRAY_LEN(golden_flip); i++)
        check_golden(&golden_flip[i], false);
    for (size_t i = 0; i < LUM_ARRAY_LEN(golden_hdrflip); i++)
        check_golden(&golden_hdrflip[i], true);
}

static void the_same_is_zero(void **state)
{
    (void)state;
    static struct picture x;
    struct lum_hdrflip_exposures e;
    fill(&x, 1, 1.0f);
    assert_true(flip(&x, &x, NULL) == 0.0);
    assert_true(hdrflip(&x, &x, &e) == 0.0);
}

/* |a - b| is |b - a| in every step, so the two maps are the same to the last bit. HDR-FLIP takes its exposures from r.
 */
static void symmetric_and_within_one(void **state)
{
    (void)state;
    static struct picture x, r;
    static float forth[N], back[N];
    fill(&x, 1, 1.0f);
    fill(&r, 2, 0.3f);
    flip(&x, &r, forth);
    flip(&r, &x, back);
    assert_memory_equal(forth, back, sizeof forth);
    for (int i = 0; i < N; i++)
        assert_true(forth[i] >= 0.0f && forth[i] <= 1.0f);
}

/* Even pictures have no features and no edges to filter: the error is that of their colours. Green against blue is the
 * largest there is; black against white differs by 100 in lightness alone, so 100^0.7 = 25.1 against a knee of 0.4
 * times that of green and blue. */
static void even_pictures(void **state)
{
    (void)state;
    static struct picture green, blue, black, white;
    paint(&green, 0, 1, 0);
    paint(&blue, 0, 0, 1);
    paint(&black, 0, 0, 0);
    paint(&white, 1, 1, 1);
    struct lum_lab g = lum_lab_of((float[3]){0, 1, 0}), b = lum_lab_of((float[3]){0, 0, 1});
    double da = 0.01 * (double)(g.l * g.a - b.l * b.a), db = 0.01 * (double)(g.l * g.b - b.l * b.b);
    double largest = pow(fabs((double)(g.l - b.l)) + hypot(da, db), 0.7), knee = 0.4 * largest;
    double grey = 0.95 + 0.05 * (pow(100.0, 0.7) - knee) / (largest - knee);
    /* filters sum to 1 within 21 roundings of 6e-8; colours within some 1e-5 of their range */
    assert_near("green, blue", flip(&green, &blue, NULL), 1.0, 2e-5);
    assert_near("black, white", flip(&black, &white, NULL), grey, 2e-5);
}

/* A blot moved by whole pixels moves its map by as many, where no edge of the picture is within the radius of the
 * filters (10 pixels). The same numbers are added in the same order. */
static void moves_with_the_picture(void **state)
{
    (void)state;
    static struct picture x, r;
    static float here[N], there[N];
    const int dx = 5, dy = 3;
    paint(&r, 0.2f, 0.2f, 0.2f);
    x = r;
    x.rgb[0][18 * W + 20] = 0.9f;
    flip(&x, &r, here);
    x = r;
    x.rgb[0][(18 + dy) * W + 20 + dx] = 0.9f;
    flip(&x, &r, there);
    assert_true(here[18 * W + 20] > 0.01f);
    for (int j = 0; j < H - dy; j++)
        for (int i = 0; i < W - dx; i++)
            assert_true(here[j * W + i] == there[(j + dy) * W + i + dx]);
}

/* More of the same change is never less of an error on even pictures. */
static void grows_with_the_change(void **state)
{
    (void)state;
    static struct picture x, r;
    double before = 0.0;
    paint(&r, 0.2f, 0.2f, 0.2f);
    for (int i = 1; i <= 8; i++) {
        paint(&x, 0.2f + 0.1f * (float)i, 0.2f, 0.2f);
        double now = flip(&x, &r, NULL);
        assert_true(now > before);
        before = now;
    }
}

/* A median of 0 would ask for an infinite exposure, no light at all for no number. */
static void black_pictures(void **state)
{
    (void)state;
    static struct picture x, r;
    struct lum_hdrflip_exposures e;
    paint(&r, 0, 0, 0);
    x = r;
    assert_true(hdrflip(&x, &r, &e) == 0.0);
    assert_int_equal(e.n, 0);
    x.rgb[1][7] = 3.0f; /* exposures are its own */
    assert_true(hdrflip(&x, &r, &e) > 0.0 && e.n == 2 && isfinite(e.start) && isfinite(e.stop));
    assert_true(hdrflip(&r, &x, &e) > 0.0 && e.n == 2 && isfinite(e.stop));
}

static void light_of_any_strength(void **state)
{
    (void)state;
    static struct picture x, r;
    struct lum_hdrflip_exposures e, scaled;
    fill(&x, 1, 1.0f);
    fill(&r, 2, 1.0f);
    r.rgb[0][0] = 4.0f;
    double mean = hdrflip(&x, &r, &e);
    for (int i = -100; i <= 120; i += 20) { /* powers of two change no bit of what exposures make of them */
        static struct picture xs, rs;
        for (int k = 0; k < 3; k++)
            for (int j = 0; j < N; j++) {
                xs.rgb[k][j] = ldexpf(x.rgb[k][j], i);
                rs.rgb[k][j] = ldexpf(r.rgb[k][j], i);
            }
        /* exposures are within 1e-6 of a stop of each other, from the float luminance they come from */
        assert_near("scaled", hdrflip(&xs, &rs, &scaled), mean, 1e-5);
        assert_near("exposure", scaled.start + i, e.start, 1e-5);
    }
    r.rgb[0][0] = 3e38f; /* 2^128 times the rest: the last exposure is 32 stops from the first */
    hdrflip(&x, &r, &e);
    assert_near("stops", e.stop - e.start, LUM_HDRFLIP_STOPS_MAX, 1e-9);
}

static void what_is_not_finite_is_refused(void **state)
{
    (void)state;
    static struct picture x, r;
    struct lum_flip_result result;
    struct lum_hdrflip_exposures e;
    struct lum_error err;
    fill(&x, 1, 1.0f);
    r = x;
    r.rgb[2][3 * W + 5] = NAN;
    r.rgb[0][3 * W + 6] = INFINITY;
    struct lum_flip_input in = pair(&x, &r);
    assert_int_equal(lum_flip_compare(&in, NULL, &result, &err), LUM_ERR_INVALID);
    assert_string_equal(err.text, "the reference has 2 values that are not finite, the first at pixel 5, 3");
    assert_int_equal(lum_hdrflip_compare(&in, NULL, &result, &e, NULL), LUM_ERR_INVALID);
    in = pair(&x, &x);
    in.pixels_per_degree = 0.0;
    assert_int_equal(lum_flip_compare(&in, NULL, &result, &err), LUM_ERR_INVALID);
    in.pixels_per_degree = LUM_FLIP_PIXELS_PER_DEGREE;
    lum_alloc_fail_after(1);
    assert_int_equal(lum_flip_compare(&in, NULL, &result, &err), LUM_ERR_NOMEM);
}

/* A filter that is wider than the picture: all of an even row is that row. */
static void filters_keep_what_is_even(void **state)
{
    (void)state;
    float in[3] = {2.0f, 2.0f, 2.0f}, work[3], out[3];
    struct lum_kernel gauss, slope;
    lum_kernel_gauss(5.0, 15, &gauss);
    lum_kernel_gauss_derivative(5.0, 1, 15, &slope);
    for (uint32_t w = 1; w <= 3; w += 2) {
        lum_blur(in, w, 3 / w, (const struct lum_kernel *[2]){&gauss, &gauss}, work, out);
        for (int i = 0; i < 3; i++)
            assert_near("even", (double)out[i], 2.0, 1e-5);
        lum_blur(in, w, 3 / w, (const struct lum_kernel *[2]){&slope, &gauss}, work, out);
        for (int i = 0; i < 3; i++)
            assert_near("no slope", (double)out[i], 0.0, 1e-5);
    }
}

static void colours_go_there_and_back(void **state)
{
    (void)state;
    struct lum_lab white = lum_lab_of((float[3]){1, 1, 1}), same = lum_ycxcz_of((float[3]){1, 1, 1});
    assert_near("L of white", (double)white.l, 100.0, 1e-4);
    assert_near("a of white", (double)white.a, 0.0, 1e-4);
    assert_near("Cz of white", (double)same.b, 0.0, 1e-4);
    for (int i = 0; i < 64; i++) {
        const float c[3] = {(float)(i & 3) / 3.0f, (float)(i >> 2 & 3) / 3.0f, (float)(i >> 4) / 3.0f};
        float lab[3], linear[3];
        lum_lab_to_rgb(lum_lab_of(c), lab);
        lum_ycxcz_to_rgb(lum_ycxcz_of(c), linear);
        for (int k = 0; k < 3;
             k++) { /* the matrices are each other's inverse to 1e-8; floats to 1e-7, times 10 terms */
            assert_near("by L*a*b*", (double)lab[k], (double)c[k], 2e-6);
            assert_near("by YCxCz", (double)linear[k], (double)c[k], 2e-6);
        }
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(golden_values),
        cmocka_unit_test(the_same_is_zero),
        cmocka_unit_test(symmetric_and_within_one),
        cmocka_unit_test(even_pictures),
        cmocka_unit_test(moves_with_the_picture),
        cmocka_unit_test(grows_with_the_change),
        cmocka_unit_test(black_pictures),
        cmocka_unit_test(light_of_any_strength),
        cmocka_unit_test(what_is_not_finite_is_refused),
        cmocka_unit_test(filters_keep_what_is_even),
        cmocka_unit_test(colours_go_there_and_back),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

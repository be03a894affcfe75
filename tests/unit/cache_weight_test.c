/* What records count at points (NOTES H27): finite wherever the point is, and right where it can be said by hand.
 */
#include "core/cache/weight.h"
#include "tests/support/scene_fixture.h"

static const enum lum_metric metrics[] = {LUM_METRIC_WARD, LUM_METRIC_TENTS};

static float weight_of(const struct lum_cache_record *record, enum lum_metric metric, float accuracy, struct lum_vec3 p,
                       struct lum_vec3 n)
{
    struct lum_weighting w = lum_weighting_of(accuracy);
    return lum_weight_of(&w, metric, record, p, n);
}

static struct lum_cache_record floor_record(float radius)
{
    return (struct lum_cache_record){.n = {0, 1, 0}, .ng = {0, 1, 0}, .radius = radius};
}

static void a_record_counts_most_where_it_lies(void **state)
{
    (void)state;
    struct lum_cache_record r = floor_record(0.5f);
    r.p = lum_v3(0.3f, 0.7f, -0.2f);
    for (size_t m = 0; m < LUM_ARRAY_LEN(metrics); m++) {
        float most = weight_of(&r, metrics[m], 0.2f, r.p, r.n);
        assert_true(most > 0.0f && isfinite(most));
        float last = most;
        for (int k = 1; k < 50; k++) { /* along the floor, and by turning the normal: less and less */
            float w = weight_of(&r, metrics[m], 0.2f, lum_v3(r.p.x + 0.01f * (float)k, r.p.y, r.p.z), r.n);
            assert_true(w < last && w > 0.0f);
            last = w;
        }
        last = most;
        for (int k = 1; k < 11;
             k++) { /* WARD ends at sqrt(2) asin(0.2 / sqrt 2) .. : 0.28 rad, TENTS at 10 degrees + 0.2 */
            float a = 0.025f * (float)k, w = weight_of(&r, metrics[m], 0.2f, r.p, lum_v3(sinf(a), cosf(a), 0));
            assert_true(w < last && w > 0.0f);
            last = w;
        }
    }
}

static void its_reach_is_the_radius(void **state)
{
    (void)state;
    struct lum_cache_record r = floor_record(0.25f);
    for (size_t m = 0; m < LUM_ARRAY_LEN(metrics); m++) {
        assert_true(weight_of(&r, metrics[m], 0.3f, lum_v3(0.249f, 0, 0), r.n) > 0.0f);
        assert_true(weight_of(&r, metrics[m], 0.3f, lum_v3(0.251f, 0, 0), r.n) == 0.0f);
        assert_true(weight_of(&r, metrics[m], 0.3f, r.p, lum_v3(1, 0, 0)) == 0.0f);
        assert_true(weight_of(&r, metrics[m], 0.3f, r.p, lum_v3_neg(r.n)) == 0.0f);
    }
    /* Ward by hand: e = 0.3 * 0.1 / 0.25 = 0.12 */
    assert_float_equal(weight_of(&r, LUM_METRIC_WARD, 0.3f, lum_v3(0.1f, 0, 0), r.n), 1.0f / 0.12f, 1e-5f);
    /* a step: above or below the floor by more than a twentieth of the radius */
    assert_true(weight_of(&r, LUM_METRIC_TENTS, 0.3f, lum_v3(0.1f, 0.013f, 0), r.n) == 0.0f);
    assert_true(weight_of(&r, LUM_METRIC_TENTS, 0.3f, lum_v3(0.1f, -0.013f, 0), r.n) == 0.0f);
    assert_true(weight_of(&r, LUM_METRIC_TENTS, 0.3f, lum_v3(0.1f, 0.012f, 0), r.n) > 0.0f);
}

/* Whom it serves it counts at, but not the other way round: whoever is further out than LUM_TENT_SERVES of the radius
 * hears others, too. */
static void it_serves_less_far_than_it_counts(void **state)
{
    (void)state;
    struct lum_weighting w = lum_weighting_of(0.3f);
    const struct lum_vec3 n = {0, 1, 0};
    float edge = LUM_TENT_SERVES / 4.0f; /* of a record with radius 1/4 */
    for (int k = 0; k < 1000; k++) {
        struct lum_vec3 d = {0.00025f * (float)k, 0, 0};
        bool counts = lum_weight_tents(&w, 4.0f, 1.0f, d, n, n) > 0.0f;
        bool serves = lum_weight_tents(&w, 4.0f, LUM_TENT_SERVES, d, n, n) > 0.0f;
        if (counts != (d.x < 0.25f) || serves != (d.x < edge))
            fail_msg("at %g: counts %d, serves %d", (double)d.x, counts, serves);
    }
    assert_true(lum_weight_tents(&w, 4.0f, LUM_TENT_SERVES, lum_v3(0, 0, 0), n, lum_v3(1, 0, 0)) == 0.0f);
    assert_true(lum_weight_tents(&w, 4.0f, LUM_TENT_SERVES, lum_v3(0, 0.013f, 0), n, n) == 0.0f);
}

/* On a sphere the chord is at right angles to the sum of the normals: no step. */
static void curvature_is_no_step(void **state)
{
    (void)state;
    struct lum_cache_record r = {.p = {0, 1, 0}, .n = {0, 1, 0}, .radius = 0.5f};
    for (int k = 0; k < 30; k++) {
        float a = 0.01f * (float)k;
        struct lum_vec3 p = lum_v3(sinf(a), cosf(a), 0);
        assert_true(weight_of(&r, LUM_METRIC_TENTS, 0.3f, p, p) > 0.0f);
    }
}

static float any_float(struct random_stream *random)
{
    static const float odd[] = {0.0f, -0.0f, 1e-38f, 1e-45f, 1e30f, -1e30f, INFINITY, -INFINITY, NAN};
    uint32_t bits = random_bits(random);
    return bits % 16 < LUM_ARRAY_LEN(odd) ? odd[bits % 16] : (float)(random_double(random) * 2.0 - 1.0);
}

static struct lum_vec3 any_vector(struct random_stream *random)
{
    float x = any_float(random), y = any_float(random), z = any_float(random);
    return lum_v3(x, y, z);
}

static void weights_are_finite(void **state)
{
    (void)state;
    struct random_stream random = {27};
    for (uint32_t k = 0; k < 1000000; k++) {
        struct lum_cache_record r = {
            .p = any_vector(&random), .n = any_vector(&random), .radius = fabsf(any_float(&random))};
        bool odd = k % 2, same = k % 3 == 0;
        if (!odd) {
            r.p = lum_v3_mul(random_direction(&random), (float)random_double(&random));
            r.n = random_direction(&random);
            r.radius = (float)random_double(&random) + 0x1p-20f;
        }
        struct lum_vec3 p = odd ? any_vector(&random) : lum_v3_mad(r.p, random_direction(&random), 1e-3f);
        struct lum_vec3 n = same ? r.n : any_vector(&random);
        float accuracy = LUM_ACCURACY_MIN + 2.0f * (float)random_double(&random);
        for (size_t m = 0; m < LUM_ARRAY_LEN(metrics); m++) {
            float w = weight_of(&r, metrics[m], accuracy, same && k % 2 ? r.p : p, n);
            if (!(w >= 0.0f) || !isfinite(w))
                fail_msg("query %u, metric %zu: weight %g", k, m, (double)w);
        }
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_record_counts_most_where_it_lies),
        cmocka_unit_test(its_reach_is_the_radius),
        cmocka_unit_test(it_serves_less_far_than_it_counts),
        cmocka_unit_test(curvature_is_no_step),
        cmocka_unit_test(weights_are_finite),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

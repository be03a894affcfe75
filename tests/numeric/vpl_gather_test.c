/* Gathering: bounds of the geometry term, nearness, and any split of the points. */
#include "tests/numeric/stats.h"
#include "tests/support/vpls.h"

/* A handful of VPLs in an empty scene. */
struct loose {
    float p[6][16], unit[3][16];
    struct lum_vpl_set set;
};

static void loose_init(struct loose *l)
{
    memset(l, 0, sizeof *l);
    l->set = (struct lum_vpl_set){.n = 16,
                                  .px = l->p[0],
                                  .py = l->p[1],
                                  .pz = l->p[2],
                                  .nx = l->p[3],
                                  .ny = l->p[4],
                                  .nz = l->p[5],
                                  .flux = {l->unit[0], l->unit[1], l->unit[2]}};
}

static void loose_put(struct loose *l, uint32_t i, struct lum_vec3 p, struct lum_vec3 n, struct lum_rgb flux)
{
    l->p[0][i] = p.x, l->p[1][i] = p.y, l->p[2][i] = p.z;
    l->p[3][i] = n.x, l->p[4][i] = n.y, l->p[5][i] = n.z;
    l->unit[0][i] = flux.r, l->unit[1][i] = flux.g, l->unit[2][i] = flux.b;
}

static double dot(struct lum_vec3 a, struct lum_vec3 b)
{
    return (double)a.x * (double)b.x + (double)a.y * (double)b.y + (double)a.z * (double)b.z;
}

static double bounded_term(struct lum_bound b, struct lum_vec3 v, struct lum_vec3 nv, struct lum_vec3 p,
                           struct lum_vec3 n)
{
    struct lum_vec3 d = lum_v3_sub(v, p);
    double r2 = dot(d, d), r = sqrt(r2), m = (double)b.min_distance;
    double cosines = fmax(0.0, dot(d, n) / r) * fmax(0.0, -dot(d, nv) / r), x;
    switch (b.kind) {
    case LUM_BOUND_NONE:
        return cosines / r2;
    case LUM_BOUND_THESIS:
        x = fmin(fmax((r - 0.8 * m) / (0.4 * m), 0.0), 1.0);
        return cosines / r2 * (3 * x * x - 2 * x * x * x);
    case LUM_BOUND_CLAMP:
        return fmin(cosines / r2, 1.0 / (m * m));
    case LUM_BOUND_SMOOTH:
        return cosines / (r2 + m * m);
    }
    return 0.0;
}

static struct lum_vec3 random_unit(struct rng *r)
{
    double z = 2.0 * rng_unit(r) - 1.0, s = sqrt(1.0 - z * z), phi = 2.0 * LUM_PI_D * rng_unit(r);
    return lum_v3((float)(s * cos(phi)), (float)(s * sin(phi)), (float)z);
}

static struct lum_vec3 random_place(struct rng *r)
{
    return lum_v3((float)(4.0 * rng_unit(r) - 2.0), (float)(4.0 * rng_unit(r) - 2.0), (float)(4.0 * rng_unit(r) - 2.0));
}

static void bounds_follow_their_formulas(void **state)
{
    (void)state;
    struct rig r;
    rig_begin(&r, 1);
    rig_commit(&r);
    struct rng random = {5};
    for (int kind = LUM_BOUND_NONE; kind <= LUM_BOUND_SMOOTH; kind++)
        for (int round = 0; round < 20; round++) {
            struct lum_bound bound = {(enum lum_bound_kind)kind, round % 4 == 3 ? 4.0f : 1.5f};
            struct loose l;
            loose_init(&l);
            for (uint32_t i = 0; i < 16; i++)
                loose_put(&l, i, random_place(&random), random_unit(&random), lum_rgb(1.0f, 2.0f, 0.5f * (float)i));
            struct lum_gather_points pts = {0};
            for (int i = 0; i < 256; i++)
                vpls_add_point(&pts, random_place(&random), random_unit(&random));
            struct lum_rgb e[LUM_RAY_BATCH];
            vpls_gather(&r, &l.set, bound, &pts, e);
            for (uint32_t i = 0; i < 256; i++) {
                double want[3] = {0}, size = 0.0;
                for (uint32_t k = 0; k < 16; k++) {
                    struct lum_vec3 v = {l.p[0][k], l.p[1][k], l.p[2][k]}, nv = {l.p[3][k], l.p[4][k], l.p[5][k]};
                    double term = bounded_term(bound, v, nv, pts.p[i], pts.n[i]) / LUM_PI_D,
                           d2 = dot(lum_v3_sub(v, pts.p[i]), lum_v3_sub(v, pts.p[i]));
                    want[0] += term, want[1] += 2.0 * term, want[2] += 0.5 * k * term;
                    size += 8.0 / d2; /* rounding is relative to the term without its cosines */
                }
                double got[3] = {(double)e[i].r, (double)e[i].g, (double)e[i].b};
                for (int c = 0; c < 3; c++)
                    if (!(fabs(got[c] - want[c]) < 32.0 * 0x1p-23 * size)) /* some twenty float operations */
                        fail_msg("kind %d point %u: %g, expected %g", kind, i, got[c], want[c]);
            }
        }
    rig_end(&r);
}

/* VPLs on the very point, a hair away, behind, in its plane. */
static void nearness_is_finite(void **state)
{
    (void)state;
    struct rig r;
    rig_begin(&r, 1);
    rig_commit(&r);
    static const float nears[] = {0.0f, 1e-38f, 1e-30f, 1e-20f, 1e-12f, 1e-7f, 1e-5f, 1e-4f, 1e-3f};
    static const struct lum_vec3 normals[] = {{0, 1, 0}, {0, -1, 0}, {1, 0, 0}, {0.6f, -0.8f, 0}};
    for (int kind = LUM_BOUND_NONE; kind <= LUM_BOUND_SMOOTH; kind++)
        for (size_t k = 0; k < LUM_ARRAY_LEN(nears); k++)
            for (size_t n = 0; n < LUM_ARRAY_LEN(normals); n++)
                for (int zero_bound = 0; zero_bound < 2; zero_bound++) {
                    struct loose l;
                    loose_init(&l);
                    loose_put(&l, 0, lum_v3(0, nears[k], 0), normals[n], lum_grey(0x1p64f));
                    loose_put(&l, 1, lum_v3(nears[k], 0, 0), normals[n], lum_grey(1.0f));
                    struct lum_gather_points pts = {0};
                    vpls_add_point(&pts, lum_v3(0, 0, 0), lum_v3(0, 1, 0));
                    struct lum_rgb e[1];
                    uint64_t rays = vpls_gather(
                        &r, &l.set, (struct lum_bound){(enum lum_bound_kind)kind, zero_bound ? 0.0f : 0.1f}, &pts, e);
                    assert_true(e[0].g >= 0.0f && rays <= 1);
                    if (normals[n].y > 0.0f || nears[k] == 0.0f) /* faces away, or gives no direction */
                        assert_true(e[0].g == 0.0f && rays == 0);
                }
    rig_end(&r);
}

/* However the points are split into calls: the same bits, the same rays. */
static void calls_may_be_split(void **state)
{
    (void)state;
    struct rig r;
    rig_begin(&r, 1);
    rig_room(&r);
    rig_bulb(&r, "bulb", rig_v(0, 2.5, 0), 100);
    rig_commit(&r);
    struct vpls v = {.n = 61, .max_bounces = 4};
    vpls_update(&v, &r);
    struct rng random = {9};
    static struct lum_gather_points all, part;
    all.n_points = 0;
    for (int i = 0; i < 256; i++) /* everywhere, inside the crate too; shading normals tilted */
        vpls_add_point(
            &all,
            rig_to_scene(&r, 3.8 * rng_unit(&random) - 1.9, 3.0 * rng_unit(&random), 3.8 * rng_unit(&random) - 1.9),
            random_unit(&random));
    for (int i = 0; i < 256; i++)
        all.n[i] = lum_normalize(lum_v3_mad(all.ng[i], random_unit(&random), 0.3f));
    uint32_t slots[61];
    for (uint32_t i = 0; i < 61; i++)
        slots[i] = 60 - i;
    const uint32_t sizes[] = {256, 255, 100, 16, 7, 1};
    struct lum_rgb first[LUM_RAY_BATCH];
    uint64_t first_rays = 0;
    uint32_t n_missed = 0;
    for (size_t k = 0; k < LUM_ARRAY_LEN(sizes); k++) {
        struct lum_rgb e[LUM_RAY_BATCH] = {{0}};
        uint16_t missed[LUM_RAY_BATCH] = {0};
        struct lum_counters counters = {0};
        for (uint32_t at = 0; at < 256; at += part.n_points) {
            part.n_points = 256 - at < sizes[k] ? 256 - at : sizes[k];
            memcpy(part.p, all.p + at, part.n_points * sizeof part.p[0]);
            memcpy(part.n, all.n + at, part.n_points * sizeof part.n[0]);
            memcpy(part.ng, all.ng + at, part.n_points * sizeof part.ng[0]);
            struct lum_gather job = {.snapshot = r.snapshot,
                                     .set = &v.set,
                                     .slots = slots,
                                     .n_slots = 61,
                                     .points = &part,
                                     .irradiance = e + at,
                                     .missed = missed + at,
                                     .counters = &counters};
            lum_vpl_gather(&job);
        }
        uint32_t total_missed = 0;
        for (int i = 0; i < 256; i++) {
            total_missed += missed[i];
            assert_in_range(missed[i], 0, 61);
        }
        if (k == 0) {
            memcpy(first, e, sizeof e);
            first_rays = counters.rays[LUM_RAY_INDIRECT_DIFFUSE];
            n_missed = total_missed;
        }
        assert_memory_equal(first, e, sizeof e);
        assert_int_equal(counters.rays[LUM_RAY_INDIRECT_DIFFUSE], first_rays);
        assert_int_equal(total_missed, n_missed);
    }
    assert_true(n_missed > 0 && n_missed < first_rays);
    lum_vpl_finish(&v.set);
    rig_end(&r);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(bounds_follow_their_formulas),
        cmocka_unit_test(nearness_is_finite),
        cmocka_unit_test(calls_may_be_split),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

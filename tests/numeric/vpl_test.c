/* Virtual point lights against closed forms, and what an edit may move. */
#include "tests/support/rig.h"

#include "core/render/frame.h"
#include "core/vpl/vpl.h"

struct vpls {
    struct lum_vpl_set set;
    struct lum_counters counters;
    uint32_t n, max_bounces, seed;
};

static void update(struct vpls *v, const struct rig *r)
{
    struct lum_vpl_request rq = {r->snapshot, v->n, v->max_bounces, v->seed, r->pool, &v->counters};
    memset(&v->counters, 0, sizeof v->counters);
    RIG_OK(lum_vpl_update(&v->set, &rq, &err));
    assert_int_equal(v->counters.nonfinite, 0);
    assert_int_equal(v->counters.bad_rays, 0);
}

/* Sum of the flux of bounce b's slots, green. */
static double flux_of_slots(const struct vpls *v, uint32_t first, uint32_t n)
{
    double sum = 0.0;
    for (uint32_t i = first; i < first + n; i++)
        sum += (double)v->set.flux[1][i];
    return sum;
}

/* A closed box with albedo rho and a light inside: bounce k's VPLs carry Phi rho^k, exactly: nothing escapes. */
static void flux_falls_by_albedo(void **state)
{
    (void)state;
    struct rig r;
    rig_begin(&r, 2);
    struct lum_material_desc m = rig_diffuse(0.5f);
    rig_material(&r, "wall", &m);
    rig_box(&r, "box", 1, 1.5, 2);
    rig_object(&r, "box", "box", "wall", rig_v(0, 0, 0));
    struct lum_light_desc l = rig_point(rig_v(0.3, 0.2, 0.1), 100);
    rig_light(&r, "bulb", &l);
    rig_commit(&r);
    struct vpls v = {.n = 256, .max_bounces = 9};
    update(&v, &r);
    double scale = r.snapshot->norm.scale, phi = 400.0 * LUM_PI_D * scale * scale;
    for (uint32_t b = 0, first = 0, n = 128; b < 8; b++, first += n, n /= 2) {
        double got = flux_of_slots(&v, first, n), want = phi * pow(0.5, b + 1.0);
        if (!(fabs(got / want - 1.0) < 1e-5)) /* 2^-24 for each product of the path and of the weight */
            fail_msg("bounce %u: %g, expected %g", b, got, want);
    }
    assert_int_equal(v.set.n_lit, 256);
    print_message("spacing %g, rays %llu\n", (double)v.set.spacing, (unsigned long long)v.counters.rays[LUM_RAY_VPL]);
    lum_vpl_finish(&v.set);
    rig_end(&r);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(flux_falls_by_albedo),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

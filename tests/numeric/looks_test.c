/* Light paths that begin with a look out of a portal, and those that are aimed at one (core/vpl/walk.h). */
#include "tests/support/vpls.h"

#include "core/light/emit.h"
#include "core/light/portals.h"
#include "core/light/sample.h"
#include "core/math/warp.h"
#include "core/vpl/share.h"
#include "tests/numeric/stats.h"
#include "tests/support/effort.h"

/* ---- which way a point outside is to aim ---- */

/* A box whose face at z = 1 is open. */
static struct lum_portals open_face(void)
{
    struct lum_portals o;
    lum_portals_cut(&o, lum_v3(-1, -0.5f, -1), lum_v3(1, 0.5f, 1), 8);
    uint32_t first = 5 * lum_portals_per_face(&o);
    for (uint32_t i = 0; i < o.along[0]; i++)
        for (uint32_t j = 0; j < o.along[1]; j++)
            assert_true(lum_portals_open(&o, first + j * o.side + i));
    lum_portals_sort(&o);
    return o;
}

/* Of the rectangle |x| < a, |y| < b at distance d, seen from above its centre. */
static double solid_angle(double a, double b, double d)
{
    return 4.0 * atan(a * b / (d * sqrt(a * a + b * b + d * d)));
}

/* What is drawn has the density that its direction is said to have, so that the mean of 1 / density is the solid angle
 * of all that is open; and chances add up to 1. */
static void aims_fill_what_is_open(void **state)
{
    (void)state;
    const struct lum_portals o = open_face();
    const struct lum_vec3 normals[] = {{0, 0, -1}, {0.6f, 0, -0.8f}, {0, 0, 1}};
    for (size_t k = 0; k < LUM_ARRAY_LEN(normals); k++) {
        const struct lum_vec3 p = {0, 0, 2.5f};
        struct lum_portals_seen seen;
        lum_portals_see(&o, p, normals[k], &seen);
        double chances = 0.0;
        for (uint32_t i = 0; i < o.n; i++)
            chances += (double)lum_portals_chance(&o, &seen, o.cell[i]);
        assert_true(fabs(chances - 1.0) < 1e-5); /* rounding of 64 floats */
        struct mean per_density = {0};
        struct rng random = {k};
        for (int i = 0; i < 20000; i++) {
            struct lum_vec3 d;
            struct lum_portal_hit hit;
            struct lum_vec2 u = {(float)(rng_u64(&random) >> 40) * 0x1p-24f,
                                 (float)(rng_u64(&random) >> 40) * 0x1p-24f};
            assert_true(lum_portals_aim(&o, &seen, p, u, &d, &hit));
            double pdf = (double)lum_portals_aim_pdf(&o, &seen, p, d);
            assert_true(pdf > 0.0);
            mean_add(&per_density, 1.0 / pdf);
        }
        double want = solid_angle(1.0, 0.5, 1.5), err = mean_stderr(&per_density);
        /* a line at a cell's edge may be taken to enter by the one beside it: of 20,000 a few */
        if (!(fabs(per_density.mean - want) < 4.0 * err + 1e-3 * want))
            fail_msg("normal %zu: %g +- %g sr, %g are open", k, per_density.mean, err, want);
    }
}

static void from_inside_and_behind_nothing_is_aimed_at(void **state)
{
    (void)state;
    const struct lum_portals o = open_face();
    const struct lum_vec3 places[] = {{0, 0, 0}, {0, 0, -2}, {3, 0, 0.5f}};
    for (size_t k = 0; k < LUM_ARRAY_LEN(places); k++) {
        struct lum_portals_seen seen;
        struct lum_portal_hit hit;
        struct lum_vec3 d;
        lum_portals_see(&o, places[k], lum_v3(0, 0, 1), &seen);
        assert_true(seen.all == 0.0f);
        assert_false(lum_portals_aim(&o, &seen, places[k], (struct lum_vec2){0.5f, 0.5f}, &d, &hit));
        assert_true(lum_portals_chance(&o, &seen, o.cell[0]) == 0.0f);
    }
}

/* ---- a room, and a yard before its window ---- */

static void put_box(struct rig *r, int i, const double *w)
{
    char id[8];
    snprintf(id, sizeof id, "box-%d", i);
    rig_box(r, id, 0.5 * (w[3] - w[0]), 0.5 * (w[4] - w[1]), 0.5 * (w[5] - w[2]));
    rig_object(r, id, id, "white", rig_v(0.5 * (w[0] + w[3]), 0.5 * (w[1] + w[4]), 0.5 * (w[2] + w[5])));
}

/* 6 x 3 x 6 m, with a window of 2.4 x 1.6 m in the wall at z = -3; outside 8 x 5 m of ground, and a wall across. */
static void yard_begin(struct rig *r, const struct lum_light_desc *light)
{
    static const double box[][6] = {
        {-3, -0.1, -3, 3, 0, 3},         {-3, 3, -3, 3, 3.1, 3},           {-3.1, -0.1, -3, -3, 3.1, 3},
        {3, -0.1, -3, 3.1, 3.1, 3},      {-3.1, -0.1, 3, 3.1, 3.1, 3.1},   {-3.1, -0.1, -3.1, -1.2, 3.1, -3},
        {1.2, -0.1, -3.1, 3.1, 3.1, -3}, {-1.2, -0.1, -3.1, 1.2, 0.8, -3}, {-1.2, 2.4, -3.1, 1.2, 3.1, -3},
        {-4, -0.3, -8.5, 4, -0.2, -3.5}, {-4, -0.3, -8.7, 4, 1, -8.5}};
    rig_begin(r, 2);
    struct lum_material_desc white = rig_diffuse(0.7f);
    rig_material(r, "white", &white);
    for (size_t i = 0; i < LUM_ARRAY_LEN(box); i++)
        put_box(r, (int)i, box[i]);
    rig_light(r, "afar", light);
    rig_commit(r);
}

/* What the VPLs of a level inside send out. */
static double inside(const struct rig *r, const struct lum_vpl_set *set, const struct lum_vpl_plan *plan,
                     uint32_t level)
{
    const struct lum_vec3 lo = rig_to_scene(r, -3.01, -0.01, -3.0), hi = rig_to_scene(r, 3.01, 3.01, 3.01);
    uint32_t first, n = lum_vpl_plan_run(plan, 0, level, &first);
    double flux = 0.0;
    for (uint32_t i = first; i < first + n; i++)
        if (set->px[i] > lo.x && set->px[i] < hi.x && set->py[i] > lo.y && set->py[i] < hi.y && set->pz[i] > lo.z &&
            set->pz[i] < hi.z)
            flux += (double)set->flux_unit[1][i];
    return flux;
}

enum { LEVELS = 3, SEEDS = 24 };

static void measure(const struct rig *r, uint32_t n, uint32_t tries, struct mean ret[LEVELS])
{
    for (uint32_t seed = 1; seed <= (TEST_TELLS ? SEEDS : 1); seed++) {
        struct vpls v = {.n = n, .max_bounces = 6, .seed = seed, .tries = tries};
        vpls_update(&v, r);
        assert_int_equal(v.set.portals.n > 0, tries > 1);
        struct lum_vpl_plan plan;
        lum_vpl_plan_init(&plan, &v.set);
        for (uint32_t level = 0; level < LEVELS; level++)
            mean_add(&ret[level], inside(r, &v.set, &plan, level));
        lum_vpl_finish(&v.set);
    }
}

/* Paths by looks, by aims and otherwise bring as much inside, at each bounce, as paths that know of no portals; and are
 * a better estimate, of a fraction as many. */
static void as_much_comes_in(void **state)
{
    (void)state;
    const struct lum_light_desc lights[] = {
        {.kind = &lum_light_kind_environment, .color = lum_grey(1), .intensity = 1, .on = true},
        {.kind = &lum_light_kind_sky,
         .color = lum_grey(1),
         .intensity = 1,
         .cie_type = 1,
         .ground_albedo = 0.2,
         .on = true},
        {.kind = &lum_light_kind_directional,
         .color = lum_grey(1),
         .intensity = 1,
         .direction = {0.1, -1, -0.7},
         .on = true},
        {.kind = &lum_light_kind_directional,
         .color = lum_grey(1),
         .intensity = 1,
         .direction = {0.3, -1, -0.2},
         .diameter_rad = 0.2,
         .on = true},
    };
    for (size_t k = 0; k < LUM_ARRAY_LEN(lights); k++) {
        struct rig r;
        struct mean with[LEVELS] = {0}, without[LEVELS] = {0};
        yard_begin(&r, &lights[k]);
        measure(&r, 2048, 8, with);
        measure(&r, 32768, 1, without);
        for (uint32_t level = 0; level < LEVELS && TEST_TELLS; level++) {
            double e1 = mean_stderr(&with[level]), e2 = mean_stderr(&without[level]);
            print_message("light %zu, bounce %u: %g +- %g by portals, %g +- %g without\n", k, level, with[level].mean,
                          e1, without[level].mean, e2);
            /* 12 comparisons: 4 deviations are met by chance once in 1300 runs; choose.c scales what it chooses, which
             * is off by less than 1 % where there are as many slots as here */
            if (!(fabs(with[level].mean - without[level].mean) <=
                  4.0 * sqrt(e1 * e1 + e2 * e2) + 0.01 * without[level].mean))
                fail_msg("light %zu, bounce %u: %g +- %g by portals, %g +- %g without", k, level, with[level].mean, e1,
                         without[level].mean, e2);
        }
        rig_end(&r);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(aims_fill_what_is_open),
        cmocka_unit_test(from_inside_and_behind_nothing_is_aimed_at),
        cmocka_unit_test(as_much_comes_in),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

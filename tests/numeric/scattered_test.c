/* Light of surfaces and of other fog that fog scatters to the eye, in first frames of `live`: what is drawn stands for
 * all, in closed rooms of even light fog does not show, path is right, and a dimmed light is no ray.
 *
 * Means of pictures over seeds, to four standard errors and 3 %, which is what a first frame may be off by. */
#include "core/vpl/air.h"
#include "core/vpl/lifted.h"
#include "tests/numeric/fog.h"
#include "tests/support/effort.h"
#include "tests/support/vpls.h"

#define SEEDS TEST_EFFORT(24)

/* ---- draws ---- */

/* What one VPL brings, in double: importance apart. */
static double term_of(const struct lum_vpl_set *set, uint32_t k, const struct lum_vpl_air *at)
{
    double d[3] = {(double)at->p.x - (double)set->px[k], (double)at->p.y - (double)set->py[k],
                   (double)at->p.z - (double)set->pz[k]};
    double n[3] = {(double)set->nx[k], (double)set->ny[k], (double)set->nz[k]};
    double d2 = d[0] * d[0] + d[1] * d[1] + d[2] * d[2], h = d[0] * n[0] + d[1] * n[1] + d[2] * n[2];
    double m = fmax((double)(LUM_VPL_LIFT * set->radius[k]), (double)LUM_POINT_LIGHT_NEAR), r = sqrt(d2);
    if (!(h > 0.0))
        return 0.0;
    m = fmin(m, 0.1 / (double)at->sigma_t);
    double rise = m * m * m * m / (h * h + m * m), r2 = d2 + rise, b = sqrt(h * h + rise);
    double cosine = (d[0] * (double)at->to.x + d[1] * (double)at->to.y + d[2] * (double)at->to.z) / r;
    double g = (double)at->g, phase = (1.0 - g * g) / pow(1.0 + g * g - 2.0 * g * cosine, 1.5) / (4.0 * PI);
    return b / (r2 * sqrt(r2)) * (1.0 + (double)set->gain[k] * rise / r2) * phase / PI;
}

/* Over u in even steps a draw counts each VPL as often as its chance says, but for one step of each: n VPLs of some
 * 500 that are drawn 8 at a time are off by no more than 500 / (8 STEPS), and the float sums by less. */
#define STEPS TEST_EFFORT(16384)
static void draws_stand_for_all(void **state)
{
    (void)state;
    struct rig r;
    rig_begin(&r, 0);
    rig_room(&r);
    rig_bulb(&r, "bulb", rig_v(0, 2, 0.3), 100);
    struct lum_medium_desc fog = fog_everywhere(0.3f, 0.02f, 0.2f);
    put_fog(&r, "fog", &fog);
    rig_commit(&r);
    struct vpls v = {.n = 512, .max_bounces = 63, .media = true, .scatters = true, .tries = 8};
    vpls_update(&v, &r);
    const float gs[] = {0.0f, -0.5f, 0.9f};
    const struct lum_vec3 at[] = {rig_to_scene(&r, 0, 1.5, 0), rig_to_scene(&r, 1.9, 0.01, -1.9),
                                  rig_to_scene(&r, -1, 2.9, 1.2)};
    for (size_t i = 0; i < LUM_ARRAY_LEN(gs) * LUM_ARRAY_LEN(at); i++) {
        struct lum_vpl_air air = {at[i / 3], lum_normalize(lum_v3(0.3f, -0.2f, 0.8f)), gs[i % 3], 0.32f};
        double want = 0.0, sum = 0.0, most = 0.0;
        for (uint32_t k = 0; k < v.set.n_bounced; k++) {
            double part = term_of(&v.set, k, &air);
            want += part * (double)v.set.flux[1][k];
            most = fmax(most, (double)(v.set.flux[1][k] / fmaxf(v.set.importance[k], 1e-30f)));
        }
        double reach = 0.0;
        for (uint32_t k = 0; k < v.set.n_bounced; k++)
            reach += term_of(&v.set, k, &air) * (double)v.set.importance[k];
        for (uint32_t j = 0; j < STEPS; j++) {
            struct lum_vpl_air_draw draws[8];
            uint32_t n = lum_vpl_air_draw(&v.set, &air, 8, ((float)j + 0.5f) / STEPS, draws);
            assert_in_range(n, 1, 8);
            for (uint32_t k = 0; k < n; k++)
                sum += (double)(draws[k].weight * v.set.flux[1][draws[k].slot]) / STEPS;
        }
        double off = most * reach / 8.0 / STEPS * v.set.n_bounced + 1e-4 * want;
        print_message("point %zu, g %g: %.6g, all of them %.6g +- %.2g\n", i / 3, (double)air.g, sum, want, off);
        assert_true(off < 0.1 * want || !TEST_TELLS); /* or it says nothing */
        if (TEST_TELLS && !(fabs(sum - want) <= off))
            fail_msg("point %zu, g %g: %.8g, not %.8g", i / 3, (double)air.g, sum, want);
    }
    struct lum_vpl_air_draw none[4];
    struct lum_vpl_set empty = {0};
    struct lum_vpl_air air = {at[0], lum_v3(0, 0, 1), 0, 0.3f};
    assert_int_equal(lum_vpl_air_draw(&empty, &air, 4, 0.5f, none), 0);
    lum_vpl_finish(&v.set);
    rig_end(&r);
}

/* ---- pictures ---- */

struct estimate {
    double mean, stderr;
};

static struct estimate estimate_of(double sum, double square, uint32_t n)
{
    double mean = sum / n;
    return (struct estimate){mean, sqrt(fmax(0.0, square / n - mean * mean) / (n - 1))};
}

static struct estimate by_first_frames(struct rig *r)
{
    double sum = 0.0, square = 0.0;
    r->settings.method = lum_method_find("live");
    r->settings.max_spp = 1;
    for (uint32_t seed = 0; seed < SEEDS; seed++) {
        r->settings.seed = seed;
        rig_fresh_view(r);
        rig_pass(r);
        double g = (double)rig_mean(r).g;
        sum += g;
        square += g * g;
    }
    return estimate_of(sum, square, SEEDS);
}

static struct estimate by_paths(struct rig *r, uint32_t passes)
{
    double before = 0.0, sum = 0.0, square = 0.0;
    r->settings.method = lum_method_find("path");
    r->settings.max_spp = passes;
    rig_fresh_view(r);
    for (uint32_t i = 1; i <= passes; i++) {
        rig_pass(r);
        double total = (double)rig_mean(r).g * i, pass = total - before;
        before = total;
        sum += pass;
        square += pass * pass;
    }
    return estimate_of(sum, square, passes);
}

static void set_picture(struct rig *r)
{
    r->settings.antialias = false;
    r->settings.w = 48;
    r->settings.h = 32;
}

static void check(const char *what, struct estimate live, double want, double want_error)
{
    double error = hypot(live.stderr, want_error);
    print_message("%s: %.4f +- %.4f, not %.4f +- %.4f\n", what, live.mean, live.stderr, want, want_error);
    assert_true(error < 0.04 * want || !TEST_TELLS); /* or it says little */
    if (TEST_TELLS && !(fabs(live.mean - want) <= 4.0 * error + 0.03 * want))
        fail_msg("%s: %.5f, not %.5f", what, live.mean, want);
}

/* Light that is the same from everywhere, 1, is that in fog, too, if it only scatters. */
static void fog_in_a_furnace(void **state)
{
    (void)state;
    const float sigmas[] = {0.1f, 1.0f}, gs[] = {0.0f, 0.5f, -0.5f};
    for (size_t i = 0; i < LUM_ARRAY_LEN(sigmas) * LUM_ARRAY_LEN(gs); i++) {
        struct rig r;
        rig_begin(&r, 2);
        rig_furnace(&r, 1, 0.5f, 0.5);
        rig_camera(&r, rig_v(0.2, 0.1, 0.6), rig_v(-0.3, -0.2, -1), 80);
        struct lum_medium_desc fog = fog_everywhere(sigmas[i / 3], 0, gs[i % 3]);
        put_fog(&r, "fog", &fog);
        rig_commit(&r);
        set_picture(&r);
        char what[64];
        snprintf(what, sizeof what, "%g/m, g %g", (double)sigmas[i / 3], (double)gs[i % 3]);
        check(what, by_first_frames(&r), 1.0, 0.0);
        rig_end(&r);
    }
}

/* A black wall behind fog in a lit room: all light of the picture comes from the fog. The lamp is out of sight, and a
 * screen keeps its light off the fog that is seen, so that surfaces and other fog light it. */
static void begin_dark(struct rig *r, int i)
{
    rig_begin(r, 2);
    rig_room(r);
    rig_box(r, "board", 1.5, 1.2, 0.02);
    rig_diffuse_object(r, "board", "black", 0.0f, rig_v(0, 1.5, -1.7));
    rig_box(r, "screen", 1.9, 0.02, 0.8);
    rig_diffuse_object(r, "screen", "grey", 0.5f, rig_v(0, 2.2, -1.1));
    rig_bulb(r, "bulb", rig_v(0.2, 2.7, -0.5), 100);
    struct lum_medium_desc fog = fog_everywhere(0.2f, 0.02f, 0.0f),
                           cloud = fog_box(1, 0.1f, rig_v(-1, 1, -1.5), rig_v(1, 2, -0.5));
    fog.g = i == 1 ? 0.6f : 0.0f;
    cloud.g = -0.3f;
    if (i != 2)
        put_fog(r, "fog", &fog);
    if (i >= 2)
        put_fog(r, "cloud", &cloud);
    rig_commit(r);
    rig_camera(r, rig_v(0, 1.5, 1.6), rig_v(0, 1.5, -1.7), 36);
    set_picture(r);
}

static void fog_before_a_board(void **state)
{
    (void)state;
    const char *const what[] = {"fog", "fog that scatters on", "a cloud", "a cloud in fog"};
    for (int i = 0; i < 4; i++) {
        struct rig r;
        begin_dark(&r, i);
        struct estimate path = by_paths(&r, TEST_EFFORT(96));
        check(what[i], by_first_frames(&r), path.mean, path.stderr);
        rig_end(&r);
    }
}

/* Nothing but a cloud scatters light, and no surface passes any on: a bulb, a black floor, no sky. Tiles at
 * its outline have pixels that see no fog, among them their deepest. */
static void begin_cloud(struct rig *r)
{
    rig_begin(r, 2);
    rig_box(r, "floor", 3, 0.5, 3);
    rig_diffuse_object(r, "floor", "black", 0.0f, rig_v(0, -0.5, 0));
    rig_bulb(r, "bulb", rig_v(2, 3, 5), 1000);
    struct lum_medium_desc cloud = fog_box(1.5f, 0.01f, rig_v(-1.5, 0.7, -1.5), rig_v(1.5, 2.2, 1.5));
    put_fog(r, "cloud", &cloud);
    rig_commit(r);
    rig_camera(r, rig_v(0, 1.4, 6.4), rig_v(0, 1.2, 0), 39);
    set_picture(r);
    r->settings.w = 144;
    r->settings.h = 96;
}

static void cloud_before_nothing(void **state)
{
    (void)state;
    struct rig r;
    begin_cloud(&r);
    struct estimate path = by_paths(&r, TEST_EFFORT(96));
    check("a cloud before nothing", by_first_frames(&r), path.mean, path.stderr);
    rig_end(&r);
}

/* What a tile's points saw of an earlier set of VPLs is forgotten with it, all of it. */
static void fewer_vpls(void **state)
{
    (void)state;
    struct rig r;
    begin_cloud(&r);
    r.settings.method = lum_method_find("live");
    r.settings.max_spp = 1;
    r.settings.n_vpls = 1024;
    for (int i = 0; i < 6; i++) {
        rig_camera(&r, rig_v(0.4 * i, 1.4, 6.4), rig_v(0, 1.2, 0), 39);
        rig_pass(&r);
    }
    r.settings.n_vpls = 1;
    rig_pass(&r);
    rig_assert_as_fresh(&r, "fewer");
    rig_end(&r);
}

/* ---- edits ---- */

/* A room with nothing between its lamps and the fog that is seen: single scattering is then as in a fresh view, too,
 * bit for bit (core/effect/fog/airlight.h). What stands in it is behind the eye. */
static void begin_plain(struct rig *r)
{
    rig_begin(r, 2);
    rig_room(r);
    rig_object(r, "crate", "crate", "red", rig_v(0.5, 0.5, 1.4));
    rig_bulb(r, "bulb", rig_v(1.2, 2.4, -0.9), 100);
    rig_camera(r, rig_v(0, 1.5, 0.6), rig_v(0, 1.5, -1.7), 40);
    struct lum_medium_desc fog = fog_everywhere(0.2f, 0.02f, 0.3f);
    put_fog(r, "fog", &fog);
    set_picture(r);
    r->settings.method = lum_method_find("live");
    r->settings.max_spp = 1;
}

static void dimmed_without_a_ray(void **state)
{
    (void)state;
    struct rig r;
    begin_plain(&r);
    rig_commit(&r);
    struct lum_pass_stats stats = rig_pass(&r);
    assert_true(stats.rays[LUM_RAY_SCATTERING] > 0);
    rig_bulb(&r, "bulb", rig_v(1.2, 2.4, -0.9), 30);
    rig_commit(&r);
    stats = rig_pass(&r);
    assert_int_equal(rig_all_rays(&stats), 0);
    rig_assert_as_fresh(&r, "dimmed");
    rig_end(&r);
}

/* Light paths become others, though nothing but a power changed; then something moves. */
static void lit_for_the_first_time(void **state)
{
    (void)state;
    struct rig r;
    begin_plain(&r);
    struct lum_light_desc lamp = rig_point(rig_v(-1.2, 2.4, -0.9), 50);
    lamp.on = false;
    rig_light(&r, "lamp", &lamp);
    rig_commit(&r);
    rig_pass(&r);
    lamp.on = true;
    rig_light(&r, "lamp", &lamp);
    rig_commit(&r);
    rig_pass(&r);
    rig_assert_as_fresh(&r, "lit");
    rig_object(&r, "crate", "crate", "red", rig_v(-0.5, 0.5, 1.4));
    rig_commit(&r);
    rig_pass(&r);
    rig_assert_as_fresh(&r, "moved");
    r.settings.effects_off = LUM_EFFECT_BIT(LUM_EFFECT_SCATTERING);
    struct lum_pass_stats stats = rig_pass(&r);
    assert_int_equal(stats.rays[LUM_RAY_SCATTERING], 0);
    rig_assert_as_fresh(&r, "without");
    rig_end(&r);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(draws_stand_for_all),
        cmocka_unit_test(fog_in_a_furnace),
        cmocka_unit_test(fog_before_a_board),
        cmocka_unit_test(cloud_before_nothing),
        cmocka_unit_test(fewer_vpls),
        cmocka_unit_test(dimmed_without_a_ray),
        cmocka_unit_test(lit_for_the_first_time),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

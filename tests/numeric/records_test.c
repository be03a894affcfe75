/* Records of a view: every point is served, the picture does not depend on who did the work, and nothing is done twice.
 * Records are closed forms (tests/support/closed_kind.h), so what pixels interpolate can be told. */
#include "core/effect/indirect/tile_points.h"
#include "tests/support/closed_kind.h"
#include "tests/support/effort.h"
#include "tests/support/rig.h"

/* White walls, so that pixels show irradiance / pi times 3/4 (rig_room). The light is there to call for indirect light;
 * the method leaves out what it gives directly. */
static void furnish(struct rig *r, const struct lum_method *method)
{
    rig_room(r);
    struct lum_light_desc bulb = rig_point(rig_v(-1, 2.2, 0.5), 100);
    rig_light(r, "bulb", &bulb);
    rig_commit(r);
    r->settings.method = method;
    r->settings.w = 120;
    r->settings.h = 80;
}

static void move_crate(struct rig *r, double x)
{
    rig_object(r, "crate", "crate", "red", rig_v(x, 0.5, -0.4));
    rig_commit(r);
}

/* Three cameras and an edit, so that records are reused, added and refreshed; the pictures one after the other. */
enum { N_PICTURES = 4 };
static void render_all(struct rig *r, struct lum_rgb *ret_pictures[N_PICTURES])
{
    for (int k = 0; k < N_PICTURES; k++) {
        rig_camera(r, rig_v(-0.3 + 0.2 * k, 1.4, 1.8), rig_v(0.2 - 0.1 * k, 0.9, -0.5), 60);
        if (k == 2)
            move_crate(r, 0.45);
        rig_pass(r);
        ret_pictures[k] = rig_picture(r);
    }
}

static void any_number_of_threads(const struct lum_method *method)
{
    static const uint32_t threads[] = {1, 7, 2, 3, 16};
    struct lum_rgb *first[N_PICTURES] = {NULL};
    for (size_t t = 0; t < 1 + TEST_EFFORT(LUM_ARRAY_LEN(threads) - 1); t++) {
        struct rig r;
        struct lum_rgb *pictures[N_PICTURES];
        rig_begin(&r, threads[t]);
        furnish(&r, method);
        render_all(&r, pictures);
        for (int k = 0; k < N_PICTURES; k++) {
            size_t bytes = (size_t)r.settings.w * r.settings.h * sizeof(struct lum_rgb);
            if (t > 0 && memcmp(first[k], pictures[k], bytes) != 0)
                fail_msg("%s: picture %d differs between 1 and %u threads", method->cache->name, k, threads[t]);
            if (t > 0)
                lum_free(pictures[k]);
            else
                first[k] = pictures[k];
        }
        rig_end(&r);
    }
    for (int k = 0; k < N_PICTURES; k++)
        lum_free(first[k]);
}

static void the_picture_is_the_same_for_any_number_of_threads(void **state)
{
    (void)state;
    any_number_of_threads(&closed_methods[CLOSED_WAVY]);
    any_number_of_threads(&closed_methods[CLOSED_LINEAR]);
    any_number_of_threads(&closed_methods[CLOSED_STALE]);
    any_number_of_threads(&closed_quarter);
}

/* Every pixel shows the closed form where it looks, to within `error` of it. */
static void check_picture(struct rig *r, enum closed_kind kind, float error)
{
    struct lum_aovs aov;
    RIG_OK(lum_view_aovs(r->view, r->snapshot, &r->settings, &aov, &err));
    for (uint32_t i = 0; i < r->settings.w * r->settings.h; i++) {
        uint32_t x = i % r->settings.w, y = i / r->settings.w;
        struct lum_pick pick;
        lum_pick_at(r->snapshot, &r->settings.camera, r->settings.w, r->settings.h, x + 0.5, y + 0.5, &pick);
        assert_true(pick.hit);
        struct lum_vec3 p = rig_to_scene(r, pick.point_world.x, pick.point_world.y, pick.point_world.z);
        struct lum_rgb want = lum_rgb_mul(closed_irradiance(kind, p, aov.normal_world[i]), aov.albedo[i]);
        struct lum_rgb got = lum_rgb_scale(lum_film_mean(lum_view_film(r->view), x, y), LUM_PI);
        float off = lum_max(fabsf(got.r - want.r), lum_max(fabsf(got.g - want.g), fabsf(got.b - want.b)));
        if (!(off <= error))
            fail_msg("pixel %u,%u: %g %g %g, closed form %g %g %g", x, y, (double)got.r, (double)got.g, (double)got.b,
                     (double)want.r, (double)want.g, (double)want.b);
    }
}

/* A linear field with its gradient is extrapolated exactly, but for the rounding of values of up to 80: 2^-17 a term,
 * some tens of terms, times the albedo. */
static void linear_light_is_exact(void **state)
{
    (void)state;
    struct rig r;
    rig_begin(&r, 2);
    furnish(&r, &closed_methods[CLOSED_LINEAR]);
    rig_pass(&r);
    check_picture(&r, CLOSED_LINEAR, 2e-4f);
    rig_end(&r);
}

/* The light changes by 0.3 a unit, and records reach 1.2; normals here are alike or at right angles. */
static void every_pixel_is_served(void **state)
{
    (void)state;
    struct rig r;
    rig_begin(&r, 2);
    furnish(&r, &closed_methods[CLOSED_WAVY]);
    rig_pass(&r);
    check_picture(&r, CLOSED_WAVY, 0.36f);
    r.settings.method = &closed_quarter;
    rig_pass(&r);
    check_picture(&r, CLOSED_WAVY, 0.36f);
    rig_end(&r);
}

/* Records that reach nobody, not even the next pixel (hard case 28): each pixel gets its own, and nothing is divided by
 * a weight that is next to none. As exact as a linear field with its gradient. */
static void records_that_reach_nobody_serve_all_the_same(void **state)
{
    (void)state;
    struct rig r;
    rig_begin(&r, 2);
    furnish(&r, &closed_methods[CLOSED_POINTS]);
    r.settings.w = 40;
    r.settings.h = 30;
    struct lum_pass_stats stats = rig_pass(&r);
    assert_int_equal(stats.cache.created, 40 * 30);
    check_picture(&r, CLOSED_POINTS, 2e-4f);
    rig_end(&r);
}

/* A gradient that says that light changes by thousands of times itself within a record's reach (hard case 29): what is
 * extrapolated stays within a twentieth and 20 times of what the record says, 0.5 to 3.5 here, times an albedo of 0.05
 * to 0.75. */
static void steep_gradients_do_not_overshoot(void **state)
{
    (void)state;
    struct rig r;
    rig_begin(&r, 2);
    furnish(&r, &closed_methods[CLOSED_STEEP]);
    rig_pass(&r);
    float least = INFINITY, most = 0.0f;
    for (uint32_t i = 0; i < r.settings.w * r.settings.h; i++) {
        struct lum_rgb c = lum_film_mean(lum_view_film(r.view), i % r.settings.w, i / r.settings.w);
        least = lum_min(least, LUM_PI * lum_min(c.r, lum_min(c.g, c.b)));
        most = lum_max(most, LUM_PI * lum_rgb_max(c));
    }
    if (!(least >= 0.05f * 0.5f * 0.05f && most <= 20.0f * 3.5f * 0.75f))
        fail_msg("%g to %g", (double)least, (double)most);
    assert_true(most > 10.0f); /* the gradient was heard */
    rig_end(&r);
}

/* The same picture again makes nothing and allocates nothing; nor does one after lum_view_forget, which finds all
 * records. */
static void a_picture_at_rest_does_nothing(void **state)
{
    (void)state;
    struct rig r;
    rig_begin(&r, 1);
    furnish(&r, &closed_methods[CLOSED_STALE]);
    struct lum_pass_stats first = rig_pass(&r);
    struct lum_rgb *picture = rig_picture(&r);
    (void)first;
    lum_view_forget(r.view);
    lum_alloc_fail_after(1);
    struct lum_pass_stats stats = rig_pass(&r);
    lum_alloc_fail_after(0);
    (void)stats;
    rig_assert_picture(&r, picture, "the same again");
    lum_free(picture);
    rig_end(&r);
}

/* Whatever allocation fails, the pass says so or goes without; the next one makes the picture. */
static void failures_of_memory(void **state)
{
    (void)state;
    struct rig r;
    rig_begin(&r, 1);
    furnish(&r, &closed_methods[CLOSED_WAVY]);
    r.settings.w = r.settings.h = 20;
    rig_pass(&r);
    struct lum_rgb *picture = rig_picture(&r);
    uint32_t n_failed = 0;
    for (uint64_t k = 1; k < 200; k++) {
        struct lum_pass_stats stats;
        struct lum_error err = {0};
        rig_fresh_view(&r);
        lum_alloc_fail_after(k);
        enum lum_status status = lum_view_pass(r.view, r.snapshot, &r.settings, NULL, &stats, &err);
        lum_alloc_fail_after(0);
        n_failed += status != LUM_OK;
        assert_true(status == LUM_OK || err.text[0] != '\0');
        rig_pass(&r);
        rig_assert_picture(&r, picture, "after a failure");
    }
    assert_true(n_failed > 10);
    lum_free(picture);
    rig_end(&r);
}

/* What a kind gets wrong is counted, and does not reach the picture. */
static void broken_records_are_counted(void **state)
{
    (void)state;
    struct rig r;
    struct lum_pass_stats stats;
    rig_begin(&r, 2);
    furnish(&r, &closed_methods[CLOSED_BROKEN]);
    RIG_OK(lum_view_pass(r.view, r.snapshot, &r.settings, NULL, &stats, &err));
    assert_true(stats.nonfinite > 0);
    assert_true(lum_rgb_black(rig_mean(&r)));
    rig_end(&r);
}

/* A record is refreshed at most once for an edit, however many squares look at it. */
static void stale_records_are_refreshed_once(void **state)
{
    (void)state;
    struct rig r;
    rig_begin(&r, 3);
    furnish(&r, &closed_methods[CLOSED_STALE]);
    rig_pass(&r);
    uint64_t before = closed_refreshes();
    move_crate(&r, 0.45);
    rig_pass(&r);
    uint64_t once = closed_refreshes() - before;
    assert_true(once > 50);
    rig_camera(&r, rig_v(-0.3, 1.4, 1.7), rig_v(0.2, 0.9, -0.5), 60); /* sees the same, and less */
    rig_pass(&r);
    assert_true(closed_refreshes() - before <= once + once / 10);
    check_picture(&r, CLOSED_STALE, 0.36f);
    rig_end(&r);
}

/* A view from near by is as exact after one from afar as it would be alone, and both keep what was made for them. Light
 * changes by at most 1 a unit, so that it is off by at most the reach of a record, and as much again for the pixel's
 * own size; all that is seen lies within `far` of the eye. */
static void a_near_view_makes_its_own_records(void **state)
{
    (void)state;
    const struct lum_vec3d target = rig_v(0.43, 0.87, -0.4);
    struct rig r;
    rig_begin(&r, 3);
    furnish(&r, &closed_methods[CLOSED_PIXELS_KIND]);
    const double vfov[] = {100, 12.5, 100, 12.5};
    for (int k = 0; k < 4; k++) {
        rig_camera(&r, rig_v(-0.3, 1.4, 1.8), target, vfov[k]);
        struct lum_pass_stats stats = rig_pass(&r);
        float pixel = 2.0f * tanf(0.5f * (float)vfov[k] * LUM_PI / 180.0f) / (float)r.settings.h;
        float far = 5.0f * (float)r.snapshot->norm.scale;
        check_picture(&r, CLOSED_PIXELS_KIND, (LUM_RECORD_COARSER * CLOSED_PIXELS + 1.0f) * pixel * far);
        if (k < 2)
            assert_true(stats.cache.created > 20);
        else
            assert_int_equal(stats.cache.created, 0);
    }
    rig_end(&r);
}

/* Whoever comes first makes the record: in every storage, for one thread and for many, every pixel gets its light. What
 * one thread does is the same in all of them. */
static void records_are_shared_freely(void **state)
{
    (void)state;
    struct lum_rgb *by_one = NULL;
    for (uint32_t threads = 1; threads <= 7; threads += 6)
        for (int storage = 0; storage < LUM_STORAGE_COUNT; storage++) {
            struct rig r;
            rig_begin(&r, threads);
            r.settings.storage = (enum lum_storage)storage;
            r.settings.deterministic = false;
            furnish(&r, &closed_free);
            struct lum_pass_stats stats = rig_pass(&r);
            assert_true(stats.cache.created > 50);
            assert_int_equal(stats.cache.records, stats.cache.created);
            check_picture(&r, CLOSED_WAVY, 0.36f);
            if (threads == 1 && by_one)
                rig_assert_picture(&r, by_one, lum_storage_names[storage]);
            else if (threads == 1)
                by_one = rig_picture(&r);
            rig_camera(&r, rig_v(-0.3, 1.4, 1.7), rig_v(0.2, 0.9, -0.5), 60);
            stats = rig_pass(&r);
            assert_true(stats.cache.created < stats.cache.records / 10);
            r.settings.deterministic = true;
            rig_pass(&r);
            check_picture(&r, CLOSED_WAVY, 0.36f);
            rig_end(&r);
        }
    lum_free(by_one);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_picture_is_the_same_for_any_number_of_threads),
        cmocka_unit_test(linear_light_is_exact),
        cmocka_unit_test(every_pixel_is_served),
        cmocka_unit_test(records_that_reach_nobody_serve_all_the_same),
        cmocka_unit_test(steep_gradients_do_not_overshoot),
        cmocka_unit_test(a_picture_at_rest_does_nothing),
        cmocka_unit_test(failures_of_memory),
        cmocka_unit_test(broken_records_are_counted),
        cmocka_unit_test(stale_records_are_refreshed_once),
        cmocka_unit_test(a_near_view_makes_its_own_records),
        cmocka_unit_test(records_are_shared_freely),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

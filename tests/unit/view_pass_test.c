/* Passes of a view: any size, any number of threads, cancelled, rough, short of memory; what is under a pixel. */
#include "tests/support/lit_room.h"

/* Pixels of a small picture are those of a bigger one's corner that see the same rays: the eye's arithmetic depends on
 * the size only through the centre, so pictures of equal parity are compared at equal pixel size, without noise. */
static void odd_sizes_equal_the_crop(void **state)
{
    (void)state;
    const uint32_t sizes[][2] = {{1, 1}, {1, 33}, {47, 1}, {17, 31}, {15, 15}, {33, 65}};
    struct rig r;
    rig_begin(&r, 2);
    rig_room(&r);
    rig_bulb(&r, "bulb", rig_v(-1, 2, 0.5), 60);
    rig_commit(&r);
    use_method(&r, "whitted");
    const double tan_of_pixel = 0.01;
    for (size_t k = 0; k < LUM_ARRAY_LEN(sizes); k++) {
        uint32_t w = sizes[k][0], h = sizes[k][1], big_w = w + 34, big_h = h + 50;
        r.settings.w = w;
        r.settings.h = h;
        r.settings.camera.vfov_deg = fmax(1.0, 2.0 * atan(tan_of_pixel * h / 2) * (180.0 / 3.14159265358979323846));
        double tan_half = tan(r.settings.camera.vfov_deg * (3.14159265358979323846 / 360.0));
        rig_pass(&r);
        struct lum_rgb *small = rig_picture(&r);
        r.settings.w = big_w;
        r.settings.h = big_h;
        r.settings.camera.vfov_deg = 2.0 * atan(tan_half / h * big_h) * (180.0 / 3.14159265358979323846);
        rig_pass(&r);
        const struct lum_film *f = lum_view_film(r.view);
        uint32_t off = 0;
        for (uint32_t y = 0; y < h; y++)
            for (uint32_t x = 0; x < w; x++) {
                struct lum_rgb big = lum_film_mean(f, x + 17, y + 25), one = small[y * w + x];
                /* tan(atan()) rounds differently: a ray is off by an ulp, which matters at edges only */
                off += !(fabsf(big.r - one.r) <= 1e-4f * one.r);
            }
        if (off > (w * h) / 50)
            fail_msg("%u x %u: %u pixels differ from the crop", w, h, off);
        lum_free(small);
    }
    rig_end(&r);
}

static void threads_do_not_matter(void **state)
{
    (void)state;
    const uint32_t threads[] = {1, 2, 3, 7};
    const char *methods[] = {"whitted", "path"};
    for (int i = 0; i < 2; i++) {
        struct lum_rgb *first = NULL;
        uint64_t rays = 0;
        for (size_t k = 0; k < LUM_ARRAY_LEN(threads); k++) {
            struct rig r;
            lit_room(&r, threads[k]);
            use_method(&r, methods[i]);
            r.settings.max_depth = 4;
            struct lum_pass_stats s = rig_pass(&r);
            if (i == 1)
                s = rig_pass(&r);
            if (!first) {
                first = rig_picture(&r);
                rays = rig_all_rays(&s);
            }
            rig_assert_picture(&r, first, methods[i]);
            assert_int_equal(rig_all_rays(&s), rays);
            rig_end(&r);
        }
        lum_free(first);
    }
}

static void cancelled_pass_leaves_a_consistent_film(void **state)
{
    (void)state;
    struct rig r;
    lit_room(&r, 2);
    use_method(&r, "path");
    r.settings.max_depth = 2;
    rig_pass(&r);
    rig_pass(&r);
    struct lum_rgb *two = rig_picture(&r);
    rig_fresh_view(&r);
    rig_pass(&r);
    struct lum_pass_stats s;
    _Atomic bool cancel = true;
    struct lum_error err = {0};
    assert_int_equal(lum_view_pass(r.view, r.snapshot, &r.settings, &cancel, &s, &err), LUM_ERR_CANCELLED);
    assert_int_equal(s.spp, 1);
    assert_false(s.complete);
    rig_pass(&r);
    rig_assert_picture(&r, two, "after a cancelled pass");
    lum_free(two);

    use_method(&r, "whitted");
    rig_pass(&r);
    struct lum_rgb *whole = rig_picture(&r);
    rig_fresh_view(&r);
    assert_int_equal(lum_view_pass(r.view, r.snapshot, &r.settings, &cancel, &s, &err), LUM_ERR_CANCELLED);
    assert_int_equal(s.spp, 0);
    rig_pass(&r);
    rig_assert_picture(&r, whole, "whitted after a cancelled pass");
    lum_free(whole);
    rig_end(&r);
}

/* One rough pass per picture, one path a block; the samples after it are those of a view that never had one. */
static void rough_passes_come_first_and_leave_no_trace(void **state)
{
    (void)state;
    struct rig r;
    lit_room(&r, 2);
    use_method(&r, "path");
    r.settings.w = 50, r.settings.h = 35; /* no multiple of a block or a tile */
    r.settings.max_depth = 2;
    rig_pass(&r);
    struct lum_rgb *one = rig_picture(&r);
    for (uint32_t side = 2; side <= 16; side *= 2) {
        rig_fresh_view(&r);
        r.settings.preview = side;
        struct lum_pass_stats s = rig_pass(&r);
        /* tiles of 16 are cut into blocks on their own; the last column of tiles is 2 wide, the last row 3 high */
        uint32_t columns = 3 * (16 / side) + 1, rows = 2 * (16 / side) + (3 + side - 1) / side;
        assert_int_equal(s.rays[LUM_RAY_PRIMARY], columns * rows);
        assert_int_equal(s.preview, side);
        assert_int_equal(s.spp, 0);
        assert_true(s.changed && !s.complete && isnan(s.error.bound));
        s = rig_pass(&r);
        assert_int_equal(s.preview, 0);
        assert_int_equal(s.spp, 1);
        rig_assert_picture(&r, one, "after a rough pass");
    }
    lum_free(one);
    rig_end(&r);
}

/* What takes the size of its blocks has a limit, and says so. */
static void rough_passes_have_a_limit(void **state)
{
    (void)state;
    static const struct {
        const char *method;
        uint32_t most;
    } rows[] = {{"path", LUM_PREVIEW_WHOLE}, {"live", LUM_PREVIEW_MAX}, {"tic", LUM_PREVIEW_MAX}};
    for (size_t i = 0; i < LUM_ARRAY_LEN(rows); i++) {
        struct rig r;
        struct lum_pass_stats stats;
        struct lum_error err = {0};
        lit_room(&r, 2);
        use_method(&r, rows[i].method);
        r.settings.preview = rows[i].most;
        assert_int_equal(rig_pass(&r).preview, rows[i].most);
        r.settings.preview++;
        assert_int_equal(lum_view_pass(r.view, r.snapshot, &r.settings, NULL, &stats, &err), LUM_ERR_INVALID);
        assert_string_equal(err.field, "preview");
        rig_end(&r);
    }
}

/* A frame that is only a new sum comes at once, without a rough pass, whose own buffers would cost rays. */
static void a_dimmed_lamp_has_no_rough_pass(void **state)
{
    (void)state;
    struct rig r;
    lit_room(&r, 2);
    use_method(&r, "live");
    r.settings.preview = 4;
    r.settings.max_spp = 3;
    assert_int_equal(rig_pass(&r).preview, 4);
    while (!rig_pass(&r).complete)
        continue;
    for (int i = 1; i <= 2; i++) { /* the second before the first is refined */
        struct lum_light_desc sky = {
            .kind = &lum_light_kind_environment, .color = lum_grey(1), .intensity = 5.0f - (float)i, .on = true};
        rig_light(&r, "sky", &sky);
        rig_commit(&r);
        struct lum_pass_stats s = rig_pass(&r);
        assert_int_equal(s.preview, 0);
        assert_int_equal(s.spp, 1);
        assert_int_equal(rig_all_rays(&s), 0);
    }
    rig_end(&r);
}

static void progress_stops_and_starts_over(void **state)
{
    (void)state;
    struct rig r;
    lit_room(&r, 2);
    use_method(&r, "path");
    r.settings.max_depth = 2;
    r.settings.max_spp = 3;
    for (uint32_t i = 1; i <= 3; i++) {
        struct lum_pass_stats s = rig_pass(&r);
        assert_int_equal(s.spp, i);
        assert_true(s.complete == (i == 3));
        assert_true(isnan(s.error.bound) == (i < 2));
    }
    struct lum_pass_stats s = rig_pass(&r);
    assert_no_rays(&s, "complete");
    assert_true(!s.changed && s.complete);
    r.settings.max_spp = 4; /* goes on */
    s = rig_pass(&r);
    assert_int_equal(s.spp, 4);
    r.settings.seed++; /* starts over */
    s = rig_pass(&r);
    assert_int_equal(s.spp, 1);
    rig_end(&r);
}

static void first_hits_and_picks(void **state)
{
    (void)state;
    struct rig r;
    lit_room(&r, 2);
    struct lum_aovs a;
    RIG_OK(lum_view_aovs(r.view, r.snapshot, &r.settings, &a, &err));
    uint32_t w = r.settings.w, h = r.settings.h;
    for (uint32_t y = 0; y < h; y++)
        for (uint32_t x = 0; x < w; x++) {
            struct lum_pick p;
            lum_pick_at(r.snapshot, &r.settings.camera, w, h, x + 0.5, y + 0.5, &p);
            assert_true(p.hit);
            size_t i = y * w + x;
            assert_true(fabs(p.distance_m - (double)a.depth_m[i]) < 1e-5);
            if (a.instance[i] != LUM_NO_OBJECT)
                assert_string_equal(p.id, r.snapshot->instances[a.instance[i]].id);
            assert_true(fabsf(lum_length(a.normal_world[i]) - 1.0f) < 1e-5f);
        }
    struct lum_pick p;
    struct lum_camera up = {{0, 1, 0}, {0, 5, 0}, {0, 0, 1}, 10, false};
    lum_pick_at(r.snapshot, &up, 3, 3, 1.5, 1.5, &p);
    assert_true(p.hit);
    assert_string_equal(p.id, "lamp");
    assert_true(fabs(p.distance_m - 1.9) < 1e-5 && fabs(p.point_world.y - 2.9) < 1e-5 && p.normal.y < -0.999f);
    lum_pick_at(r.snapshot, &up, 0, 0, (double)NAN, 0, &p);
    assert_false(p.hit);
    rig_end(&r);
}

/* In a closed room all is met, none nearer than its walls or farther than its corners; from above a box its lid alone.
 */
static void what_is_around_an_eye(void **state)
{
    (void)state;
    struct rig r;
    rig_begin(&r, 1);
    rig_furnace(&r, 1.0, 0.5f, 1.0);
    rig_commit(&r);
    struct lum_surroundings around;
    struct lum_camera inside = {{0, 0, 0}, {0, 0, 1}, {0, 1, 0}, 60, false};
    lum_surroundings_at(r.snapshot, &inside, &around);
    assert_true(around.enclosed == 1.0);
    assert_true(around.reach_m >= 1.0 - 1e-5 && around.reach_m <= sqrt(3.0));
    /* A square of half side a at a distance d takes 4 asin(a^2 / (a^2 + d^2)) of 4 pi. Its border, four arcs of
     * acos(1/3) here, crosses some 22 of the 256 equal cells that the directions stand for: at most half of each is
     * counted wrongly. */
    struct lum_camera above = {{0, 2, 0}, {0, 5, 0}, {0, 0, 1}, 60, false};
    lum_surroundings_at(r.snapshot, &above, &around);
    assert_true(fabs(around.enclosed - asin(0.5) / 3.14159265358979323846) <= 11.0 / 256);
    struct lum_camera nowhere = {{(double)NAN, 2, 0}, {0, 5, 0}, {0, 0, 1}, 60, false};
    lum_surroundings_at(r.snapshot, &nowhere, &around);
    assert_true(around.enclosed == 0.0 && around.reach_m == 0.0);
    rig_end(&r);
}

/* Also when they were asked for while something was away that is back in the pass that follows. */
static void first_hits_between_passes_do_not_show(void **state)
{
    (void)state;
    struct rig r;
    lit_room(&r, 2);
    use_method(&r, "ais");
    r.settings.max_spp = 1;
    rig_pass(&r);
    struct lum_aovs unused;
    rig_object(&r, "crate", "crate", "red", rig_v(-0.8, 0.5, -0.4));
    rig_commit(&r);
    RIG_OK(lum_view_aovs(r.view, r.snapshot, &r.settings, &unused, &err));
    rig_object(&r, "crate", "crate", "red", rig_v(0.5, 0.5, -0.4));
    rig_commit(&r);
    rig_pass(&r);
    rig_assert_as_fresh(&r, "the crate is back");
    rig_end(&r);
}

static void refusals_name_the_field(void **state)
{
    (void)state;
    struct rig r;
    lit_room(&r, 1);
    const struct lum_view_settings good = r.settings;
    struct lum_view_settings bad[8];
    for (size_t i = 0; i < LUM_ARRAY_LEN(bad); i++)
        bad[i] = good;
    bad[0].w = 0;
    bad[1].method = NULL;
    bad[2].shadow_samples = 17;
    bad[3].camera.vfov_deg = (double)NAN;
    bad[4].camera.target = bad[4].camera.position;
    bad[5].camera.position.x = 1e300;
    bad[6].camera.up.x = (double)INFINITY;
    bad[7].camera.position.x = 2e7; /* 8 units to the metre: over what a ray may start from */
    const char *fields[] = {"size", "method", "shadow_samples", "vfov_deg", "target", "position", "camera", "position"};
    for (size_t i = 0; i < LUM_ARRAY_LEN(bad); i++) {
        struct lum_pass_stats s;
        struct lum_error err = {0};
        assert_int_equal(lum_view_pass(r.view, r.snapshot, &bad[i], NULL, &s, &err), LUM_ERR_INVALID);
        assert_string_equal(err.field, fields[i]);
    }
    r.settings.camera.up = rig_v(0, 0, 0); /* any up will do */
    r.settings.shadow_samples = 1;
    rig_pass(&r);
    r.settings.camera.position.x = 1e7;
    rig_pass(&r);
    rig_end(&r);
}

static void short_memory_is_survived(void **state)
{
    (void)state;
    const char *methods[] = {"whitted", "path"};
    for (int i = 0; i < 2; i++) {
        struct rig r;
        lit_room(&r, 1);
        use_method(&r, methods[i]);
        rig_pass(&r);
        struct lum_rgb *whole = rig_picture(&r);
        bool done = false;
        for (uint64_t k = 1; !done; k++) {
            lum_view_destroy(r.view);
            r.view = NULL;
            struct lum_pass_stats s;
            struct lum_error err = {0};
            lum_alloc_fail_after(k);
            enum lum_status status = lum_view_create(r.pool, &r.view, &err);
            if (status == LUM_OK)
                status = lum_view_pass(r.view, r.snapshot, &r.settings, NULL, &s, &err);
            lum_alloc_fail_after(0);
            if (status != LUM_OK)
                assert_int_equal(status, LUM_ERR_NOMEM);
            done = status == LUM_OK;
            if (!r.view)
                continue;
            rig_pass(&r); /* the view goes on where it was */
            if (strcmp(methods[i], "whitted") == 0)
                rig_assert_picture(&r, whole, "after short memory");
        }
        lum_free(whole);
        rig_end(&r);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(odd_sizes_equal_the_crop),
        cmocka_unit_test(threads_do_not_matter),
        cmocka_unit_test(cancelled_pass_leaves_a_consistent_film),
        cmocka_unit_test(rough_passes_come_first_and_leave_no_trace),
        cmocka_unit_test(rough_passes_have_a_limit),
        cmocka_unit_test(a_dimmed_lamp_has_no_rough_pass),
        cmocka_unit_test(progress_stops_and_starts_over),
        cmocka_unit_test(first_hits_and_picks),
        cmocka_unit_test(what_is_around_an_eye),
        cmocka_unit_test(first_hits_between_passes_do_not_show),
        cmocka_unit_test(refusals_name_the_field),
        cmocka_unit_test(short_memory_is_survived),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

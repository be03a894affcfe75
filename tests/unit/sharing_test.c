/* Views that share caches find each other's records, and what they share stays when one of them goes. */
#include "tests/support/effort.h"
#include "tests/support/house.h"

static void begin(struct house *h)
{
    house_begin(h, lum_method_find("tic"));
    h->rig.settings.w = 96;
    h->rig.settings.h = 64;
}

static struct lum_pass_stats look(struct house *h, struct lum_view *view, const struct lum_view_settings *settings)
{
    struct lum_pass_stats stats;
    RIG_OK(lum_view_pass(view, h->rig.snapshot, settings, NULL, &stats, &err));
    return stats;
}

static struct lum_view *another_view(struct house *h, bool shares)
{
    struct lum_view *view = NULL;
    RIG_OK(lum_view_create(h->rig.pool, &view, &err));
    if (shares)
        lum_view_share(view, h->caches);
    return view;
}

/* From half a metre beside: most of what the second one sees, the first one saw. */
static void the_second_viewer_pays_less(void **state)
{
    (void)state;
    struct house h;
    begin(&h);
    struct lum_pass_stats first = look(&h, h.rig.view, &h.rig.settings);
    assert_true(first.cache.created > 0 && first.cache.records == first.cache.created);
    struct lum_view_settings beside = h.rig.settings;
    beside.camera.position.x += 0.5;
    struct lum_view *second = another_view(&h, true), *alone = another_view(&h, false);
    struct lum_pass_stats shared = look(&h, second, &beside), all = look(&h, alone, &beside);
    print_message("records: the first viewer made %llu, the second %llu; alone it makes %llu\n",
                  (unsigned long long)first.cache.created, (unsigned long long)shared.cache.created,
                  (unsigned long long)all.cache.created);
    assert_int_equal(shared.cache.records, first.cache.created + shared.cache.created);
    struct lum_caches_size size;
    lum_caches_measure(h.caches, &size);
    assert_int_equal(size.records, shared.cache.records);
    assert_true(size.bytes > size.records * sizeof(float));
    assert_int_equal(shared.rays[LUM_RAY_VPL], 0);
    assert_true(all.rays[LUM_RAY_VPL] > 0);
    double share = 0.6; /* what the second viewer of a room may pay of what he pays alone */
    assert_true((double)shared.cache.created < share * (double)all.cache.created);
    assert_true((double)shared.rays[LUM_RAY_INDIRECT_DIFFUSE] < share * (double)all.rays[LUM_RAY_INDIRECT_DIFFUSE]);
    lum_view_destroy(alone);
    lum_view_destroy(second);
    house_end(&h);
}

/* What the statistics say, also of a frame in which nothing changed and of one in which a lamp moved. */
static void counters_tell_what_is_there(void **state)
{
    (void)state;
    static const char *const methods[] = {"irrcache", "ic", "tic", "live"};
    for (size_t m = 0; m < LUM_ARRAY_LEN(methods); m++) {
        struct house h;
        begin(&h);
        struct rig *r = &h.rig;
        r->settings.method = lum_method_find(methods[m]);
        r->settings.deterministic = false; /* records of irrcache as they come */
        r->settings.max_spp = 1;
        struct lum_pass_stats first = look(&h, r->view, &r->settings);
        assert_true(first.cache.created > 0 && first.cache.reused == 0);
        assert_int_equal(first.n_vpls_moved, first.n_vpls);
        struct lum_view *second = another_view(&h, true);
        struct lum_pass_stats same = look(&h, second, &r->settings);
        assert_int_equal(same.cache.created, 0);
        assert_int_equal(same.cache.reused, first.cache.records); /* each serves the point that it was made for */
        lum_view_destroy(second);
        struct lum_pass_stats rest = look(&h, r->view, &r->settings);
        assert_int_equal(rest.cache.records, first.cache.records);
        assert_int_equal(rest.n_vpls, first.n_vpls);
        assert_int_equal(rest.n_vpls_moved, 0);
        rig_bulb(r, "lamp", rig_v(0.3, 2.4, 0), 100.0);
        rig_commit(r);
        struct lum_pass_stats moved = look(&h, r->view, &r->settings);
        assert_true(moved.n_vpls_moved <= moved.n_vpls);
        assert_true((moved.n_vpls_moved > 0) == (first.n_vpls > 0));
        house_end(&h);
    }
}

static void who_comes_back_finds_his_records(void **state)
{
    (void)state;
    struct house h;
    begin(&h);
    struct lum_pass_stats first = look(&h, h.rig.view, &h.rig.settings);
    lum_view_destroy(h.rig.view);
    h.rig.view = another_view(&h, true);
    struct lum_pass_stats again = look(&h, h.rig.view, &h.rig.settings);
    assert_int_equal(again.cache.created, 0);
    assert_int_equal(again.cache.records, first.cache.records);
    assert_int_equal(again.rays[LUM_RAY_INDIRECT_DIFFUSE] + again.rays[LUM_RAY_VPL], 0);
    struct lum_pass_stats rest = look(&h, h.rig.view, &h.rig.settings);
    assert_int_equal(rest.cache.records, first.cache.records);
    house_end(&h);
}

static void other_settings_have_another_cache(void **state)
{
    (void)state;
    struct house h;
    begin(&h);
    struct lum_pass_stats first = look(&h, h.rig.view, &h.rig.settings);
    struct lum_view_settings finer = h.rig.settings;
    finer.cache_accuracy *= 0.5f;
    struct lum_view *second = another_view(&h, true);
    struct lum_pass_stats own = look(&h, second, &finer);
    assert_int_equal(own.cache.records, own.cache.created);
    assert_true(own.cache.created > first.cache.created);
    lum_view_destroy(second);
    house_end(&h);
}

/* An edit reaches the cache through whichever view looks first; the other one sees it as well. */
static void an_edit_reaches_both(void **state)
{
    (void)state;
    struct house h;
    begin(&h);
    struct lum_view *second = another_view(&h, true);
    struct lum_view_settings beside = h.rig.settings;
    beside.camera.position.x += 0.5;
    look(&h, h.rig.view, &h.rig.settings);
    look(&h, second, &beside);
    struct lum_light_desc lamp = rig_point(rig_v(0, 2.5, 0), 20.0);
    rig_light(&h.rig, "lamp", &lamp);
    rig_commit(&h.rig);
    struct lum_pass_stats a = look(&h, h.rig.view, &h.rig.settings), b = look(&h, second, &beside);
    assert_int_equal(a.rays[LUM_RAY_INDIRECT_DIFFUSE] + a.rays[LUM_RAY_VPL], 0);
    assert_int_equal(b.rays[LUM_RAY_INDIRECT_DIFFUSE] + b.rays[LUM_RAY_VPL], 0);
    assert_true(a.changed && b.changed);
    double was = (double)lum_film_mean(lum_view_film(second), 48, 40).g;
    lamp.intensity = 100.0;
    rig_light(&h.rig, "lamp", &lamp);
    rig_commit(&h.rig);
    look(&h, h.rig.view, &h.rig.settings);
    look(&h, second, &beside);
    double now = (double)lum_film_mean(lum_view_film(second), 48, 40).g;
    assert_true(was > 0.0 && fabs(now / was - 5.0) < 1e-3); /* linear, but for float sums */
    lum_view_destroy(second);
    house_end(&h);
}

/* A picture, one after an object moved, and one after a lamp was dimmed, each onto the ones before. */
static void play(const struct lum_view_settings *settings, uint32_t threads, struct lum_rgb *ret_pictures[3])
{
    struct rig r;
    rig_begin(&r, threads);
    rig_room(&r);
    struct lum_light_desc lamp = rig_point(rig_v(0, 2.5, 0), 100.0);
    rig_light(&r, "lamp", &lamp);
    r.settings.method = settings->method;
    r.settings.storage = settings->storage;
    r.settings.deterministic = true;
    r.settings.w = 48;
    r.settings.h = 40;
    for (int frame = 0; frame < 3; frame++) {
        if (frame == 1)
            rig_object(&r, "crate", "crate", "red", rig_v(-0.5, 0.5, -0.4));
        lamp.intensity = frame == 2 ? 20.0 : 100.0;
        rig_light(&r, "lamp", &lamp);
        rig_commit(&r);
        rig_pass(&r);
        ret_pictures[frame] = rig_picture(&r);
    }
    rig_end(&r);
}

static void storages_and_threads_do_not_matter(void **state)
{
    (void)state;
    static const char *const methods[] = {"irrcache", "ic", "tic"};
    static const uint32_t threads[] = {7, 2, 3, 1};
    size_t n_bytes = (size_t)48 * 40 * sizeof(struct lum_rgb);
    for (size_t m = 0; m < TEST_EFFORT(LUM_ARRAY_LEN(methods)); m++) {
        struct lum_view_settings settings = {.method = lum_method_find(methods[m]), .storage = LUM_STORAGE_SERIAL};
        struct lum_rgb *expected[3], *got[3];
        play(&settings, 1, expected);
        for (int storage = 0; storage < LUM_STORAGE_COUNT; storage++)
            for (size_t t = 0; t < TEST_EFFORT(LUM_ARRAY_LEN(threads)); t++) {
                settings.storage = (enum lum_storage)storage;
                play(&settings, threads[t], got);
                for (int frame = 0; frame < 3; frame++) {
                    if (memcmp(got[frame], expected[frame], n_bytes) != 0)
                        fail_msg("%s, %s, %u threads: frame %d differs from that of one thread", methods[m],
                                 lum_storage_names[storage], threads[t], frame);
                    lum_free(got[frame]);
                }
            }
        for (int frame = 0; frame < 3; frame++)
            lum_free(expected[frame]);
    }
}

/* What a rough pass leaves in the cache is as fine as the frame that follows it. */
static void a_rough_pass_makes_no_coarse_records(void **state)
{
    (void)state;
    struct house h;
    begin(&h);
    struct rig *r = &h.rig;
    r->settings.method = lum_method_find("live");
    r->settings.max_spp = 1;
    r->settings.w = 300;
    r->settings.h = 200;
    struct lum_view *alone = another_view(&h, false);
    struct lum_view_settings fine = r->settings;
    struct lum_pass_stats whole = look(&h, alone, &fine);
    r->settings.preview = 8;
    struct lum_pass_stats rough = look(&h, r->view, &r->settings), frame = look(&h, r->view, &r->settings);
    assert_int_equal(rough.preview, 8);
    print_message("records: %llu alone; %llu of the rough pass, %llu after the frame\n",
                  (unsigned long long)whole.cache.records, (unsigned long long)rough.cache.records,
                  (unsigned long long)frame.cache.records);
    assert_true(rough.cache.records > 0);
    /* Where the first ones lie decides where others go. Coarse ones were less than half as many. */
    assert_true((double)frame.cache.records > 0.75 * (double)whole.cache.records);
    lum_view_destroy(alone);
    house_end(&h);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_second_viewer_pays_less),          cmocka_unit_test(who_comes_back_finds_his_records),
        cmocka_unit_test(other_settings_have_another_cache),    cmocka_unit_test(an_edit_reaches_both),
        cmocka_unit_test(counters_tell_what_is_there),          cmocka_unit_test(storages_and_threads_do_not_matter),
        cmocka_unit_test(a_rough_pass_makes_no_coarse_records),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

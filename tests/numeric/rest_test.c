/* Soft shadows of `live` while a picture rests: what a frame's budget left out is found out then. */
#include "tests/support/rig.h"

static void put_lamp(struct rig *r, double x)
{
    struct lum_light_desc l = rig_quad(rig_v(x, 2.8, 0), rig_v(1, 0, 0), rig_v(0, 0, 0.7), 100);
    rig_light(r, "lamp", &l);
}

static void shadowed_room(struct rig *r, uint32_t budget)
{
    rig_begin(r, 2);
    rig_room(r);
    put_lamp(r, -0.5);
    rig_commit(r);
    r->settings.method = lum_method_find("live");
    r->settings.effects_off = 1u << LUM_EFFECT_INDIRECT_DIFFUSE;
    r->settings.max_spp = 0;
    r->settings.shadow_budget = budget;
    r->settings.deterministic = false;
}

/* What there is after so many passes of a view that knew nothing: a fast frame, and samples. */
static struct lum_rgb *picture_after(struct rig *r, uint32_t passes)
{
    rig_fresh_view(r);
    for (uint32_t i = 0; i < passes; i++)
        rig_pass(r);
    return rig_picture(r);
}

static bool shows(const struct rig *r, const struct lum_rgb *picture)
{
    struct lum_rgb *now = rig_picture(r);
    bool same = memcmp(now, picture, (size_t)r->settings.w * r->settings.h * sizeof *now) == 0;
    lum_free(now);
    return same;
}

/* All strata are asked for where a shadow's border is: in the end it does not matter when. */
static void budgets_are_made_up_for(void **state)
{
    (void)state;
    struct rig r;
    shadowed_room(&r, UINT32_MAX);
    struct lum_rgb *first = picture_after(&r, 1), *last = picture_after(&r, 33);
    r.settings.shadow_budget =
        r.settings.w * r.settings.h / 2; /* 16 of them; all strata are 16 a pixel, and here a third ask for them */
    lum_free(picture_after(&r, 1));
    assert_false(shows(&r, first));
    lum_free(picture_after(&r, 33));
    rig_assert_picture(&r, last, "with a ray a pixel and budget");
    lum_free(first);
    lum_free(last);
    rig_end(&r);
}

/* Then only the sample is left that path tracing takes, too. */
static void there_is_an_end(void **state)
{
    (void)state;
    struct rig r;
    shadowed_room(&r, UINT32_MAX);
    r.settings.antialias = false;
    struct lum_pass_stats live, path;
    lum_free(picture_after(&r, 16));
    live = rig_pass(&r);
    r.settings.method = lum_method_find("path");
    lum_free(picture_after(&r, 15));
    path = rig_pass(&r);
    assert_int_equal(rig_all_rays(&live), rig_all_rays(&path));
    rig_end(&r);
}

static void cancelled_at_rest(void **state)
{
    (void)state;
    struct rig r;
    shadowed_room(&r, 500);
    struct lum_rgb *whole = picture_after(&r, 9);
    const _Atomic bool cancel = true;
    struct lum_pass_stats unused;
    rig_fresh_view(&r);
    for (uint32_t i = 0; i < 9; i++) {
        rig_pass(&r);
        if (i < 8)
            assert_int_equal(lum_view_pass(r.view, r.snapshot, &r.settings, &cancel, &unused, NULL), LUM_ERR_CANCELLED);
    }
    rig_assert_picture(&r, whole, "cancelled before every pass");
    lum_free(whole);
    rig_end(&r);
}

/* Where a picture must depend on the edits alone, it does not matter how long it rested between them. */
static void deterministic_forgets_nothing_and_learns_nothing(void **state)
{
    (void)state;
    static const uint32_t rests[] = {1, 9};
    struct lum_rgb *moved[2];
    struct rig r;
    shadowed_room(&r, 500);
    r.settings.deterministic = true;
    for (int i = 0; i < 2; i++) {
        rig_object(&r, "crate", "crate", "red", rig_v(0.5, 0.5, -0.4));
        rig_commit(&r);
        lum_free(picture_after(&r, rests[i]));
        rig_object(&r, "crate", "crate", "red", rig_v(0.3, 0.5, -0.4));
        rig_commit(&r);
        rig_pass(&r);
        moved[i] = rig_picture(&r);
    }
    rig_assert_picture(&r, moved[0], "moved after a rest");
    lum_free(moved[0]);
    lum_free(moved[1]);
    rig_end(&r);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(budgets_are_made_up_for),
        cmocka_unit_test(there_is_an_end),
        cmocka_unit_test(cancelled_at_rest),
        cmocka_unit_test(deterministic_forgets_nothing_and_learns_nothing),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

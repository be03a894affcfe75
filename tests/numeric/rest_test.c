/* Soft shadows of `live` while a picture rests: what a frame's budget left out is found out then. */
#include "tests/support/cut_short.h"

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
    rig_assert_picture(&r, last, "with half a ray a pixel and budget");
    lum_free(first);
    lum_free(last);
    rig_end(&r);
}

/* Then only the sample is left that path tracing takes, too; at once where no shadow is soft. */
static void there_is_an_end(void **state)
{
    (void)state;
    for (int soft = 0; soft < 2; soft++) {
        struct rig r;
        shadowed_room(&r, UINT32_MAX);
        r.settings.antialias = false;
        if (!soft) {
            RIG_OK(lum_scene_remove(r.scene, LUM_ENTITY_LIGHT, "lamp", &err));
            rig_bulb(&r, "bulb", rig_v(0, 2.5, 0), 100);
            rig_commit(&r);
        }
        lum_free(picture_after(&r, soft ? 16 : 4));
        struct lum_pass_stats live = rig_pass(&r);
        assert_true(live.stage_ms[LUM_STAGE_COMPOSITE] == 0.0); /* no frame was made */
        r.settings.method = lum_method_find("path");
        lum_free(picture_after(&r, soft ? 15 : 3));
        struct lum_pass_stats path = rig_pass(&r);
        assert_int_equal(rig_all_rays(&live), rig_all_rays(&path));
        rig_end(&r);
    }
}

/* ---- passes that are cut short ---- */

/* The second sample, cut short wherever it can be: the film never shows less than it did. Afterwards all is as if it
 * had not been, once the frame could be made finer: the next time samples are shown. */
static void cancelled_at_rest(void **state)
{
    (void)state;
    struct rig r;
    shadowed_room(&r, UINT32_MAX);
    struct lum_rgb *frame = picture_after(&r, 1), *blend = picture_after(&r, 5);
    r.settings.deterministic = true; /* never a finer frame */
    struct lum_rgb *plain = picture_after(&r, 3);
    r.settings.deterministic = false;
    uint32_t n_cancelled = 0, n_later = 0;
    for (uint32_t loop = 1;; loop++) {
        struct lum_pass_stats stats;
        uint32_t left;
        lum_free(picture_after(&r, 2));
        bool cut = pass_is_cut_short(&r, loop, 3, &stats, &left);
        if (left > 0) /* it has not so many */
            break;
        if (!cut)
            continue; /* all jobs were begun */
        n_cancelled++;
        n_later += stats.spp == 3;
        assert_true(shows(&r, stats.spp == 2 ? frame : plain));
        while (stats.spp < 5)
            stats = rig_pass(&r);
        rig_assert_picture(&r, blend, "after a pass that was cut short");
    }
    assert_true(n_cancelled > 3 && n_later > 2 && n_later < n_cancelled);
    lum_free(frame);
    lum_free(blend);
    lum_free(plain);
    rig_end(&r);
}

/* ---- where a picture depends on the edits alone ---- */

static void paint(struct rig *r, float albedo)
{
    struct lum_material_desc m = rig_diffuse(albedo);
    rig_material(r, "red", &m);
    rig_commit(r);
}

static void put_crate(struct rig *r, double x)
{
    rig_object(r, "crate", "crate", "red", rig_v(x, 0.5, -0.4));
    rig_commit(r);
}

static void rest(struct rig *r, uint32_t passes)
{
    while (passes--)
        rig_pass(r);
}

/* It does not matter how long it rested between them. */
static void deterministic_pictures_do_not_rest(void **state)
{
    (void)state;
    static const uint32_t passes[] = {1, 9};
    struct lum_rgb *moved[2];
    struct rig r;
    shadowed_room(&r, 500);
    r.settings.deterministic = true;
    for (int i = 0; i < 2; i++) {
        paint(&r, 0.5f);
        put_crate(&r, 0.5);
        rig_fresh_view(&r);
        rest(&r, passes[i]);
        put_crate(&r, 0.4);
        rest(&r, passes[i]);
        paint(&r, 0.2f); /* what is known of shadows is looked at again */
        rest(&r, passes[i]);
        put_crate(&r, 0.3);
        rest(&r, 1);
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
        cmocka_unit_test(deterministic_pictures_do_not_rest),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

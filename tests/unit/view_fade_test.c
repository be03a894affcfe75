/* A view whose lamps fade from one look to another: its pictures are sums of those of both ends, and take no ray. */
#include "core/render/mix.h"
#include "tests/support/lit_room.h"

#define STEPS 8

/* A look: by which factor each primary of each lamp shines, of what the scene has. */
struct look {
    const char *id;
    struct lum_rgb times;
};
static const struct look evening[] = {
    {"lamp", {0.125f, 0.0625f, 0.03125f}}, {"bulb", {0.5f, 0.25f, 0.75f}}, {"far", {0.0f, 0.0f, 0.0f}}};

struct way {
    const struct look *look;
    uint32_t n;
    float share; /* 0: as the scene has it. 1: the look */
};

/* As a fade rounds it. */
static void shine(void *user, struct lum_light *l)
{
    const struct way *w = user;
    for (uint32_t i = 0; i < w->n; i++) {
        if (strcmp(w->look[i].id, l->id) != 0)
            continue;
        struct lum_rgb there = lum_rgb_mul(l->power, w->look[i].times);
        l->power = lum_rgb_add(lum_rgb_scale(l->power, 1.0f - w->share), lum_rgb_scale(there, w->share));
        l->on = !lum_rgb_black(l->power);
    }
}

/* The scene, so far from how it is. */
static const struct lum_snapshot *relit(const struct lum_snapshot *whole, const struct way *w)
{
    const struct lum_snapshot *s = NULL;
    RIG_OK(lum_snapshot_relit(whole, shine, (void *)w, &s, &err));
    return s;
}

/* The rig's view shows the scene in that light; `fading` back to how it is. */
static struct lum_pass_stats show(struct rig *r, const struct lum_snapshot *s, bool fading)
{
    struct lum_pass_stats stats;
    r->settings.fading = fading;
    RIG_OK(lum_view_pass(r->view, s, &r->settings, NULL, &stats, &err));
    return stats;
}

static struct lum_pass_stats show_look(struct rig *r, const struct way *w, bool fading)
{
    const struct lum_snapshot *s = relit(r->snapshot, w);
    struct lum_pass_stats stats = show(r, s, fading);
    lum_snapshot_unref(s);
    return stats;
}

static struct way way_of(float share)
{
    return (struct way){evening, LUM_ARRAY_LEN(evening), share};
}

/* A view that has seen all lamps shine, and shows the evening. */
static void dusk(struct rig *r, uint32_t threads, const char *method)
{
    lit_room(r, threads);
    use_method(r, method);
    r->settings.w = 75, r->settings.h = 50;
    rig_pass(r);
    struct way w = way_of(1.0f);
    show_look(r, &w, false);
}

/* The largest difference of a primary, over the largest of the picture. */
static double difference(const struct rig *r, const struct lum_rgb *other)
{
    double off = 0.0, most = 0.0;
    struct lum_rgb *own = rig_picture(r);
    for (size_t i = 0; i < (size_t)r->settings.w * r->settings.h; i++) {
        const float a[] = {own[i].r, own[i].g, own[i].b}, b[] = {other[i].r, other[i].g, other[i].b};
        for (int k = 0; k < 3; k++) {
            off = fmax(off, fabs((double)a[k] - (double)b[k]));
            most = fmax(most, (double)b[k]);
        }
    }
    lum_free(own);
    return most > 0.0 ? off / most : 0.0;
}

/* Of whitted each picture is a sum of at most five lights, mirrors and glass: as a sum of two such it is the same but
 * for what floats round, half of FLT_EPSILON in each of a dozen products and sums. */
static void a_picture_on_the_way_is_what_it_would_be_made_anew(void **state)
{
    (void)state;
    struct rig r;
    dusk(&r, 2, "whitted");
    for (int i = 1; i < STEPS; i++) {
        struct way w = way_of(1.0f - (float)i / STEPS);
        struct lum_pass_stats s = show_look(&r, &w, true);
        assert_no_rays(&s, "on the way");
        assert_int_equal(s.spp, 1);
        struct lum_rgb *mixed = rig_picture(&r);
        struct rig anew;
        lit_room(&anew, 1);
        use_method(&anew, "whitted");
        anew.settings.w = r.settings.w, anew.settings.h = r.settings.h;
        show_look(&anew, &w, false);
        double off = difference(&anew, mixed);
        if (!(off <= 12.0 * 0x1p-24))
            fail_msg("step %d: off by %g of the picture", i, off);
        lum_free(mixed);
        rig_end(&anew);
    }
    rig_end(&r);
}

/* Of live, with all that it keeps: no ray, no sum made anew but that of the end, and pictures between both ends. */
static void no_stage_runs_on_the_way(void **state)
{
    (void)state;
    struct rig r;
    dusk(&r, 2, "live");
    struct lum_rgb *first = rig_picture(&r);
    struct way w = way_of(1.0f - 1.0f / STEPS);
    struct lum_pass_stats s = show_look(&r, &w, true);
    assert_no_rays(&s, "the first step");
    for (int i = 2; i < STEPS; i++) {
        w = way_of(1.0f - (float)i / STEPS);
        s = show_look(&r, &w, true);
        assert_no_rays(&s, "a step");
        for (int stage = 0; stage < LUM_STAGE_COUNT; stage++)
            if (stage != LUM_STAGE_COMPOSITE && s.stage_ms[stage] > 0.0)
                fail_msg("step %d: %s ran", i, lum_stage_names[stage]);
        assert_true(s.changed && !s.complete);
    }
    struct lum_rgb *late = rig_picture(&r);
    s = show(&r, r.snapshot, false);
    assert_no_rays(&s, "the end");
    struct lum_rgb *last = rig_picture(&r);
    float share = (float)(STEPS - 1) / STEPS;
    for (size_t i = 0; i < (size_t)r.settings.w * r.settings.h; i++) {
        double want = (double)first[i].g * (1.0 - (double)share) + (double)last[i].g * (double)share;
        if (!(fabs((double)late[i].g - want) <= 16.0 * 0x1p-24 * fmax((double)first[i].g, (double)last[i].g)))
            fail_msg("pixel %zu: %g, not %g", i, (double)late[i].g, want);
    }
    lum_free(first);
    lum_free(late);
    lum_free(last);
    rig_end(&r);
}

/* What is at rest after a fade is bit for bit what an edit at once would have brought. */
static void the_end_is_as_if_nothing_had_faded(void **state)
{
    (void)state;
    static const char *const methods[] = {"whitted", "live", "tic", "igi"};
    for (size_t m = 0; m < LUM_ARRAY_LEN(methods); m++) {
        struct rig r, at_once;
        dusk(&at_once, 1, methods[m]);
        show(&at_once, at_once.snapshot, false);
        struct lum_rgb *want = rig_picture(&at_once);
        dusk(&r, 3, methods[m]);
        for (int i = 1; i < STEPS; i++) {
            struct way w = way_of(1.0f - (float)i / STEPS);
            show_look(&r, &w, true);
        }
        struct lum_pass_stats s = show(&r, r.snapshot, false);
        assert_no_rays(&s, methods[m]);
        rig_assert_picture(&r, want, methods[m]);
        lum_free(want);
        rig_end(&r);
        rig_end(&at_once);
    }
}

/* A picture on which lights rest after all is made anew, then refined. */
static void who_rests_on_the_way_gets_a_picture_of_its_own(void **state)
{
    (void)state;
    struct rig r, at_once;
    struct way w = way_of(0.375f);
    dusk(&at_once, 1, "live");
    show_look(&at_once, &w, false);
    struct lum_rgb *want = rig_picture(&at_once);
    dusk(&r, 2, "live");
    const struct lum_snapshot *s = relit(r.snapshot, &w);
    struct lum_pass_stats stats = show(&r, s, true);
    assert_false(stats.complete);
    stats = show(&r, s, true);
    assert_no_rays(&stats, "made anew");
    rig_assert_picture(&r, want, "at rest on the way");
    stats = show(&r, s, true);
    assert_true(rig_all_rays(&stats) > 0 && stats.spp == 2);
    lum_snapshot_unref(s);
    lum_free(want);
    rig_end(&r);
    rig_end(&at_once);
}

/* Lamps that have not all gone the same share of their way: pictures are made as ever. */
static void who_is_not_on_the_way_gets_a_picture_of_its_own(void **state)
{
    (void)state;
    struct rig r, at_once;
    struct way w = {evening, 2, 0.25f}; /* one is there already */
    dusk(&at_once, 1, "live");
    show_look(&at_once, &w, false);
    struct lum_rgb *want = rig_picture(&at_once);
    dusk(&r, 2, "live");
    struct lum_pass_stats s = show_look(&r, &w, true);
    assert_no_rays(&s, "apart");
    rig_assert_picture(&r, want, "apart");
    w.share = 0.125f; /* from there both go on evenly */
    show_look(&r, &w, true);
    w.share = 0.0625f;
    s = show_look(&r, &w, true);
    assert_true(s.stage_ms[LUM_STAGE_INDIRECT] == 0.0);
    lum_free(want);
    rig_end(&r);
    rig_end(&at_once);
}

/* Which share of the way lamps have gone is told to within what a float rounds, and lamps beside it are seen. */
static void the_way_is_told_by_the_lamps(void **state)
{
    (void)state;
    struct rig r;
    lit_room(&r, 1);
    struct way all = way_of(1.0f);
    const struct lum_snapshot *start = relit(r.snapshot, &all);
    for (int i = 0; i <= STEPS; i++) {
        struct way w = way_of(1.0f - (float)i / STEPS);
        const struct lum_snapshot *s = relit(r.snapshot, &w);
        double share = lum_mix_share(start, r.snapshot, s);
        if (!(fabs(share - (double)i / STEPS) <= 8.0 * 0x1p-24))
            fail_msg("%g, not %g", share, (double)i / STEPS);
        lum_snapshot_unref(s);
    }
    struct way beyond = way_of(1.0625f), apart = {evening, 1, 0.5f};
    const struct lum_snapshot *too_far = relit(r.snapshot, &beyond), *beside = relit(r.snapshot, &apart);
    assert_true(isnan(lum_mix_share(start, r.snapshot, too_far)));
    assert_true(isnan(lum_mix_share(start, r.snapshot, beside)));
    assert_true(isnan(lum_mix_share(r.snapshot, r.snapshot, r.snapshot)));
    lum_snapshot_unref(too_far);
    lum_snapshot_unref(beside);
    lum_snapshot_unref(start);
    rig_end(&r);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_picture_on_the_way_is_what_it_would_be_made_anew),
        cmocka_unit_test(no_stage_runs_on_the_way),
        cmocka_unit_test(the_end_is_as_if_nothing_had_faded),
        cmocka_unit_test(who_rests_on_the_way_gets_a_picture_of_its_own),
        cmocka_unit_test(who_is_not_on_the_way_gets_a_picture_of_its_own),
        cmocka_unit_test(the_way_is_told_by_the_lamps),
    };
    return cmocka_run_group_tests_name("view_fade", tests, NULL, NULL);
}

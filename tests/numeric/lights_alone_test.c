/* Views that show some lights alone: without a ray, and with the others' pictures as they are. */
#include <string.h>

#include "core/cache/caches.h"
#include "tests/numeric/relight_room.h"

static void switch_alone(void *user, struct lum_light *light)
{
    light->on = strcmp(light->id, user) == 0;
}

static void show_alone(struct rig *r, const struct lum_snapshot *whole, const char *id)
{
    const struct lum_snapshot *alone = NULL;
    RIG_OK(lum_snapshot_relit(whole, switch_alone, (void *)id, &alone, &err));
    lum_snapshot_unref(r->snapshot);
    r->snapshot = alone;
}

static void show_whole(struct rig *r, const struct lum_snapshot *whole)
{
    lum_snapshot_unref(r->snapshot);
    r->snapshot = lum_snapshot_ref(whole);
}

/* One view shows a lamp alone, another, which shares the cache of indirect light, all of them: no ray for the one, the
 * same picture as where the others are switched off, and not a bit of difference for the other. */
static void lights_alone_in_one_view_of_two(void **state)
{
    (void)state;
    struct rig r;
    struct lum_caches *caches;
    struct lum_view *other;
    struct lum_pass_stats s;
    room(&r, false);
    r.settings.effects_off = 0;
    RIG_OK(lum_caches_create(lum_pool_size(r.pool), &caches, &err));
    RIG_OK(lum_view_create(r.pool, &other, &err));
    lum_view_share(r.view, caches);
    lum_view_share(other, caches);
    rig_commit(&r);
    rig_pass(&r);
    struct lum_view *one = r.view;
    RIG_OK(lum_view_pass(other, r.snapshot, &r.settings, NULL, &s, &err));
    r.view = other;
    struct lum_rgb *all = rig_picture(&r);
    r.view = one;

    const struct lum_snapshot *whole = lum_snapshot_ref(r.snapshot);
    show_alone(&r, whole, "bulb");
    uint64_t version = r.snapshot->versions.light_power;
    s = rig_pass(&r);
    assert_int_equal(rig_all_rays(&s), 0);
    struct lum_rgb *bulb = rig_picture(&r);
    RIG_OK(lum_view_pass(other, whole, &r.settings, NULL, &s, &err));
    assert_int_equal(rig_all_rays(&s), 0);
    r.view = other;
    rig_assert_picture(&r, all, "the other view");
    r.view = one;
    show_alone(&r, whole, "nobody");
    assert_true(r.snapshot->versions.light_power != version);
    rig_pass(&r);
    assert_true(rig_mean(&r).g == 0.0f);
    show_alone(&r, whole, "bulb");
    assert_true(r.snapshot->versions.light_power == version);
    show_whole(&r, whole);
    s = rig_pass(&r);
    assert_int_equal(rig_all_rays(&s), 0);
    rig_assert_picture(&r, all, "all again");
    put_lamp(&r, 1, false);
    rig_commit(&r);
    rig_pass(&r);
    rig_assert_picture(&r, bulb, "the others switched off");

    lum_free(all);
    lum_free(bulb);
    lum_snapshot_unref(whole);
    lum_view_destroy(other);
    lum_view_destroy(r.view);
    r.view = NULL;
    lum_caches_destroy(caches);
    rig_end(&r);
}

/* What is switched off shines as brightly alone as if it were on. */
static void a_light_alone_may_be_switched_off(void **state)
{
    (void)state;
    struct rig r;
    room(&r, false);
    rig_commit(&r);
    const struct lum_snapshot *on = lum_snapshot_ref(r.snapshot);
    show_alone(&r, on, "lamp");
    rig_pass(&r);
    struct lum_rgb *lamp = rig_picture(&r);
    show_whole(&r, on);
    put_lamp(&r, 1, false);
    rig_commit(&r);
    const struct lum_snapshot *off = lum_snapshot_ref(r.snapshot);
    show_alone(&r, off, "lamp");
    rig_pass(&r);
    rig_assert_picture(&r, lamp, "switched off, and shown alone");
    lum_free(lamp);
    lum_snapshot_unref(on);
    lum_snapshot_unref(off);
    rig_end(&r);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(lights_alone_in_one_view_of_two),
        cmocka_unit_test(a_light_alone_may_be_switched_off),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

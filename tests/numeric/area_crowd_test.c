/* Soft shadows of `live` of more lights than layers, which are sampled together. */
#include <math.h>

#include "core/effect/direct/layers.h"
#include "tests/numeric/live_shadows.h"

#define CROWD 40

static void crowded_room(struct rig *r, uint32_t threads, int from, int to)
{
    rig_begin(r, threads);
    rig_room(r);
    for (int i = from; i < to; i++) {
        const char id[] = {'l', (char)('0' + i / 10), (char)('0' + i % 10), 0};
        struct lum_light_desc l = rig_quad(rig_v(-1.8 + 0.4 * (i % 10), 2.9, -1.5 + 0.9 * (i / 10)), rig_v(0.1, 0, 0),
                                           rig_v(0, 0, 0.1), i == 39 ? 0.001 : 100 + 20 * i);
        l.camera_visible = false;
        rig_light(r, id, &l);
    }
    rig_commit(r);
    set_live(r, 0);
    r->settings.w = 240;
    r->settings.h = 160;
}

/* Light is linear: what 40 lights give is the sum of what they give by eights, which all have layers. */
static void crowd_is_the_sum(void **state)
{
    (void)state;
    struct rig r;
    double parts = 0.0;
    for (int from = 0; from < CROWD; from += (int)LUM_AREA_LAYERS) {
        crowded_room(&r, 0, from, from + (int)LUM_AREA_LAYERS);
        struct lum_pass_stats s = rig_pass(&r);
        assert_true(s.culled_bound == 0.0);
        parts += (double)rig_mean(&r).g;
        rig_end(&r);
    }
    crowded_room(&r, 0, 0, CROWD);
    struct lum_pass_stats s = rig_pass(&r);
    assert_true(s.culled_bound > 0.0 && s.culled_bound <= 1.0 / 512);
    /* Each of the lights is asked for by a pixel in 16 at least: 2400 samples, whose values deviate by no more than
     * what they are. They are about alike, so their sum deviates by 1 / sqrt(2400 * 40), were samples random: four of
     * these, and what is left out. */
    if (!(fabs((double)rig_mean(&r).g / parts - 1.0) < 4.0 / sqrt(2400.0 * CROWD) + 1.0 / 512))
        fail_msg("together %g, in parts %g", (double)rig_mean(&r).g, parts);
    rig_end(&r);
}

/* An edit of one of many lights makes all of it anew; the picture is that of a new view, for any number of threads. */
static void crowd_is_never_stale(void **state)
{
    (void)state;
    struct rig r;
    struct lum_rgb *first = NULL;
    for (uint32_t threads = 1; threads <= 2; threads++) {
        crowded_room(&r, threads, 0, CROWD);
        rig_pass(&r);
        struct lum_light_desc l = rig_quad(rig_v(1.8, 2.9, 1.2), rig_v(0.1, 0, 0), rig_v(0, 0, 0.1), 5000);
        l.camera_visible = false;
        rig_light(&r, "l39", &l);
        rig_commit(&r);
        rig_pass(&r);
        if (first) {
            rig_assert_picture(&r, first, "threads");
        } else {
            first = rig_picture(&r);
            rig_fresh_view(&r);
            rig_pass(&r);
            rig_assert_picture(&r, first, "brightened");
        }
        rig_end(&r);
    }
    lum_free(first);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(crowd_is_the_sum),
        cmocka_unit_test(crowd_is_never_stale),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

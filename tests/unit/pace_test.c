/* How rough a picture is, so that it is there in time. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include <math.h>
#include <string.h>

#include "core/method/method.h"
#include "core/render/pace.h"

static uint32_t choose(double whole_ms, const char *method, double limit_ms)
{
    struct lum_pace p = {0};
    lum_pace_note(&p, 1, whole_ms);
    return lum_pace_choose(&p, lum_method_find(method), limit_ms);
}

/* As small as leaves one in its time, and never more than a pass takes. */
static void blocks_are_as_small_as_time_allows(void **state)
{
    (void)state;
    struct lum_pace unknown = {0};
    assert_int_equal(lum_pace_choose(&unknown, lum_method_find("live"), 60.0), 8);
    assert_int_equal(choose(54.0, "live", 60.0), 1);
    assert_int_equal(choose(120.0, "live", 60.0), 2);
    assert_int_equal(choose(180.0, "live", 60.0), 3);
    assert_int_equal(choose(300.0, "live", 60.0), 4);
    assert_int_equal(choose(600.0, "live", 60.0), 8);
    assert_int_equal(choose(600.0, "live", 700.0), 1);
    assert_int_equal(choose(1e12, "live", 60.0), 16);
    assert_int_equal(choose(230.0, "path", 60.0), 2);
    assert_int_equal(choose(250.0, "path", 60.0), 4); /* of powers of two, which fill tiles */
}

/* A machine on which a pass takes fixed + whole / side^exponent, of which nothing but that is known: from the third
 * frame on a dragged view keeps its time, and no finer side would (but for sides that are nearly as dear as the time
 * allows). */
static void a_drag_keeps_its_time(void **state)
{
    (void)state;
    static const struct {
        double fixed, whole, exponent;
    } machines[] = {{2, 300, 1.25}, {20, 300, 1.0}, {1, 2000, 2.0}, {0, 40, 1.0}, {5, 5000, 1.5}};
    const struct lum_method *live = lum_method_find("live");
    for (size_t m = 0; m < sizeof machines / sizeof *machines; m++)
        for (double limit = 30.0; limit < 1000.0; limit *= 2.0) {
            struct lum_pace p = {0};
            uint32_t side = 0;
            for (uint32_t frame = 0; frame < 20; frame++) {
                side = lum_pace_choose(&p, live, limit);
                double ms = machines[m].fixed + machines[m].whole * pow(side, -machines[m].exponent);
                lum_pace_note(&p, side, ms);
                if (frame >= 3 && side < 16 && ms > 1.2 * limit)
                    fail_msg("machine %zu, limit %g: frame %u took %g ms", m, limit, frame, ms);
            }
            if (side > 1 &&
                machines[m].fixed + machines[m].whole * pow(side / 2.0, -machines[m].exponent) < 0.5 * limit)
                fail_msg("machine %zu, limit %g: side %u is rougher than need be", m, limit, side);
        }
}

/* A scene that grows dearer by the frame makes the picture rougher, at once; one that grows cheaper finer again, once
 * what was is forgotten. */
static void it_follows_the_scene(void **state)
{
    (void)state;
    const struct lum_method *live = lum_method_find("live");
    struct lum_pace p = {0};
    uint32_t side = 0, roughest = 0;
    for (int frame = 0; frame < 120; frame++) {
        double whole = frame < 10 ? 100.0 : frame < 30 ? 600.0 : 50.0;
        side = lum_pace_choose(&p, live, 60.0);
        lum_pace_note(&p, side, whole * pow(side, -1.25));
        roughest = side > roughest ? side : roughest;
        if (frame == 9)
            assert_int_equal(side, 2);
        if (frame == 29)
            assert_int_equal(side, 8);
    }
    assert_int_equal(roughest, 8);
    assert_int_equal(side, 1);
}

static void cost_goes_with_pixels(void **state)
{
    (void)state;
    struct lum_pace p = {0};
    lum_pace_note(&p, 1, 50.0);
    assert_int_equal(lum_pace_choose(&p, lum_method_find("live"), 60.0), 1);
    lum_pace_scale(&p, 4.0);
    assert_int_equal(lum_pace_choose(&p, lum_method_find("live"), 60.0), 3);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(blocks_are_as_small_as_time_allows),
        cmocka_unit_test(a_drag_keeps_its_time),
        cmocka_unit_test(it_follows_the_scene),
        cmocka_unit_test(cost_goes_with_pixels),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

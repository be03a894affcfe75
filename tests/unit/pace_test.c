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
#include "core/render/view.h"

/* None of whose time can be eased. */
static void note(struct lum_pace *p, uint32_t side, double ms)
{
    lum_pace_note(p, lum_method_find("live"), &(struct lum_pace_pass){.side = side, .ms = ms});
}

static uint32_t choose(double whole_ms, const char *method, double limit_ms)
{
    struct lum_pace p = {0};
    note(&p, 1, whole_ms);
    return lum_pace_choose(&p, lum_method_find(method), limit_ms).side;
}

/* As small as leaves one in its time, and never more than a pass takes. */
static void blocks_are_as_small_as_time_allows(void **state)
{
    (void)state;
    struct lum_pace unknown = {0};
    assert_int_equal(lum_pace_choose(&unknown, lum_method_find("live"), 60.0).side, 8);
    assert_int_equal(choose(54.0, "live", 60.0), 1);
    assert_int_equal(choose(120.0, "live", 60.0), 2);
    assert_int_equal(choose(180.0, "live", 60.0), 3);
    assert_int_equal(choose(300.0, "live", 60.0), 4);
    assert_int_equal(choose(600.0, "live", 60.0), 8);
    assert_int_equal(choose(600.0, "live", 700.0), 1);
    assert_int_equal(choose(1e12, "live", 60.0), 32); /* of blocks of 16 at half the size */
    assert_int_equal(choose(1e12, "path", 60.0), 16);
    assert_int_equal(choose(230.0, "path", 60.0), 2);
    assert_int_equal(choose(250.0, "path", 60.0), 4); /* of powers of two, which fill tiles */
}

/* What does not hang on the side is told, and what is expected of sides that were not tried is what they take. */
static void fixed_time_is_no_reason_for_larger_blocks(void **state)
{
    (void)state;
    static const uint32_t sides[] = {16, 12, 8};
    const struct lum_method *live = lum_method_find("live");
    for (double fixed_ms = 0.0; fixed_ms <= 30.0; fixed_ms += 10.0)
        for (size_t k = 0; k < sizeof sides / sizeof *sides; k++) {
            struct lum_pace p = {0};
            double at16 = 4.0, at = at16 * pow(16.0 / sides[k], 1.25) + fixed_ms;
            lum_pace_note(&p, live, &(struct lum_pace_pass){.side = 16, .ms = at16 + fixed_ms, .fixed_ms = fixed_ms});
            struct lum_pace_choice c = lum_pace_choose(&p, live, at * (1.0 + 1e-9));
            assert_int_equal(c.side, sides[k]);
            assert_true(fabs(c.ms - at) < 1e-9 * at);
        }
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
                side = lum_pace_choose(&p, live, limit).side;
                double ms = machines[m].fixed + machines[m].whole * pow(side, -machines[m].exponent);
                note(&p, side, ms);
                if (frame >= 3 && side < LUM_PREVIEW_MAX && ms > 1.2 * limit)
                    fail_msg("machine %zu, limit %g: frame %u took %g ms", m, limit, frame, ms);
            }
            if (side > 1 &&
                machines[m].fixed + machines[m].whole * pow(side / 2.0, -machines[m].exponent) < 0.5 * limit)
                fail_msg("machine %zu, limit %g: side %u is rougher than need be", m, limit, side);
        }
}

/* Where to see all surfaces is most of a pass, larger blocks are of no use: half the size is, from the third frame on,
 * and serves for as long as the whole size would take too long. */
static void half_the_size_is_the_last_resort(void **state)
{
    (void)state;
    const struct lum_method *live = lum_method_find("live");
    for (double limit = 30.0; limit <= 480.0; limit *= 2.0) {
        struct lum_pace p = {0};
        uint32_t n_late = 0, n_half = 0;
        double whole_16 = 100.0 + 500.0 * pow(16.0, -1.25); /* ms: of all surfaces, and of light by the side */
        note(&p, 1, 600.0);
        for (uint32_t frame = 0; frame < 100; frame++) {
            uint32_t side = lum_pace_choose(&p, live, limit).side;
            bool half = side > LUM_PREVIEW_WHOLE;
            double ms = half ? whole_16 / 4.0 : 100.0 + 500.0 * pow(side, -1.25);
            note(&p, side, ms);
            n_half += half;
            n_late += frame >= 3 && ms > 1.2 * limit;
        }
        /* forgotten after 30 passes, and tried again: but it is known from half the size that it would be too dear */
        assert_int_equal(n_late, 0);
        assert_true(limit < whole_16 ? n_half >= 97 : n_half <= 1);
    }
}

/* The first pass of a side makes its buffers and takes long: that is no reason for ever to take it for dearer than the
 * next, and to go to and fro between the two. What is forgotten after 30 passes may be tried again. */
static void each_side_is_learned(void **state)
{
    (void)state;
    static const struct {
        double surfaces, light, half; /* ms of the whole size; of half of it, over that of blocks of 16 */
    } machines[] = {{13.0, 120.0, 0.36}, {17.0, 60.0, 0.3}, {14.0, 30.0, 0.5}, {5.0, 200.0, 0.25}};
    for (size_t m = 0; m < LUM_ARRAY_LEN(machines); m++)
        for (double limit = 10.0; limit < 40.0; limit *= 1.1) {
            struct lum_pace p = {0};
            bool seen[LUM_PREVIEW_MAX + 1] = {false};
            uint32_t n_late = 0, n_changes = 0, was = 0;
            note(&p, 1, machines[m].surfaces + machines[m].light);
            for (uint32_t frame = 0; frame < 100; frame++) {
                uint32_t side = lum_pace_choose(&p, lum_method_find("live"), limit).side;
                bool half = side > LUM_PREVIEW_WHOLE;
                double ms = (half ? machines[m].half : 1.0) *
                            (machines[m].surfaces + machines[m].light * pow(half ? 16 : side, -1.25));
                note(&p, side, seen[side] ? ms : 2.5 * ms);
                n_changes += frame >= 5 && side != was;
                n_late += frame >= 5 && seen[side] && ms > 1.2 * limit && !half;
                seen[side] = true;
                was = side;
            }
            if (n_late > 2 || n_changes > 12)
                fail_msg("machine %zu, limit %g: %u late, %u changes", m, limit, n_late, n_changes);
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
        side = lum_pace_choose(&p, live, 60.0).side;
        note(&p, side, whole * pow(side, -1.25));
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
    note(&p, 1, 50.0);
    assert_int_equal(lum_pace_choose(&p, lum_method_find("live"), 60.0).side, 1);
    lum_pace_scale(&p, 4.0);
    assert_int_equal(lum_pace_choose(&p, lum_method_find("live"), 60.0).side, 3);
}

/* A pass of blocks of 2 takes .42 of a whole one, 300 ms, of 3 .25: of these, too, half is the stage that is eased. */
static void what_costs_least_accuracy_goes_first(void **state)
{
    (void)state;
    static const struct {
        const char *method, *eased;
        double limit_ms;
        uint32_t side;
        double ms;
    } rows[] = {
        {"live", NULL, 301.0, 1, 300.0},
        {"live", NULL, 127.0, 2, 126.13},
        {"live", "shadow_rays", 100.0, 2, 63.07}, /* and not blocks of 3 */
        {"live", "shadow_rays", 64.0, 2, 63.07},
        {"live", "shadow_rays", 60.0, 3, 37.99},
        {"irrcache", "record_rays", 100.0, 2, 81.99}, /* .3 of the stage is left */
        {"tic", NULL, 100.0, 3, 75.98},               /* nothing of it is worth it */
        {"live", "shadow_rays", 0.01, 32, 1.17},      /* not to be kept: the least there is */
    };
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        const struct lum_method *method = lum_method_find(rows[i].method);
        struct lum_pace p = {0};
        lum_pace_note(&p, method, &(struct lum_pace_pass){.side = 1, .ms = 300.0, .stage_ms = 150.0});
        struct lum_pace_choice c = lum_pace_choose(&p, method, rows[i].limit_ms);
        const char *eased = c.eased ? c.eased : "nothing", *expected = rows[i].eased ? rows[i].eased : "nothing";
        if (c.side != rows[i].side || strcmp(eased, expected) != 0 || fabs(c.ms - rows[i].ms) > 0.01)
            fail_msg("row %zu: blocks of %u, %s eased, %.2f ms", i, c.side, eased, c.ms);
    }
}

/* On machines where a pass takes fixed + refined of one stage, both by the side: the view is within a fifth of its time
 * from the third frame on wherever any choice is, though it knows nothing of the machine but what passes took; and
 * eased passes say the same of those that are not. */
static void an_eased_drag_keeps_its_time(void **state)
{
    (void)state;
    static const struct {
        const char *method;
        double fixed, whole, stage, left; /* ms; the last two: of the stage alone */
    } machines[] = {{"live", 1, 100, 200, 0.0}, {"live", 5, 400, 40, 0.0}, {"irrcache", 3, 100, 900, 0.3}};
    for (size_t m = 0; m < sizeof machines / sizeof *machines; m++)
        for (double limit = 20.0; limit < 1000.0; limit *= 2.0) {
            const struct lum_method *method = lum_method_find(machines[m].method);
            struct lum_pace p = {0};
            for (uint32_t frame = 0; frame < 100; frame++) {
                struct lum_pace_choice c = lum_pace_choose(&p, method, limit);
                double part = pow(c.side, -1.25), stage = machines[m].stage * part * (c.eased ? machines[m].left : 1.0);
                double ms = machines[m].fixed + machines[m].whole * part + stage;
                if (frame >= 3 && c.side < LUM_PREVIEW_MAX && ms > 1.2 * limit)
                    fail_msg("machine %zu, limit %g: frame %u took %g ms, %g were expected", m, limit, frame, ms, c.ms);
                if (c.eased && c.side <= 2 &&
                    machines[m].fixed + (machines[m].whole + machines[m].stage) * part < limit)
                    fail_msg("machine %zu, limit %g: frame %u is eased for nothing", m, limit, frame);
                lum_pace_note(
                    &p, method,
                    &(struct lum_pace_pass){.side = c.side, .eased = c.eased != NULL, .ms = ms, .stage_ms = stage});
            }
        }
}

static void only_what_the_table_names_is_eased(void **state)
{
    (void)state;
    size_t n;
    for (const struct lum_method *m = lum_methods(&n), *end = m + n; m < end; m++) {
        struct lum_view_settings s = lum_view_settings_default(), was;
        s.method = m;
        was = s;
        lum_pace_apply_ease(&s);
        bool live = strcmp(m->name, "live") == 0, irrcache = strcmp(m->name, "irrcache") == 0;
        assert_int_equal(s.shadow_budget, live ? 0 : was.shadow_budget);
        assert_int_equal(s.n_vpls, irrcache ? was.n_vpls / 4 : was.n_vpls);
        assert_int_equal(lum_pace_ease_of(m) != NULL, live || irrcache);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(blocks_are_as_small_as_time_allows),
        cmocka_unit_test(fixed_time_is_no_reason_for_larger_blocks),
        cmocka_unit_test(a_drag_keeps_its_time),
        cmocka_unit_test(half_the_size_is_the_last_resort),
        cmocka_unit_test(each_side_is_learned),
        cmocka_unit_test(it_follows_the_scene),
        cmocka_unit_test(cost_goes_with_pixels),
        cmocka_unit_test(what_costs_least_accuracy_goes_first),
        cmocka_unit_test(an_eased_drag_keeps_its_time),
        cmocka_unit_test(only_what_the_table_names_is_eased),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

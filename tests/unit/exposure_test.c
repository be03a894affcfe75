/* Automatic exposure over time. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "server/director/exposure.h"

/* Pictures that would be exposed to goal, one each step, until nothing follows; how many. */
static int see_until_still(struct lum_auto_exposure *a, double goal, int64_t *now_ns)
{
    int n = 0;
    do {
        double was = a->ev;
        *now_ns += LUM_EXPOSURE_STEP_NS;
        lum_auto_exposure_see(a, goal, true, *now_ns);
        assert_true(fabs(a->ev - goal) <= fabs(was - goal)); /* it never goes the other way, nor beyond */
        n++;
    } while (a->follows && n < 1000);
    return n;
}

static struct lum_auto_exposure settled_at(double ev)
{
    struct lum_auto_exposure a = {0};
    lum_auto_exposure_see(&a, ev, true, 0);
    assert_true(a.settled && !a.follows && a.ev == ev);
    return a;
}

static void it_is_kept_within_its_latitude(void **state)
{
    (void)state;
    const double off[] = {-LUM_EXPOSURE_LATITUDE, -0.5, 0.0, 1.0, LUM_EXPOSURE_LATITUDE};
    for (size_t i = 0; i < sizeof off / sizeof off[0]; i++) {
        struct lum_auto_exposure a = settled_at(8.0);
        lum_auto_exposure_see(&a, 8.0 + off[i], true, 1000000000);
        assert_true(a.ev == 8.0 && !a.follows);
    }
}

/* The first picture shows a change as it is; then what is beyond is followed, e^-t of it left: log(2 / 0.02) seconds to
 * within 0.02 stops of 2, and as long for less. */
static void what_is_beyond_is_followed_slowly(void **state)
{
    (void)state;
    for (int sign = -1; sign <= 1; sign += 2) {
        int64_t now_ns = 5000000000;
        struct lum_auto_exposure a = settled_at(8.0);
        double goal = 8.0 + sign * (LUM_EXPOSURE_LATITUDE + 2.0);
        lum_auto_exposure_see(&a, goal, true, now_ns);
        assert_true(a.ev == 8.0 && a.follows);
        int n = see_until_still(&a, goal, &now_ns);
        assert_true(fabs(fabs(goal - a.ev) - LUM_EXPOSURE_LATITUDE) < 0.021);
        double seconds = n * LUM_EXPOSURE_STEP_NS * 1e-9;
        assert_true(fabs(seconds - LUM_EXPOSURE_FOLLOWS_S * log(2.0 / 0.02)) < 0.25);
    }
}

/* Rough pictures and black ones move nothing. */
static void what_says_nothing_is_not_followed(void **state)
{
    (void)state;
    struct lum_auto_exposure a = settled_at(8.0);
    lum_auto_exposure_see(&a, 14.0, false, 1000000000);
    assert_true(a.ev == 8.0 && !a.follows);
    lum_auto_exposure_see(&a, 14.0, true, 2000000000);
    assert_true(a.follows);
    lum_auto_exposure_see(&a, 0.0, true, 3000000000);
    assert_true(a.ev == 8.0 && !a.follows);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(it_is_kept_within_its_latitude),
        cmocka_unit_test(what_is_beyond_is_followed_slowly),
        cmocka_unit_test(what_says_nothing_is_not_followed),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

/* Where a budget ends a picture. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include <math.h>
#include <string.h>

#include "server/director/budget.h"

static const char *stop(const struct lum_view_budget *budget, const char *method, const struct lum_pass_stats *pass,
                        double spent_ms)
{
    const char *why = lum_budget_stop(budget, lum_method_find(method), pass, spent_ms);
    return why ? why : "";
}

/* However long the passes are, the picture ends no further from its time than half of one. */
static void a_time_is_met_within_half_a_pass(void **state)
{
    (void)state;
    const struct lum_view_budget budget = {.time_ms = {true, 1000.0}};
    for (double ms = 1.0; ms < 3000.0; ms *= 1.37) {
        struct lum_pass_stats pass = {.ms = ms, .spp = 1, .error = LUM_FILM_ERROR_UNKNOWN};
        double spent_ms = ms;
        while (!*stop(&budget, "path", &pass, spent_ms)) {
            spent_ms += ms;
            pass.spp++;
        }
        assert_string_equal(stop(&budget, "path", &pass, spent_ms), "time");
        if (!(fabs(spent_ms - 1000.0) <= 0.5 * ms || pass.spp == 1))
            fail_msg("passes of %g ms ended at %g ms", ms, spent_ms);
    }
}

/* What is met first ends it; a picture of no whole sample goes on. */
static void the_first_one_ends_it(void **state)
{
    (void)state;
    const struct lum_view_budget budget = {.time_ms = {true, 1000.0}, .error = {true, 0.1}}, none = {0};
    struct lum_pass_stats pass = {.ms = 10.0, .spp = 4, .error = {.rel = 0.05, .bound = 0.09, .fresh = 1.0}};
    assert_string_equal(stop(&budget, "live", &pass, 50.0), "error");
    assert_string_equal(stop(&none, "live", &pass, 1e6), "");
    pass.error.fresh = 0.9;
    assert_string_equal(stop(&budget, "live", &pass, 50.0), "");
    pass.error.fresh = 1.0;
    pass.error.bound = 0.11;
    assert_string_equal(stop(&budget, "live", &pass, 50.0), "");
    assert_string_equal(stop(&budget, "live", &pass, 995.0), "time");
    pass.spp = 0;
    assert_string_equal(stop(&budget, "live", &pass, 2000.0), "");
    pass.spp = 1;
    assert_string_equal(stop(&budget, "tic", &pass, 2000.0), ""); /* its error is still being measured */
    pass.complete = true;
    assert_string_equal(stop(&budget, "tic", &pass, 2000.0), "whole");
    pass.error = LUM_FILM_ERROR_UNKNOWN;
    assert_string_equal(stop(&none, "path", &pass, 1.0), "spp");
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_time_is_met_within_half_a_pass),
        cmocka_unit_test(the_first_one_ends_it),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

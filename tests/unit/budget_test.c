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

/* What is black has no error to wait for: that is said after 64 samples. Without an error asked for it goes on. */
static void a_black_picture_ends_early(void **state)
{
    (void)state;
    const struct lum_view_budget budget = {.error = {true, 0.1}}, none = {0};
    struct lum_pass_stats pass = {.spp = 63, .unlit = true, .error = LUM_FILM_ERROR_UNKNOWN};
    assert_string_equal(stop(&budget, "path", &pass, 50.0), "");
    pass.spp = 64;
    assert_string_equal(stop(&budget, "path", &pass, 50.0), "black");
    assert_string_equal(stop(&none, "path", &pass, 50.0), "");
    pass.unlit = false;
    assert_string_equal(stop(&budget, "path", &pass, 50.0), "");
}

/* ---- what is expected ---- */

#define SAMPLE_MS 20.0
#define BOUND_OF_ONE 0.4 /* of noise alone: n samples have it over sqrt(n) */

/* A picture of `path` after so many samples. */
static struct lum_budget_watch refined(const struct lum_view_budget *budget, uint32_t max_spp, uint32_t spp)
{
    const struct lum_view_settings settings = {.method = lum_method_find("path"), .max_spp = max_spp};
    struct lum_budget_watch w;
    lum_budget_begin(&w);
    for (uint32_t i = 1; i <= spp; i++) {
        struct lum_pass_stats pass = {.spp = i, .ms = SAMPLE_MS, .complete = i == max_spp};
        pass.noise = BOUND_OF_ONE / sqrt(i);
        pass.error = (struct lum_film_error){.rel = 0.8 * pass.noise, .bound = pass.noise, .fresh = 1.0};
        lum_budget_note(&w, budget, &settings, &pass, SAMPLE_MS * i);
    }
    return w;
}

static void assert_end(const struct lum_budget_end *end, const char *stopped_by, double ms, double error)
{
    assert_string_equal(end->stopped_by ? end->stopped_by : "", stopped_by);
    if (!(fabs(end->ms.likely - ms) <= 1e-6 * ms && fabs(end->error.likely - error) <= 1e-6 * error))
        fail_msg("%s: %g ms instead of %g, error %g instead of %g", stopped_by, end->ms.likely, ms, end->error.likely,
                 error);
    assert_true(end->ms.least <= ms && ms <= end->ms.most);
    assert_true(end->error.least <= error && error <= end->error.most);
}

/* By noise alone 0.05 takes (0.4 / 0.05)^2 = 64 samples: whichever of it, the time and the samples comes first. */
static void the_end_is_predicted(void **state)
{
    (void)state;
    struct lum_view_budget budget = {.error = {true, 0.05}};
    struct lum_budget_watch w = refined(&budget, 1000, 1);
    assert_null(w.now.stopped_by); /* what a sample takes is not known */
    assert_string_equal(w.verdict, "open");
    w = refined(&budget, 1000, 8);
    assert_end(&w.now, "error", 64 * SAMPLE_MS, 0.05);
    assert_string_equal(w.verdict, "likely");
    w = refined(&budget, 36, 8);
    assert_end(&w.now, "spp", 36 * SAMPLE_MS, 0.4 / 6.0);
    assert_string_equal(w.verdict, "open"); /* what is known of it could be met after 18 samples already */
    w = refined(&budget, 16, 8);
    assert_end(&w.now, "spp", 16 * SAMPLE_MS, 0.1);
    assert_string_equal(w.verdict, "unlikely");
    budget.time_ms = (struct lum_opt){true, 16 * SAMPLE_MS};
    w = refined(&budget, 36, 8);
    assert_end(&w.now, "time", 16 * SAMPLE_MS, 0.1);
    assert_string_equal(w.verdict, "unlikely");
    budget.error.set = false;
    w = refined(&budget, 36, 8);
    assert_end(&w.now, "time", 16 * SAMPLE_MS, 0.1);
    assert_null(w.verdict);
}

/* Of a picture that stopped it is told what was expected when that was first known, so that it can be compared. */
static void what_came_is_told_beside_what_was_expected(void **state)
{
    (void)state;
    const struct lum_view_budget budget = {.error = {true, 0.1}};
    struct lum_budget_watch w = refined(&budget, 1000, 15);
    assert_null(w.stopped_by);
    w = refined(&budget, 1000, 16);
    assert_string_equal(w.stopped_by, "error");
    assert_string_equal(w.verdict, "met");
    struct lum_budget_news news = lum_budget_news_of(&w);
    assert_string_equal(news.predicted.stopped_by, "error"); /* after two samples, by no more than how noise may fall */
    assert_true(news.predicted.ms.least <= 16 * SAMPLE_MS && 16 * SAMPLE_MS <= news.predicted.ms.most);
    assert_true(news.spent_ms == 16 * SAMPLE_MS);
    w = refined(&budget, 9, 9);
    assert_string_equal(w.stopped_by, "spp");
    assert_string_equal(w.verdict, "missed");
    const struct lum_view_settings more = {.method = lum_method_find("path"), .max_spp = 100};
    w.pass.complete = false;
    lum_budget_change(&w, &(struct lum_view_budget){.error = {true, 0.05}}, &more);
    assert_null(w.stopped_by);
    assert_end(&w.first, "error", 64 * SAMPLE_MS, 0.05);
}

/* No pass makes it better: as soon as its error is measured, by more than a few probes, it is judged by that. */
static void a_method_without_samples_says_at_once(void **state)
{
    (void)state;
    const struct lum_view_settings settings = {.method = lum_method_find("tic"), .max_spp = 1};
    struct lum_pass_stats pass = {
        .spp = 1, .ms = 10.0, .noise = (double)NAN, .error = {.rel = 0.1, .bound = 0.2, .fresh = 0.5}};
    const struct {
        double error, fresh, probes;
        bool complete;
        const char *verdict, *stopped_by;
    } rows[] = {
        {0.05, 0.5, 256, false, "open", ""},     {0.05, 1.0, 255, false, "open", ""},
        {0.05, 1.0, 256, false, "unlikely", ""}, {0.05, 1.0, 256, true, "missed", "whole"},
        {0.15, 1.0, 256, false, "open", ""},     {0.15, 1.0, 256, true, "missed", "whole"},
        {0.25, 1.0, 256, true, "met", "error"},
    };
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        struct lum_budget_watch w;
        pass.error.fresh = rows[i].fresh;
        pass.error.probes = rows[i].probes;
        pass.complete = rows[i].complete;
        lum_budget_begin(&w);
        lum_budget_note(&w, &(struct lum_view_budget){.error = {true, rows[i].error}}, &settings, &pass, 10.0);
        assert_string_equal(w.verdict, rows[i].verdict);
        assert_string_equal(w.stopped_by ? w.stopped_by : "", rows[i].stopped_by);
        assert_null(w.now.stopped_by);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_time_is_met_within_half_a_pass),
        cmocka_unit_test(the_first_one_ends_it),
        cmocka_unit_test(a_black_picture_ends_early),
        cmocka_unit_test(the_end_is_predicted),
        cmocka_unit_test(what_came_is_told_beside_what_was_expected),
        cmocka_unit_test(a_method_without_samples_says_at_once),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

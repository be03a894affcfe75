/* Is a promise kept? A picture is refined as --error and --time have it, by the same code (server/director/budget.h),
 * under several promises at once: each is over where it would have stopped. Then the true error of a picture that
 * stopped by an error, the time of one that stopped by a time, and what was predicted of both. A run that does not get
 * there in --seconds is counted, and says nothing. */
#include <math.h>
#include <string.h>

#include "server/director/budget.h"
#include "tests/bench/places.h"
#include "tests/bench/reference.h"
#include "tests/bench/table.h"

#define METHODS "live,path"
#define TIME_MS 1000.0
#define TIME_WITHIN 0.1

enum { MAX_SEEDS = 30, QUICK_SEEDS = 2, QUICK_SPP = 100 };

enum promise { ERROR_20, ERROR_10, ERROR_5, ERROR_2, TIME_1, PROMISES };
static const struct {
    const char *name;
    double error, time_ms;
} promises[] = {[ERROR_20] = {"--error 0.2", 0.2, 0.0},
                [ERROR_10] = {"--error 0.1", 0.1, 0.0},
                [ERROR_5] = {"--error 0.05", 0.05, 0.0},
                [ERROR_2] = {"--error 0.02", 0.02, 0.0},
                [TIME_1] = {"--time 1", 0.0, TIME_MS}};

/* Of a scene, a method and a promise; those that stopped as promised. */
struct runs {
    size_t n_runs, n, n_kept, n_predicted, n_in_range;
    double part[MAX_SEEDS]; /* true error over the promised one, or time */
    double ms[MAX_SEEDS];
    double predicted[MAX_SEEDS]; /* time over that which was first predicted */
};

struct rig {
    struct lum_bench_stand at;
    const struct lum_method *method;
    struct lum_bench_reference reference;
    double patience_ms;
    struct runs runs[PROMISES];
};

static struct lum_view_budget budget_of(enum promise p)
{
    return (struct lum_view_budget){.time_ms = {promises[p].time_ms > 0.0, promises[p].time_ms},
                                    .error = {promises[p].error > 0.0, promises[p].error}};
}

/* ---- a run ---- */

static void note_prediction(struct runs *r, const struct lum_budget_watch *w)
{
    const struct lum_forecast_range *ms = &w->first.ms;
    if (!w->first.stopped_by)
        return;
    r->n_in_range += ms->least <= w->spent_ms && !(w->spent_ms > ms->most);
    r->predicted[r->n_predicted++] = w->spent_ms / ms->likely;
}

static void note_stop(struct rig *rig, const struct lum_view *view, enum promise p, const struct lum_budget_watch *w)
{
    struct runs *r = &rig->runs[p];
    if (strcmp(w->stopped_by, p == TIME_1 ? "time" : "error") != 0)
        return;
    r->ms[r->n] = w->spent_ms;
    if (p == TIME_1) {
        r->part[r->n] = w->spent_ms / TIME_MS;
        r->n_kept += fabs(r->part[r->n] - 1.0) <= TIME_WITHIN;
    } else {
        lum_bench_picture_of(view, rig->at.picture);
        r->part[r->n] = lum_bench_rms_of_picture(&rig->reference, rig->at.picture) / promises[p].error;
        r->n_kept += r->part[r->n] <= 1.0;
        note_prediction(r, w);
    }
    r->n++;
}

/* All promises of one picture. */
static bool run_passes(struct rig *rig, struct lum_view *view)
{
    struct lum_error err = {0};
    struct lum_budget_watch watches[PROMISES];
    struct lum_pass_stats pass;
    size_t n_open = PROMISES;
    double spent_ms = 0.0;
    for (enum promise p = 0; p < PROMISES; p++) {
        lum_budget_begin(&watches[p]);
        rig->runs[p].n_runs++;
    }
    do {
        if (lum_view_pass(view, rig->at.world.snapshot, &rig->at.settings, NULL, &pass, &err) != LUM_OK)
            return lum_bench_failed(err.text);
        spent_ms += pass.ms;
        for (enum promise p = 0; p < PROMISES; p++) {
            const struct lum_view_budget budget = budget_of(p);
            if (watches[p].stopped_by)
                continue;
            lum_budget_note(&watches[p], &budget, &rig->at.settings, &pass, spent_ms);
            if (!watches[p].stopped_by)
                continue;
            note_stop(rig, view, p, &watches[p]);
            n_open--;
        }
    } while (n_open > 0 && spent_ms < rig->patience_ms);
    return true;
}

/* On a view of its own, with caches of its own. */
static bool run(struct rig *rig, uint32_t seed)
{
    struct lum_error err = {0};
    struct lum_view *view = NULL;
    rig->at.settings.seed = seed;
    bool ok =
        lum_view_create(rig->at.world.pool, &view, &err) == LUM_OK ? run_passes(rig, view) : lum_bench_failed(err.text);
    lum_view_destroy(view);
    return ok;
}

/* ---- a scene ---- */

static bool open_rig(struct rig *rig)
{
    const struct lum_bench_options *o = rig->at.options;
    if (!lum_bench_stand_open(&rig->at, (const uint32_t[]){96, 64}, (const uint32_t[]){48, 32}))
        return false;
    rig->at.settings.max_spp = o->quick ? QUICK_SPP : LUM_LIMIT_SPP;
    rig->at.settings.error_share = LUM_ERROR_SHARE;
    rig->patience_ms = 1e3 * o->seconds;
    struct lum_bench_truth truth = lum_bench_truth_of(o, &rig->at.world, &rig->at.settings);
    truth.least_spp = truth.most_spp;
    truth.or_more = true;
    return lum_bench_reference_make(&rig->reference, &truth);
}

static const struct lum_bench_column columns[] = {
    {"scene", "scene", LUM_BENCH_TEXT},
    {"method", "method", LUM_BENCH_TEXT},
    {"promise", "promise", LUM_BENCH_TEXT},
    {"runs", "runs", 0},
    {"stopped", "stopped so", 0},
    {"kept", "kept", 0},
    {"part", "true / promised, median", 3},
    {"most", "most", 3},
    {"ms", "ms, median", 0},
    {"predicted", "predicted", 0},
    {"in_range", "within the range", 0},
    {"over_predicted", "time / first predicted, median", 2},
};

static double quantile(double *values, size_t n, double q)
{
    return n > 0 ? lum_bench_quantile(values, n, q) : (double)NAN;
}

static void tell(struct rig *rig, enum promise p, struct lum_bench_table *table)
{
    struct runs *r = &rig->runs[p];
    LUM_BENCH_TEXTS(table, rig->at.place->scene, rig->method->name, promises[p].name);
    LUM_BENCH_NUMBERS(table, (double)r->n_runs, (double)r->n, (double)r->n_kept, quantile(r->part, r->n, 0.5),
                      quantile(r->part, r->n, 1.0), quantile(r->ms, r->n, 0.5), (double)r->n_predicted,
                      (double)r->n_in_range, quantile(r->predicted, r->n_predicted, 0.5));
}

static bool measure_scene(void *of, void *table)
{
    struct rig *rig = of;
    uint32_t n_seeds = rig->at.options->quick ? QUICK_SEEDS : (uint32_t)rig->at.options->seeds;
    lum_bench_progress("budgets: %s", rig->at.place->scene);
    bool ok = open_rig(rig);
    for (size_t m = 0; m < rig->at.n_methods && ok; m++) {
        lum_bench_progress("budgets: %s: %s", rig->at.place->scene, rig->at.methods[m]->name);
        rig->method = rig->at.settings.method = rig->at.methods[m];
        memset(rig->runs, 0, sizeof rig->runs);
        for (uint32_t seed = 0; seed < n_seeds && ok; seed++)
            ok = run(rig, seed);
        for (enum promise p = 0; p < PROMISES && ok; p++)
            tell(rig, p, table);
    }
    return ok;
}

static void close_rig(void *of)
{
    struct rig *rig = of;
    lum_bench_reference_finish(&rig->reference);
    lum_bench_stand_close(&rig->at);
}

int lum_bench_budgets(const struct lum_bench_options *options)
{
    const struct lum_bench_tour tour = {METHODS, sizeof(struct rig), measure_scene, close_rig};
    struct lum_bench_table table = LUM_BENCH_TABLE(columns);
    bool ok = lum_bench_go(&tour, options, &table);
    ok = lum_bench_table_finish(&table, options, "budgets") && ok;
    return ok ? 0 : 1;
}

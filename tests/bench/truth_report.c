/* The truth study as tables on stdout, as CSV and JSON. */
#include <math.h>
#include <string.h>

#include "core/metric/metric.h"
#include "tests/bench/table.h"
#include "tests/bench/truth.h"

#define TEXT LUM_BENCH_TEXT

/* All over the reference; percentiles are of blocks. */
#define BLOCK_COLUMNS                                                                                                  \
    {"mean", "mean", 3}, {"median", "median", 3}, {"p5", "5 %", 3}, {"p25", NULL, 4}, {"p75", NULL, 4},                \
        {"p95", "95 %", 3}, {"lowest", "lowest", 2}, {"highest", "highest", 2}, {"counted", NULL, 0},                  \
        {"dark", NULL, 0}, {"stderr_mean", NULL, 5}, {"stderr_block_median", "reference's own, median", 4},            \
        {"stderr_block_p95", "95 %", 4},                                                                               \
    {                                                                                                                  \
        "reference_spp", "samples", 0                                                                                  \
    }

static void put_blocks(struct lum_bench_table *t, const struct lum_blocks_result *b, uint32_t reference_spp)
{
    const double none = (double)NAN;
    if (b->n_counted == 0) {
        LUM_BENCH_NUMBERS(t, none, none, none, none, none, none, none, none, none, none, none, none, none, none);
        return;
    }
    LUM_BENCH_NUMBERS(t, b->mean, b->median, b->p5, b->p25, b->p75, b->p95, b->lowest, b->highest, b->n_counted,
                      b->n_dark, b->mean_stderr, b->stderr_median, b->stderr_p95, reference_spp);
}

/* ---- pictures ---- */

static const struct lum_bench_column row_columns[] = {
    {"scene", "scene", TEXT},
    {"method", "method", TEXT},
    {"when", "when", TEXT},
    {"own_s", "s", 3},
    {"wall_s", NULL, 3},
    {"spp", "spp", 0},
    BLOCK_COLUMNS,
    {"smape", "SMAPE", 4},
    {"relmse", "relMSE", 4},
    {"error_rms", "error", 4},
    {"error_said", "that it says", 4},
    LUM_BENCH_RAY_COLUMNS(0),
};

/* Of pictures at rest whose true error the reference can tell, how many methods said one that is no less. */
static void report_said(const struct truth_study *study)
{
    size_t n_told = 0, n_covered = 0;
    for (size_t i = 0; i < study->n_rows; i++) {
        const struct truth_row *r = &study->rows[i];
        if (isnan(r->error_said) || isnan(r->error_rms) || !strcmp(r->when, "moving"))
            continue;
        n_told++;
        n_covered += r->error_said >= r->error_rms;
    }
    if (n_told)
        printf("What methods say of their error is no less than it is in %zu of %zu pictures.\n", n_covered, n_told);
}

static bool report_rows(const struct truth_study *study, const struct lum_bench_options *options)
{
    struct lum_bench_table t = LUM_BENCH_TABLE(row_columns);
    for (size_t i = 0; i < study->n_rows; i++) {
        const struct truth_row *r = &study->rows[i];
        LUM_BENCH_TEXTS(&t, r->scene, r->method, r->when);
        LUM_BENCH_NUMBERS(&t, r->own_s, r->wall_s, r->spp);
        put_blocks(&t, &r->blocks, r->reference_spp);
        LUM_BENCH_NUMBERS(&t, r->error.smape, r->error.relmse, r->error_rms, r->error_said);
        for (int k = 0; k < LUM_RAY_KIND_COUNT; k++)
            lum_bench_table_number(&t, (double)r->rays[k]);
    }
    printf("Mean luminance over that of the reference, whole and by blocks of 1/24 of the width; %s.\n"
           "s: seconds of a machine of its own (CPU time over threads); moving: of a frame.\n"
           "error: root mean square of luminance over its mean; what a method says of it is meant to be the same.\n",
           study->machine);
    printf(LUM_BENCH_RELMSE ".\n", LUM_METRIC_EPSILON, LUM_METRIC_EPSILON);
    report_said(study);
    return lum_bench_table_finish(&t, options, "truth");
}

/* ---- the first picture ---- */

static const struct lum_bench_column cost_columns[] = {
    {"scene", "scene", TEXT},
    {"method", "method", TEXT},
    {"first_ms", "first frame, ms", 0},
    {"sample_ms", "a sample of path, ms", 0},
    {"ratio", "ratio", 2},
    {"ratio_lo", NULL, 3},
    {"ratio_hi", NULL, 3},
    {"ratio_wall", "by the clock on the wall", 2},
    {"share", "share of the machine", 2},
};

static bool report_costs(const struct truth_study *study, const struct lum_bench_options *options)
{
    struct lum_bench_table t = LUM_BENCH_TABLE(cost_columns);
    for (size_t i = 0; i < study->n_costs; i++) {
        const struct truth_cost *c = &study->costs[i];
        LUM_BENCH_TEXTS(&t, c->scene, c->method);
        LUM_BENCH_NUMBERS(&t, c->first_ms, c->sample_ms, c->own.median, c->own.lo, c->own.hi, c->wall.median, c->share);
    }
    if (study->n_costs)
        puts("\nThe first full frame in samples of path (one for every pixel, in the same run)");
    return lum_bench_table_finish(&t, options, study->n_costs ? "truth-first" : NULL);
}

/* ---- effects ---- */

static const struct lum_bench_column effect_columns[] = {
    {"scene", "scene", TEXT},
    {"method", "method", TEXT},
    {"effect", "effect", TEXT},
    {"share", "share of the light", 4},
    BLOCK_COLUMNS,
    {"rays", "rays", 0},
};

static bool report_effects(const struct truth_study *study, const struct lum_bench_options *options)
{
    struct lum_bench_table t = LUM_BENCH_TABLE(effect_columns);
    for (size_t i = 0; i < study->n_effects; i++) {
        const struct truth_effect *e = &study->effects[i];
        LUM_BENCH_TEXTS(&t, e->scene, e->method, e->effect);
        lum_bench_table_number(&t, e->share);
        put_blocks(&t, &e->blocks, e->reference_spp);
        lum_bench_table_number(&t, (double)e->rays);
    }
    if (study->n_effects)
        puts("\nLight of each effect in the first frame over that in path");
    return lum_bench_table_finish(&t, options, study->n_effects ? "truth-effects" : NULL);
}

bool truth_report(const struct truth_study *study, const struct lum_bench_options *options)
{
    return report_rows(study, options) && report_costs(study, options) && report_effects(study, options);
}

/* What a view at rest shows as samples come: the errors of the picture after 0 to 32 of them, over several draws,
 * beside those of the samples alone. Neither SMAPE nor relMSE is to rise with time.
 *
 * Draws differ in all that is drawn at random, the first frame, too; the cache is made anew for each. What the mean
 * of a number of samples is above that of the frame is told with its standard error, of differences draw by draw.
 * Not every sample makes a picture (lum_refine_is_due): between two the last one counts, which people see then. */
#include <math.h>

#include "core/metric/metric.h"
#include "tests/bench/places.h"
#include "tests/bench/reference.h"
#include "tests/bench/table.h"

static const uint32_t at_spp[] = {0, 1, 2, 4, 8, 16, 32};
enum { STEPS = LUM_ARRAY_LEN(at_spp), SEEDS = 30, METRICS = 2 };

struct rig {
    struct lum_bench_stand at;
    struct lum_bench_reference reference;
    uint32_t n_seeds, n_steps;
    double live[METRICS][STEPS][SEEDS], path[METRICS][STEPS][SEEDS]; /* SMAPE, relMSE */
};

static const struct lum_bench_column columns[] = {
    {"scene", "scene", LUM_BENCH_TEXT},
    {"spp", "samples", 0},
    {"smape", "SMAPE", 4},
    {"smape_rise", "above the frame's", 4},
    {"smape_rise_se", "+-", 4},
    {"relmse", "relMSE", 4},
    {"relmse_rise", "above the frame's", 4},
    {"relmse_rise_se", "+-", 4},
    {"path_smape", "samples alone: SMAPE", 4},
    {"path_relmse", "relMSE", 4},
    {"reference_spp", NULL, 0},
    {"reference_relmse", NULL, 6},
};

/* One draw, on a view with caches of its own. frame_first: the first pass of the method is no sample. */
static bool draw(struct rig *rig, const char *method, uint32_t seed, bool frame_first,
                 double ret_errors[METRICS][STEPS][SEEDS])
{
    struct lum_error err = {0};
    struct lum_view *view = NULL;
    struct lum_pass_stats stats;
    struct lum_view_settings settings = rig->at.settings;
    settings.method = lum_method_find(method);
    settings.max_spp = LUM_LIMIT_SPP; /* as a view at rest that nobody stops */
    settings.seed = seed + 1;
    uint32_t n = 0;
    bool ok = lum_view_create(rig->at.world.pool, &view, &err) == LUM_OK;
    for (uint32_t k = 0; ok && k < rig->n_steps; k++) {
        while (ok && n < at_spp[k] + (frame_first ? 1 : 0)) {
            ok = lum_view_pass(view, rig->at.world.snapshot, &settings, NULL, &stats, &err) == LUM_OK;
            n++;
        }
        if (!ok || n == 0)
            continue;
        struct lum_bench_error e = lum_bench_error_of(&rig->reference, view);
        ret_errors[0][k][seed] = e.smape, ret_errors[1][k][seed] = e.relmse;
    }
    lum_view_destroy(view);
    return ok || lum_bench_failed(err.text);
}

/* Mean of n values less those of `from` (NULL: 0), and its standard error; NAN of one draw. */
static double mean_of(const double *values, const double *from, uint32_t n, double *ret_se)
{
    double mean = 0.0, square = 0.0;
    for (uint32_t i = 0; i < n; i++)
        mean += (values[i] - (from ? from[i] : 0.0)) / n;
    for (uint32_t i = 0; i < n; i++)
        square += pow(values[i] - (from ? from[i] : 0.0) - mean, 2.0);
    *ret_se = n > 1 ? sqrt(square / (n - 1.0) / n) : (double)NAN;
    return mean;
}

static void tell(const struct rig *rig, struct lum_bench_table *table)
{
    for (uint32_t k = 0; k < rig->n_steps; k++) {
        double unused, n[2 * 3];
        for (int m = 0; m < METRICS; m++) {
            n[3 * m] = mean_of(rig->live[m][k], NULL, rig->n_seeds, &unused);
            n[3 * m + 1] = mean_of(rig->live[m][k], rig->live[m][0], rig->n_seeds, &n[3 * m + 2]);
        }
        LUM_BENCH_TEXTS(table, rig->at.place->scene);
        LUM_BENCH_NUMBERS(table, (double)at_spp[k], n[0], n[1], n[2], n[3], n[4], n[5],
                          k ? mean_of(rig->path[0][k], NULL, rig->n_seeds, &unused) : (double)NAN,
                          k ? mean_of(rig->path[1][k], NULL, rig->n_seeds, &unused) : (double)NAN,
                          (double)rig->reference.spp, rig->reference.relmse);
    }
}

static bool measure_scene(void *of, void *table)
{
    struct rig *rig = of;
    const struct lum_bench_options *options = rig->at.options;
    if (!lum_bench_stand_open(&rig->at, (const uint32_t[]){300, 200}, (const uint32_t[]){48, 32})) {
        printf("skipped: %s\n", rig->at.place->scene);
        return true;
    }
    rig->n_steps = options->quick ? 4 : STEPS;
    rig->n_seeds = options->seeds ? options->seeds : options->quick ? 2 : 3;
    lum_bench_progress("rest: %s: reference", rig->at.place->scene);
    struct lum_bench_truth truth = lum_bench_truth_of(options, &rig->at.world, &rig->at.settings);
    truth.or_more = true;
    if (!lum_bench_reference_make(&rig->reference, &truth))
        return false;
    for (uint32_t seed = 0; seed < rig->n_seeds; seed++) {
        lum_bench_progress("rest: %s: draw %u", rig->at.place->scene, seed + 1);
        if (!draw(rig, "live", seed, true, rig->live) || !draw(rig, "path", seed, false, rig->path))
            return false;
    }
    tell(rig, table);
    return true;
}

static void close_rig(void *of)
{
    struct rig *rig = of;
    lum_bench_reference_finish(&rig->reference);
    lum_bench_stand_close(&rig->at);
}

int lum_bench_rest(const struct lum_bench_options *options)
{
    const struct lum_bench_tour tour = {"live", sizeof(struct rig), measure_scene, close_rig};
    struct lum_bench_table table = LUM_BENCH_TABLE(columns);
    lum_thread_init_fp();
    bool ok = lum_bench_go(&tour, options, &table);
    printf("samples: on the frame. " LUM_BENCH_RELMSE "\n", LUM_METRIC_EPSILON, LUM_METRIC_EPSILON);
    ok = lum_bench_table_finish(&table, options, "rest") && ok;
    return ok ? 0 : 1;
}

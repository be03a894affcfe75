/* What the k-th viewer pays: tables, and two figures by scene. Values are medians over rounds. */
#include "tests/bench/viewers.h"

#include <math.h>
#include <string.h>

#include "tests/bench/plot.h"
#include "tests/bench/table.h"

#define TEXT LUM_BENCH_TEXT

/* Medians of a frame. */
struct cost {
    double rays, created, indirect_ms, cpu_ms;
};

static struct cost cost_of(const struct viewers_study *study, const struct viewers_frame *f)
{
    size_t n = study->n_rounds;
    return (struct cost){lum_bench_median_of(f->rays, n), lum_bench_median_of(f->created, n),
                         lum_bench_median_of(f->indirect_ms, n), lum_bench_median_of(f->cpu_ms, n)};
}

/* ---- the k-th viewer ---- */

static const struct lum_bench_column columns[] = {
    {"scene", NULL, TEXT},
    {"method", NULL, TEXT},
    {"viewer", NULL, 0},
    {"degrees", NULL, 0},
    {"shared_rays", NULL, 0},
    {"shared_created", NULL, 0},
    {"shared_indirect_cpu_ms", NULL, 4},
    {"shared_cpu_ms", NULL, 4},
    {"own_rays", NULL, 0},
    {"own_created", NULL, 0},
    {"own_indirect_cpu_ms", NULL, 4},
    {"own_cpu_ms", NULL, 4},
    {"rays_of_first", NULL, 4},
    {"created_of_first", NULL, 4},
    {"indirect_cpu_of_first", NULL, 4},
    {"cpu_of_first", NULL, 4},
};

static void put_rows(struct lum_bench_table *t, const struct viewers_study *study, size_t scene, int method)
{
    const struct viewers_cell *cell = &study->cells[scene][method];
    struct cost first = cost_of(study, &cell->frames[VIEWERS_SHARED][0]);
    for (int k = 0; k < VIEWERS; k++) {
        struct cost shared = cost_of(study, &cell->frames[VIEWERS_SHARED][k]),
                    own = cost_of(study, &cell->frames[VIEWERS_OWN][k]);
        LUM_BENCH_TEXTS(t, lum_bench_scene_name(study->scenes[scene]), viewers_methods[method]);
        LUM_BENCH_NUMBERS(t, k + 1, viewers_degrees[k], shared.rays, shared.created, shared.indirect_ms, shared.cpu_ms,
                          own.rays, own.created, own.indirect_ms, own.cpu_ms, shared.rays / first.rays,
                          shared.created / first.created, shared.indirect_ms / first.indirect_ms,
                          shared.cpu_ms / first.cpu_ms);
    }
}

/* ---- memory ---- */

static const struct lum_bench_column memory_columns[] = {
    {"scene", NULL, TEXT}, {"method", NULL, TEXT},        {"one_viewer_kb", NULL, 0}, {"eight_viewers_kb", NULL, 0},
    {"records", NULL, 0},  {"bytes_per_record", NULL, 1}, {"cache_kb", NULL, 0},
};

static double bytes_per_record(const struct viewers_cell *cell)
{
    return cell->cache.records ? (double)cell->cache.bytes / (double)cell->cache.records : (double)NAN;
}

static void put_memory(struct lum_bench_table *t, const struct viewers_study *study, size_t scene, int method)
{
    const struct viewers_cell *cell = &study->cells[scene][method];
    LUM_BENCH_TEXTS(t, lum_bench_scene_name(study->scenes[scene]), viewers_methods[method]);
    LUM_BENCH_NUMBERS(t, cell->one_kb, cell->eight_kb, (double)cell->cache.records, bytes_per_record(cell),
                      (double)cell->cache.bytes / 1024.0);
}

/* ---- the summary ---- */

static const struct lum_bench_column summary_columns[] = {
    {"", "scene", TEXT},       {"", "method", TEXT},     {"", "2nd: rays, %", 1},
    {"", "records, %", 1},     {"", "CPU, %", 1},        {"", "8th: CPU, %", 1},
    {"", "eight: CPU, ms", 0}, {"", "eight daemons", 0}, {"", "eight: memory, MB", 0},
    {"", "eight daemons", 0},  {"", "records", 0},       {"", "bytes a record", 0},
};

static void put_summary(struct lum_bench_table *t, const struct viewers_study *study, size_t scene, int method)
{
    const struct viewers_cell *cell = &study->cells[scene][method];
    struct cost first = cost_of(study, &cell->frames[VIEWERS_SHARED][0]),
                second = cost_of(study, &cell->frames[VIEWERS_SHARED][1]),
                last = cost_of(study, &cell->frames[VIEWERS_SHARED][VIEWERS - 1]);
    double sum[VIEWERS_WAYS] = {0};
    for (int way = 0; way < VIEWERS_WAYS; way++)
        for (int k = 0; k < VIEWERS; k++)
            sum[way] += cost_of(study, &cell->frames[way][k]).indirect_ms;
    LUM_BENCH_TEXTS(t, lum_bench_scene_name(study->scenes[scene]), viewers_methods[method]);
    LUM_BENCH_NUMBERS(t, 100.0 * second.rays / first.rays, 100.0 * second.created / first.created,
                      100.0 * second.indirect_ms / first.indirect_ms, 100.0 * last.indirect_ms / first.indirect_ms,
                      sum[VIEWERS_SHARED], sum[VIEWERS_OWN], cell->eight_kb / 1024.0, VIEWERS * cell->one_kb / 1024.0,
                      (double)cell->cache.records, bytes_per_record(cell));
}

/* ---- tables and figures ---- */

/* Rows by scene and method. */
static const struct output {
    const char *file; /* NULL: to stdout */
    const struct lum_bench_column *columns;
    size_t n_columns;
    void (*put)(struct lum_bench_table *t, const struct viewers_study *study, size_t scene, int method);
} outputs[] = {
    {NULL, summary_columns, LUM_ARRAY_LEN(summary_columns), put_summary},
    {"viewers", columns, LUM_ARRAY_LEN(columns), put_rows},
    {"viewers-memory", memory_columns, LUM_ARRAY_LEN(memory_columns), put_memory},
};

static bool write_output(const struct output *o, const struct viewers_study *study,
                         const struct lum_bench_options *options)
{
    struct lum_bench_table t = {.columns = o->columns, .n_columns = o->n_columns};
    for (size_t scene = 0; scene < study->n_scenes; scene++)
        for (int m = 0; m < VIEWERS_METHODS; m++)
            o->put(&t, study, scene, m);
    return lum_bench_table_finish(&t, options, o->file);
}

enum { SERIES = VIEWERS_METHODS * VIEWERS_WAYS + VIEWERS_WAYS };

/* Percent of what the first viewer paid. */
struct curves {
    double x[VIEWERS], y[VIEWERS_SCENES][VIEWERS_METHODS][VIEWERS_WAYS][VIEWERS];
};

static void make_panel(const struct viewers_study *study, const struct curves *c, size_t scene,
                       struct lum_plot_series series[SERIES], struct lum_plot_panel *ret_panel)
{
    size_t n = 0;
    for (int m = 0; m < VIEWERS_METHODS; m++)
        for (int way = 0; way < VIEWERS_WAYS; way++)
            series[n++] = (struct lum_plot_series){
                .label = way == VIEWERS_SHARED ? viewers_methods[m] : NULL,
                .color = (uint32_t)m,
                .dashed = way == VIEWERS_OWN,
                .n = VIEWERS,
                .x = c->x,
                .y = c->y[scene][m][way],
            };
    series[n++] = (struct lum_plot_series){.label = "one cache", .color = LUM_PLOT_GREY};
    series[n++] = (struct lum_plot_series){.label = "a cache for each", .color = LUM_PLOT_GREY, .dashed = true};
    *ret_panel = (struct lum_plot_panel){.title = lum_bench_scene_name(study->scenes[scene]),
                                         .x = {"viewer", LUM_PLOT_LINEAR, 1.0, VIEWERS},
                                         .y = {"first frame, % of the first viewer's", LUM_PLOT_LINEAR, 0.0, 0.0},
                                         .series = series,
                                         .n_series = n};
}

static bool draw(const struct viewers_study *study, const struct lum_bench_options *options, bool rays)
{
    const char *name = rays ? "viewers-rays.svg" : "viewers-time.svg";
    struct curves c;
    struct lum_plot_series series[VIEWERS_SCENES][SERIES];
    struct lum_plot_panel panels[VIEWERS_SCENES];
    char subtitle[32];
    for (size_t scene = 0; scene < study->n_scenes; scene++) {
        for (int i = 0; i < VIEWERS_METHODS * VIEWERS_WAYS * VIEWERS; i++) {
            int k = i % VIEWERS, way = i / VIEWERS % VIEWERS_WAYS, m = i / VIEWERS / VIEWERS_WAYS;
            const struct viewers_cell *cell = &study->cells[scene][m];
            struct cost first = cost_of(study, &cell->frames[way][0]), its = cost_of(study, &cell->frames[way][k]);
            c.x[k] = k + 1;
            c.y[scene][m][way][k] = 100.0 * (rays ? its.rays / first.rays : its.indirect_ms / first.indirect_ms);
        }
        make_panel(study, &c, scene, series[scene], &panels[scene]);
    }
    snprintf(subtitle, sizeof subtitle, "%u × %u", study->w, study->h);
    const struct lum_plot plot = {.title = rays ? "Rays of indirect light, by viewer of one room"
                                                : "CPU time of indirect light, by viewer of one room",
                                  .subtitle = subtitle,
                                  .panels = panels,
                                  .n_panels = study->n_scenes,
                                  .same_y = true};
    return lum_bench_plot(options, name, &plot, study->machine);
}

bool viewers_report(const struct viewers_study *study, const struct lum_bench_options *options)
{
    bool ok = true;
    printf("%u x %u pixels; %s\n\nIndirect light of first frames: the second and the eighth viewer's cost over the "
           "first one's on one cache; all\neight together, against eight daemons; memory of their processes.\n",
           study->w, study->h, study->machine);
    for (size_t i = 0; ok && i < LUM_ARRAY_LEN(outputs); i++)
        ok = write_output(&outputs[i], study, options);
    return ok && draw(study, options, true) && draw(study, options, false);
}

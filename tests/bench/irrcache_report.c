/* Tables 7.0 and 7.1 of the thesis as markdown on stdout, everything as CSV and JSON, and speed-ups, turns and lookups
 * as figures. */
#include <math.h>
#include <string.h>

#include "tests/bench/bench.h"
#include "tests/bench/irrcache.h"
#include "tests/bench/plot.h"
#include "tests/bench/table.h"

#define TEXT LUM_BENCH_TEXT

/* Over the frame of TRA in the same round. */
static struct lum_bench_median speedup(const struct irr_scene *s, int storage, uint32_t crew)
{
    const struct irr_cell *c = &s->cells[storage][crew];
    return lum_bench_ratio(s->cells[IRR_TRA][0].ms, c->ms, c->n);
}

/* Over a rival with as many threads: the claim of the chapter is LCK's. */
static struct lum_bench_median gain_of_waitfree(const struct irr_scene *s, int rival, uint32_t crew)
{
    const struct irr_cell *c = &s->cells[IRR_WF][crew];
    return lum_bench_ratio(s->cells[rival][crew].ms, c->ms, c->n);
}

/* ---- still images ---- */

static const struct lum_bench_column still_columns[] = {
    {"", "scene", TEXT},  {"", "threads", 0},  {"", "storage", TEXT},  {"", "time, s", 3},         {"", "records", 0},
    {"", "discarded", 1}, {"", "overhead", 3}, {"", "speed-up", TEXT}, {"", "WF over this", TEXT},
};

static void print_stills(const struct irr_study *study, struct lum_bench_table *t)
{
    for (size_t i = 0; i < study->n_scenes; i++)
        for (uint32_t crew = 0; crew < study->n_crews; crew++)
            for (int k = 0; k < IRR_STORAGES; k++) {
                const struct irr_scene *s = &study->scenes[i];
                const struct irr_cell *c = &s->cells[k][crew];
                if (c->n == 0)
                    continue;
                lum_bench_table_text(t, s->name);
                lum_bench_table_number(t, irr_threads[crew]);
                lum_bench_table_text(t, irr_storages[k]);
                LUM_BENCH_NUMBERS(t, 1e-3 * lum_bench_median_of(c->ms, c->n), lum_bench_median_of(c->records, c->n),
                                  lum_bench_median_of(c->discarded, c->n), lum_bench_median_of(c->overhead, c->n));
                lum_bench_table_median(t, speedup(s, k, crew), 3);
                lum_bench_table_median(t, gain_of_waitfree(s, k, crew), 3);
            }
}

static const struct lum_bench_column still_file_columns[] = {
    {"scene", NULL, TEXT},   {"triangles", NULL, 0},  {"threads", NULL, 0},     {"storage", NULL, TEXT},
    {"ms", NULL, 4},         {"cpu_ms", NULL, 4},     {"indirect_ms", NULL, 4}, {"records", NULL, 1},
    {"discarded", NULL, 1},  {"overhead", NULL, 6},   {"rays", NULL, 0},        {"speedup", NULL, 4},
    {"speedup_lo", NULL, 4}, {"speedup_hi", NULL, 4}, {"efficiency", NULL, 4},
};

static void put_stills(const struct irr_study *study, struct lum_bench_table *t)
{
    for (size_t i = 0; i < study->n_scenes; i++)
        for (uint32_t k = 0; k < study->n_crews * IRR_STORAGES; k++) {
            const struct irr_scene *s = &study->scenes[i];
            uint32_t crew = k / IRR_STORAGES, storage = k % IRR_STORAGES, n = irr_threads[crew];
            const struct irr_cell *c = &s->cells[storage][crew];
            if (c->n == 0)
                continue;
            struct lum_bench_median m = speedup(s, (int)storage, crew);
            uint32_t running = n < study->n_processors ? n : study->n_processors;
            lum_bench_table_text(t, s->name);
            LUM_BENCH_NUMBERS(t, (double)s->n_triangles, n);
            lum_bench_table_text(t, irr_storages[storage]);
            LUM_BENCH_NUMBERS(t, lum_bench_median_of(c->ms, c->n), lum_bench_median_of(c->cpu_ms, c->n),
                              lum_bench_median_of(c->indirect_ms, c->n), lum_bench_median_of(c->records, c->n),
                              lum_bench_median_of(c->discarded, c->n), lum_bench_median_of(c->overhead, c->n),
                              (double)c->rays, m.median, m.lo, m.hi, m.median / running);
        }
}

/* ---- turns ---- */

static const struct lum_bench_column turn_columns[] = {
    {"", "a turn of the camera", TEXT}, {"", "threads", 0},         {"", "storage", TEXT},
    {"", "first frame, s", 3},          {"", "fps of the rest", 2}, {"", "records made", 0},
};

static bool was_turned(const struct irr_animation *a, uint32_t which)
{
    return a->n_threads[which] > 0 && a->ms[IRR_WF][which][0] > 0.0;
}

/* Frames a second after the first: their number over their time, as the thesis counts. */
static void print_turns(const struct irr_study *study, struct lum_bench_table *t)
{
    for (size_t i = 0; i < 2 * study->n_animations; i++)
        for (int k = IRR_LCK; k < IRR_STORAGES; k++) {
            const struct irr_animation *a = &study->animations[i / 2];
            uint32_t which = i % 2;
            double sum_ms = 0.0, made = 0.0;
            if (!was_turned(a, which))
                continue;
            for (uint32_t f = 0; f < a->n_frames; f++) {
                sum_ms += f > 0 ? a->ms[k][which][f] : 0.0;
                made += a->created[k][which][f];
            }
            lum_bench_table_text(t, a->name);
            lum_bench_table_number(t, a->n_threads[which]);
            lum_bench_table_text(t, irr_storages[k]);
            LUM_BENCH_NUMBERS(t, 1e-3 * a->ms[k][which][0], 1e3 * (a->n_frames - 1u) / sum_ms, made);
        }
}

static const struct lum_bench_column turn_file_columns[] = {
    {"scene", NULL, TEXT}, {"threads", NULL, 0}, {"storage", NULL, TEXT},
    {"frame", NULL, 0},    {"ms", NULL, 4},      {"created", NULL, 0},
};

static void put_turns(const struct irr_study *study, struct lum_bench_table *t)
{
    for (size_t i = 0; i < 2 * study->n_animations; i++)
        for (int k = IRR_LCK; k < IRR_STORAGES; k++) {
            const struct irr_animation *a = &study->animations[i / 2];
            uint32_t which = i % 2;
            for (uint32_t f = 0; f < a->n_frames && was_turned(a, which); f++) {
                lum_bench_table_text(t, a->name);
                lum_bench_table_number(t, a->n_threads[which]);
                lum_bench_table_text(t, irr_storages[k]);
                LUM_BENCH_NUMBERS(t, f, a->ms[k][which][f], a->created[k][which][f]);
            }
        }
}

/* ---- lookups ---- */

static const struct lum_bench_column lookup_columns[] = {
    {"", "million lookups/s", TEXT},
    {"", "threads", 0},
    {"", "alone", TEXT},
    {"", "1 in 64 inserts", TEXT},
};

static struct lum_bench_median lookups_per_s(const struct irr_lookups *l, double unit)
{
    double v[IRR_ROUNDS];
    for (size_t i = 0; i < l->n; i++)
        v[i] = l->per_s[i] / unit;
    return lum_bench_bootstrap(v, l->n);
}

static void print_lookups(const struct irr_study *study, struct lum_bench_table *t)
{
    for (int k = 0; k < IRR_STORAGES; k++)
        for (uint32_t crew = 0; crew < study->n_crews; crew++) {
            if (study->lookups[0][k][crew].n == 0)
                continue;
            lum_bench_table_text(t, irr_storages[k]);
            lum_bench_table_number(t, irr_threads[crew]);
            for (int mixed = 0; mixed < 2; mixed++)
                lum_bench_table_median(t, lookups_per_s(&study->lookups[mixed][k][crew], 1e6), 3);
        }
}

static const struct lum_bench_column lookup_file_columns[] = {
    {"storage", NULL, TEXT}, {"threads", NULL, 0}, {"inserts", NULL, 6}, {"per_s", NULL, 0},
    {"lo", NULL, 0},         {"hi", NULL, 0},      {"found", NULL, 3},
};

static void put_lookups(const struct irr_study *study, struct lum_bench_table *t)
{
    for (int k = 0; k < 2 * IRR_STORAGES; k++)
        for (uint32_t crew = 0; crew < study->n_crews; crew++) {
            const struct irr_lookups *l = &study->lookups[k % 2][k / 2][crew];
            if (l->n == 0)
                continue;
            struct lum_bench_median m = lookups_per_s(l, 1.0);
            lum_bench_table_text(t, irr_storages[k / 2]);
            lum_bench_table_number(t, irr_threads[crew]);
            LUM_BENCH_NUMBERS(t, k % 2 ? 1.0 / IRR_INSERT_EVERY : 0.0, m.median, m.lo, m.hi, l->found);
        }
}

/* ---- figures ---- */

static bool draw_turn(const struct irr_study *study, const struct irr_animation *a,
                      const struct lum_bench_options *options)
{
    double x[IRR_FRAMES];
    struct lum_plot_series series[2][IRR_STORAGES];
    struct lum_plot_panel panels[2];
    char titles[2][64], title[128], subtitle[64], file[128];
    size_t n_panels = 0;
    for (uint32_t f = 0; f < a->n_frames; f++)
        x[f] = f;
    for (uint32_t which = 0; which < 2 && was_turned(a, which); which++) {
        for (uint32_t k = IRR_LCK; k < IRR_STORAGES; k++)
            series[which][k - IRR_LCK] = (struct lum_plot_series){
                .label = irr_storages[k], .color = k, .bare = true, .n = a->n_frames, .x = x, .y = a->ms[k][which]};
        snprintf(titles[which], sizeof titles[which], "%u threads", a->n_threads[which]);
        panels[n_panels++] = (struct lum_plot_panel){titles[which],
                                                     {"frame", LUM_PLOT_LINEAR, 0.0, (double)a->n_frames},
                                                     {"ms", LUM_PLOT_LOG10, 0.0, 0.0},
                                                     series[which],
                                                     IRR_STORAGES - IRR_LCK};
    }
    snprintf(title, sizeof title, "The camera turns once around, records stay: %s", a->name);
    snprintf(subtitle, sizeof subtitle, "%u × %u, irrcache", study->w, study->h);
    snprintf(file, sizeof file, "irrcache-turn-%s.svg", a->name);
    const struct lum_plot plot = {title, subtitle, panels, n_panels, true};
    return lum_bench_plot(options, file, &plot, study->machine);
}

/* What is drawn over the number of threads. */
struct curves {
    double x[IRR_CREWS], y[IRR_STORAGES][IRR_CREWS], lo[IRR_STORAGES][IRR_CREWS], hi[IRR_STORAGES][IRR_CREWS];
    struct lum_plot_series series[IRR_STORAGES];
};

static void set_point(struct curves *c, uint32_t storage, uint32_t crew, struct lum_bench_median m)
{
    c->x[crew] = irr_threads[crew];
    c->y[storage][crew] = m.median;
    c->lo[storage][crew] = m.lo;
    c->hi[storage][crew] = m.hi;
}

/* TRA, with one thread, is no curve. */
static struct lum_plot_panel panel_of(struct curves *c, const char *title, const char *y, uint32_t n_crews)
{
    for (uint32_t k = IRR_LCK; k < IRR_STORAGES; k++)
        c->series[k - IRR_LCK] = (struct lum_plot_series){.label = irr_storages[k],
                                                          .color = k,
                                                          .n = n_crews,
                                                          .x = c->x,
                                                          .y = c->y[k],
                                                          .y_lo = c->lo[k],
                                                          .y_hi = c->hi[k]};
    return (struct lum_plot_panel){
        title, {"threads", LUM_PLOT_LOG2, 0.0, 0.0}, {y, LUM_PLOT_LINEAR, 0.0, 0.0}, c->series, IRR_STORAGES - IRR_LCK};
}

static bool draw_speedups(const struct irr_study *study, const struct lum_bench_options *options)
{
    struct curves curves[IRR_SCENES];
    struct lum_plot_panel panels[IRR_SCENES];
    char subtitle[64];
    for (size_t i = 0; i < study->n_scenes; i++) {
        for (uint32_t k = IRR_LCK; k < IRR_STORAGES; k++)
            for (uint32_t crew = 0; crew < study->n_crews; crew++)
                set_point(&curves[i], k, crew, speedup(&study->scenes[i], (int)k, crew));
        panels[i] = panel_of(&curves[i], study->scenes[i].name, "speed-up over TRA", study->n_crews);
    }
    snprintf(subtitle, sizeof subtitle, "%u × %u, from an empty cache", study->w, study->h);
    const struct lum_plot plot = {"Storages of the irradiance cache", subtitle, panels, study->n_scenes, true};
    return lum_bench_plot(options, "irrcache-speedup.svg", &plot, study->machine);
}

static bool draw_lookups(const struct irr_study *study, const struct lum_bench_options *options)
{
    struct curves curves[2];
    struct lum_plot_panel panels[2];
    char mixed_title[64];
    snprintf(mixed_title, sizeof mixed_title, "one operation in %u inserts", IRR_INSERT_EVERY);
    for (uint32_t mixed = 0; mixed < 2; mixed++) {
        for (uint32_t k = IRR_LCK; k < IRR_STORAGES; k++)
            for (uint32_t crew = 0; crew < study->n_crews; crew++)
                set_point(&curves[mixed], k, crew, lookups_per_s(&study->lookups[mixed][k][crew], 1e6));
        panels[mixed] =
            panel_of(&curves[mixed], mixed ? mixed_title : "lookups alone", "million lookups a second", study->n_crews);
    }
    const struct lum_plot plot = {"Lookups under contention", "All threads together", panels, 2, true};
    return lum_bench_plot(options, "irrcache-lookups.svg", &plot, study->machine);
}

/* ---- all ---- */

static const struct output {
    const char *file; /* NULL: to stdout */
    const struct lum_bench_column *columns;
    size_t n_columns;
    void (*fill)(const struct irr_study *study, struct lum_bench_table *t);
} outputs[] = {
    {NULL, still_columns, LUM_ARRAY_LEN(still_columns), print_stills},
    {NULL, turn_columns, LUM_ARRAY_LEN(turn_columns), print_turns},
    {NULL, lookup_columns, LUM_ARRAY_LEN(lookup_columns), print_lookups},
    {"irrcache", still_file_columns, LUM_ARRAY_LEN(still_file_columns), put_stills},
    {"irrcache-turns", turn_file_columns, LUM_ARRAY_LEN(turn_file_columns), put_turns},
    {"irrcache-lookups-table", lookup_file_columns, LUM_ARRAY_LEN(lookup_file_columns), put_lookups},
};

static void print_heading(const struct irr_study *study)
{
    printf(
        "%u x %u; %s; accuracy %g; 95 %% intervals\n"
        "TRA: one thread, nothing shared. LCK: one lock; overhead: seconds waiting for it, all threads together. LW: "
        "merged at the end of the frame; overhead: seconds of merging. WF: wait-free; overhead: insertions that found "
        "another thread's first; nothing is lost by it.\n",
        study->w, study->h, study->machine, (double)study->accuracy);
    if (irr_threads[study->n_crews - 1] > study->n_processors)
        printf("Only %u threads run at once here. More than that cannot be faster; what they show is what a storage "
               "costs when its threads are interrupted: one that holds a lock makes the others wait, one that works "
               "alone makes records that another has; a wait-free one does neither.\n",
               study->n_processors);
}

bool irr_report(const struct irr_study *study, const struct lum_bench_options *options)
{
    bool ok = true;
    print_heading(study);
    for (size_t i = 0; ok && i < LUM_ARRAY_LEN(outputs); i++) {
        const struct output *o = &outputs[i];
        if (o->fill == put_turns && study->n_animations == 0)
            continue;
        struct lum_bench_table t = {.columns = o->columns, .n_columns = o->n_columns};
        o->fill(study, &t);
        ok = lum_bench_table_finish(&t, options, o->file);
    }
    for (size_t i = 0; ok && i < study->n_animations; i++)
        ok = draw_turn(study, &study->animations[i], options);
    return ok && draw_speedups(study, options) && draw_lookups(study, options);
}

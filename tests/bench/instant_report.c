/* Tables 6.1 to 6.5 of the thesis, as markdown on stdout and in full as CSV and JSON; how costs grow, and how they go
 * along an animation, as figures. */
#include "tests/bench/instant.h"

#include <math.h>
#include <string.h>

#include "core/metric/metric.h"
#include "tests/bench/plot.h"
#include "tests/bench/table.h"

static double mean_of(const double *values, size_t n)
{
    double sum = 0.0;
    for (size_t i = 0; i < n; i++)
        sum += values[i] / (double)n;
    return n ? sum : (double)NAN;
}

/* How many times faster a is than b. */
static struct lum_bench_median speedup(const struct instant_cell *a, const struct instant_cell *b, bool cpu)
{
    return lum_bench_ratio(cpu ? b->cpu_ms : b->ms, cpu ? a->cpu_ms : a->ms, a->n < b->n ? a->n : b->n);
}

static void put_speedup(struct lum_bench_table *t, const struct instant_cell *a, const struct instant_cell *b)
{
    lum_bench_table_median(t, speedup(a, b, false), 2);
}

/* ---- what the thesis has ---- */

/* Speed-ups: of IC over IGI in tables 6.1 and 6.2, of TIC over IGI in 6.3 and 6.4, of TIC over IC in 6.4. 0: not there.
 * Its scene with bunnies in 6.1 and 6.2 is not said to have how many of them. */
static const struct published {
    const char *scene;
    double ic_whole, ic_diffuse, tic_whole, tic_diffuse, tic_ic;
} published[] = {
    {"cornell", 2.81, 5.38, 4.95, 14.33, 3.00},
    {"wobble", 3.26, 7.40, 5.49, 12.33, 3.00},
    {"desk", 3.62, 9.33, 6.82, 18.67, 3.00},
    {"bunnies-1", 0, 0, 6.13, 18.67, 4.00},
    {"bunnies-2", 0, 0, 5.54, 13.75, 3.25},
    {"bunnies-4", 0, 0, 3.98, 11.00, 2.60},
    {"bunnies-9", 2.18, 5.18, 2.42, 6.33, 1.33},
    {"cornell-indirect", 3.21, 6.87, 0, 0, 0},
    {"conference", 3.51, 8.27, 5.05, 24.60, 3.40},
    {"sibenik", 1.49, 2.55, 3.76, 19.40, 8.40},
    {"office", 3.39, 10.02, 0, 0, 0},
};

static struct published published_of(const char *scene)
{
    for (size_t i = 0; i < LUM_ARRAY_LEN(published); i++)
        if (strcmp(published[i].scene, scene) == 0)
            return published[i];
    return (struct published){.scene = scene};
}

static void put_published(struct lum_bench_table *t, double value)
{
    lum_bench_table_number(t, value > 0.0 ? value : (double)NAN);
}

/* ---- tables on stdout ---- */

#define TEXT LUM_BENCH_TEXT

static const struct lum_bench_column first_columns[] = {
    {"", "first frame, ms (6.1, 6.2)", TEXT},
    {"", "RT", 1},
    {"", "IGI", 1},
    {"", "IC", 1},
    {"", "LIVE", 1},
    {"", "IC/IGI", TEXT},
    {"", "thesis", 2},
    {"", "diffuse IGI", 1},
    {"", "IC", 1},
    {"", "LIVE", 1},
    {"", "IC/IGI", TEXT},
    {"", "thesis", 2},
};

static void print_first(const struct instant_study *study, struct lum_bench_table *t)
{
    static const enum instant_method order[] = {INSTANT_RT, INSTANT_IGI, INSTANT_IC, INSTANT_LIVE};
    for (size_t i = 0; i < study->n_scenes; i++) {
        const struct instant_scene *s = &study->scenes[i];
        struct published p = published_of(s->name);
        lum_bench_table_text(t, s->name);
        for (int part = 0; part < INSTANT_PARTS; part++) {
            for (size_t k = part == INSTANT_DIFFUSE; k < LUM_ARRAY_LEN(order); k++)
                lum_bench_table_number(
                    t, lum_bench_median_of(s->first.cells[order[k]][part].ms, s->first.cells[order[k]][part].n));
            put_speedup(t, &s->first.cells[INSTANT_IC][part], &s->first.cells[INSTANT_IGI][part]);
            put_published(t, part == INSTANT_WHOLE ? p.ic_whole : p.ic_diffuse);
        }
    }
}

static const struct lum_bench_column moving_columns[] = {
    {"", "animation, frames per second (6.3)", TEXT},
    {"", "RT", 2},
    {"", "IGI", 2},
    {"", "IC", 2},
    {"", "TIC", 2},
    {"", "LIVE", 2},
    {"", "TIC/IGI", TEXT},
    {"", "thesis", 2},
    {"", "LIVE/TIC", TEXT},
};

static void print_moving(const struct instant_study *study, struct lum_bench_table *t)
{
    for (size_t i = 0; i < study->n_scenes; i++) {
        const struct instant_scene *s = &study->scenes[i];
        const struct instant_cell(*c)[INSTANT_PARTS] = s->moving.cells;
        if (!s->moves)
            continue;
        lum_bench_table_text(t, s->name);
        for (int m = 0; m < INSTANT_METHODS; m++)
            lum_bench_table_number(t, 1000.0 / mean_of(c[m][INSTANT_WHOLE].ms, c[m][INSTANT_WHOLE].n));
        put_speedup(t, &c[INSTANT_TIC][INSTANT_WHOLE], &c[INSTANT_IGI][INSTANT_WHOLE]);
        put_published(t, published_of(s->name).tic_whole);
        put_speedup(t, &c[INSTANT_LIVE][INSTANT_WHOLE], &c[INSTANT_TIC][INSTANT_WHOLE]);
    }
}

static const struct lum_bench_column diffuse_columns[] = {
    {"", "animation, diffuse alone, ms (6.4)", TEXT},
    {"", "IGI", 2},
    {"", "IC", 2},
    {"", "TIC", 2},
    {"", "LIVE", 2},
    {"", "S_IGI", TEXT},
    {"", "thesis", 2},
    {"", "S_IC", TEXT},
    {"", "thesis", 2},
    {"", "LIVE/TIC", TEXT},
};

static void print_diffuse(const struct instant_study *study, struct lum_bench_table *t)
{
    for (size_t i = 0; i < study->n_scenes; i++) {
        const struct instant_scene *s = &study->scenes[i];
        const struct instant_cell(*c)[INSTANT_PARTS] = s->moving.cells;
        if (!s->moves)
            continue;
        lum_bench_table_text(t, s->name);
        for (int m = INSTANT_IGI; m < INSTANT_METHODS; m++)
            lum_bench_table_number(t, mean_of(c[m][INSTANT_DIFFUSE].ms, c[m][INSTANT_DIFFUSE].n));
        put_speedup(t, &c[INSTANT_TIC][INSTANT_DIFFUSE], &c[INSTANT_IGI][INSTANT_DIFFUSE]);
        put_published(t, published_of(s->name).tic_diffuse);
        put_speedup(t, &c[INSTANT_TIC][INSTANT_DIFFUSE], &c[INSTANT_IC][INSTANT_DIFFUSE]);
        put_published(t, published_of(s->name).tic_ic);
        put_speedup(t, &c[INSTANT_LIVE][INSTANT_DIFFUSE], &c[INSTANT_TIC][INSTANT_DIFFUSE]);
    }
}

static const struct lum_bench_column error_columns[] = {
    {"", "error (6.5)", TEXT},
    {"", "relMSE x 1000: RT", 2},
    {"", "IGI", 2},
    {"", "IC", 2},
    {"", "TIC", 2},
    {"", "LIVE", 2},
    {"", "reference", 3},
    {"", "SMAPE %: RT", 2},
    {"", "IGI", 2},
    {"", "IC", 2},
    {"", "TIC", 2},
    {"", "LIVE", 2},
};

static void print_errors_of(const char *scene, const char *when, const struct instant_frames *f,
                            struct lum_bench_table *t)
{
    char text[64];
    for (int p = 0; p < INSTANT_PARTS; p++) {
        snprintf(text, sizeof text, "%.30s, %s, %s", scene, when, instant_parts[p]);
        lum_bench_table_text(t, text);
        for (int m = 0; m < INSTANT_METHODS; m++)
            lum_bench_table_number(t, 1e3 * f->errors[m][p].relmse);
        lum_bench_table_number(t, 1e3 * f->reference_relmse[p]);
        for (int m = 0; m < INSTANT_METHODS; m++)
            lum_bench_table_number(t, 1e2 * f->errors[m][p].smape);
    }
}

static void print_errors(const struct instant_study *study, struct lum_bench_table *t)
{
    for (size_t i = 0; i < study->n_scenes; i++) {
        const struct instant_scene *s = &study->scenes[i];
        print_errors_of(s->name, "first", &s->first, t);
        if (s->moves)
            print_errors_of(s->name, "last pose", &s->moving, t);
    }
}

static const struct lum_bench_column seen_columns[] = {
    {"", "HDR-VDP, % of pixels (6.5)", TEXT},
    {"", "P >=", TEXT},
    {"", "IGI", 2},
    {"", "IC", 2},
    {"", "TIC", 2},
    {"", "LIVE", 2},
    {"", "reference", 2},
    {"", "TIC beside IGI", 2},
};

enum { CERTAINTIES = 4 };
static double seen_with(const struct lum_bench_seen *s, int certainty)
{
    const double all[CERTAINTIES] = {s->p75, s->p95, s->dim75, s->dim95};
    return all[certainty];
}

static void print_seen_of(const struct instant_scene *s, int part, struct lum_bench_table *t)
{
    static const char *const names[CERTAINTIES] = {"75 %", "95 %", "75 %, dim", "95 %, dim"};
    const struct instant_frames *f = s->moves ? &s->moving : &s->first;
    char text[64];
    for (int k = 0; k < CERTAINTIES; k++) {
        snprintf(text, sizeof text, "%.30s, %s, %s", s->name, s->moves ? "last pose" : "first", instant_parts[part]);
        LUM_BENCH_TEXTS(t, text, names[k]);
        for (int m = INSTANT_IGI; m < INSTANT_METHODS; m++)
            lum_bench_table_number(t, seen_with(&f->seen[m][part], k));
        LUM_BENCH_NUMBERS(t, seen_with(&f->noise[part], k), seen_with(&f->tic_igi[part], k));
    }
}

static void print_seen(const struct instant_study *study, struct lum_bench_table *t)
{
    for (size_t i = 0; i < study->n_scenes; i++)
        for (int p = 0; p < INSTANT_PARTS; p++)
            print_seen_of(&study->scenes[i], p, t);
}

static const struct lum_bench_column ray_columns[] = {
    {"", "diffuse alone, thousand rays", TEXT},
    {"", "first: IGI", 1},
    {"", "IC", 1},
    {"", "LIVE", 1},
    {"", "a pose: IGI", 1},
    {"", "IC", 1},
    {"", "TIC", 1},
    {"", "LIVE", 1},
    {"", "records IC", 0},
    {"", "TIC", 0},
    {"", "LIVE", 0},
};

static double thousand_rays(const struct instant_cell *c)
{
    return c->n ? 1e-3 * (c->rays[LUM_RAY_INDIRECT_DIFFUSE] + c->rays[LUM_RAY_VPL]) : (double)NAN;
}

static void print_rays(const struct instant_study *study, struct lum_bench_table *t)
{
    static const enum instant_method first[] = {INSTANT_IGI, INSTANT_IC, INSTANT_LIVE};
    for (size_t i = 0; i < study->n_scenes; i++) {
        const struct instant_scene *s = &study->scenes[i];
        const struct instant_frames *f = s->moves ? &s->moving : &s->first;
        lum_bench_table_text(t, s->name);
        for (size_t k = 0; k < LUM_ARRAY_LEN(first); k++)
            lum_bench_table_number(t, thousand_rays(&s->first.cells[first[k]][INSTANT_DIFFUSE]));
        for (int m = INSTANT_IGI; m < INSTANT_METHODS; m++)
            lum_bench_table_number(t, thousand_rays(&s->moving.cells[m][INSTANT_DIFFUSE]));
        for (int m = INSTANT_IC; m < INSTANT_METHODS; m++)
            lum_bench_table_number(t, f->cells[m][INSTANT_DIFFUSE].records);
    }
}

/* ---- files ---- */

static const struct lum_bench_column frame_columns[] = {
    {"scene", NULL, TEXT},         {"frames", NULL, TEXT}, {"method", NULL, TEXT}, {"part", NULL, TEXT},
    {"accuracy", NULL, 3},         {"n", NULL, 0},         {"ms_mean", NULL, 4},   {"ms_median", NULL, 4},
    {"cpu_ms_mean", NULL, 4},      {"relmse", NULL, 9},    {"smape", NULL, 9},     {"reference_spp", NULL, 0},
    {"reference_relmse", NULL, 9}, {"p75", NULL, 4},       {"p95", NULL, 4},       {"flip", NULL, 6},
    {"records", NULL, 1},          {"created", NULL, 1},   {"updated", NULL, 1},   {"slots", NULL, 0},
    LUM_BENCH_RAY_COLUMNS(1),
};

static void put_cell(struct lum_bench_table *t, const struct instant_scene *s, const struct instant_frames *f, int m,
                     int p)
{
    const struct instant_cell *c = &f->cells[m][p];
    LUM_BENCH_TEXTS(t, s->name, f == &s->first ? "first" : "animation", instant_methods[m], instant_parts[p]);
    LUM_BENCH_NUMBERS(t, s->accuracy, (double)c->n, mean_of(c->ms, c->n), lum_bench_median_of(c->ms, c->n),
                      mean_of(c->cpu_ms, c->n), f->errors[m][p].relmse, f->errors[m][p].smape, (double)f->reference_spp,
                      f->reference_relmse[p], f->seen[m][p].p75, f->seen[m][p].p95, f->seen[m][p].flip, c->records,
                      c->created, c->updated, m == INSTANT_LIVE ? (double)NAN : (double)s->n_slots);
    for (int k = 0; k < LUM_RAY_KIND_COUNT; k++)
        lum_bench_table_number(t, c->rays[k]);
}

static void put_frames(const struct instant_study *study, struct lum_bench_table *t)
{
    for (size_t i = 0; i < study->n_scenes; i++)
        for (int k = 0; k < 2 * INSTANT_METHODS * INSTANT_PARTS; k++) {
            const struct instant_scene *s = &study->scenes[i];
            const struct instant_frames *f = k < INSTANT_METHODS * INSTANT_PARTS ? &s->first : &s->moving;
            int m = k / INSTANT_PARTS % INSTANT_METHODS, p = k % INSTANT_PARTS;
            if (f->cells[m][p].n)
                put_cell(t, s, f, m, p);
        }
}

static const struct lum_bench_column ratio_columns[] = {
    {"scene", NULL, TEXT},    {"frames", NULL, TEXT}, {"part", NULL, TEXT}, {"faster", NULL, TEXT},
    {"slower", NULL, TEXT},   {"speedup", NULL, 4},   {"lo", NULL, 4},      {"hi", NULL, 4},
    {"speedup_cpu", NULL, 4}, {"cpu_lo", NULL, 4},    {"cpu_hi", NULL, 4},
};

static void put_ratio(struct lum_bench_table *t, const struct instant_scene *s, const struct instant_frames *f,
                      int part, const enum instant_method pair[2])
{
    const struct instant_cell *a = &f->cells[pair[0]][part], *b = &f->cells[pair[1]][part];
    if (a->n == 0 || b->n == 0)
        return;
    struct lum_bench_median wall = speedup(a, b, false), cpu = speedup(a, b, true);
    LUM_BENCH_TEXTS(t, s->name, f == &s->first ? "first" : "animation", instant_parts[part], instant_methods[pair[0]],
                    instant_methods[pair[1]]);
    LUM_BENCH_NUMBERS(t, wall.median, wall.lo, wall.hi, cpu.median, cpu.lo, cpu.hi);
}

static void put_ratios(const struct instant_study *study, struct lum_bench_table *t)
{
    static const enum instant_method pairs[][2] = {
        {INSTANT_IC, INSTANT_IGI}, {INSTANT_TIC, INSTANT_IGI}, {INSTANT_TIC, INSTANT_IC}, {INSTANT_LIVE, INSTANT_TIC}};
    for (size_t i = 0; i < study->n_scenes; i++)
        for (int p = 0; p < INSTANT_PARTS; p++)
            for (size_t k = 0; k < LUM_ARRAY_LEN(pairs); k++) {
                put_ratio(t, &study->scenes[i], &study->scenes[i].first, p, pairs[k]);
                put_ratio(t, &study->scenes[i], &study->scenes[i].moving, p, pairs[k]);
            }
}

static const struct lum_bench_column growth_columns[] = {
    {"grows", "a pose, as this grows", TEXT},
    {"x", "to", 2},
    {"method", "method", TEXT},
    {"ms_mean", "ms", 4},
    {"cpu_ms", "CPU ms", 4},
    {"records", "records", 1},
    {"rays", "rays", 1},
};

static void put_growth(const struct instant_study *study, struct lum_bench_table *t)
{
    for (int g = 0; g < INSTANT_GROWTHS; g++)
        for (size_t i = 0; i < study->growth[g].n; i++)
            for (int m = 0; m < INSTANT_METHODS; m++) {
                const struct instant_cell *c = &study->growth[g].cells[i][m];
                if (c->n == 0)
                    continue;
                lum_bench_table_text(t, instant_growths[g]);
                lum_bench_table_number(t, study->growth[g].x[i]);
                lum_bench_table_text(t, instant_methods[m]);
                LUM_BENCH_NUMBERS(t, mean_of(c->ms, c->n), mean_of(c->cpu_ms, c->n), c->records,
                                  1e3 * thousand_rays(c));
            }
}

/* ---- figures ---- */

static const char *const growth_titles[INSTANT_GROWTHS] = {"virtual point lights", "records of tic", "moving objects",
                                                           "triangles", "pixels"};

struct lines {
    double x[INSTANT_METHODS][INSTANT_POSES], y[INSTANT_METHODS][INSTANT_POSES];
    struct lum_plot_series series[INSTANT_METHODS];
    size_t n;
};

static void add_line(struct lines *l, int method, size_t n)
{
    l->series[l->n++] = (struct lum_plot_series){.label = instant_methods[method],
                                                 .color = (uint32_t)method,
                                                 .bare = n > 20,
                                                 .n = n,
                                                 .x = l->x[method],
                                                 .y = l->y[method]};
}

/* CPU time, which sharing the machine changes least. */
static void growth_lines(const struct instant_curve *curve, bool by_records, struct lines *l)
{
    l->n = 0;
    for (int m = INSTANT_IGI; m < INSTANT_METHODS; m++) {
        for (size_t i = 0; i < curve->n; i++) {
            l->x[m][i] = by_records ? curve->cells[i][INSTANT_TIC].records : curve->x[i];
            l->y[m][i] = mean_of(curve->cells[i][m].cpu_ms, curve->cells[i][m].n);
        }
        if (curve->n && curve->cells[0][m].n)
            add_line(l, m, curve->n);
    }
}

static bool draw_growth(const struct instant_study *study, const struct lum_bench_options *options)
{
    struct lum_plot_panel panels[INSTANT_GROWTHS];
    struct lines *lines = lum_calloc(INSTANT_GROWTHS, sizeof *lines);
    size_t n = 0;
    if (!lines)
        return false;
    for (int g = 0; g < INSTANT_GROWTHS; g++) {
        growth_lines(&study->growth[g], g == INSTANT_RECORDS, &lines[g]);
        if (lines[g].n)
            panels[n++] = (struct lum_plot_panel){.x = {growth_titles[g], LUM_PLOT_LOG2, 0, 0},
                                                  .y = {"CPU ms a frame", LUM_PLOT_LOG10, 0, 0},
                                                  .series = lines[g].series,
                                                  .n_series = lines[g].n};
    }
    bool ok =
        n == 0 || lum_bench_plot(options, "growth.svg",
                                 &(struct lum_plot){.title = "Indirect diffuse light of a moving scene, as it grows",
                                                    .subtitle = "Animation of bunnies",
                                                    .panels = panels,
                                                    .n_panels = n,
                                                    .same_y = true},
                                 study->machine);
    lum_free(lines);
    return ok;
}

/* Pose by pose. */
static bool draw_animation(const struct instant_study *study, const struct instant_scene *s,
                           const struct lum_bench_options *options)
{
    struct lines *l = lum_calloc(1, sizeof *l);
    char name[96], title[160];
    if (!l)
        return false;
    for (int m = INSTANT_IGI; m < INSTANT_METHODS; m++) {
        const struct instant_cell *c = &s->moving.cells[m][INSTANT_DIFFUSE];
        for (size_t i = 0; i < c->n; i++) {
            l->x[m][i] = (double)(i + 1);
            l->y[m][i] = c->cpu_ms[i];
        }
        if (c->n)
            add_line(l, m, c->n);
    }
    snprintf(name, sizeof name, "instant-%.60s.svg", s->name);
    snprintf(title, sizeof title, "Indirect diffuse light of %.60s, frame by frame", s->name);
    struct lum_plot_panel panel = {.x = {"frame", LUM_PLOT_LINEAR, 0, 0},
                                   .y = {"CPU ms", LUM_PLOT_LOG10, 0, 0},
                                   .series = l->series,
                                   .n_series = l->n};
    char subtitle[32];
    snprintf(subtitle, sizeof subtitle, "%u × %u", study->w, study->h);
    const struct lum_plot plot = {.title = title, .subtitle = subtitle, .panels = &panel, .n_panels = 1};
    bool ok = lum_bench_plot(options, name, &plot, study->machine);
    lum_free(l);
    return ok;
}

/* ---- all ---- */

typedef void (*fill_fn)(const struct instant_study *study, struct lum_bench_table *t);

static const struct output {
    const char *file; /* NULL: to stdout */
    const struct lum_bench_column *columns;
    size_t n_columns;
    fill_fn fill;
} outputs[] = {
    {NULL, first_columns, LUM_ARRAY_LEN(first_columns), print_first},
    {NULL, moving_columns, LUM_ARRAY_LEN(moving_columns), print_moving},
    {NULL, diffuse_columns, LUM_ARRAY_LEN(diffuse_columns), print_diffuse},
    {NULL, error_columns, LUM_ARRAY_LEN(error_columns), print_errors},
    {NULL, seen_columns, LUM_ARRAY_LEN(seen_columns), print_seen},
    {NULL, ray_columns, LUM_ARRAY_LEN(ray_columns), print_rays},
    {"instant", frame_columns, LUM_ARRAY_LEN(frame_columns), put_frames},
    {"instant-speedup", ratio_columns, LUM_ARRAY_LEN(ratio_columns), put_ratios},
};

static bool write_output(const struct instant_study *study, const struct lum_bench_options *options,
                         const struct output *o)
{
    struct lum_bench_table t = {.columns = o->columns, .n_columns = o->n_columns};
    o->fill(study, &t);
    return lum_bench_table_finish(&t, options, o->file);
}

bool instant_report(const struct instant_study *study, const struct lum_bench_options *options)
{
    printf("%u x %u; %s; RT: whitted; medians of frames or of ratios, with 95 %% intervals\n", study->w, study->h,
           study->machine);
    printf("(6.1) to (6.5): tables of the thesis, columns \"thesis\": its figures; " LUM_BENCH_RELMSE "\n",
           LUM_METRIC_EPSILON, LUM_METRIC_EPSILON);
    bool ok = true;
    for (size_t i = 0; ok && i < LUM_ARRAY_LEN(outputs); i++)
        ok = write_output(study, options, &outputs[i]);
    for (size_t i = 0; ok && i < study->n_scenes; i++)
        ok = !study->scenes[i].moves || draw_animation(study, &study->scenes[i], options);
    return ok;
}

bool instant_report_growth(const struct instant_study *study, const struct lum_bench_options *options)
{
    printf("%s; indirect diffuse light alone, means of poses of an animation of bunnies\n", study->machine);
    const struct output growth = {"growth", growth_columns, LUM_ARRAY_LEN(growth_columns), put_growth};
    return write_output(study, options, &growth) && draw_growth(study, options);
}

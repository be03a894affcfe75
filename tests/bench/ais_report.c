/* Tables 5.1 to 5.3 of the thesis, as markdown on stdout and in full as CSV and JSON, and error against cost as
 * figures. */
#include "tests/bench/ais.h"

#include <math.h>

#include "core/metric/metric.h"
#include "tests/bench/plot.h"
#include "tests/bench/table.h"

static double frames_per_second(const struct ais_cell *c)
{
    return 1000.0 / lum_bench_median_of(c->ms, c->n);
}

/* How many times faster a is than b: by wall clock, or by CPU time. NAN where one of them is missing. */
static struct lum_bench_median speedup(const struct ais_cell *a, const struct ais_cell *b, bool cpu)
{
    return lum_bench_ratio(cpu ? b->cpu_ms : b->ms, cpu ? a->cpu_ms : a->ms, a->n < b->n ? a->n : b->n);
}

/* The speed-ups that are reported; the first five are table 5.2's. */
static const struct comparison {
    enum ais_part part;
    enum ais_method a, b;
} comparisons[] = {
    {AIS_ID, AIS_A, AIS_MAX},   {AIS_SS, AIS_A, AIS_MAX},   {AIS_PM, AIS_A, AIS_MAX},
    {AIS_FULL, AIS_A, AIS_MAX}, {AIS_FULL, AIS_A, AIS_IGI}, {AIS_FULL, AIS_LIVE, AIS_A},
};

static struct lum_bench_median comparison_of(const struct ais_scene *s, const struct comparison *c, bool cpu)
{
    return speedup(&s->cells[c->a][c->part], &s->cells[c->b][c->part], cpu);
}

/* ---- tables on stdout ---- */

#define TEXT LUM_BENCH_TEXT

static const struct lum_bench_column fps_columns[] = {
    {"", "frames per second", TEXT},
    {"", "ID A", 2},
    {"", "A-MAX", 2},
    {"", "SS A", 2},
    {"", "A-MAX", 2},
    {"", "PM A", 2},
    {"", "A-MAX", 2},
    {"", "FULL A", 2},
    {"", "A-MAX", 2},
    {"", "IGI", 2},
    {"", "LIVE", 2},
};

static void print_frames(const struct ais_study *study, struct lum_bench_table *t)
{
    for (size_t i = 0; i < study->n_scenes; i++) {
        const struct ais_scene *s = &study->scenes[i];
        lum_bench_table_text(t, s->name);
        for (int p = 0; p < AIS_PARTS; p++)
            for (int m = 0; m < (p == AIS_FULL ? AIS_METHODS : AIS_IGI); m++)
                lum_bench_table_number(t, frames_per_second(&s->cells[m][p]));
    }
}

static const struct lum_bench_column speedup_columns[] = {
    {"", "speed-up", TEXT},     {"", "ID A/A-MAX", TEXT}, {"", "SS A/A-MAX", TEXT}, {"", "PM A/A-MAX", TEXT},
    {"", "FULL A/A-MAX", TEXT}, {"", "A/IGI", TEXT},      {"", "LIVE/A", TEXT},
};
_Static_assert(LUM_ARRAY_LEN(speedup_columns) == LUM_ARRAY_LEN(comparisons) + 1, "a column for each comparison");

/* The last row has means over scenes, as the thesis has: of rows in which all have the same effects. */
static void print_speedups(const struct ais_study *study, struct lum_bench_table *t)
{
    double sum[LUM_ARRAY_LEN(comparisons)] = {0};
    size_t n[LUM_ARRAY_LEN(comparisons)] = {0};
    char text[64];
    for (size_t i = 0; i < study->n_scenes; i++) {
        lum_bench_table_text(t, study->scenes[i].name);
        for (size_t k = 0; k < LUM_ARRAY_LEN(comparisons); k++) {
            struct lum_bench_median r = comparison_of(&study->scenes[i], &comparisons[k], false);
            lum_bench_table_median(t, r, 2);
            if (isfinite(r.median) && !study->scenes[i].partly) {
                sum[k] += r.median;
                n[k]++;
            }
        }
    }
    lum_bench_table_text(t, "mean");
    for (size_t k = 0; k < LUM_ARRAY_LEN(comparisons); k++) {
        text[0] = 0;
        if (n[k])
            snprintf(text, sizeof text, "%.2f", sum[k] / (double)n[k]);
        lum_bench_table_text(t, text);
    }
}

static const struct lum_bench_column error_columns[] = {
    {"", "relMSE x 1000", TEXT}, {"", "A", 3},         {"", "A-MAX", 3}, {"", "IGI", 3}, {"", "LIVE", 3},
    {"", "reference", 3},        {"", "SMAPE % A", 2}, {"", "A-MAX", 2}, {"", "IGI", 2}, {"", "LIVE", 2},
};

static void print_errors(const struct ais_study *study, struct lum_bench_table *t)
{
    for (size_t i = 0; i < study->n_scenes; i++) {
        const struct ais_scene *s = &study->scenes[i];
        lum_bench_table_text(t, s->name);
        for (int m = 0; m < AIS_METHODS; m++)
            lum_bench_table_number(t, 1e3 * s->errors[m].relmse);
        lum_bench_table_number(t, 1e3 * s->reference_relmse);
        for (int m = 0; m < AIS_METHODS; m++)
            lum_bench_table_number(t, 1e2 * s->errors[m].smape);
    }
}

static const struct lum_bench_column ray_columns[] = {
    {"", "million rays in FULL", TEXT},
    {"", "ID A", 2},
    {"", "A-MAX", 2},
    {"", "IGI", 2},
    {"", "LIVE", 2},
    {"", "SS A", 2},
    {"", "A-MAX", 2},
    {"", "IGI", 2},
    {"", "LIVE", 2},
    {"", "PM A", 2},
    {"", "A-MAX", 2},
    {"", "IGI", 2},
    {"", "LIVE", 2},
};

static double million_rays(const struct ais_cell *c, enum ais_part part)
{
    const uint64_t *n = c->rays;
    uint64_t direct = n[LUM_RAY_DIRECT] + n[LUM_RAY_SOFT_SHADOW] + n[LUM_RAY_ENVIRONMENT];
    uint64_t indirect = n[LUM_RAY_INDIRECT_DIFFUSE] + n[LUM_RAY_VPL];
    uint64_t sum = part == AIS_ID ? indirect : part == AIS_SS ? direct : n[LUM_RAY_MEDIA];
    return c->n ? (double)sum * 1e-6 : (double)NAN;
}

static void print_rays(const struct ais_study *study, struct lum_bench_table *t)
{
    for (size_t i = 0; i < study->n_scenes; i++) {
        lum_bench_table_text(t, study->scenes[i].name);
        for (int p = 0; p < AIS_FULL; p++)
            for (int m = 0; m < AIS_METHODS; m++)
                lum_bench_table_number(t, million_rays(&study->scenes[i].cells[m][AIS_FULL], (enum ais_part)p));
    }
}

/* What the thesis' model of cost says, in which a pixel traces a ray to each VPL of each subset that it takes, seen
 * from the point or not: a frame of IGI takes a ray for each ninth of 256 VPLs, A a sixteenth of that for each
 * iteration. */
static const struct lum_bench_column model_columns[] = {
    {"", "rays for indirect light, a pixel", TEXT},
    {"", "slots for 256 VPLs", 0},
    {"", "iterations", 2},
    {"", "traced: A", 2},
    {"", "A-MAX", 2},
    {"", "IGI", 2},
    {"", "A-MAX/A", 2},
    {"", "IGI/A", 2},
    {"", "without culling: A", 2},
    {"", "A-MAX", 2},
    {"", "IGI", 2},
    {"", "A-MAX/A", 2},
    {"", "IGI/A", 2},
};

static void print_model(const struct ais_study *study, struct lum_bench_table *t)
{
    for (size_t i = 0; i < study->n_scenes; i++) {
        const struct ais_scene *s = &study->scenes[i];
        const double n = (double)study->w * study->h, subset = AIS_VPLS / 9.0, most = 9.0 / 16.0 * subset;
        double per_pixel[AIS_METHODS], a = s->iterations / 16.0 * subset;
        for (int m = 0; m < AIS_METHODS; m++) {
            const struct ais_cell *c = &s->cells[m][AIS_FULL];
            per_pixel[m] = c->n ? (double)c->rays[LUM_RAY_INDIRECT_DIFFUSE] / n : (double)NAN;
        }
        if (s->partly)
            continue;
        lum_bench_table_text(t, s->name);
        LUM_BENCH_NUMBERS(t, (double)s->n_slots, s->iterations, per_pixel[AIS_A], per_pixel[AIS_MAX],
                          per_pixel[AIS_IGI], per_pixel[AIS_MAX] / per_pixel[AIS_A],
                          per_pixel[AIS_IGI] / per_pixel[AIS_A], a, most, subset, most / a, subset / a);
    }
}

/* ---- equal time, equal error ---- */

enum axis { COST, RAYS, RELMSE, SMAPE };

static double error_of(const struct lum_bench_error *e, enum axis axis)
{
    return axis == RELMSE ? e->relmse : e->smape;
}

static double value_of(const struct ais_point *p, enum axis axis)
{
    return axis == COST ? p->cpu_ms : axis == RAYS ? (double)p->rays : error_of(&p->error, axis);
}

/* The points by rising cost or rays, without those of no less error than one that takes no more, as the draws say that
 * pick. */
static struct ais_curve front_of(const struct ais_curve *c, enum axis cost, enum axis error)
{
    struct ais_curve all = *c, front = {.n = 0};
    for (size_t i = 1; i < all.n; i++)
        for (size_t k = i; k > 0 && value_of(&all.points[k], cost) < value_of(&all.points[k - 1], cost); k--) {
            struct ais_point p = all.points[k];
            all.points[k] = all.points[k - 1];
            all.points[k - 1] = p;
        }
    for (size_t i = 0; i < all.n; i++)
        if (front.n == 0 ||
            error_of(&all.points[i].picked_by, error) < error_of(&front.points[front.n - 1].picked_by, error))
            front.points[front.n++] = all.points[i];
    return front;
}

/* What a curve says of something: its value, or that it is less ('<') or more ('>'). NAN: nothing. */
struct reading {
    double value;
    char bound; /* 0: none */
};

/* On the straight line from p to q, on logarithmic paper. */
static double between(const struct ais_point *p, const struct ais_point *q, enum axis x_axis, double x,
                      enum axis y_axis)
{
    double x0 = value_of(p, x_axis), x1 = value_of(q, x_axis), y0 = value_of(p, y_axis), y1 = value_of(q, y_axis);
    if (!(fmin(fmin(x0, x1), fmin(y0, y1)) > 0.0) || x0 == x1)
        return fmax(y0, y1); /* an unbiased squared error may be below 0 */
    return y0 * exp(log(y1 / y0) * log(x / x0) / log(x1 / x0));
}

/* The error of the front at this cost. */
static struct reading error_at(const struct ais_curve *c, double cost, enum axis error)
{
    const struct ais_curve front = front_of(c, COST, error);
    const struct ais_point *p = front.points;
    bool beyond = true;
    size_t n = 0; /* points that cost no more */
    for (size_t i = 0; i < c->n; i++)
        beyond = beyond && c->points[i].cpu_ms <= cost;
    while (n < front.n && p[n].cpu_ms <= cost)
        n++;
    if (n == 0)
        return (struct reading){value_of(&p[0], error), '>'};
    if (n == front.n)
        return (struct reading){value_of(&p[n - 1], error), beyond ? '<' : 0};
    return (struct reading){between(&p[n - 1], &p[n], COST, cost, error), 0};
}

/* What the front costs where it first comes down to this error. */
static struct reading cost_at(const struct ais_curve *c, double value, enum axis error)
{
    const struct ais_curve front = front_of(c, COST, error);
    const struct ais_point *p = front.points;
    size_t n = 0; /* points of more error */
    while (n < front.n && value_of(&p[n], error) > value)
        n++;
    if (n == 0)
        return (struct reading){p[0].cpu_ms, '<'};
    if (n == front.n)
        return (struct reading){p[n - 1].cpu_ms, '>'};
    return (struct reading){between(&p[n - 1], &p[n], error, value, COST), 0};
}

static void put_reading(struct lum_bench_table *t, struct reading r)
{
    char text[64] = "";
    if (isfinite(r.value))
        snprintf(text, sizeof text, "%s%.2f", r.bound == '<' ? "< " : r.bound == '>' ? "> " : "", r.value);
    lum_bench_table_text(t, text);
}

/* The error of c at what a costs, and what c costs at the error of a, over those of a. */
static void put_compared(struct lum_bench_table *t, const struct ais_curve *c, const struct ais_point *a,
                         enum axis error)
{
    struct reading there = {(double)NAN, 0}, cost = {(double)NAN, 0};
    if (a && c->n) {
        there = error_at(c, a->cpu_ms, error);
        there.value /= value_of(a, error);
        cost = cost_at(c, value_of(a, error), error);
        cost.value /= a->cpu_ms;
    }
    put_reading(t, there);
    put_reading(t, cost);
}

/* The cost of b over that of curve c at b's error. */
static void put_inverse(struct lum_bench_table *t, const struct ais_curve *c, const struct ais_point *b,
                        enum axis error)
{
    struct reading r = {(double)NAN, 0};
    if (b && c->n) {
        r = cost_at(c, value_of(b, error), error);
        r.value = b->cpu_ms / r.value;
        r.bound = r.bound == '<' ? '>' : r.bound == '>' ? '<' : 0;
    }
    put_reading(t, r);
}

static const struct ais_point *default_point(const struct ais_curve *c)
{
    for (size_t i = 0; i < c->n; i++)
        if (c->points[i].at_default)
            return &c->points[i];
    return NULL;
}

static const struct lum_bench_column equal_columns[] = {
    {"", "equal time, equal error", TEXT},   {"", "error", TEXT},
    {"", "LIVE/A: error at A's time", TEXT}, {"", "time at A's error", TEXT},
    {"", "time at LIVE's error", TEXT},      {"", "IGI/A: error at A's time", TEXT},
    {"", "time at A's error", TEXT},         {"", "time at IGI's error", TEXT},
    {"", "path/A: error at A's time", TEXT}, {"", "time at A's error", TEXT},
};

static void print_equal(const struct ais_study *study, struct lum_bench_table *t)
{
    for (size_t i = 0; i < study->n_scenes; i++)
        for (enum axis error = RELMSE; error <= SMAPE; error++) {
            const struct ais_curve *curves = study->scenes[i].curves, *path = &curves[AIS_METHODS];
            const struct ais_point *a = default_point(&curves[AIS_A]), *live = default_point(&curves[AIS_LIVE]);
            const struct ais_point *igi = default_point(&curves[AIS_IGI]);
            LUM_BENCH_TEXTS(t, study->scenes[i].name, error == RELMSE ? "relMSE" : "SMAPE");
            put_compared(t, &curves[AIS_LIVE], a, error);
            put_inverse(t, &curves[AIS_A], live, error);
            put_compared(t, &curves[AIS_IGI], a, error);
            put_inverse(t, &curves[AIS_A], igi, error);
            put_compared(t, path, a, error);
        }
}

/* ---- files ---- */

static const struct lum_bench_column frame_columns[] = {
    {"scene", NULL, TEXT},         {"method", NULL, TEXT}, {"part", NULL, TEXT},    {"fps", NULL, 4},
    {"cpu_ms", NULL, 4},           {"relmse", NULL, 9},    {"smape", NULL, 9},      {"reference_spp", NULL, 0},
    {"reference_relmse", NULL, 9}, {"slots", NULL, 0},     {"iterations", NULL, 4}, LUM_BENCH_RAY_COLUMNS(0),
};

static void put_frames(const struct ais_study *study, struct lum_bench_table *t)
{
    for (size_t i = 0; i < study->n_scenes; i++)
        for (int k = 0; k < AIS_METHODS * AIS_PARTS; k++) {
            int m = k / AIS_PARTS, p = k % AIS_PARTS;
            const struct ais_scene *s = &study->scenes[i];
            const struct ais_cell *c = &s->cells[m][p];
            if (c->n == 0)
                continue;
            LUM_BENCH_TEXTS(t, s->name, ais_methods[m], ais_parts[p]);
            LUM_BENCH_NUMBERS(t, frames_per_second(c), lum_bench_median_of(c->cpu_ms, c->n),
                              p == AIS_FULL ? s->errors[m].relmse : (double)NAN,
                              p == AIS_FULL ? s->errors[m].smape : (double)NAN, (double)s->reference_spp,
                              s->reference_relmse, m == AIS_LIVE ? (double)NAN : (double)s->n_slots,
                              m == AIS_A && p == AIS_ID ? s->iterations : (double)NAN);
            for (int r = 0; r < LUM_RAY_KIND_COUNT; r++)
                lum_bench_table_number(t, (double)c->rays[r]);
        }
}

static const struct lum_bench_column ratio_columns[] = {
    {"scene", NULL, TEXT}, {"part", NULL, TEXT}, {"faster", NULL, TEXT},   {"slower", NULL, TEXT}, {"speedup", NULL, 4},
    {"lo", NULL, 4},       {"hi", NULL, 4},      {"speedup_cpu", NULL, 4}, {"cpu_lo", NULL, 4},    {"cpu_hi", NULL, 4},
};

static void put_ratios(const struct ais_study *study, struct lum_bench_table *t)
{
    for (size_t i = 0; i < study->n_scenes; i++)
        for (size_t k = 0; k < LUM_ARRAY_LEN(comparisons); k++) {
            const struct comparison *c = &comparisons[k];
            struct lum_bench_median wall = comparison_of(&study->scenes[i], c, false);
            struct lum_bench_median cpu = comparison_of(&study->scenes[i], c, true);
            if (!isfinite(wall.median))
                continue;
            LUM_BENCH_TEXTS(t, study->scenes[i].name, ais_parts[c->part], ais_methods[c->a], ais_methods[c->b]);
            LUM_BENCH_NUMBERS(t, wall.median, wall.lo, wall.hi, cpu.median, cpu.lo, cpu.hi);
        }
}

static const struct lum_bench_column point_columns[] = {
    {"scene", NULL, TEXT},       {"method", NULL, TEXT}, {"vpls", NULL, 0},  {"shadow_budget", NULL, 0},
    {"cache_accuracy", NULL, 3}, {"default", NULL, 0},   {"spp", NULL, 0},   {"cpu_ms", NULL, 4},
    {"rays", NULL, 0},           {"relmse", NULL, 9},    {"smape", NULL, 9},
};

static const char *curve_name(int curve)
{
    return curve < AIS_METHODS ? ais_methods[curve] : "path";
}

static void put_points(const struct ais_study *study, struct lum_bench_table *t)
{
    for (size_t i = 0; i < study->n_scenes; i++)
        for (int m = 0; m <= AIS_METHODS; m++)
            for (size_t k = 0; k < study->scenes[i].curves[m].n; k++) {
                const struct ais_point *p = &study->scenes[i].curves[m].points[k];
                LUM_BENCH_TEXTS(t, study->scenes[i].name, curve_name(m));
                bool live = m == AIS_LIVE;
                LUM_BENCH_NUMBERS(t, (double)p->n_vpls, live ? (double)p->shadow_budget : (double)NAN,
                                  live ? p->cache_accuracy : (double)NAN, (double)p->at_default, (double)p->spp,
                                  p->cpu_ms, (double)p->rays, p->error.relmse, p->error.smape);
            }
}

/* ---- figures ---- */

static bool draw(const struct ais_study *study, const struct ais_scene *s, const struct lum_bench_options *options)
{
    double x[2][AIS_METHODS + 1][AIS_POINTS], y[2][AIS_METHODS + 1][AIS_POINTS];
    struct lum_plot_series series[2][AIS_METHODS + 1];
    size_t n = 0;
    for (int m = 0; m <= AIS_METHODS; m++) {
        for (int side = 0; side < 2 && s->curves[m].n; side++) {
            struct ais_curve c = s->curves[m];
            if (m == AIS_LIVE) /* whose budgets lie in no order */
                c = front_of(&c, side ? RAYS : COST, RELMSE);
            for (size_t i = 0; i < c.n; i++) {
                x[side][m][i] = side ? (double)c.points[i].rays * 1e-6 : c.points[i].cpu_ms;
                y[side][m][i] = c.points[i].error.relmse;
            }
            series[side][n] = (struct lum_plot_series){
                .label = curve_name(m), .color = (uint32_t)m, .n = c.n, .x = x[side][m], .y = y[side][m]};
        }
        n += s->curves[m].n > 0;
    }
    const struct lum_plot_axis error = {"relMSE", LUM_PLOT_LOG10, 0.0, 0.0};
    const struct lum_plot_panel panels[2] = {
        {"(a) by time", {"CPU time of a frame, ms", LUM_PLOT_LOG10, 0.0, 0.0}, error, series[0], n},
        {"(b) by rays", {"rays of a frame, millions", LUM_PLOT_LOG10, 0.0, 0.0}, error, series[1], n},
    };
    char title[128], subtitle[96], file[128];
    snprintf(title, sizeof title, "Error against cost: %s", s->name);
    snprintf(subtitle, sizeof subtitle, "%u × %u, one frame from nothing, against path (%u samples)", study->w,
             study->h, s->reference_spp);
    snprintf(file, sizeof file, "ais-%s.svg", s->name);
    const struct lum_plot plot = {title, subtitle, panels, 2, true};
    return lum_bench_plot(options, file, &plot, study->machine);
}

/* ---- all ---- */

typedef void (*fill_fn)(const struct ais_study *study, struct lum_bench_table *t);

static const struct output {
    const char *file; /* NULL: to stdout */
    const char *note; /* above the table; NULL: none */
    const struct lum_bench_column *columns;
    size_t n_columns;
    fill_fn fill;
} outputs[] = {
    {NULL, NULL, fps_columns, LUM_ARRAY_LEN(fps_columns), print_frames},
    {NULL, "X/Y above 1: X is faster.", speedup_columns, LUM_ARRAY_LEN(speedup_columns), print_speedups},
    {NULL, NULL, ray_columns, LUM_ARRAY_LEN(ray_columns), print_rays},
    {NULL, NULL, model_columns, LUM_ARRAY_LEN(model_columns), print_model},
    {NULL, "Less is better. The reference's own noise counts in SMAPE, not in relMSE.", error_columns,
     LUM_ARRAY_LEN(error_columns), print_errors},
    {NULL,
     "Below 1: LIVE (IGI, path) has less error than A, or needs less CPU time. At A's time and error: A at its "
     "default\n"
     "of 256 VPLs, LIVE (IGI) along the front of its budgets; at LIVE's (IGI's) error: that at its default, A along "
     "its\n"
     "own. < and >: beyond the end, which gives the bound.",
     equal_columns, LUM_ARRAY_LEN(equal_columns), print_equal},
    {"ais", NULL, frame_columns, LUM_ARRAY_LEN(frame_columns), put_frames},
    {"ais-speedup", NULL, ratio_columns, LUM_ARRAY_LEN(ratio_columns), put_ratios},
    {"ais-budget", NULL, point_columns, LUM_ARRAY_LEN(point_columns), put_points},
};

static bool any_partly(const struct ais_study *study)
{
    bool any = false;
    for (size_t i = 0; i < study->n_scenes; i++)
        any = any || study->scenes[i].partly;
    return any;
}

bool ais_report(const struct ais_study *study, const struct lum_bench_options *options)
{
    bool ok = true;
    printf("%u x %u; %s; A: ais, A-MAX: ais-max; 95 %% intervals\n", study->w, study->h, study->machine);
    printf("ID: indirect diffuse, SS: soft shadows, PM: participating media, FULL: all; " LUM_BENCH_RELMSE "\n",
           LUM_METRIC_EPSILON, LUM_METRIC_EPSILON);
    if (any_partly(study))
        printf(
            "SCENE-no-gloss: gloss is off in all methods and in the reference, so that all have the same effects; "
            "SCENE\nitself: with gloss, of which LIVE traces paths and A shows reflected lights alone; not in means\n");
    for (size_t i = 0; ok && i < LUM_ARRAY_LEN(outputs); i++) {
        const struct output *o = &outputs[i];
        struct lum_bench_table t = {.columns = o->columns, .n_columns = o->n_columns};
        if (o->note)
            printf("\n%s\n", o->note);
        o->fill(study, &t);
        ok = lum_bench_table_finish(&t, options, o->file);
    }
    for (size_t i = 0; ok && i < study->n_scenes; i++)
        ok = draw(study, &study->scenes[i], options);
    return ok;
}

/* The accuracy study as tables on stdout, CSV and JSON, a figure per scene, and one page, accuracy.html. */
#include <ctype.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/metric/metric.h"
#include "server/stream/png.h"
#include "tests/bench/accuracy.h"
#include "tests/bench/plot.h"
#include "tests/bench/table.h"

/* ---- what points say ---- */

double accuracy_ms(const struct accuracy_point *p)
{
    return lum_bench_median_of(p->own_ms, p->n);
}

double accuracy_error(const struct accuracy_point *p, enum accuracy_error which)
{
    double sum = 0.0;
    for (uint32_t i = 0; i < p->n; i++)
        sum += p->error[which][i];
    return p->n ? sum / p->n : (double)NAN;
}

struct curve {
    size_t n;
    double ms[ACCURACY_POINTS], error[ACCURACY_POINTS];
};

/* Of a method that adds samples: its pictures of growing numbers of them, at its default settings. */
static struct curve curve_of(const struct accuracy_scene *s, const char *method, enum accuracy_error which)
{
    struct curve c = {0};
    for (size_t i = 0; i < s->n; i++) {
        const struct accuracy_point *p = &s->points[i];
        bool follows = i + 1 < s->n && !s->points[i + 1].first;
        if (strcmp(p->method->name, method) == 0 && (!p->first || follows)) {
            c.ms[c.n] = accuracy_ms(p);
            c.error[c.n++] = accuracy_error(p, which);
        }
    }
    return c;
}

double accuracy_time_to(const struct accuracy_scene *s, const char *method, enum accuracy_error which, double error)
{
    struct curve c = curve_of(s, method, which);
    for (size_t i = 0; i < c.n; i++) {
        if (!(c.error[i] <= error))
            continue;
        if (i == 0 || !(c.error[i] > 0.0))
            return c.ms[i];
        double t = log(c.error[i - 1] / error) / log(c.error[i - 1] / c.error[i]);
        return c.ms[i - 1] * pow(c.ms[i] / c.ms[i - 1], t);
    }
    return (double)NAN;
}

double accuracy_slope(const struct accuracy_scene *s, const char *method)
{
    struct curve c = curve_of(s, method, ACCURACY_RELMSE);
    double n = 0.0, x = 0.0, y = 0.0, xx = 0.0, xy = 0.0;
    for (size_t i = c.n / 2; i < c.n; i++)
        if (c.error[i] > 0.0) {
            double lx = log(c.ms[i]), ly = log(c.error[i]);
            n++, x += lx, y += ly, xx += lx * lx, xy += lx * ly;
        }
    return n >= 3.0 ? (n * xy - x * y) / (n * xx - x * x) : (double)NAN;
}

bool accuracy_is_default(const struct accuracy_scene *s, size_t i)
{
    const struct accuracy_point *p = &s->points[i];
    char vpls[32];
    snprintf(vpls, sizeof vpls, "%u ", LUM_VPL_DEFAULT);
    return p->first && (!lum_method_counts_vpls(p->method) || strncmp(p->setting, vpls, strlen(vpls)) == 0);
}

static bool beaten(const struct accuracy_scene *s, const struct accuracy_point *p)
{
    for (size_t i = 0; i < s->n; i++)
        if (accuracy_ms(&s->points[i]) < accuracy_ms(p) &&
            accuracy_error(&s->points[i], ACCURACY_RELMSE) < accuracy_error(p, ACCURACY_RELMSE))
            return true;
    return false;
}

/* Least error of any setting of the method: what is left is bias, or the noise of the most samples. */
static double floor_of(const struct accuracy_scene *s, const struct lum_method *method)
{
    double least = INFINITY;
    for (size_t i = 0; i < s->n; i++)
        if (s->points[i].method == method)
            least = fmin(least, accuracy_error(&s->points[i], ACCURACY_RELMSE));
    return least;
}

/* ---- the report ---- */

#define TEXT LUM_BENCH_TEXT
static const struct lum_bench_column point_columns[] = {
    {"scene", "scene", TEXT},
    {"method", "method", TEXT},
    {"setting", "setting", TEXT},
    {"front", "on the front", TEXT},
    {"ms", "ms", 1},
    {"ms_lo", NULL, 1},
    {"ms_hi", NULL, 1},
    {"rays_per_pixel", "rays a pixel", 2},
    {"relmse", "relMSE", 5},
    {"relmse_least", NULL, 5},
    {"relmse_most", NULL, 5},
    {"smape", "SMAPE", 4},
    {"path_ms", "ms that path takes for it", 0},
    {"path_over_ms", "over its own", 2},
    {"seeds", NULL, 0},
};
static const struct lum_bench_column even_columns[] = {
    {"scene", "scene", TEXT},
    {"method", "method", TEXT},
    {"first_ms", "first frame, ms", 1},
    {"first_relmse", "its relMSE", 4},
    {"path_ms", "path is as good after, ms", 0},
    {"live_ms", "live is as good after, ms", 0},
    {"first_smape", "SMAPE of the first frame", 4},
    {"path_smape_ms", "path is as good by SMAPE after, ms", 0},
    {"live_smape_ms", "live is as good by SMAPE after, ms", 0},
    {"floor", "least relMSE of any setting", 5},
    {"slope", "slope of its error over time", 2},
    {"same", "A/A: time of path over itself", TEXT},
    {"reference_relmse", "of the reference", 6},
};

struct accuracy_report {
    const struct lum_bench_options *options;
    struct lum_bench_table points, even;
    FILE *page;
    bool ok;
};

struct accuracy_report *accuracy_report_open(const struct lum_bench_options *options)
{
    struct accuracy_report *r = lum_calloc(1, sizeof *r);
    if (!r) {
        fprintf(stderr, "lumend-bench: out of memory\n");
        return NULL;
    }
    *r = (struct accuracy_report){.options = options,
                                  .points = LUM_BENCH_TABLE(point_columns),
                                  .even = LUM_BENCH_TABLE(even_columns),
                                  .page = lum_bench_open(options, "accuracy.html")};
    if (!r->page) {
        lum_free(r);
        return NULL;
    }
    fputs("<!DOCTYPE html>\n<meta charset=\"utf-8\">\n<title>lumend-bench accuracy</title>\n<style>\n"
          "body { font: 14px sans-serif; margin: 1em; background: #222; color: #ddd; max-width: 1280px }\n"
          "figure { display: inline-block; margin: 0 8px 8px 0; vertical-align: top }\n"
          "figure img { display: block; width: 300px } img.plot { width: 100%; max-width: 1100px }\n"
          "td, th { padding: 2px 10px 2px 0; text-align: right } td:first-child, th:first-child { text-align: left }\n"
          "</style>\n<h1>What accuracy costs in time</h1>\n"
          "<p>Each mark is a picture of a method at a setting: how long it took from nothing, and how far it is off. "
          "Lower "
          "and further left is better. The lines of path and live go on as samples are added; where one crosses the "
          "height of a mark, it is as good as that.",
          r->page);
    fputs(options->quick ? " Made with --quick: not for quoting.</p>\n" : "</p>\n", r->page);
    return r;
}

static void file_name(const struct accuracy_scene *s, const char *part, const char *type, char *ret_name, size_t size)
{
    int n = snprintf(ret_name, size, "accuracy-%.60s", s->name);
    for (int i = 0; i < n; i++)
        if (!isalnum((unsigned char)ret_name[i]) && ret_name[i] != '_')
            ret_name[i] = '-';
    snprintf(ret_name + n, size - (size_t)n, "%s%.32s.%s", *part ? "-" : "", part, type);
}

/* ---- a figure ---- */

struct lines {
    struct lum_plot_series series[LUM_BENCH_METHODS];
    double x[LUM_BENCH_METHODS][ACCURACY_POINTS], rays[LUM_BENCH_METHODS][ACCURACY_POINTS],
        y[LUM_BENCH_METHODS][ACCURACY_POINTS], lo[LUM_BENCH_METHODS][ACCURACY_POINTS],
        hi[LUM_BENCH_METHODS][ACCURACY_POINTS];
    size_t n;
};

static int by_ms(const void *a, const void *b)
{
    const struct accuracy_point *const *p = a, *const *q = b;
    double d = accuracy_ms(*p) - accuracy_ms(*q);
    return d < 0.0 ? -1 : d > 0.0;
}

/* A method's points from left to right. */
static void add_line(struct lines *l, const struct accuracy_scene *s, const struct lum_method *method)
{
    const struct accuracy_point *sorted[ACCURACY_POINTS];
    size_t n = 0, k = l->n++;
    for (size_t i = 0; i < s->n; i++)
        if (s->points[i].method == method)
            sorted[n++] = &s->points[i];
    qsort(sorted, n, sizeof *sorted, by_ms);
    for (size_t i = 0; i < n; i++) {
        double least = INFINITY, most = 0.0;
        for (uint32_t seed = 0; seed < sorted[i]->n; seed++) {
            least = fmin(least, sorted[i]->error[ACCURACY_RELMSE][seed]);
            most = fmax(most, sorted[i]->error[ACCURACY_RELMSE][seed]);
        }
        l->x[k][i] = accuracy_ms(sorted[i]);
        l->rays[k][i] = sorted[i]->rays;
        l->y[k][i] = accuracy_error(sorted[i], ACCURACY_RELMSE);
        l->lo[k][i] = least;
        l->hi[k][i] = most;
    }
    l->series[k] = (struct lum_plot_series){.label = method->name,
                                            .color = (uint32_t)(k % LUM_PLOT_COLORS),
                                            .dashed = k >= LUM_PLOT_COLORS,
                                            .n = n,
                                            .x = l->x[k],
                                            .y = l->y[k],
                                            .y_lo = l->lo[k],
                                            .y_hi = l->hi[k]};
}

static bool draw(struct accuracy_report *r, const struct accuracy_scene *s)
{
    struct lines *l = lum_calloc(1, sizeof *l);
    struct lum_plot_series by_rays[LUM_BENCH_METHODS];
    char name[160], chart[160], title[128], subtitle[128];
    if (!l)
        return false;
    for (size_t i = 0; i < s->n && l->n < LUM_BENCH_METHODS; i++)
        if (i == 0 || s->points[i].method != s->points[i - 1].method)
            add_line(l, s, s->points[i].method);
    for (size_t k = 0; k < l->n; k++) {
        by_rays[k] = l->series[k];
        by_rays[k].x = l->rays[k];
    }
    const struct lum_plot_panel panels[] = {
        {.x = {"milliseconds", LUM_PLOT_LOG10, 0, 0},
         .y = {"relMSE", LUM_PLOT_LOG10, 0, 0},
         .series = l->series,
         .n_series = l->n},
        {.x = {"rays a pixel", LUM_PLOT_LOG10, 0, 0},
         .y = {"relMSE", LUM_PLOT_LOG10, 0, 0},
         .series = by_rays,
         .n_series = l->n},
    };
    snprintf(title, sizeof title, "Error over time and over rays, %.60s", s->name);
    snprintf(subtitle, sizeof subtitle, "%u × %u, pixel centres, %u seeds: mean, least and most", s->w, s->h,
             s->n ? s->points[0].n : 0);
    const struct lum_plot plot = {
        .title = title, .subtitle = subtitle, .panels = panels, .n_panels = 2, .same_y = true};
    file_name(s, "", "svg", name, sizeof name);
    bool ok = lum_bench_plot(r->options, name, &plot, s->machine);
    file_name(s, "chart", "svg", chart, sizeof chart);
    ok = ok && accuracy_chart_draw(r->options, s, chart);
    fprintf(r->page,
            "<h2>%s</h2>\n<img class=\"plot\" src=\"%s\" alt=\"error over time, and when path is as good\">\n"
            "<img class=\"plot\" src=\"%s\" alt=\"error over time of each setting\">\n",
            s->name, chart, name);
    lum_free(l);
    return ok;
}

/* ---- tables ---- */

static double least_of(const double *v, uint32_t n)
{
    double least = INFINITY;
    for (uint32_t i = 0; i < n; i++)
        least = fmin(least, v[i]);
    return least;
}

static double most_of(const double *v, uint32_t n)
{
    double most = -INFINITY;
    for (uint32_t i = 0; i < n; i++)
        most = fmax(most, v[i]);
    return most;
}

static void add_points(struct accuracy_report *r, const struct accuracy_scene *s)
{
    for (size_t i = 0; i < s->n; i++) {
        const struct accuracy_point *p = &s->points[i];
        double ms[ACCURACY_SEEDS], relmse = accuracy_error(p, ACCURACY_RELMSE);
        double path_ms = accuracy_time_to(s, "path", ACCURACY_RELMSE, relmse);
        memcpy(ms, p->own_ms, sizeof ms);
        struct lum_bench_median m = lum_bench_bootstrap(ms, p->n);
        LUM_BENCH_TEXTS(&r->points, s->name, p->method->name, p->setting, beaten(s, p) ? "" : "yes");
        LUM_BENCH_NUMBERS(&r->points, m.median, m.lo, m.hi, p->rays, relmse, least_of(p->error[ACCURACY_RELMSE], p->n),
                          most_of(p->error[ACCURACY_RELMSE], p->n), accuracy_error(p, ACCURACY_SMAPE), path_ms,
                          path_ms / m.median, (double)p->n);
    }
}

static void add_even(struct accuracy_report *r, struct accuracy_scene *s, size_t i)
{
    const struct accuracy_point *p = &s->points[i];
    double relmse = accuracy_error(p, ACCURACY_RELMSE), smape = accuracy_error(p, ACCURACY_SMAPE);
    double path_ms = accuracy_time_to(s, "path", ACCURACY_RELMSE, relmse);
    LUM_BENCH_TEXTS(&r->even, s->name, p->method->name);
    LUM_BENCH_NUMBERS(&r->even, accuracy_ms(p), relmse, path_ms, accuracy_time_to(s, "live", ACCURACY_RELMSE, relmse),
                      smape, accuracy_time_to(s, "path", ACCURACY_SMAPE, smape),
                      accuracy_time_to(s, "live", ACCURACY_SMAPE, smape), floor_of(s, p->method),
                      accuracy_slope(s, p->method->name));
    lum_bench_table_median(&r->even, lum_bench_bootstrap(s->same, s->n_same), 3);
    lum_bench_table_number(&r->even, s->reference_relmse);
    fprintf(r->page, "<tr><td>%s<td>%.0f<td>%.4f<td>", p->method->name, accuracy_ms(p), relmse);
    fprintf(r->page, isfinite(path_ms) ? "%.1f s" : "later than measured", path_ms * 1e-3);
    fprintf(r->page, "<td>%.5f\n", floor_of(s, p->method));
}

bool accuracy_report_scene(struct accuracy_report *r, const struct accuracy_scene *scene)
{
    struct accuracy_scene *s = lum_calloc(1, sizeof *s); /* what is sorted is a copy */
    if (!s)
        return false;
    *s = *scene;
    add_points(r, s);
    r->ok = draw(r, s);
    fputs("<table>\n<tr><th>method<th>first frame, ms<th>its relMSE<th>path is as good after<th>least relMSE of any "
          "setting\n",
          r->page);
    for (size_t i = 0; i < s->n; i++)
        if (accuracy_is_default(s, i))
            add_even(r, s, i);
    fputs("</table>\n", r->page);
    lum_free(s);
    return r->ok;
}

bool accuracy_report_picture(struct accuracy_report *r, const struct accuracy_scene *s, const char *title,
                             const char *file, const float *picture, double white)
{
    char name[160], path[4096];
    struct lum_error err = {0};
    size_t n = (size_t)s->w * s->h;
    uint8_t *rgb = lum_calloc(n, 3);
    if (!rgb)
        return false;
    for (size_t i = 0; i < n; i++)
        lum_tone_pixel(lum_rgb(picture[3 * i], picture[3 * i + 1], picture[3 * i + 2]), white, LUM_TONE_AGX,
                       rgb + 3 * i);
    file_name(s, file, "png", name, sizeof name);
    snprintf(path, sizeof path, "%s/%s", r->options->out, name);
    bool ok = lum_png_write(path, &(struct lum_png){rgb, s->w, s->h, 6}, &err) == LUM_OK;
    lum_free(rgb);
    if (!ok)
        fprintf(stderr, "lumend-bench: %s\n", err.text);
    fprintf(r->page, "<figure><figcaption>%s</figcaption><a href=\"%s\"><img src=\"%s\" alt=\"\"></a></figure>\n",
            title, name, name);
    return ok;
}

bool accuracy_report_close(struct accuracy_report *r, bool ok)
{
    if (!r)
        return false;
    printf("Every picture: " LUM_BENCH_RELMSE "\n", LUM_METRIC_EPSILON, LUM_METRIC_EPSILON);
    ok = lum_bench_table_finish(&r->points, r->options, "accuracy") && ok;
    printf("\nFirst frames at the default settings, and when path tracing is as good\n");
    ok = lum_bench_table_finish(&r->even, r->options, "accuracy-break-even") && ok;
    ok = lum_bench_close(r->page, "accuracy.html") && ok;
    lum_free(r);
    return ok;
}

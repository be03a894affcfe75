#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "tests/bench/accuracy.h"
#include "tests/bench/plot.h"

/* Drawn from left to right, of those that were measured; the first has what the title says. */
static const char *const drawn[] = {"live", "path", "tic", "ais", "igi", "irrcache"};
enum { DRAWN = LUM_ARRAY_LEN(drawn) };

#define LONG_NAME 20u /* characters; with more a title must be short to fit */

struct curve {
    size_t n;
    double s[ACCURACY_POINTS], percent[ACCURACY_POINTS];
};

/* Root mean square of relative errors. */
static double percent(double relmse)
{
    return relmse > 0.0 ? 100.0 * sqrt(relmse) : (double)NAN;
}

static int by_time(const void *a, const void *b)
{
    double d = ((const double *)a)[0] - ((const double *)b)[0];
    return d < 0.0 ? -1 : d > 0.0;
}

/* Of a method that adds samples its default settings, of others what no other setting of theirs beats. */
static void find_curve(const struct accuracy_scene *s, const char *method, struct curve *ret_curve)
{
    double points[ACCURACY_POINTS][2], least = INFINITY;
    size_t n = 0;
    bool adds = false;
    for (size_t i = 0; i < s->n; i++)
        adds = adds || (strcmp(s->points[i].method->name, method) == 0 && !s->points[i].first);
    for (size_t i = 0; i < s->n; i++) {
        const struct accuracy_point *p = &s->points[i];
        if (strcmp(p->method->name, method) == 0 && (!adds || !p->first || accuracy_is_default(s, i))) {
            points[n][0] = 1e-3 * accuracy_ms(p);
            points[n++][1] = percent(accuracy_error(p, ACCURACY_RELMSE));
        }
    }
    qsort(points, n, sizeof *points, by_time);
    ret_curve->n = 0;
    for (size_t i = 0; i < n; i++) {
        if (!adds && !(points[i][1] < least))
            continue;
        least = points[i][1];
        ret_curve->s[ret_curve->n] = points[i][0];
        ret_curve->percent[ret_curve->n++] = points[i][1];
    }
}

/* From a first frame to the path traced picture that is as good. n 0: path is not so good in what was measured. */
struct even {
    size_t n;
    double s[2], percent[2];
    char note[64];
};

static void find_even(const struct accuracy_scene *s, const char *method, struct even *ret_even)
{
    *ret_even = (struct even){0};
    for (size_t i = 0; i < s->n; i++) {
        if (!accuracy_is_default(s, i) || strcmp(s->points[i].method->name, method) != 0)
            continue;
        double relmse = accuracy_error(&s->points[i], ACCURACY_RELMSE);
        double path_s = 1e-3 * accuracy_time_to(s, "path", ACCURACY_RELMSE, relmse);
        if (!isfinite(path_s))
            return;
        *ret_even = (struct even){
            .n = 2, .s = {1e-3 * accuracy_ms(&s->points[i]), path_s}, .percent = {percent(relmse), percent(relmse)}};
        snprintf(ret_even->note, sizeof ret_even->note, "path: as good after %.2g s", path_s);
    }
}

struct chart {
    struct curve curves[DRAWN];
    struct even even[DRAWN];
    struct lum_plot_series series[2 * DRAWN + 2];
    size_t n;
};

static void fill(struct chart *c, const struct accuracy_scene *s)
{
    for (size_t i = 0; i < DRAWN; i++) {
        find_curve(s, drawn[i], &c->curves[i]);
        if (strcmp(drawn[i], "path") != 0)
            find_even(s, drawn[i], &c->even[i]);
    }
    for (size_t i = 0; i < DRAWN; i++) {
        struct even *e = &c->even[i];
        bool first = i == 0;
        if (e->n && first) /* a line to it; of the others its end alone */
            c->series[c->n++] = (struct lum_plot_series){
                .color = LUM_PLOT_GREY, .dashed = true, .n = 2, .x = e->s, .y = e->percent, .note = e->note};
        if (e->n)
            c->series[c->n++] = (struct lum_plot_series){
                .color = (uint32_t)i, .dashed = true, .n = 1, .x = e->s + 1, .y = e->percent + 1};
    }
    for (size_t i = 0; i < DRAWN; i++)
        if (c->curves[i].n)
            c->series[c->n++] = (struct lum_plot_series){.label = drawn[i],
                                                         .color = (uint32_t)i,
                                                         .n = c->curves[i].n,
                                                         .x = c->curves[i].s,
                                                         .y = c->curves[i].percent};
    c->series[c->n++] = (struct lum_plot_series){
        .label = "hollow: path as good as a first frame", .color = LUM_PLOT_GREY, .dashed = true};
}

bool accuracy_chart_draw(const struct lum_bench_options *options, const struct accuracy_scene *s, const char *name)
{
    struct chart *c = lum_calloc(1, sizeof *c);
    char title[160], subtitle[256];
    if (!c)
        return false;
    fill(c, s);
    const char *what = strlen(s->name) <= LONG_NAME ? "How good a picture is after how long" : "Error over time";
    snprintf(title, sizeof title, "%s, %.60s", what, s->name);
    snprintf(subtitle, sizeof subtitle, "%u × %u, %u seeds", s->w, s->h, s->n ? s->points[0].n : 0);
    const struct lum_plot_panel panel = {.x = {"seconds from nothing", LUM_PLOT_LOG10, 0, 0},
                                         .y = {"relative error (root of relMSE), %", LUM_PLOT_LOG10, 0, 0},
                                         .series = c->series,
                                         .n_series = c->n};
    const struct lum_plot plot = {.title = title, .subtitle = subtitle, .panels = &panel, .n_panels = 1};
    bool ok = lum_bench_plot(options, name, &plot, s->machine);
    lum_free(c);
    return ok;
}

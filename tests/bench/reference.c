#include "tests/bench/reference.h"

#include <math.h>
#include <string.h>

#include "core/metric/metric.h"

#define RELMSE_ENOUGH 5e-4

static bool failed(const char *text)
{
    fprintf(stderr, "lumend-bench: %s\n", text);
    return false;
}

static double half_mean(const struct lum_film *f, int half, size_t pixel, size_t channel)
{
    return f->n[half][pixel] ? f->half[half][3 * pixel + channel] / (double)f->n[half][pixel] : 0.0;
}

/* picture NULL: the noise of the reference itself. */
static double relmse_against(const struct lum_bench_reference *r, const float *picture)
{
    const struct lum_film *reference = lum_view_film(r->view);
    double sum = 0.0, epsilon = LUM_METRIC_EPSILON * r->mean * r->mean;
    size_t n = (size_t)reference->w * reference->h;
    for (size_t i = 0; i < 3 * n; i++) {
        double a = half_mean(reference, 0, i / 3, i % 3), b = half_mean(reference, 1, i / 3, i % 3);
        double x = picture ? (double)picture[i] : 0.0, middle = 0.5 * (a + b);
        double square = picture ? (x - a) * (x - b) : 0.25 * (a - b) * (a - b);
        sum += square / (middle * middle + epsilon);
    }
    return sum / (3.0 * (double)n);
}

static void read_film(const struct lum_view *view, float *ret_values)
{
    const struct lum_film *f = lum_view_film(view);
    for (uint32_t y = 0; y < f->h; y++)
        for (uint32_t x = 0; x < f->w; x++) {
            struct lum_rgb c = lum_film_mean(f, x, y);
            float *v = ret_values + 3 * ((size_t)y * f->w + x);
            v[0] = c.r, v[1] = c.g, v[2] = c.b;
        }
}

static void read_truth(struct lum_bench_reference *r)
{
    size_t n = (size_t)r->w * r->h;
    read_film(r->view, r->truth);
    r->mean = 0.0;
    for (size_t i = 0; i < 3 * n; i += 3)
        r->mean += (double)lum_luminance(lum_rgb(r->truth[i], r->truth[i + 1], r->truth[i + 2])) / (double)n;
    r->relmse = relmse_against(r, NULL);
}

static bool trace_paths(struct lum_bench_reference *r, const struct lum_bench_truth *t)
{
    struct lum_error err = {0};
    struct lum_pass_stats stats = {0};
    struct lum_view_settings s = *t->settings;
    s.method = lum_method_find("path");
    s.seed = 1000003; /* independent of the pictures that are compared */
    for (bool done = false; !done;) {
        if (lum_view_pass(r->view, t->world->snapshot, &s, NULL, &stats, &err) != LUM_OK)
            return failed(err.text);
        if (stats.spp < t->least_spp || (stats.spp & (stats.spp - 1)) != 0)
            continue;
        read_truth(r);
        done = stats.spp >= t->most_spp || r->relmse <= RELMSE_ENOUGH;
    }
    r->spp = stats.spp;
    r->demand = stats.demand;
    return true;
}

bool lum_bench_reference_make(struct lum_bench_reference *r, const struct lum_bench_truth *truth)
{
    struct lum_error err = {0};
    *r = (struct lum_bench_reference){.w = truth->settings->w, .h = truth->settings->h};
    size_t n = 3 * (size_t)r->w * r->h;
    r->truth = lum_calloc(n, sizeof *r->truth);
    r->picture = lum_calloc(n, sizeof *r->picture);
    if (!r->truth || !r->picture)
        return failed("out of memory");
    if (lum_view_create(truth->world->pool, &r->view, &err) != LUM_OK)
        return failed(err.text);
    return trace_paths(r, truth);
}

void lum_bench_reference_finish(struct lum_bench_reference *r)
{
    lum_view_destroy(r->view);
    lum_free(r->truth);
    lum_free(r->picture);
    memset(r, 0, sizeof *r);
}

struct lum_bench_error lum_bench_error_of(struct lum_bench_reference *r, const struct lum_view *view)
{
    read_film(view, r->picture);
    struct lum_metric_result m = lum_metric_compare(&(struct lum_metric_input){
        .x = r->picture, .r = r->truth, .n = 3 * (size_t)r->w * r->h, .epsilon = LUM_METRIC_EPSILON * r->mean});
    return (struct lum_bench_error){relmse_against(r, r->picture), m.smape};
}

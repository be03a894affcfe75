#include "tests/bench/reference.h"

#include <string.h>
#include <unistd.h>

#include "core/image/exr.h"
#include "core/metric/metric.h"

#define RELMSE_ENOUGH 5e-4
#define MOST_SPP 65536u

/* picture NULL: the noise of the reference itself. */
static double relmse_against(const struct lum_bench_reference *r, const float *picture)
{
    double sum = 0.0, epsilon = LUM_METRIC_EPSILON * r->mean * r->mean;
    size_t n = 3 * (size_t)r->w * r->h;
    for (size_t i = 0; i < n; i++) {
        double a = (double)r->half[0][i], b = (double)r->half[1][i];
        double x = picture ? (double)picture[i] : 0.0, middle = 0.5 * (a + b);
        double square = picture ? (x - a) * (x - b) : 0.25 * (a - b) * (a - b);
        sum += square / (middle * middle + epsilon);
    }
    return sum / (double)n;
}

static void find_truth(struct lum_bench_reference *r)
{
    size_t n = (size_t)r->w * r->h;
    for (size_t i = 0; i < 3 * n; i++)
        r->truth[i] = 0.5f * (r->half[0][i] + r->half[1][i]);
    r->mean = 0.0;
    for (size_t i = 0; i < 3 * n; i += 3)
        r->mean += (double)lum_luminance(lum_rgb(r->truth[i], r->truth[i + 1], r->truth[i + 2])) / (double)n;
    r->relmse = relmse_against(r, NULL);
}

/* The film has as many even samples as odd ones. */
static void read_halves(struct lum_bench_reference *r, const struct lum_film *f)
{
    for (size_t i = 0; i < 3 * (size_t)r->w * r->h; i++)
        for (int half = 0; half < 2; half++)
            r->half[half][i] = (float)(f->half[half][i] / (double)f->n[half][i / 3]);
    find_truth(r);
}

/* ---- kept references ---- */

enum { CHANNELS = 7 };
static const char *const channel_names[CHANNELS] = {"even.R", "even.G", "even.B", "odd.R", "odd.G", "odd.B", "spp"};

/* FNV-1a of the halves, which hold one sample each. */
static uint64_t fingerprint(const struct lum_bench_reference *r)
{
    uint64_t hash = 0xcbf29ce484222325u;
    for (int half = 0; half < 2; half++) {
        const unsigned char *bytes = (const unsigned char *)r->half[half];
        for (size_t i = 0; i < 3 * (size_t)r->w * r->h * sizeof(float); i++)
            hash = (hash ^ bytes[i]) * 0x100000001b3u;
    }
    return hash;
}

/* True when there is one, which then is r. */
static bool read_kept(struct lum_bench_reference *r, const char *path)
{
    struct lum_error err = {0};
    struct lum_exr_image image = {0};
    size_t n = (size_t)r->w * r->h;
    if (access(path, R_OK) != 0)
        return false;
    bool ok = lum_exr_read(path, r->w, r->h, &image, &err) == LUM_OK;
    ok = ok && image.w == r->w && image.h == r->h && image.n_channels == CHANNELS;
    uint32_t found = 0;
    for (uint32_t c = 0; ok && c < CHANNELS; c++)
        for (uint32_t k = 0; k < CHANNELS; k++) {
            if (strcmp(image.names[c], channel_names[k]) != 0)
                continue;
            found |= 1u << k;
            for (size_t i = 0; k < 6 && i < n; i++)
                r->half[k / 3][3 * i + k % 3] = image.pixels[c * n + i];
            if (k == 6)
                r->spp = (uint32_t)image.pixels[c * n];
        }
    lum_exr_finish(&image);
    if (ok && found == (1u << CHANNELS) - 1u) {
        find_truth(r);
        return true;
    }
    fprintf(stderr, "lumend-bench: %s is not a reference that was kept: making it anew\n", path);
    return false;
}

static bool keep(const struct lum_bench_reference *r, const char *path)
{
    struct lum_error err = {0};
    const float spp = (float)r->spp;
    struct lum_exr_channel channels[CHANNELS] = {0};
    for (size_t k = 0; k < CHANNELS; k++) {
        snprintf(channels[k].name, sizeof channels[k].name, "%s", channel_names[k]);
        if (k < 6)
            channels[k].pixels = r->half[k / 3] + k % 3, channels[k].stride = 3;
        else
            channels[k].pixels = &spp, channels[k].stride = 0;
    }
    return lum_exr_write(path, r->w, r->h, channels, CHANNELS, NULL, 0, &err) == LUM_OK || lum_bench_failed(err.text);
}

/* ---- making it ---- */

static bool trace_until(struct lum_bench_reference *r, struct lum_view *view, const struct lum_bench_truth *t,
                        uint32_t spp)
{
    struct lum_error err = {0};
    struct lum_pass_stats stats = {0};
    struct lum_view_settings s = *t->settings;
    s.method = lum_method_find("path");
    s.seed = 1000003; /* independent of the pictures that are compared */
    while (stats.spp < spp)
        if (lum_view_pass(view, t->world->snapshot, &s, NULL, &stats, &err) != LUM_OK)
            return lum_bench_failed(err.text);
    r->spp = stats.spp;
    r->demand = stats.demand;
    read_halves(r, lum_view_film(view));
    return true;
}

/* *ret_path: where one of the asked samples is kept. */
static bool find_kept(struct lum_bench_reference *r, const struct lum_bench_truth *t, char *ret_path, size_t size)
{
    const unsigned long long hash = fingerprint(r);
    for (uint32_t spp = t->or_more ? MOST_SPP : t->most_spp; spp >= t->most_spp; spp /= 2) {
        snprintf(ret_path, size, "%s/%016llx-%u.exr", t->keep, hash, spp);
        if (read_kept(r, ret_path))
            return true;
    }
    return false;
}

static bool trace_paths(struct lum_bench_reference *r, struct lum_view *view, const struct lum_bench_truth *t)
{
    char path[4096] = "";
    if (!trace_until(r, view, t, 2))
        return false;
    if (t->keep && find_kept(r, t, path, sizeof path))
        return true;
    for (uint32_t spp = t->least_spp; spp <= t->most_spp; spp *= 2) {
        if (!trace_until(r, view, t, spp))
            return false;
        if (r->relmse <= RELMSE_ENOUGH)
            break;
    }
    return !t->keep || keep(r, path);
}

struct lum_bench_truth lum_bench_truth_of(const struct lum_bench_options *options, const struct lum_world *world,
                                          const struct lum_view_settings *settings)
{
    uint32_t most = options->quick ? 16 : options->reference_spp;
    return (struct lum_bench_truth){
        .world = world,
        .settings = settings,
        .least_spp = most < 64 ? most : 64,
        .most_spp = most,
        .keep = options->references,
    };
}

bool lum_bench_reference_make(struct lum_bench_reference *r, const struct lum_bench_truth *truth)
{
    struct lum_error err = {0};
    struct lum_view *view = NULL;
    *r = (struct lum_bench_reference){.w = truth->settings->w, .h = truth->settings->h};
    size_t n = 3 * (size_t)r->w * r->h;
    float **const buffers[] = {&r->half[0], &r->half[1], &r->truth, &r->picture};
    for (size_t i = 0; i < LUM_ARRAY_LEN(buffers); i++)
        if (!(*buffers[i] = lum_calloc(n, sizeof(float))))
            return lum_bench_failed("out of memory");
    if (lum_view_create(truth->world->pool, &view, &err) != LUM_OK)
        return lum_bench_failed(err.text);
    bool ok = trace_paths(r, view, truth);
    lum_view_destroy(view);
    return ok;
}

void lum_bench_reference_finish(struct lum_bench_reference *r)
{
    lum_free(r->half[0]);
    lum_free(r->half[1]);
    lum_free(r->truth);
    lum_free(r->picture);
    memset(r, 0, sizeof *r);
}

void lum_bench_picture_of(const struct lum_view *view, float *ret_picture)
{
    const struct lum_film *f = lum_view_film(view);
    for (size_t i = 0; i < (size_t)f->w * f->h; i++) {
        struct lum_rgb c = lum_film_mean(f, (uint32_t)(i % f->w), (uint32_t)(i / f->w));
        float *v = ret_picture + 3 * i;
        v[0] = c.r, v[1] = c.g, v[2] = c.b;
    }
}

struct lum_bench_error lum_bench_error_of_picture(const struct lum_bench_reference *r, const float *picture)
{
    struct lum_metric_result m = lum_metric_compare(&(struct lum_metric_input){
        .x = picture, .r = r->truth, .n = 3 * (size_t)r->w * r->h, .epsilon = LUM_METRIC_EPSILON * r->mean});
    return (struct lum_bench_error){relmse_against(r, picture), m.smape};
}

static double luminance_at(const float *rgb, size_t i)
{
    return (double)lum_luminance(lum_rgb(rgb[3 * i], rgb[3 * i + 1], rgb[3 * i + 2]));
}

double lum_bench_rms_of_picture(const struct lum_bench_reference *r, const float *picture)
{
    size_t n = (size_t)r->w * r->h;
    double square = 0.0, mean = 0.0;
    for (size_t i = 0; i < n; i++) {
        double b = luminance_at(picture, i);
        square += (b - luminance_at(r->half[0], i)) * (b - luminance_at(r->half[1], i)) / (double)n;
        mean += b / (double)n;
    }
    return mean > 0.0 ? sqrt(fmax(square, 0.0)) / mean : 0.0;
}

struct lum_bench_error lum_bench_error_of(struct lum_bench_reference *r, const struct lum_view *view)
{
    lum_bench_picture_of(view, r->picture);
    return lum_bench_error_of_picture(r, r->picture);
}

/* lumend compare: how far one picture is from another. */
#define _GNU_SOURCE /* getopt_long */
#include "server/cli/commands.h"

#include <getopt.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cjson/cJSON.h>

#include "core/image/exr.h"
#include "core/math/vec.h"
#include "core/metric/blocks.h"
#include "core/metric/metric.h"
#include "protocol/base/nearest.h"
#include "protocol/json/json.h"
#include "server/cli/option.h"
#include "server/stream/png.h"

#define MAX_SIDE 32768u

static const char help[] =
    "usage: lumend compare A.exr B.exr [--metric LIST] [--second C.exr] [--heatmap F.png]\n"
    "  How far A is from B, the reference, over R, G and B; JSON on stdout.\n"
    "  relmse is mean((a - b)^2 / (b^2 + 0.01)): noise where B is black makes it huge; smape stays within 0 and 1.\n"
    "  blocks is A over B by mean luminance of squares of 1/24 of the width (25 x 25 pixels at 600 x 400): bias shows "
    "there,\n"
    "  noise does not. mean is that of the whole pictures; median, percentiles, lowest and highest are those of the "
    "squares;\n"
    "  dark counts squares left out, below 1/512 of the mean of B. stderr is the relative standard error that B itself "
    "has,\n"
    "  of its mean and of its squares (median, 95 %): at most, from differences of neighbours, or with --second as it "
    "is.\n"
    "  --metric LIST    of relmse, rmse, smape, blocks, comma separated (default: the first three)\n"
    "  --second C.exr   the same picture as B, independent of it (another seed, as many samples): the reference is the "
    "mean\n"
    "                   of both, and what they differ by says how much noise it has\n"
    "  --heatmap F.png  relative squared error of each pixel: black 0.0001 and less, white 1 and more\n";

enum metric { METRIC_RELMSE, METRIC_RMSE, METRIC_SMAPE, METRIC_BLOCKS, METRIC_COUNT };
static const char *const metric_names[METRIC_COUNT] = {"relmse", "rmse", "smape", "blocks"};
static const char *const later_names[] = {"flip", "hdrflip", "hdrvdp"};

struct picture {
    const char *path;
    struct lum_exr_image image;
    uint32_t rgb[3]; /* channel indices */
};
enum { PICTURE_A, PICTURE_B, PICTURE_SECOND, PICTURE_COUNT };

struct compare {
    struct picture pictures[PICTURE_COUNT]; /* path NULL: not given */
    const char *heatmap;
    bool wanted[METRIC_COUNT], help;
};

/* ---- arguments ---- */

static enum lum_status want_metric(struct compare *c, const char *name, size_t n, struct lum_error *err)
{
    for (int i = 0; i < METRIC_COUNT; i++)
        if (strlen(metric_names[i]) == n && memcmp(name, metric_names[i], n) == 0) {
            c->wanted[i] = true;
            return LUM_OK;
        }
    for (size_t i = 0; i < LUM_ARRAY_LEN(later_names); i++)
        if (strlen(later_names[i]) == n && memcmp(name, later_names[i], n) == 0)
            return lum_fail(err, LUM_ERR_UNSUPPORTED, "metric", "the metric %s is not in this version", later_names[i]);
    char given[41], near[128];
    snprintf(given, sizeof given, "%.*s", (int)n, name);
    lum_nearest_among(given, metric_names, METRIC_COUNT, near, sizeof near);
    return lum_fail(err, LUM_ERR_INVALID, "metric", "there is no metric \"%s\"%s", given, near);
}

static enum lum_status want_metrics(struct compare *c, const char *list, struct lum_error *err)
{
    for (;;) {
        size_t n = strcspn(list, ",");
        enum lum_status st = want_metric(c, list, n, err);
        if (st || !list[n])
            return st;
        list += n + 1;
    }
}

static enum lum_status parse(int argc, char **argv, struct compare *c, struct lum_error *err)
{
    static const struct option options[] = {{"metric", required_argument, NULL, 'm'},
                                            {"second", required_argument, NULL, 's'},
                                            {"heatmap", required_argument, NULL, 'h'},
                                            {"help", no_argument, NULL, '?' + 256},
                                            {0}};
    const char *metrics = "relmse,rmse,smape";
    optind = 0;
    opterr = 0;
    for (int code, i = 0; (code = getopt_long(argc, argv, ":", options, &i)) != -1;) {
        if (code != '?' && code != ':' && !lum_option_is_whole(argv, options[i].name))
            return lum_fail(err, LUM_ERR_INVALID, "", "an option is abbreviated: write --%s", options[i].name);
        if (code == 'm')
            metrics = optarg;
        else if (code == 's')
            c->pictures[PICTURE_SECOND].path = optarg;
        else if (code == 'h')
            c->heatmap = optarg;
        else if (code == '?' + 256)
            c->help = true;
        else if (code == '?')
            return lum_option_unknown(argv[optind - 1], options, err);
        else
            return lum_fail(err, LUM_ERR_INVALID, "", "%.60s needs a value", argv[optind - 1]);
    }
    if (c->help)
        return LUM_OK;
    if (argc - optind != 2)
        return lum_fail(err, LUM_ERR_INVALID, "", "two EXR files are needed, %d given (see: lumend compare --help)",
                        argc - optind);
    c->pictures[PICTURE_A].path = argv[optind];
    c->pictures[PICTURE_B].path = argv[optind + 1];
    return want_metrics(c, metrics, err);
}

/* ---- work ---- */

static enum lum_status find_rgb(struct picture *p, struct lum_error *err)
{
    static const char *const names[3] = {"R", "G", "B"};
    for (int k = 0; k < 3; k++) {
        uint32_t i = 0;
        while (i < p->image.n_channels && strcmp(p->image.names[i], names[k]) != 0)
            i++;
        if (i == p->image.n_channels)
            return lum_fail(err, LUM_ERR_UNSUPPORTED, "", "%s has no channel %s", p->path, names[k]);
        p->rgb[k] = i;
    }
    return LUM_OK;
}

static enum lum_status load(struct compare *c, struct lum_error *err)
{
    const struct lum_exr_image *first = &c->pictures[0].image;
    for (int i = 0; i < PICTURE_COUNT && c->pictures[i].path; i++) {
        struct picture *p = &c->pictures[i];
        enum lum_status st = lum_exr_read(p->path, MAX_SIDE, MAX_SIDE, &p->image, err);
        if (!st)
            st = find_rgb(p, err);
        if (st)
            return st;
        if (p->image.w != first->w || p->image.h != first->h)
            return lum_fail(err, LUM_ERR_INVALID, "", "the sizes differ: %u x %u and %u x %u", first->w, first->h,
                            p->image.w, p->image.h);
    }
    return LUM_OK;
}

static size_t pixel_count(const struct compare *c)
{
    return (size_t)c->pictures[0].image.w * c->pictures[0].image.h;
}

static float *channel(const struct compare *c, int picture, int k)
{
    const struct picture *p = &c->pictures[picture];
    return p->image.pixels + (size_t)p->rgb[k] * pixel_count(c);
}

static void find_luminance(const struct compare *c, int picture, float *ret_luminance)
{
    for (size_t i = 0; i < pixel_count(c); i++)
        ret_luminance[i] =
            lum_luminance(lum_rgb(channel(c, picture, 0)[i], channel(c, picture, 1)[i], channel(c, picture, 2)[i]));
}

/* From here on B is the reference: with a second one their mean. */
static void join_references(struct compare *c)
{
    for (int k = 0; k < 3; k++)
        for (size_t i = 0; i < pixel_count(c); i++)
            channel(c, PICTURE_B, k)[i] = 0.5f * (channel(c, PICTURE_B, k)[i] + channel(c, PICTURE_SECOND, k)[i]);
}

/* Joins the references. */
static enum lum_status measure_blocks(struct compare *c, struct lum_blocks_result *ret_blocks, struct lum_error *err)
{
    const size_t n = pixel_count(c);
    float *values = lum_calloc(4 * n, sizeof *values);
    if (!values)
        return lum_fail(err, LUM_ERR_NOMEM, "", "no memory for the luminance of %zu pixels", n);
    struct lum_blocks_input in = {c->pictures[0].image.w, c->pictures[0].image.h, values, values + n, {NULL, NULL}};
    find_luminance(c, PICTURE_A, values);
    if (c->pictures[PICTURE_SECOND].path) {
        find_luminance(c, PICTURE_B, values + 2 * n);
        find_luminance(c, PICTURE_SECOND, values + 3 * n);
        in.r_halves[0] = values + 2 * n;
        in.r_halves[1] = values + 3 * n;
        join_references(c);
    }
    find_luminance(c, PICTURE_B, values + n);
    enum lum_status st = lum_blocks_compare(&in, NULL, ret_blocks, err);
    lum_free(values);
    return st;
}

/* Over the three channels: each has as many values, so the mean of the means is the mean of all, but for values that
 * are not finite; the root is taken last. */
static struct lum_metric_result measure(const struct compare *c)
{
    struct lum_metric_result sum = {0};
    for (int k = 0; k < 3; k++) {
        struct lum_metric_input in = {channel(c, PICTURE_A, k), channel(c, PICTURE_B, k), pixel_count(c),
                                      LUM_METRIC_EPSILON};
        struct lum_metric_result m = lum_metric_compare(&in);
        sum.rmse += m.rmse * m.rmse / 3.0;
        sum.relmse += m.relmse / 3.0;
        sum.smape += m.smape / 3.0;
        sum.n_nonfinite += m.n_nonfinite;
    }
    sum.rmse = sqrt(sum.rmse);
    return sum;
}

/* Black body colours over four decades; a pixel that is not finite is cyan. */
static void heat_pixel(double square, uint8_t ret_rgb[3])
{
    if (!isfinite(square)) {
        memcpy(ret_rgb, (uint8_t[]){0, 255, 255}, 3);
        return;
    }
    double t = square > 0.0 ? fmin(fmax(log10(square) / 4.0 + 1.0, 0.0), 1.0) : 0.0;
    for (int k = 0; k < 3; k++)
        ret_rgb[k] = (uint8_t)(255.0 * fmin(fmax(3.0 * t - k, 0.0), 1.0) + 0.5);
}

static enum lum_status write_heatmap(const struct compare *c, struct lum_error *err)
{
    size_t n = pixel_count(c);
    uint8_t *rgb = lum_calloc(n, 3);
    if (!rgb)
        return lum_fail(err, LUM_ERR_NOMEM, "", "no memory for the heat map");
    for (size_t i = 0; i < n; i++) {
        double square = 0.0;
        for (int k = 0; k < 3; k++)
            square += lum_metric_relative_square((double)channel(c, PICTURE_A, k)[i],
                                                 (double)channel(c, PICTURE_B, k)[i], LUM_METRIC_EPSILON) /
                      3.0;
        heat_pixel(square, rgb + 3 * i);
    }
    enum lum_status st =
        lum_png_write(c->heatmap, &(struct lum_png){rgb, c->pictures[0].image.w, c->pictures[0].image.h, 6}, err);
    lum_free(rgb);
    return st;
}

static cJSON *pair(double a, double b)
{
    cJSON *array = cJSON_CreateArray();
    lum_json_add(array, NULL, cJSON_CreateNumber(a));
    lum_json_add(array, NULL, cJSON_CreateNumber(b));
    return array;
}

static bool add_numbers(cJSON *object, const char *const *names, const double *values, size_t n)
{
    bool ok = true;
    for (size_t i = 0; ok && i < n; i++)
        ok = lum_json_add_number(object, names[i], values[i]);
    return ok;
}

/* NULL when memory is short. */
static cJSON *blocks_json(const struct lum_blocks_result *m)
{
    static const char *const names[] = {"side", "counted", "dark", "mean",   "median", "p5",
                                        "p25",  "p75",     "p95",  "lowest", "highest"};
    static const char *const error_names[] = {"mean", "median", "p95"};
    const double values[] = {m->grid.side, m->n_counted, m->n_dark, m->mean,   m->median, m->p5,
                             m->p25,       m->p75,       m->p95,    m->lowest, m->highest};
    const double errors[] = {m->mean_stderr, m->stderr_median, m->stderr_p95};
    cJSON *o = cJSON_CreateObject(), *e = cJSON_CreateObject();
    bool ok = add_numbers(e, error_names, errors, LUM_ARRAY_LEN(errors));
    ok = lum_json_add(o, "grid", pair(m->grid.nx, m->grid.ny)) && ok;
    ok = add_numbers(o, names, values, LUM_ARRAY_LEN(values)) && ok;
    if (lum_json_add(o, "stderr", e) && ok)
        return o;
    cJSON_Delete(o);
    return NULL;
}

static enum lum_status print_result(const struct compare *c, const struct lum_metric_result *m,
                                    const struct lum_blocks_result *blocks, struct lum_error *err)
{
    const double values[METRIC_BLOCKS] = {m->relmse, m->rmse, m->smape};
    cJSON *o = cJSON_CreateObject();
    bool ok =
        lum_json_add_string(o, "a", c->pictures[PICTURE_A].path) &&
        lum_json_add_string(o, "b", c->pictures[PICTURE_B].path) &&
        (!c->pictures[PICTURE_SECOND].path || lum_json_add_string(o, "second", c->pictures[PICTURE_SECOND].path)) &&
        lum_json_add(o, "size", pair(c->pictures[0].image.w, c->pictures[0].image.h)) &&
        lum_json_add_number(o, "nonfinite", (double)m->n_nonfinite);
    for (int i = 0; ok && i < METRIC_BLOCKS; i++)
        ok = !c->wanted[i] || lum_json_add_number(o, metric_names[i], values[i]);
    ok = ok && (!c->wanted[METRIC_BLOCKS] || lum_json_add(o, "blocks", blocks_json(blocks)));
    char *text = ok ? lum_json_print(o, NULL) : NULL;
    cJSON_Delete(o);
    if (!text)
        return lum_fail(err, LUM_ERR_NOMEM, "", "no memory for the result");
    puts(text);
    free(text);
    return LUM_OK;
}

int lum_cmd_compare(int argc, char **argv)
{
    struct compare c = {0};
    struct lum_blocks_result blocks = {0};
    struct lum_error err;
    if (parse(argc, argv, &c, &err)) {
        fprintf(stderr, "lumend compare: %s\n", err.text);
        return LUM_EXIT_USAGE;
    }
    if (c.help) {
        fputs(help, stdout);
        return LUM_EXIT_OK;
    }
    enum lum_status st = load(&c, &err);
    if (!st)
        st = measure_blocks(&c, &blocks, &err);
    if (!st) {
        struct lum_metric_result m = measure(&c);
        st = print_result(&c, &m, &blocks, &err);
    }
    if (!st && c.heatmap)
        st = write_heatmap(&c, &err);
    if (st)
        fprintf(stderr, "lumend compare: %s\n", err.text);
    for (int i = 0; i < PICTURE_COUNT; i++)
        lum_exr_finish(&c.pictures[i].image);
    return st ? LUM_EXIT_FAILED : LUM_EXIT_OK;
}

/* lumend compare: how far one picture is from another. */
#define _GNU_SOURCE /* getopt_long */
#include "server/commands.h"

#include <getopt.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cjson/cJSON.h>

#include "core/image/exr.h"
#include "core/metric/metric.h"
#include "protocol/json.h"
#include "server/option_errors.h"
#include "server/png.h"

#define MAX_SIDE 32768u

static const char help[] =
    "usage: lumend compare A.exr B.exr [--metric LIST] [--heatmap F.png]\n"
    "  How far A is from B, the reference, over R, G and B; JSON on stdout.\n"
    "  relmse is mean((a - b)^2 / (b^2 + 0.01)): noise where B is black makes it huge; smape stays within 0 and 1.\n"
    "  --metric LIST    of relmse, rmse, smape, comma separated (default: all three)\n"
    "  --heatmap F.png  relative squared error of each pixel: black 0.0001 and less, white 1 and more\n";

static const char *const metric_names[] = {"relmse", "rmse", "smape"};
static const char *const later_names[] = {"flip", "hdrflip", "hdrvdp"};
enum { METRIC_COUNT = LUM_ARRAY_LEN(metric_names) };

struct compare {
    const char *path_a, *path_b, *heatmap;
    bool wanted[METRIC_COUNT], help;
    struct lum_exr_image a, b;
    uint32_t rgb_a[3], rgb_b[3]; /* channel indices */
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
    return lum_fail(err, LUM_ERR_INVALID, "metric", "there is no metric \"%.*s\"", n < 40 ? (int)n : 40, name);
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
        return lum_fail(err, LUM_ERR_INVALID, "", "two EXR files are needed, %d given", argc - optind);
    c->path_a = argv[optind];
    c->path_b = argv[optind + 1];
    return want_metrics(c, metrics, err);
}

/* ---- work ---- */

static enum lum_status find_rgb(const struct lum_exr_image *im, const char *path, uint32_t ret_rgb[3],
                                struct lum_error *err)
{
    static const char *const names[3] = {"R", "G", "B"};
    for (int k = 0; k < 3; k++) {
        uint32_t i = 0;
        while (i < im->n_channels && strcmp(im->names[i], names[k]) != 0)
            i++;
        if (i == im->n_channels)
            return lum_fail(err, LUM_ERR_UNSUPPORTED, "", "%s has no channel %s", path, names[k]);
        ret_rgb[k] = i;
    }
    return LUM_OK;
}

static enum lum_status load(struct compare *c, struct lum_error *err)
{
    enum lum_status st = lum_exr_read(c->path_a, MAX_SIDE, MAX_SIDE, &c->a, err);
    if (!st)
        st = lum_exr_read(c->path_b, MAX_SIDE, MAX_SIDE, &c->b, err);
    if (!st)
        st = find_rgb(&c->a, c->path_a, c->rgb_a, err);
    if (!st)
        st = find_rgb(&c->b, c->path_b, c->rgb_b, err);
    if (!st && (c->a.w != c->b.w || c->a.h != c->b.h))
        st =
            lum_fail(err, LUM_ERR_INVALID, "", "the sizes differ: %u x %u and %u x %u", c->a.w, c->a.h, c->b.w, c->b.h);
    return st;
}

static const float *channel(const struct lum_exr_image *im, const uint32_t rgb[3], int k)
{
    return im->pixels + (size_t)rgb[k] * im->w * im->h;
}

/* Over the three channels: each has as many values, so the mean of the means is the mean of all, but for values that
 * are not finite; the root is taken last. */
static struct lum_metric_result measure(const struct compare *c)
{
    struct lum_metric_result sum = {0};
    for (int k = 0; k < 3; k++) {
        struct lum_metric_input in = {channel(&c->a, c->rgb_a, k), channel(&c->b, c->rgb_b, k), (size_t)c->a.w * c->a.h,
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
    size_t n = (size_t)c->a.w * c->a.h;
    uint8_t *rgb = lum_calloc(n, 3);
    if (!rgb)
        return lum_fail(err, LUM_ERR_NOMEM, "", "no memory for the heat map");
    for (size_t i = 0; i < n; i++) {
        double square = 0.0;
        for (int k = 0; k < 3; k++)
            square += lum_metric_relative_square((double)channel(&c->a, c->rgb_a, k)[i],
                                                 (double)channel(&c->b, c->rgb_b, k)[i], LUM_METRIC_EPSILON) /
                      3.0;
        heat_pixel(square, rgb + 3 * i);
    }
    enum lum_status st = lum_png_write(c->heatmap, &(struct lum_png){rgb, c->a.w, c->a.h, 6}, err);
    lum_free(rgb);
    return st;
}

static enum lum_status print_result(const struct compare *c, const struct lum_metric_result *m, struct lum_error *err)
{
    const double values[METRIC_COUNT] = {m->relmse, m->rmse, m->smape};
    cJSON *o = cJSON_CreateObject(), *size = cJSON_CreateArray();
    lum_json_add(size, NULL, cJSON_CreateNumber(c->a.w));
    lum_json_add(size, NULL, cJSON_CreateNumber(c->a.h));
    bool ok = lum_json_add_string(o, "a", c->path_a) && lum_json_add_string(o, "b", c->path_b) &&
              lum_json_add(o, "size", size) && lum_json_add_number(o, "nonfinite", (double)m->n_nonfinite);
    for (int i = 0; ok && i < METRIC_COUNT; i++)
        ok = !c->wanted[i] || lum_json_add_number(o, metric_names[i], values[i]);
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
    if (!st) {
        struct lum_metric_result m = measure(&c);
        st = print_result(&c, &m, &err);
    }
    if (!st && c.heatmap)
        st = write_heatmap(&c, &err);
    if (st)
        fprintf(stderr, "lumend compare: %s\n", err.text);
    lum_exr_finish(&c.a);
    lum_exr_finish(&c.b);
    return st ? LUM_EXIT_FAILED : LUM_EXIT_OK;
}

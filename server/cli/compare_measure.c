#include "server/cli/compare_measure.h"

#include <math.h>
#include <string.h>

#include "core/math/color.h"
#include "core/metric/heat.h"

const char *const lum_compare_names[LUM_COMPARE_METRICS] = {"relmse",  "rmse",   "smape", "flip",
                                                            "hdrflip", "hdrvdp", "blocks"};

enum lum_compare_metric lum_compare_map_of(enum lum_compare_metric metric)
{
    return metric == LUM_COMPARE_FLIP || metric == LUM_COMPARE_HDRFLIP || metric == LUM_COMPARE_HDRVDP
               ? metric
               : LUM_COMPARE_RELMSE;
}

static size_t pixel_count(const struct lum_comparison *c)
{
    return (size_t)c->pictures[LUM_COMPARE_A].w * c->pictures[LUM_COMPARE_A].h;
}

static float *channel(const struct lum_comparison *c, int picture, int k)
{
    return c->pictures[picture].rgb[k];
}

/* Planes of floats as room to work in. */
static enum lum_status alloc_planes(const struct lum_comparison *c, size_t n, float **ret, struct lum_error *err)
{
    *ret = lum_calloc(pixel_count(c), n * sizeof **ret);
    return *ret ? LUM_OK : lum_fail(err, LUM_ERR_NOMEM, "", "no memory to compare %zu pixels", pixel_count(c));
}

/* The map of a metric, to be filled; NULL stays NULL where none is wanted. */
static enum lum_status alloc_map(struct lum_comparison *c, enum lum_compare_metric metric, struct lum_error *err)
{
    return c->maps_wanted ? alloc_planes(c, 1, &c->maps[metric], err) : LUM_OK;
}

/* ---- relMSE, RMSE, SMAPE, blocks ---- */

static void find_luminance(const struct lum_comparison *c, int picture, float *ret_luminance)
{
    for (size_t i = 0; i < pixel_count(c); i++)
        ret_luminance[i] =
            lum_luminance(lum_rgb(channel(c, picture, 0)[i], channel(c, picture, 1)[i], channel(c, picture, 2)[i]));
}

/* From here on B is the reference: with a second one their mean. */
static void join_references(struct lum_comparison *c)
{
    for (int k = 0; k < 3; k++)
        for (size_t i = 0; i < pixel_count(c); i++)
            channel(c, LUM_COMPARE_B, k)[i] =
                0.5f * (channel(c, LUM_COMPARE_B, k)[i] + channel(c, LUM_COMPARE_SECOND, k)[i]);
}

/* Joins the references. */
static enum lum_status measure_blocks(struct lum_comparison *c, struct lum_error *err)
{
    const size_t n = pixel_count(c);
    float *values;
    enum lum_status st = alloc_planes(c, 4, &values, err);
    if (st)
        return st;
    struct lum_blocks_input in = {c->pictures[0].w, c->pictures[0].h, values, values + n, {NULL, NULL}};
    find_luminance(c, LUM_COMPARE_A, values);
    if (c->pictures[LUM_COMPARE_SECOND].path) {
        find_luminance(c, LUM_COMPARE_B, values + 2 * n);
        find_luminance(c, LUM_COMPARE_SECOND, values + 3 * n);
        in.r_halves[0] = values + 2 * n;
        in.r_halves[1] = values + 3 * n;
        join_references(c);
    }
    find_luminance(c, LUM_COMPARE_B, values + n);
    st = lum_blocks_compare(&in, NULL, &c->blocks, err);
    lum_free(values);
    return st;
}

/* Over the three channels: each has as many values, so the mean of the means is the mean of all, but for values that
 * are not finite; the root is taken last. */
static void measure_relative(struct lum_comparison *c)
{
    struct lum_metric_result sum = {0};
    for (int k = 0; k < 3; k++) {
        struct lum_metric_input in = {channel(c, LUM_COMPARE_A, k), channel(c, LUM_COMPARE_B, k), pixel_count(c),
                                      LUM_METRIC_EPSILON};
        struct lum_metric_result m = lum_metric_compare(&in);
        sum.rmse += m.rmse * m.rmse / 3.0;
        sum.relmse += m.relmse / 3.0;
        sum.smape += m.smape / 3.0;
        sum.n_nonfinite += m.n_nonfinite;
    }
    sum.rmse = sqrt(sum.rmse);
    c->relative = sum;
}

/* Relative squared errors over four decades: 0 is 0.0001 and less, 1 is 1 and more. */
static enum lum_status map_relative(struct lum_comparison *c, struct lum_error *err)
{
    enum lum_status st = alloc_map(c, LUM_COMPARE_RELMSE, err);
    if (st || !c->maps_wanted)
        return st;
    for (size_t i = 0; i < pixel_count(c); i++) {
        double square = 0.0;
        for (int k = 0; k < 3; k++)
            square += lum_metric_relative_square((double)channel(c, LUM_COMPARE_A, k)[i],
                                                 (double)channel(c, LUM_COMPARE_B, k)[i], LUM_METRIC_EPSILON) /
                      3.0;
        c->maps[LUM_COMPARE_RELMSE][i] =
            isfinite(square) ? (float)(square > 1e-4 ? fmin(log10(square) / 4.0 + 1.0, 1.0) : 0.0) : NAN;
    }
    return LUM_OK;
}

/* ---- FLIP ---- */

static struct lum_flip_input flip_input(const struct lum_comparison *c)
{
    const struct lum_compared *a = &c->pictures[LUM_COMPARE_A], *b = &c->pictures[LUM_COMPARE_B];
    return (struct lum_flip_input){a->w,
                                   a->h,
                                   {a->rgb[0], a->rgb[1], a->rgb[2]},
                                   {b->rgb[0], b->rgb[1], b->rgb[2]},
                                   c->pixels_per_degree > 0.0 ? c->pixels_per_degree : LUM_FLIP_PIXELS_PER_DEGREE};
}

static enum lum_status require_finite(const struct lum_comparison *c, struct lum_error *err)
{
    for (int p = LUM_COMPARE_A; p <= LUM_COMPARE_B; p++) {
        const struct lum_compared *picture = &c->pictures[p];
        struct lum_error where;
        if (lum_metric_require_finite((const float *const *)picture->rgb, 3, picture->w, picture->h, picture->path,
                                      &where))
            return lum_fail(err, LUM_ERR_INVALID, "",
                            "%.160s; flip, hdrflip and hdrvdp need every pixel, the other metrics leave these out",
                            where.text);
    }
    return LUM_OK;
}

/* Of what the display shows, so that a PNG and the EXR it was made from are compared alike. */
static enum lum_status measure_flip(struct lum_comparison *c, struct lum_error *err)
{
    const size_t n = pixel_count(c);
    struct lum_flip_input in = flip_input(c);
    float *linear;
    enum lum_status st = alloc_planes(c, 6, &linear, err);
    if (st)
        return st;
    for (size_t k = 0; k < 3; k++) {
        float *x = linear + k * n, *r = linear + (3 + k) * n;
        for (size_t i = 0; i < n; i++) {
            x[i] = lum_srgb8_to_linear[c->pictures[LUM_COMPARE_A].shown[3 * i + k]];
            r[i] = lum_srgb8_to_linear[c->pictures[LUM_COMPARE_B].shown[3 * i + k]];
        }
        in.x[k] = x;
        in.r[k] = r;
    }
    if (!(st = alloc_map(c, LUM_COMPARE_FLIP, err)))
        st = lum_flip_compare(&in, c->maps[LUM_COMPARE_FLIP], &c->flip, err);
    lum_free(linear);
    return st;
}

static enum lum_status measure_hdrflip(struct lum_comparison *c, struct lum_error *err)
{
    struct lum_flip_input in = flip_input(c);
    enum lum_status st = alloc_map(c, LUM_COMPARE_HDRFLIP, err);
    return st ? st : lum_hdrflip_compare(&in, c->maps[LUM_COMPARE_HDRFLIP], &c->hdrflip, &c->exposures, err);
}

/* ---- HDR-VDP ---- */

static enum lum_status measure_hdrvdp(struct lum_comparison *c, struct lum_error *err)
{
    const size_t n = pixel_count(c);
    float *luminance;
    enum lum_status st = alloc_planes(c, 2, &luminance, err);
    if (st)
        return st;
    struct lum_hdrvdp_input in = {c->pictures[0].w, c->pictures[0].h, luminance, luminance + n,
                                  c->pixels_per_degree > 0.0 ? c->pixels_per_degree : LUM_HDRVDP_PIXELS_PER_DEGREE};
    find_luminance(c, LUM_COMPARE_A, luminance);
    find_luminance(c, LUM_COMPARE_B, luminance + n);
    double sum = 0.0, peak = 0.0;
    for (size_t i = 0; i < 2 * n; i++) {
        luminance[i] = (float)(c->multiplier * (double)luminance[i]);
        if (i >= n) {
            sum += (double)luminance[i];
            peak = fmax(peak, (double)luminance[i]);
        }
    }
    c->mean_cd_m2 = sum / (double)n;
    c->peak_cd_m2 = peak;
    if (!(st = alloc_map(c, LUM_COMPARE_HDRVDP, err)))
        st = lum_hdrvdp_compare(&in, c->maps[LUM_COMPARE_HDRVDP], &c->hdrvdp, err);
    lum_free(luminance);
    return st;
}

/* ---- all ---- */

static bool sees(const struct lum_comparison *c)
{
    return c->wanted[LUM_COMPARE_FLIP] || c->wanted[LUM_COMPARE_HDRFLIP] || c->wanted[LUM_COMPARE_HDRVDP];
}

static enum lum_status show(struct lum_comparison *c, struct lum_error *err)
{
    enum lum_status st = LUM_OK;
    if (!c->pictures[LUM_COMPARE_B].is_png)
        st = lum_compared_exposure(&c->pictures[LUM_COMPARE_B], &c->ev100, err);
    for (int p = LUM_COMPARE_A; !st && p <= LUM_COMPARE_B; p++)
        st = lum_compared_show(&c->pictures[p], c->ev100, err);
    return st;
}

enum lum_status lum_compare_measure(struct lum_comparison *c, struct lum_error *err)
{
    enum lum_status st = measure_blocks(c, err);
    if (!st && (c->shown_wanted || c->wanted[LUM_COMPARE_FLIP]))
        st = show(c, err);
    if (st)
        return st;
    measure_relative(c);
    if ((st = map_relative(c, err)) || (sees(c) && (st = require_finite(c, err))))
        return st;
    if (c->wanted[LUM_COMPARE_FLIP] && (st = measure_flip(c, err)))
        return st;
    if (c->wanted[LUM_COMPARE_HDRFLIP] && (st = measure_hdrflip(c, err)))
        return st;
    return c->wanted[LUM_COMPARE_HDRVDP] ? measure_hdrvdp(c, err) : LUM_OK;
}

void lum_comparison_finish(struct lum_comparison *c)
{
    for (int i = 0; i < LUM_COMPARE_METRICS; i++)
        lum_free(c->maps[i]);
    for (int i = 0; i < LUM_COMPARE_PICTURES; i++)
        lum_compared_finish(&c->pictures[i]);
    *c = (struct lum_comparison){0};
}

uint8_t *lum_compare_paint(const struct lum_comparison *c, enum lum_compare_metric map)
{
    struct lum_heat heat;
    uint8_t *rgb = lum_calloc(pixel_count(c), 3);
    if (!rgb)
        return NULL;
    lum_heat_init(&heat);
    for (size_t i = 0; i < pixel_count(c); i++)
        lum_heat_color(&heat, (double)c->maps[map][i], rgb + 3 * i);
    return rgb;
}

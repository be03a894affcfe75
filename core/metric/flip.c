#include "core/metric/flip.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/metric/blur.h"
#include "core/metric/lab.h"
#include "core/metric/metric.h"

/* Constants of the papers. */
#define COLOUR_EXPONENT 0.7f
#define COLOUR_KNEE 0.4f        /* of the largest difference */
#define COLOUR_KNEE_ERROR 0.95f /* what is there becomes this */
#define FEATURE_EXPONENT 0.5f
#define FEATURE_WIDTH_DEG 0.082 /* between the peaks of an edge detector */
#define TONE_TARGET 0.85
#define TONE_LIMIT 1e4 /* there the tone map is cut to 1 already */

enum { PLANE_L, PLANE_A, PLANE_B, PLANE_EDGE, PLANE_POINT, PLANE_COUNT };

/* What the eye makes of a picture: filtered colour, Hunt-adjusted, and how much of an edge and a point there is. */
struct seen {
    float *planes[PLANE_COUNT];
};

struct filters {
    struct lum_kernel achromatic, red_green, blue_yellow[2]; /* contrast sensitivity */
    float blue_yellow_share[2];
    struct lum_kernel smooth, slope, bend; /* features */
};

struct flip {
    const struct lum_flip_input *in;
    struct filters filters;
    struct seen x, r;
    float *opponent[3], *work, *part; /* of the picture at hand */
    float *map, *memory;
    bool exposed; /* by gain, and tone mapped; else pictures are as the display shows them */
    double gain;
    float largest; /* colour difference of green and blue, to COLOUR_EXPONENT */
};

/* ---- filters ---- */

/* Sensitivities are a sqrt(pi / b) exp(-pi^2 x^2 / b) over degrees: Gaussians of variance b / (2 pi^2). */
static double sigma_of(double b, double pixels_per_degree)
{
    return sqrt(0.5 * b) / 3.14159265358979324 * pixels_per_degree;
}

static void make_filters(double ppd, struct filters *f)
{
    static const double a[2] = {34.1, 13.5}, b[2] = {0.04, 0.025}; /* blue against yellow: a sum of two */
    int radius = (int)ceil(3.0 * sigma_of(0.04, ppd));             /* of the widest, for all */
    double weights[2];
    lum_kernel_gauss(sigma_of(0.0047, ppd), radius, &f->achromatic);
    lum_kernel_gauss(sigma_of(0.0053, ppd), radius, &f->red_green);
    for (int i = 0; i < 2; i++) {
        double sum = lum_kernel_gauss(sigma_of(b[i], ppd), radius, &f->blue_yellow[i]);
        weights[i] = a[i] * sqrt(1.0 / b[i]) * sum * sum;
    }
    for (int i = 0; i < 2; i++)
        f->blue_yellow_share[i] = (float)(weights[i] / (weights[0] + weights[1]));
    double sigma = 0.5 * FEATURE_WIDTH_DEG * ppd;
    radius = (int)ceil(3.0 * sigma);
    lum_kernel_gauss(sigma, radius, &f->smooth);
    lum_kernel_gauss_derivative(sigma, 1, radius, &f->slope);
    lum_kernel_gauss_derivative(sigma, 2, radius, &f->bend);
}

/* ---- one picture ---- */

static void blur(struct flip *f, const float *in, const struct lum_kernel *x, const struct lum_kernel *y, float *ret)
{
    lum_blur(in, f->in->w, f->in->h, (const struct lum_kernel *[2]){x, y}, f->work, ret);
}

static void find_features(struct flip *f, const struct lum_kernel *across, float *ret)
{
    const size_t n = (size_t)f->in->w * f->in->h;
    blur(f, f->opponent[0], across, &f->filters.smooth, ret);
    blur(f, f->opponent[0], &f->filters.smooth, across, f->part);
    for (size_t i = 0; i < n; i++) /* of (Y + 16) / 116, whose constant part has no derivative */
        ret[i] = sqrtf(ret[i] * ret[i] + f->part[i] * f->part[i]) / 116.0f;
}

static void filter_colour(struct flip *f)
{
    const struct filters *k = &f->filters;
    const size_t n = (size_t)f->in->w * f->in->h;
    const float *share = k->blue_yellow_share;
    blur(f, f->opponent[0], &k->achromatic, &k->achromatic, f->opponent[0]);
    blur(f, f->opponent[1], &k->red_green, &k->red_green, f->opponent[1]);
    blur(f, f->opponent[2], &k->blue_yellow[0], &k->blue_yellow[0], f->part);
    blur(f, f->opponent[2], &k->blue_yellow[1], &k->blue_yellow[1], f->opponent[2]);
    for (size_t i = 0; i < n; i++)
        f->opponent[2][i] = share[0] * f->part[i] + share[1] * f->opponent[2][i];
}

/* What is less light is less colourful (Hunt). */
static struct lum_lab hunt_lab(const float rgb[3])
{
    struct lum_lab c = lum_lab_of(rgb);
    c.a *= 0.01f * c.l;
    c.b *= 0.01f * c.l;
    return c;
}

static float unit(float v)
{
    return v > 0.0f ? (v < 1.0f ? v : 1.0f) : 0.0f;
}

/* Narkowicz's fit, with what he advises to take off before. */
static float tone_map(double exposed)
{
    float v = (float)fmin(fmax(0.6 * exposed, 0.0), TONE_LIMIT);
    return unit(v * (2.51f * v + 0.03f) / (v * (2.43f * v + 0.59f) + 0.14f));
}

static void see(struct flip *f, const float *const rgb[3], struct seen *seen)
{
    const size_t n = (size_t)f->in->w * f->in->h;
    for (size_t i = 0; i < n; i++) {
        float c[3];
        for (int k = 0; k < 3; k++)
            c[k] = f->exposed ? tone_map(f->gain * (double)rgb[k][i]) : unit(rgb[k][i]);
        struct lum_lab o = lum_ycxcz_of(c);
        f->opponent[0][i] = o.l;
        f->opponent[1][i] = o.a;
        f->opponent[2][i] = o.b;
    }
    find_features(f, &f->filters.slope, seen->planes[PLANE_EDGE]);
    find_features(f, &f->filters.bend, seen->planes[PLANE_POINT]);
    filter_colour(f);
    for (size_t i = 0; i < n; i++) {
        float c[3];
        lum_ycxcz_to_rgb((struct lum_lab){f->opponent[0][i], f->opponent[1][i], f->opponent[2][i]}, c);
        struct lum_lab lab = hunt_lab((float[3]){unit(c[0]), unit(c[1]), unit(c[2])});
        seen->planes[PLANE_L][i] = lab.l;
        seen->planes[PLANE_A][i] = lab.a;
        seen->planes[PLANE_B][i] = lab.b;
    }
}

/* ---- two pictures ---- */

/* HyAB (Abasi, Tehran, Fairchild 2020), to COLOUR_EXPONENT. */
static float colour_difference(struct lum_lab x, struct lum_lab r)
{
    float da = x.a - r.a, db = x.b - r.b;
    return powf(fabsf(x.l - r.l) + sqrtf(da * da + db * db), COLOUR_EXPONENT);
}

/* Most differences are small against that of green and blue: up to the knee they have nearly all of the range. */
static float colour_error(float difference, float largest)
{
    float knee = COLOUR_KNEE * largest;
    if (difference < knee)
        return difference * (COLOUR_KNEE_ERROR / knee);
    return fminf(COLOUR_KNEE_ERROR + (difference - knee) / (largest - knee) * (1.0f - COLOUR_KNEE_ERROR), 1.0f);
}

static float pixel_error(const struct flip *f, size_t i)
{
    float *const *x = f->x.planes, *const *r = f->r.planes;
    float colour = colour_error(colour_difference((struct lum_lab){x[PLANE_L][i], x[PLANE_A][i], x[PLANE_B][i]},
                                                  (struct lum_lab){r[PLANE_L][i], r[PLANE_A][i], r[PLANE_B][i]}),
                                f->largest);
    float edge = fabsf(x[PLANE_EDGE][i] - r[PLANE_EDGE][i]), point = fabsf(x[PLANE_POINT][i] - r[PLANE_POINT][i]);
    float feature = powf(fminf(fmaxf(edge, point) * 0.70710678f, 1.0f), FEATURE_EXPONENT);
    return powf(colour, 1.0f - feature);
}

static int compare_floats(const void *a, const void *b)
{
    float x = *(const float *)a, y = *(const float *)b;
    return (x > y) - (x < y);
}

/* sorted: n of them, room for it. */
static struct lum_flip_result summarise(const float *map, size_t n, float *sorted)
{
    double sum = 0.0, below = 0.0;
    memcpy(sorted, map, n * sizeof *sorted);
    qsort(sorted, n, sizeof *sorted, compare_floats);
    for (size_t i = 0; i < n; i++)
        sum += (double)sorted[i];
    size_t at = 0;
    while (at + 1 < n && (below += (double)sorted[at]) < 0.5 * sum)
        at++;
    return (struct lum_flip_result){sum / (double)n, (double)sorted[n - 1], sum > 0.0 ? (double)sorted[at] : 0.0};
}

static enum lum_status begin(struct flip *f, const struct lum_flip_input *in, struct lum_error *err)
{
    const size_t n = (size_t)in->w * in->h;
    enum lum_status st = LUM_OK;
    if (n == 0)
        return lum_fail(err, LUM_ERR_INVALID, "", "a picture without pixels");
    if (!(in->pixels_per_degree >= 1.0 && in->pixels_per_degree <= LUM_FLIP_PIXELS_PER_DEGREE_MAX))
        return lum_fail(err, LUM_ERR_INVALID, "pixels_per_degree", "pixels per degree must be 1 to %g",
                        LUM_FLIP_PIXELS_PER_DEGREE_MAX);
    if ((st = lum_metric_require_finite(in->x, 3, in->w, in->h, "the picture", err)) ||
        (st = lum_metric_require_finite(in->r, 3, in->w, in->h, "the reference", err)))
        return st;
    f->in = in;
    f->memory = lum_calloc(n, (2 * PLANE_COUNT + 6) * sizeof *f->memory);
    if (!f->memory)
        return lum_fail(err, LUM_ERR_NOMEM, "", "no memory to compare %u x %u pixels by FLIP", in->w, in->h);
    float *next = f->memory;
    for (int i = 0; i < PLANE_COUNT; i++, next += 2 * n) {
        f->x.planes[i] = next;
        f->r.planes[i] = next + n;
    }
    for (int k = 0; k < 3; k++, next += n)
        f->opponent[k] = next;
    f->work = next;
    f->part = next + n;
    f->map = next + 2 * n;
    make_filters(in->pixels_per_degree, &f->filters);
    f->largest = colour_difference(hunt_lab((float[3]){0, 1, 0}), hunt_lab((float[3]){0, 0, 1}));
    return LUM_OK;
}

/* Each pixel of the map becomes what it is at this exposure, if that is more. */
static void add_exposure(struct flip *f)
{
    const size_t n = (size_t)f->in->w * f->in->h;
    see(f, f->in->x, &f->x);
    see(f, f->in->r, &f->r);
    for (size_t i = 0; i < n; i++)
        f->map[i] = fmaxf(f->map[i], pixel_error(f, i));
}

static void end(struct flip *f, float *ret_map, struct lum_flip_result *ret_result)
{
    const size_t n = (size_t)f->in->w * f->in->h;
    *ret_result = summarise(f->map, n, f->work);
    if (ret_map)
        memcpy(ret_map, f->map, n * sizeof *ret_map);
    lum_free(f->memory);
}

enum lum_status lum_flip_compare(const struct lum_flip_input *in, float *ret_map, struct lum_flip_result *ret_result,
                                 struct lum_error *err)
{
    struct flip f = {0};
    enum lum_status st = begin(&f, in, err);
    if (st)
        return st;
    add_exposure(&f);
    end(&f, ret_map, ret_result);
    return LUM_OK;
}

/* ---- exposures ---- */

/* The value the tone map takes to TONE_TARGET: the root above 0 of a quadratic equation. */
static double exposed_target(void)
{
    const double t = TONE_TARGET, s = 0.6;
    double a = s * s * (2.51 - 2.43 * t), b = s * (0.03 - 0.59 * t), c = -0.14 * t;
    return (-b + sqrt(b * b - 4.0 * a * c)) / (2.0 * a);
}

/* Sorted luminances of what has any, in f->work; how many there are. */
static size_t sort_luminance(struct flip *f, const float *const rgb[3])
{
    const size_t n = (size_t)f->in->w * f->in->h;
    size_t n_lit = 0;
    for (size_t i = 0; i < n; i++) {
        double y = 0.212639 * (double)rgb[0][i] + 0.715169 * (double)rgb[1][i] + 0.072192 * (double)rgb[2][i];
        if (y > 0.0)
            f->work[n_lit++] = (float)y;
    }
    qsort(f->work, n_lit, sizeof *f->work, compare_floats);
    return n_lit;
}

static struct lum_hdrflip_exposures find_exposures(struct flip *f)
{
    const size_t n = (size_t)f->in->w * f->in->h;
    size_t n_lit = sort_luminance(f, f->in->r);
    if (n_lit == 0)
        n_lit = sort_luminance(f, f->in->x);
    if (n_lit == 0)
        return (struct lum_hdrflip_exposures){0.0, 0.0, 0};
    size_t n_black = n - n_lit, at = n / 2 >= n_black ? n / 2 - n_black : n_lit / 2;
    double target = exposed_target();
    struct lum_hdrflip_exposures e = {log2(target / (double)f->work[n_lit - 1]), log2(target / (double)f->work[at]), 2};
    e.stop = fmin(e.stop, e.start + LUM_HDRFLIP_STOPS_MAX);
    e.n = (uint32_t)fmax(2.0, ceil(e.stop - e.start));
    return e;
}

enum lum_status lum_hdrflip_compare(const struct lum_flip_input *in, float *ret_map, struct lum_flip_result *ret_result,
                                    struct lum_hdrflip_exposures *ret_exposures, struct lum_error *err)
{
    struct flip f = {0};
    enum lum_status st = begin(&f, in, err);
    if (st)
        return st;
    struct lum_hdrflip_exposures e = find_exposures(&f);
    f.exposed = true;
    for (uint32_t i = 0; i < e.n; i++) {
        f.gain = exp2(e.start + (e.stop - e.start) * i / (e.n - 1));
        add_exposure(&f);
    }
    end(&f, ret_map, ret_result);
    *ret_exposures = e;
    return LUM_OK;
}

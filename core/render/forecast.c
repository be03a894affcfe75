#include "core/render/forecast.h"

#include "core/base/base.h"

#include <stdbool.h>
#include <string.h>

#define GROWS 1.1 /* of samples, from point to point: more tell nothing new */
/* What comes is like what was of late: the fit is over the points of the last quarter of all samples ... */
#define RECENT 4.0
#define FIT_POINTS 4u /* ... which are so many at least, */
#define FIT_SPAN 2.0  /* over such a ratio of samples. */
/* Until a slope is known. Of noise: 0.5 to 0.9 in `cornell` and `office`, 150 x 100, more where less of it is due to
 * paths of many segments. Of an error that is not noise alone: a filter as wide as bias and noise allow leaves one of
 * n^(-1/3), if bias grows as the area that it is over. */
#define USUAL_NOISE 0.75
#define USUAL_SLOPE (1.0 / 3.0)
#define ONE_COST 1.5   /* a sample's time is known to this factor, while there is one measurement of it */
#define DOUBT_MOST 3.0 /* of a bound over its estimate: with few samples that may be anything */

void lum_forecast_begin(struct lum_forecast *f)
{
    f->n_points = 0;
}

void lum_forecast_add(struct lum_forecast *f, const struct lum_forecast_point *now)
{
    uint32_t n = f->n_points;
    if (n >= 2 && f->points[n - 1].n < GROWS * f->points[n - 2].n) {
        f->points[n - 1] = *now;
        return;
    }
    if (n >= 1 && f->points[n - 1].n >= now->n) { /* time that brought no sample */
        f->points[n - 1] = *now;
        return;
    }
    if (n == LUM_FORECAST_POINTS) {
        memmove(f->points, f->points + 1, (n - 1) * sizeof *f->points);
        n--;
    }
    f->points[n] = *now;
    f->n_points = n + 1;
}

static const struct lum_forecast_point *newest(const struct lum_forecast *f)
{
    return &f->points[f->n_points - 1];
}

/* ---- what a sample takes ---- */

/* The first point of at least n samples. */
static uint32_t point_from(const struct lum_forecast *f, double n)
{
    uint32_t i = 0;
    while (i + 1 < f->n_points && f->points[i].n < n)
        i++;
    return i;
}

/* From point a to b; NAN: no sample lies between. */
static double cost_between(const struct lum_forecast *f, uint32_t a, uint32_t b)
{
    const struct lum_forecast_point *p = &f->points[a], *q = &f->points[b];
    return q->n > p->n ? (q->ms - p->ms) / (q->n - p->n) : (double)NAN;
}

/* Of the second half of all samples, where there are so many; the quarter before it tells how alike they are. */
static struct lum_forecast_range cost_of(const struct lum_forecast *f)
{
    if (f->n_points < 2)
        return LUM_FORECAST_UNKNOWN;
    uint32_t last = f->n_points - 1, half = point_from(f, 0.5 * newest(f)->n);
    half = half < last ? half : last - 1;
    uint32_t quarter = point_from(f, 0.25 * newest(f)->n);
    double late = cost_between(f, half, last), early = quarter < half ? cost_between(f, quarter, half) : (double)NAN;
    if (isnan(early))
        return (struct lum_forecast_range){late, late / ONE_COST, late * ONE_COST};
    return (struct lum_forecast_range){late, fmin(early, late), fmax(early, late)};
}

static struct lum_forecast_range time_of(const struct lum_forecast *f, const struct lum_forecast_range *n)
{
    const struct lum_forecast_point *now = newest(f);
    struct lum_forecast_range cost = cost_of(f), ret;
    ret.likely = now->ms + cost.likely * fmax(n->likely - now->n, 0.0);
    ret.least = now->ms + cost.least * fmax(n->least - now->n, 0.0);
    ret.most = now->ms + cost.most * fmax(n->most - now->n, 0.0);
    return ret;
}

struct lum_forecast_range lum_forecast_samples(const struct lum_forecast *f, double n)
{
    if (f->n_points < 2)
        return LUM_FORECAST_UNKNOWN;
    return time_of(f, &(struct lum_forecast_range){n, n, n});
}

/* ---- how the error falls ---- */

/* n^-slope. */
struct law {
    double slope, least_slope; /* of the bound; the steepest is LUM_FORECAST_STEEPEST */
    double noise, noise_slope; /* of what the newest samples have by themselves; NAN: that is not known */
    double doubt;              /* bound over estimate: 1 and more */
};

/* Least squares of log(bound) over log(n), or of log(noise). False: too few points, or too near each other. */
static bool fit_slope(const struct lum_forecast *f, bool of_noise, double *ret_slope)
{
    double n = 0.0, sx = 0.0, sy = 0.0, sxx = 0.0, sxy = 0.0, first = 0.0;
    for (uint32_t i = 0; i < f->n_points; i++) {
        const struct lum_forecast_point *p = &f->points[i];
        double error = of_noise ? p->noise : p->bound;
        if (!(error > 0.0) || !isfinite(error) || p->n * RECENT < newest(f)->n || !(p->n > 0.0))
            continue;
        double x = log(p->n), y = log(error);
        first = n > 0.0 ? first : p->n;
        n++;
        sx += x;
        sy += y;
        sxx += x * x;
        sxy += x * y;
    }
    if (n < FIT_POINTS || newest(f)->n < FIT_SPAN * first)
        return false;
    *ret_slope = -(n * sxy - sx * sy) / (n * sxx - sx * sx);
    return true;
}

/* False: the error is not known. */
static bool find_law(const struct lum_forecast *f, struct law *ret)
{
    const struct lum_forecast_point *now = f->n_points > 0 ? newest(f) : NULL;
    if (f->n_points < 2 || !isfinite(now->bound) || !(now->n > 0.0))
        return false;
    double noise_slope = USUAL_NOISE, slope = USUAL_SLOPE;
    (void)fit_slope(f, true, &noise_slope);
    (void)fit_slope(f, false, &slope);
    noise_slope = fmin(fmax(noise_slope, LUM_FORECAST_ROOT), LUM_FORECAST_STEEPEST);
    slope = fmin(fmax(slope, 0.0), LUM_FORECAST_STEEPEST);
    bool alone = now->noise <= now->bound;
    *ret = (struct law){.slope = alone ? noise_slope : slope,
                        .least_slope = alone ? LUM_FORECAST_ROOT : 0.5 * slope,
                        .noise = now->noise,
                        .noise_slope = noise_slope,
                        .doubt = DOUBT_MOST};
    if (now->rel > 0.0)
        ret->doubt = fmin(fmax(now->bound / now->rel, 1.0), DOUBT_MOST);
    return true;
}

/* Samples after which what is `error` after n is `limit`. */
static double samples_until(double n, double error, double limit, double slope)
{
    return error <= limit ? n : n * pow(error / limit, 1.0 / slope); /* INFINITY for a slope of 0 */
}

struct lum_forecast_range lum_forecast_until(const struct lum_forecast *f, double error)
{
    struct law law;
    struct lum_forecast_range n;
    if (!find_law(f, &law))
        return LUM_FORECAST_UNKNOWN;
    const struct lum_forecast_point *now = newest(f);
    if (now->bound <= error)
        return (struct lum_forecast_range){now->ms, now->ms, now->ms};
    n.likely = samples_until(now->n, now->bound, error, law.slope);
    n.least = samples_until(now->n, now->bound / law.doubt, error, LUM_FORECAST_STEEPEST);
    n.most = samples_until(now->n, now->bound * law.doubt, error, law.least_slope);
    if (isfinite(law.noise)) {
        n.likely = fmin(n.likely, samples_until(now->n, law.noise, error, law.noise_slope));
        n.most = fmin(n.most, samples_until(now->n, law.noise * law.doubt, error, LUM_FORECAST_ROOT));
    }
    return time_of(f, &n);
}

struct lum_forecast_range lum_forecast_error(const struct lum_forecast *f, double ms)
{
    struct law law;
    if (!find_law(f, &law))
        return LUM_FORECAST_UNKNOWN;
    const struct lum_forecast_point *now = newest(f);
    struct lum_forecast_range cost = cost_of(f), ret;
    double left = fmax(ms - now->ms, 0.0), few = now->n / (now->n + left / cost.most),
           many = now->n / (now->n + left / cost.least), likely = now->n / (now->n + left / cost.likely);
    ret.likely = now->bound * pow(likely, law.slope);
    ret.least = now->bound / law.doubt * pow(many, LUM_FORECAST_STEEPEST);
    ret.most = now->bound * law.doubt * pow(few, law.least_slope);
    if (isfinite(law.noise)) {
        ret.likely = fmin(ret.likely, law.noise * pow(likely, law.noise_slope));
        ret.most = fmin(ret.most, law.noise * law.doubt * pow(few, LUM_FORECAST_ROOT));
    }
    return ret;
}

/* What it takes to refine a picture further, from what it took so far: when its error is under a limit, and what the
 * error is at a time. Numbers alone: it knows neither picture nor method.
 *
 * Noise of n samples falls as 1 / sqrt(n) at least; of samples that are well spread, or learn where light comes from,
 * faster. Where samples correct a frame (refine.h) the error is less than theirs at first, and falls more slowly, until
 * it is theirs. Both fall as a power of n, which is fitted to how they fell of late. The ends of what is said: nothing
 * falls faster than 1 / n, noise no more slowly than 1 / sqrt(n); and both are wider by what the bound is above the
 * estimate, which is how well the error is known. */
#ifndef LUM_CORE_RENDER_FORECAST_H
#define LUM_CORE_RENDER_FORECAST_H

#include <math.h>
#include <stdint.h>

#define LUM_FORECAST_POINTS 96u /* 1 to 10 samples, and then by GROWS to 36 thousand; beyond, the oldest goes */
#define LUM_FORECAST_ROOT 0.5   /* powers of 1 / n: noise falls by no less, nothing by more */
#define LUM_FORECAST_STEEPEST 1.0

/* Of a picture after some samples; errors are relative (lum_film_error), NAN where they are not known. */
struct lum_forecast_point {
    double n, ms;      /* samples of a pixel; time since the picture began */
    double rel, bound; /* its error */
    double noise;      /* the bound of what the samples have by themselves; NAN: the same, or not known */
};

struct lum_forecast {
    uint32_t n_points; /* samples of the last grow by a tenth at least from point to point */
    struct lum_forecast_point points[LUM_FORECAST_POINTS];
};

/* NAN: not known. INFINITY: never. */
struct lum_forecast_range {
    double likely, least, most;
};
#define LUM_FORECAST_UNKNOWN ((struct lum_forecast_range){(double)NAN, (double)NAN, (double)NAN})

void lum_forecast_begin(struct lum_forecast *f); /* another picture */
/* After each pass: n and ms do not fall. A first point of 0 samples is fine: what came before them took its time. */
void lum_forecast_add(struct lum_forecast *f, const struct lum_forecast_point *now);

/* When there are n samples: ms since the picture began. Unknown before there are two points. */
struct lum_forecast_range lum_forecast_samples(const struct lum_forecast *f, double n);
/* When the bound is at most `error`: now, if it is. Unknown while the error or the cost of a sample is. */
struct lum_forecast_range lum_forecast_until(const struct lum_forecast *f, double error);
/* The bound at a time that is not past. */
struct lum_forecast_range lum_forecast_error(const struct lum_forecast *f, double ms);

#endif

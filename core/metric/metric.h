/* How far a picture x is from its reference r. Both are linear; every channel of every pixel counts alike. Values that
 * are not finite are left out and counted: the caller decides what they mean. */
#ifndef LUM_CORE_METRIC_METRIC_H
#define LUM_CORE_METRIC_METRIC_H

#include "core/base/base.h"

/* In the denominators, so that black pixels do not divide by 0. The usual value. */
#define LUM_METRIC_EPSILON 0.01

struct lum_metric_input {
    const float *x, *r; /* n values each */
    size_t n;
    double epsilon;
};
struct lum_metric_result {
    double rmse;   /* sqrt(mean((x - r)^2)) */
    double relmse; /* mean((x - r)^2 / (r^2 + epsilon)) */
    double smape;  /* mean(|x - r| / (|x| + |r| + epsilon)), in [0, 1) */
    size_t n_nonfinite;
};
/* NAN for all when no value is finite. */
struct lum_metric_result lum_metric_compare(const struct lum_metric_input *input);

/* What one value adds to relmse; for heat maps. NAN when either is not finite. */
double lum_metric_relative_square(double x, double r, double epsilon);

/* For metrics in which a pixel has its neighbours in it: fails with LUM_ERR_INVALID, naming `which` ("the reference")
 * and the first pixel, where one of n planes of w * h has a value that is not finite, and says how many do. */
LUM_MUST_USE enum lum_status lum_metric_require_finite(const float *const *planes, uint32_t n, uint32_t w, uint32_t h,
                                                       const char *which, struct lum_error *err);

#endif

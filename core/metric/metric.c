#include "core/metric/metric.h"

#include <math.h>

double lum_metric_relative_square(double x, double r, double epsilon)
{
    if (!isfinite(x) || !isfinite(r))
        return (double)NAN;
    return (x - r) * (x - r) / (r * r + epsilon);
}

struct lum_metric_result lum_metric_compare(const struct lum_metric_input *in)
{
    double square = 0.0, relative = 0.0, symmetric = 0.0;
    size_t n = 0;
    for (size_t i = 0; i < in->n; i++) {
        double x = (double)in->x[i], r = (double)in->r[i];
        if (!isfinite(x) || !isfinite(r))
            continue;
        n++;
        square += (x - r) * (x - r);
        relative += lum_metric_relative_square(x, r, in->epsilon);
        symmetric += fabs(x - r) / (fabs(x) + fabs(r) + in->epsilon);
    }
    struct lum_metric_result result = {(double)NAN, (double)NAN, (double)NAN, in->n - n};
    if (n > 0) {
        result.rmse = sqrt(square / (double)n);
        result.relmse = relative / (double)n;
        result.smape = symmetric / (double)n;
    }
    return result;
}

enum lum_status lum_metric_require_finite(const float *const *planes, uint32_t n, uint32_t w, uint32_t h,
                                          const char *which, struct lum_error *err)
{
    size_t first = SIZE_MAX, n_nonfinite = 0;
    for (uint32_t k = 0; k < n; k++)
        for (size_t i = 0; i < (size_t)w * h; i++)
            if (!isfinite(planes[k][i])) {
                n_nonfinite++;
                first = i < first ? i : first;
            }
    if (n_nonfinite == 0)
        return LUM_OK;
    return lum_fail(err, LUM_ERR_INVALID, "", "%s has %zu values that are not finite, the first at pixel %zu, %zu",
                    which, n_nonfinite, first % w, first / w);
}

#include "core/measure/dgp.h"

#include <math.h>

#define PER_LX 5.87e-5
#define PER_DECADE 0.092
#define LEAST 0.159
#define EYE_EXPONENT 1.87
#define LITTLE_LX 1000.0

struct lum_bright lum_bright_and(struct lum_bright a, struct lum_bright b)
{
    return (struct lum_bright){a.sum + b.sum, hypot(a.sum_stderr, b.sum_stderr), a.n + b.n};
}

/* Without the correction and the limit; *ret_per_lx and *ret_per_sum: what it changes by for each. */
static double plain(double sum, double lx, double *ret_per_lx, double *ret_per_sum)
{
    double contrast = sum / pow(lx, EYE_EXPONENT), slope = PER_DECADE / log(10.0) / (1.0 + contrast);
    *ret_per_lx = PER_LX - slope * contrast * EYE_EXPONENT / lx;
    *ret_per_sum = slope / pow(lx, EYE_EXPONENT);
    return PER_LX * lx + PER_DECADE * log10(1.0 + contrast) + LEAST;
}

struct lum_dgp lum_dgp_of(const struct lum_bright *bright, double lx, double eye_stderr)
{
    if (!(lx > 0.0))
        return (struct lum_dgp){lx < 0.0 || isnan(lx) ? (double)NAN : 0.0, 0.0};
    double per_lx, per_sum, dgp = plain(bright->sum, lx, &per_lx, &per_sum);
    if (lx < LITTLE_LX) {
        double little = 1.0 / (1.0 + exp(4.0 - 0.024 * lx));
        per_lx = per_lx * little + dgp * 0.024 * little * (1.0 - little);
        per_sum *= little;
        dgp *= little;
    }
    return (struct lum_dgp){fmin(dgp, 1.0), hypot(per_lx * eye_stderr, per_sum * bright->sum_stderr)};
}

enum lum_dgp_band lum_dgp_band_of(double dgp)
{
    return dgp <= 0.35   ? LUM_DGP_IMPERCEPTIBLE
           : dgp <= 0.40 ? LUM_DGP_PERCEPTIBLE
           : dgp <= 0.45 ? LUM_DGP_DISTURBING
                         : LUM_DGP_INTOLERABLE;
}

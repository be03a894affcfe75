/* Discrete distributions as inclusive prefix sums. */
#ifndef LUM_CORE_MATH_CDF_H
#define LUM_CORE_MATH_CDF_H

#include <stdint.h>

/* First entry i with x < cdf[i], so that one of probability 0 is never found while x < cdf[n - 1]; else the last. n >
 * 0. ret_below: where i begins; what belongs to it is cdf[i] - *ret_below. */
static inline uint32_t lum_cdf_find(const float *cdf, uint32_t n, float x, float *ret_below)
{
    uint32_t lo = 0, hi = n - 1;
    while (lo < hi) {
        uint32_t mid = lo + (hi - lo) / 2;
        if (x < cdf[mid])
            hi = mid;
        else
            lo = mid + 1;
    }
    *ret_below = lo > 0 ? cdf[lo - 1] : 0.0f;
    return lo;
}

#endif

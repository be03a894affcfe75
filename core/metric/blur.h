/* Separable filters of planes of floats, w * h, row by row. Beyond the edge the last pixel goes on. */
#ifndef LUM_CORE_METRIC_BLUR_H
#define LUM_CORE_METRIC_BLUR_H

#include <stdint.h>

#define LUM_BLUR_RADIUS_MAX 64 /* pixels; the widest kernel is FLIP's at LUM_FLIP_PIXELS_PER_DEGREE_MAX, 55 */

struct lum_kernel {
    int radius;
    float weights[2 * LUM_BLUR_RADIUS_MAX + 1]; /* of the pixels from -radius to radius */
};

/* exp(-(x / sigma)^2 / 2), sum 1. Returns the sum it had before. */
double lum_kernel_gauss(double sigma_px, int radius, struct lum_kernel *ret_kernel);
/* Its first (order 1) and second (order 2) derivative; weights above 0 sum to 1, those below to -1, so that a step and
 * a line of height 1 answer with 1, whatever sigma is. */
void lum_kernel_gauss_derivative(double sigma_px, int order, int radius, struct lum_kernel *ret_kernel);

/* along: x, then y. work: w * h; ret may be in, not work. */
void lum_blur(const float *in, uint32_t w, uint32_t h, const struct lum_kernel *along[2], float *work, float *ret);

#endif

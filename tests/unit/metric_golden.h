/* The golden pictures of tests/golden/metrics, and what others measured on them. */
#ifndef LUM_TESTS_UNIT_METRIC_GOLDEN_H
#define LUM_TESTS_UNIT_METRIC_GOLDEN_H

#include <stdint.h>

enum { GOLDEN_W = 240, GOLDEN_H = 160, GOLDEN_N = GOLDEN_W * GOLDEN_H };

/* Planes R, G, B, linear. Fails the test where it cannot be read. */
struct golden {
    float rgb[3][GOLDEN_N];
};
void golden_read(const char *name, struct golden *ret_picture); /* "box_4.png" */

/* The mean of a map and its weighted median; see core/metric/flip.h. 67.0206 pixels per degree. */
struct golden_flip {
    const char *x, *r;
    double mean, weighted_median, max;
};
static const struct golden_flip golden_flip[] = {
    {"box_4.png", "box_400.png", 0.131790, 0.156268, 0.664591},
    {"box_16.png", "box_400.png", 0.074795, 0.089054, 0.321801},
};
/* Exposures 1.0528 to 3.4936, 3 of them. */
static const struct golden_flip golden_hdrflip[] = {
    {"box_4.exr", "box_400.exr", 0.172415, 0.217622, 0.848651},
    {"box_16.exr", "box_400.exr", 0.093032, 0.116203, 0.562903},
};
/* Against box_400.exr: luminance as it is, in cd/m2; 29.7877 pixels per degree. */
struct golden_hdrvdp {
    const char *x;
    double p75_percent, p95_percent, mean;
};
static const struct golden_hdrvdp golden_hdrvdp[] = {
    {"box_4.exr", 58.30, 38.89, 0.72117},
    {"box_16.exr", 5.385, 1.484, 0.22035},
};

#endif

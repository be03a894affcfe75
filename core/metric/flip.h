/* FLIP: how different two pictures look when one flips between them (Andersson, Nilsson, Akenine-Moller, Oskarsson,
 * Astrom, Fairchild 2020), and HDR-FLIP, the largest of that over exposures (Andersson, Nilsson, Shirley,
 * Akenine-Moller 2021).
 *
 * Per pixel 0 (the same) to 1. Symmetric in x and r, but for the exposures of HDR-FLIP, which are those of r. Pictures
 * are three planes R, G, B of w * h floats, linear Rec.709. A value that is not finite is refused. Thread: any. */
#ifndef LUM_CORE_METRIC_FLIP_H
#define LUM_CORE_METRIC_FLIP_H

#include "core/base/base.h"

/* Pixels per degree of a display 0.7 m wide of 3840 pixels, seen from 0.7 m: what published values are for. */
#define LUM_FLIP_PIXELS_PER_DEGREE 67.0206432765823
#define LUM_FLIP_PIXELS_PER_DEGREE_MAX 400.0 /* kernels grow with it: LUM_BLUR_RADIUS_MAX holds those of so many */

struct lum_flip_input {
    uint32_t w, h;
    const float *x[3], *r[3];
    double pixels_per_degree;
};
struct lum_flip_result {
    double mean, max;
    double weighted_median; /* half of the sum of all errors is of pixels up to this one; 0 when there is no error */
};
/* Values are cut to [0, 1]: light as the display sends it. ret_map: w * h, may be NULL. */
LUM_MUST_USE enum lum_status lum_flip_compare(const struct lum_flip_input *input, float *ret_map,
                                              struct lum_flip_result *ret_result, struct lum_error *err);

/* Stops by which pictures are brightened before the tone map (ACES as fitted by Narkowicz 2015): from the one in which
 * the brightest pixel of r is at 0.85, to that in which its median is. */
struct lum_hdrflip_exposures {
    double start, stop;
    uint32_t n; /* evenly spaced, both ends in it; 0: both pictures are black */
};
#define LUM_HDRFLIP_STOPS_MAX 32.0 /* stop - start; a median of 0 is replaced by that of what is above 0 */
LUM_MUST_USE enum lum_status lum_hdrflip_compare(const struct lum_flip_input *input, float *ret_map,
                                                 struct lum_flip_result *ret_result,
                                                 struct lum_hdrflip_exposures *ret_exposures, struct lum_error *err);

#endif

/* HDR-VDP: with what probability one who looks sees that two pictures differ, per pixel (Mantiuk, Daly, Myszkowski,
 * Seidel 2005: Predicting visible differences in high dynamic range images - model and its calibration).
 *
 * Luminance goes through the optics of the eye; is counted in just noticeable differences (JND); is weighed by
 * frequency as the eye adapted to each place does; is parted into bands of frequency and orientation; in each a
 * difference is hidden by what the band holds in both pictures; probabilities over bands are joined. Colour is not
 * looked at.
 *
 * The paper leaves open how a band is smoothed before it hides (phase uncertainty) and how a picture goes on beyond its
 * edge. Of the readings tried those are here that come nearest to the published implementation (1.7), within a
 * percentage point: a band hides by what of it is below its own lower edge, so not by what is in its middle; pictures
 * are mirrored. tests/unit/hdrvdp_test.c. */
#ifndef LUM_CORE_METRIC_HDRVDP_H
#define LUM_CORE_METRIC_HDRVDP_H

#include "core/base/base.h"

/* A display 0.375 m wide of 1280 pixels, seen from 0.5 m. */
#define LUM_HDRVDP_PIXELS_PER_DEGREE 29.7877
#define LUM_HDRVDP_PIXELS_PER_DEGREE_MAX 400.0 /* as of FLIP: one option sets both */

struct lum_hdrvdp_input {
    uint32_t w, h;
    const float *x, *r; /* luminance in cd/m2 as it reaches the eye, w * h; below 1e-4 counts as that */
    double pixels_per_degree;
};
struct lum_hdrvdp_result {
    double p75, p95; /* shares of pixels whose difference is seen with at least this probability, 0 to 1 */
    double mean;     /* probability */
};
/* ret_map: w * h probabilities, may be NULL. The eye is adapted to r. A value that is not finite is refused. Thread:
 * any. */
LUM_MUST_USE enum lum_status lum_hdrvdp_compare(const struct lum_hdrvdp_input *input, float *ret_map,
                                                struct lum_hdrvdp_result *ret_result, struct lum_error *err);

#endif

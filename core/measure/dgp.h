/* Glare by day: the Daylight Glare Probability (Wienold & Christoffersen 2006), with the constants, the correction for
 * little light and the limits of evalglare:
 *
 *   DGP = 5.87e-5 Ev + 0.092 log10(1 + sum of L^2 w / (Ev^1.87 p^2)) + 0.159, at most 1
 *
 * Ev: all light at the eye, lx. Sources, of luminance L, solid angle w and Guth's position index p: what is brighter
 * than 2000 cd/m2. Below 1000 lx it is times f / (1 + f), f = e^(0.024 Ev - 4). */
#ifndef LUM_CORE_MEASURE_DGP_H
#define LUM_CORE_MEASURE_DGP_H

#include "core/base/base.h"

#define LUM_DGP_SOURCE_CD_M2 2000.0
#define LUM_DGP_PEAK_CD_M2 50000.0 /* sources apart from others, as evalglare extracts them */
#define LUM_DGP_MIN_LX 380.0       /* at the eye, of what the formula was made from: with less it is no probability */

/* What glares. */
struct lum_bright {
    double sum, sum_stderr; /* of L^2 w / p^2, cd^2/m4 */
    uint32_t n;             /* sources */
};
struct lum_bright lum_bright_and(struct lum_bright a, struct lum_bright b); /* independent of each other */

struct lum_dgp {
    double dgp, stderr_of; /* NAN: not known */
};
struct lum_dgp lum_dgp_of(const struct lum_bright *bright, double eye_lx, double eye_stderr);

/* As people say it: up to 0.35, 0.40, 0.45, and beyond. */
enum lum_dgp_band { LUM_DGP_IMPERCEPTIBLE, LUM_DGP_PERCEPTIBLE, LUM_DGP_DISTURBING, LUM_DGP_INTOLERABLE };
enum lum_dgp_band lum_dgp_band_of(double dgp);

#endif

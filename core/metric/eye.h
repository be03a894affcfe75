/* How the eye sees contrast: the parts of HDR-VDP that are closed forms. Luminances in cd/m2, frequencies in cycles per
 * degree. */
#ifndef LUM_CORE_METRIC_EYE_H
#define LUM_CORE_METRIC_EYE_H

#include "core/base/base.h"

/* What is darker or brighter counts as this: starlight, and more than a lamp. */
#define LUM_EYE_LUMINANCE_MIN 1e-4
#define LUM_EYE_LUMINANCE_MAX 1e8

/* The least contrast that is seen, at LUM_EYE_BRIGHT and the frequency seen best: the calibrated value of HDR-VDP. */
#define LUM_EYE_PEAK_CONTRAST 0.006
#define LUM_EYE_BRIGHT 100.0
#define LUM_EYE_DISTANCE_M 0.5 /* from which the picture is seen */

/* Diameter in mm at which the pupil rests (Moon and Spencer 1944). */
double lum_eye_pupil_mm(double luminance);
/* What share of a contrast reaches the retina, 0 to 1 (Deeley, Drasdo, Charman 1991). */
double lum_eye_transfer(double frequency, double pupil_mm);
/* Sensitivity to contrast of an eye that has adapted to a luminance, but for a factor (Daly 1993): the lesser of a
 * curve at the frequency, and at the frequency over lum_eye_squeeze, which is by how much less the eye resolves from
 * near by and along diagonals of the picture. picture_deg2: what the whole picture covers, in which a low frequency has
 * few periods. 0 at 0. */
double lum_eye_sensitivity(double frequency, double angle_rad, double luminance, double picture_deg2);
double lum_eye_curve(double frequency, double luminance, double picture_deg2);
double lum_eye_squeeze(double angle_rad);
/* At the frequency seen best, along an axis of the picture. */
double lum_eye_peak_sensitivity(double luminance, double picture_deg2);

/* Luminance in just noticeable differences: one more is a contrast at its threshold, at the best frequency. */
#define LUM_JND_STEPS 1024u
struct lum_jnd_scale {
    float at[LUM_JND_STEPS]; /* evenly over log luminance, MIN to MAX; at[0] is 0 */
};
void lum_jnd_scale_init(struct lum_jnd_scale *scale, double picture_deg2);
float lum_jnd_of(const struct lum_jnd_scale *scale, float luminance);

#endif

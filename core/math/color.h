/* Colour of light sources. */
#ifndef LUM_CORE_MATH_COLOR_H
#define LUM_CORE_MATH_COLOR_H

#include "core/math/vec.h"

#define LUM_CCT_MIN 1000.0 /* K; lower and higher values are clamped */
#define LUM_CCT_MAX 25000.0

/* CIE 1931 chromaticity of white light of this correlated colour temperature. Planckian radiator up to 4000 K (lamps),
 * CIE daylight from 5000 K, so that 6504 K is D65, the white of Rec.709; between them blended in mired. */
struct lum_vec2 lum_cct_chromaticity(double kelvin);

/* The same as linear Rec.709 with luminance 1. Below about 1900 K the locus leaves the gamut: negative blue is cut to 0. */
struct lum_rgb lum_cct_to_rgb(double kelvin);

/* Rec.709 to Rec.709: a picture lit by white light of this temperature as it would look under D65. Chromatic adaptation
 * by von Kries' rule in Bradford cone responses (ICC.1:2022, annex E). 6504 K gives the identity but for the rounding of its
 * chromaticity. */
void lum_white_balance(double kelvin, float ret_rgb_to_rgb[3][3]);

/* IEC 61966-2-1: linear value of an 8-bit sRGB code. */
extern const float lum_srgb8_to_linear[256];

#endif

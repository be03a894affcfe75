/* Colour of light sources. */
#ifndef LUM_CORE_MATH_COLOR_H
#define LUM_CORE_MATH_COLOR_H

#include <stdint.h>

#include "core/math/rgb.h"
#include "core/math/vec.h"

#define LUM_CCT_MIN 1000.0 /* K; lower and higher values are clamped */
#define LUM_CCT_MAX 25000.0

/* CIE 1931 chromaticity of white light of this correlated colour temperature. Planckian radiator up to 4000 K (lamps),
 * CIE daylight from 5000 K, so that 6504 K is D65, the white of Rec.709; between them blended in mired. */
struct lum_vec2 lum_cct_chromaticity(double kelvin);

/* The same as linear Rec.709 with luminance 1. Below about 1900 K the locus leaves the gamut: negative blue is cut to
 * 0. */
struct lum_rgb lum_cct_to_rgb(double kelvin);

/* Rec.709 to Rec.709: a picture lit by white light of this temperature as it would look under D65. Chromatic adaptation
 * by von Kries' rule in Bradford cone responses (ICC.1:2022, annex E). 6504 K gives the identity but for the rounding
 * of its chromaticity. */
void lum_white_balance(double kelvin, float ret_rgb_to_rgb[3][3]);

/* A share of light by colour, each channel 0..1, in 32 bits: 10 of the root of each, so that it is off by at most
 * 2^-10 / sqrt(share) of itself. Zero bits: all of it, exactly. */
static inline uint32_t lum_transmittance_pack(struct lum_rgb share)
{
    const float c[3] = {share.r, share.g, share.b};
    uint32_t bits = 0;
    for (uint32_t k = 0; k < 3; k++)
        bits |= (1023u - (uint32_t)(1023.0f * sqrtf(lum_clamp(c[k], 0.0f, 1.0f)) + 0.5f)) << 10 * k;
    return bits;
}
static inline struct lum_rgb lum_transmittance_unpack(uint32_t bits)
{
    float root[3];
    for (uint32_t k = 0; k < 3; k++)
        root[k] = (float)(1023u - (bits >> 10 * k & 1023u)) / 1023.0f;
    return lum_rgb(root[0] * root[0], root[1] * root[1], root[2] * root[2]);
}

/* IEC 61966-2-1: linear value of an 8-bit sRGB code. */
extern const float lum_srgb8_to_linear[256];

#endif

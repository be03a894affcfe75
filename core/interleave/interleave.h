/* Interleaved sampling (Keller & Heidrich 2001): neighbouring pixels use disjoint sets of samples, in a pattern that repeats
 * every `side` pixels, and a filter as large as the pattern puts the sets together again.
 *
 * A work packet is LUM_PACKET_SIDE x LUM_PACKET_SIDE pixels: patterns of 3 and of 4 and the ray batch tiles of 16 divide
 * it, and all its pixels at one place of a pattern of 3 are one ray batch. Packets at the right and lower edge are smaller.
 *
 * Everything here works on plain arrays, one entry per pixel, row by row of the picture. Thread: any; a packet is written
 * by one worker. */
#ifndef LUM_CORE_INTERLEAVE_INTERLEAVE_H
#define LUM_CORE_INTERLEAVE_INTERLEAVE_H

#include "core/base/base.h"
#include "core/math/vec.h"

#define LUM_PACKET_SIDE 48u
#define LUM_PATTERN_MAX 4u

/* What a first hit looks like to filters: borrowed arrays, w * h. */
struct lum_guide {
    uint32_t w, h;
    const struct lum_vec3 *p; /* scene space */
    const struct lum_vec3 *n; /* unit shading normal; 0: background */
    const float *depth;       /* distance from the eye, scene units; INFINITY: background */
    float pixel;              /* size of a pixel at distance 1 */
};

/* Which of the side * side sets pixel (x, y) begins with. Neighbours in the pattern get sets that lie far apart in the
 * sequence. */
uint32_t lum_pattern_set(uint32_t side, uint32_t x, uint32_t y);
/* The set of the pixel in a further iteration: all side * side sets once, each iteration again a permutation of the pattern. */
uint32_t lum_pattern_next(uint32_t side, uint32_t set, uint32_t iteration);

/* ---- guidance (listings 5.2 to 5.4): how many further iterations a tile of the pattern gets ---- */

/* Listing 5.2: the mean over the tile of missed / sampled; refined when any was missed. Returns further iterations, 0 ..
 * max - 1 (the first one is done), rounding up (algorithms A0.3). */
uint32_t lum_guidance_indirect(const uint16_t *sampled, const uint16_t *missed, uint32_t n_pixels, uint32_t max);
/* Listing 5.3: the part of the tile's samples that are occluded; refined when neither 0 nor all. Rounds up. */
uint32_t lum_guidance_shadow(uint32_t sampled, uint32_t missed, uint32_t max);
/* Listing 5.4: pixels whose metric differs from the one before in the tile (reset per tile; the tolerance is one step of one
 * sample, A0.3). value: per pixel in scan order, from lum_guidance_media_value. */
float lum_guidance_media_value(uint32_t missed, uint32_t in_halo, uint32_t n_steps);
uint32_t lum_guidance_media(const float *value, uint32_t n_pixels, uint32_t n_steps, uint32_t max);

/* ---- filters ---- */

/* The discontinuity buffer of Wald et al. 2002: each pixel becomes the mean over the side x side window around it of those
 * pixels that lie on the same smooth surface. Every window of the pattern's size holds each sample set once. For even sides
 * the window is side + 1 wide with half weights at both ends, which keeps that property and is centred.
 * in, out: w * h radiance or irradiance; the rectangle x, y, w, h of out is written. */
struct lum_filter {
    const struct lum_guide *guide;
    uint32_t side;
    const struct lum_rgb *in;
    struct lum_rgb *out;
};
void lum_filter_box(const struct lum_filter *f, uint32_t x, uint32_t y, uint32_t w, uint32_t h);

/* True when pixels a and b (indices) lie on the same smooth surface: normals within the limit, and b near the plane through a
 * relative to the size of a pixel there. */
bool lum_guide_same_surface(const struct lum_guide *guide, size_t a, size_t b);

/* Guided bilinear upsampling (5.2.4, after Tomasi & Manduchi 1998, Kopf et al. 2007): of the four nearest low-resolution
 * samples those on the pixel's own surface, with their bilinear weights. Low-resolution pixel (i, j) was computed at the full
 * resolution pixel lum_coarse_site(). low: ceil(w/2) * ceil(h/2). Returns false where none of the four serves: the caller
 * computes that pixel itself. */
static inline uint32_t lum_coarse_site(uint32_t i, uint32_t full)
{
    uint32_t x = 2 * i;
    return x < full ? x : full - 1;
}
bool lum_upsample(const struct lum_guide *guide, const struct lum_rgb *low, uint32_t x, uint32_t y, struct lum_rgb *ret_value);

#endif

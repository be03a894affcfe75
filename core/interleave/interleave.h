/* Interleaved sampling (Keller & Heidrich 2001): neighbouring pixels use disjoint subsets of samples, in a pattern that
 * repeats every `side` pixels, and a filter as large as the pattern puts the subsets together again.
 *
 * A work cell is LUM_CELL_SIDE x LUM_CELL_SIDE pixels: patterns of 3 and of 4 and the ray batch tiles of 16 divide
 * it, and all its pixels at one place of a pattern of 3 are one ray batch. Cells at the right and lower edge are
 * smaller.
 *
 * Everything here works on plain arrays, one entry per pixel, row by row of the picture. Thread: any; a cell is written
 * by one worker. */
#ifndef LUM_CORE_INTERLEAVE_INTERLEAVE_H
#define LUM_CORE_INTERLEAVE_INTERLEAVE_H

#include <math.h>

#include "core/base/base.h"
#include "core/math/rgb.h"
#include "core/math/vec.h"

#define LUM_CELL_SIDE 48u  /* pixels: the least common multiple of 3, 4 and 16, see above */
#define LUM_PATTERN_MAX 4u /* pixels a side */

/* What a first hit looks like to filters: borrowed arrays, w * h. */
struct lum_guide {
    uint32_t w, h;
    const struct lum_vec3 *p; /* scene space */
    const struct lum_vec3 *n; /* unit shading normal; 0: background */
    const float *depth;       /* distance from the eye, scene units; INFINITY: background */
    const uint8_t *kind;      /* bits that filters can ask for; NULL: none */
    float pixel;              /* size of a pixel at distance 1 */
};

/* ---- the pattern ---- */

/* Which of the side * side subsets pixel (x, y) begins with; side 1 .. LUM_PATTERN_MAX. Neighbours get subsets that lie
 * far apart in their sequence (an ordered dither). */
uint32_t lum_pattern_subset(uint32_t side, uint32_t x, uint32_t y);
/* The pixel of the pattern that begins with a subset. */
void lum_pattern_pixel(uint32_t side, uint32_t subset, uint32_t *ret_x, uint32_t *ret_y);
/* The subset of the pixel in an iteration (0: the first, subset itself): all side * side subsets once, and each
 * iteration again a permutation of the pattern, so that the tile as a whole has taken each subset equally often after
 * each of them. */
uint32_t lum_pattern_next(uint32_t side, uint32_t subset, uint32_t iteration);
/* What windows see of one axis of the picture, n positions from `first` on with `border` more on either side. Beyond an
 * edge of the picture stands the position of the same subset a period further in; LUM_NOWHERE: the picture is too small
 * for it. */
#define LUM_NOWHERE UINT32_MAX
void lum_pattern_positions(uint32_t first, uint32_t n, uint32_t border, uint32_t period, uint32_t size,
                           uint32_t *ret_at);

/* ---- guidance (listings 5.2 to 5.4): how many further iterations a tile of the pattern gets ----
 *
 * All return 0 .. max - 1, where max counts the first iteration too: there are max disjoint subsets, and one is used
 * up. The listings do not say how refine * max is rounded: up, so that what asks for refinement gets some (NOTES R3).
 */

/* Listing 5.2. sampled, missed: by pixel of the tile, VPLs of its subset and those of them that are occluded: a VPL
 * that faces away is one of those sampled and misses nothing. refine is the mean over the pixels of missed / sampled; a
 * pixel without samples misses nothing. */
uint32_t lum_guidance_indirect(const uint16_t *sampled, const uint16_t *missed, uint32_t n_pixels, uint32_t max);

/* Listing 5.3 for one light: sums over the tile of samples taken and of those occluded. Refined when neither none nor
 * all are missed. The listing averages over the lights first, where one light lit and one occluded would be refined for
 * ever without a penumbra: hence light by light (NOTES R3). */
uint32_t lum_guidance_shadow(uint32_t sampled, uint32_t missed, uint32_t max);

/* Listing 5.4, lines 12 to 26: the metric of one pixel from n marching points (points times lights: the listing divides
 * missed by the number of lights, which is the same, and forgets to do so for in_halo). */
float lum_guidance_media_value(uint32_t missed, uint32_t in_halo, uint32_t n);
/* Lines 28 to 43: value by pixel in scan order. The comparison with the previous pixel begins anew in every tile, or
 * the result would depend on who renders what. Rays of neighbours march at offsets that differ by less than a step, and
 * so count one step more or less at every boundary: up to one of n_steps is no difference (NOTES R3). */
uint32_t lum_guidance_media(const float *value, uint32_t n_pixels, uint32_t n_steps, uint32_t max);

/* ---- filters ---- */

/* Two pixels lie on one smooth surface when
 *   - their normals are within acos 0.9 = 26 degrees, and
 *   - the chord between them is at right angles to the sum of their normals, as it is on a plane, a cylinder and a
 * sphere, to within the size of a pixel there: lesser steps cannot be told from noise, larger ones are edges. What
 * float positions lose is allowed for: scene coordinates are at most 2^7, 2^-17 apart, three products of two roundings
 * each, so 2^-14 a pixel covers it. */
#define LUM_SAME_COS 0.9f
static inline float lum_guide_limit(const struct lum_guide *g, size_t i)
{
    return g->pixel * g->depth[i] + 0x1p-14f;
}
/* Pixels by index. Symmetric. Background is no surface. */
static inline bool lum_guide_same_surface(const struct lum_guide *g, size_t a, size_t b)
{
    if (!(lum_dot(g->n[a], g->n[b]) > LUM_SAME_COS))
        return false;
    float off = lum_dot(lum_v3_add(g->n[a], g->n[b]), lum_v3_sub(g->p[b], g->p[a]));
    return fabsf(off) <= lum_guide_limit(g, a) + lum_guide_limit(g, b);
}

/* What is filtered: a picture at full resolution (step 1), or at a half or a quarter of it along both axes (step 2 and
 * 4): ceil(w / step) * ceil(h / step) pixels, of which (i, j) was computed at the guide's pixel (i * step, j * step).
 */
struct lum_filter {
    const struct lum_guide *guide;
    uint8_t need;  /* pixels take part whose guide->kind has one of these bits; 0: all, and the background is a surface
                      too */
    uint32_t side; /* of the pattern */
    uint32_t
        apart; /* the pattern's places lie so many pixels apart, 1 or more: side / 2 * apart <= LUM_FILTER_BORDER_MAX */
    uint32_t step;
    const struct lum_rgb *in;
    bool lenient; /* upsampling: a pixel on whose surface no sample lies takes from those that are most like it */
};
#define LUM_FILTER_BORDER_MAX 8u   /* places 8 pixels apart, the widest in use (many_lights_join.c) */
#define LUM_LENIENT_SHARE 0x1p-10f /* of such a sample, against one on the pixel's own surface */
struct lum_filter_rect {
    uint32_t x, y, w, h;
};
static inline uint32_t lum_filter_size(uint32_t full, uint32_t step)
{
    return (full + step - 1) / step;
}

/* The discontinuity buffer of Wald et al. 2002: each pixel becomes the mean over the side x side window around it of
 * those pixels that lie on the same smooth surface. Such a window holds each sample subset once, so that on one surface
 * the structured noise of the pattern cancels. For even sides the window is side + 1 wide with half weights at both
 * ends, which keeps that property and is centred; what lies beyond the edge of the picture is replaced by the pixel of
 * the same subset one period further in. Pixels that do not take part are copied. Writes the pixels of rect (of the
 * picture that is filtered), row after row, pitch apart; reads around it as well. */
void lum_filter_box(const struct lum_filter *f, const struct lum_filter_rect *rect, struct lum_rgb *out, size_t pitch);

/* The same of a picture of step 2 or 4, followed by guided bilinear upsampling (5.2.4, after Tomasi & Manduchi 1998,
 * Kopf et al. 2007): a pixel takes of the samples around it those on its own surface, with their bilinear weights.
 * rect: of the full resolution, x and y multiples of step, at most LUM_CELL_SIDE a side. out: the whole picture at full
 * resolution; pixels that do not take part or that no sample serves are left alone. */
void lum_filter_upsampled(const struct lum_filter *f, const struct lum_filter_rect *rect, struct lum_rgb *out);
/* Which of the samples around the pixel it takes from: bit 0 above left, 1 above right, 2 below left, 3 below right;
 * those that would coincide count once. 0: none serves, and the caller computes the pixel itself. */
uint8_t lum_upsample_taps(const struct lum_filter *f, uint32_t x, uint32_t y);
/* lum_filter_upsampled of side 1 and step 2, with the taps of all pixels known: their plain mean, since all of a
 * pixel's taps have one bilinear weight. Any rect. */
void lum_filter_by_taps(const struct lum_filter *f, const uint8_t *taps, const struct lum_filter_rect *rect,
                        struct lum_rgb *out);

#define LUM_GUIDANCE_MAX 9u /* iterations of the thesis' pattern, the first one included: all its sample subsets */
/* Colours of such a map, linear: blue where a tile of the pattern was not refined, red the more often it was (5.3). */
struct lum_rgb lum_guidance_color(uint32_t iterations, uint32_t max);

#endif

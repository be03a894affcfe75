/* How far a picture x is from its reference r by blocks: ratios of the mean luminance of squares of pixels. Noise of
 * single pixels averages out there, so that what is left is light that is missing or too much: bias shows, noise does
 * not.
 *
 * A block's side is a 24th of the width, 25 x 25 pixels at 600 x 400. What is left at the right and at the bottom joins
 * the last block, or makes one of its own when it is at least half a side.
 *
 * A ratio says nothing where there is no light: a block counts when its reference is above LUM_BLOCKS_DARK of the mean
 * of the whole, and those that do not are counted as dark. With the mean exposed to middle grey (0.18 of white), sRGB
 * shows light below 0.18 / 512 of white as the codes 0 and 1 of 255: such a block is black on the screen whatever its
 * ratio is.
 *
 * The reference has noise of its own. With a and b the pixels of two independent halves of it and r = (a + b) / 2, E[(a
 * - b)^2 / 4] is the variance of r. Pixels are independent of each other, too, so the variance of a block's mean is the
 * sum of those over n^2: as many degrees of freedom as it has pixels. Without halves the variance is bounded from
 * above: of two pixels p and q E[(p - q)^2] = var p + var q + (difference of their light)^2, so the squares of disjoint
 * neighbours sum to at least the variance of the block's sum. (Not of a reference that was filtered: its pixels hang
 * together.) The ratio x / r then has the relative standard error of r, to first order. */
#ifndef LUM_CORE_METRIC_BLOCKS_H
#define LUM_CORE_METRIC_BLOCKS_H

#include "core/base/base.h"

#define LUM_BLOCKS_ACROSS 24u /* 25 pixels of a picture of 600 */
#define LUM_BLOCKS_DARK (1.0 / 512.0)

struct lum_blocks_grid {
    uint32_t side, nx, ny;
};
struct lum_blocks_grid lum_blocks_grid(uint32_t w, uint32_t h);
/* Where block k of n begins, k = n: where the last one ends, over `size` pixels. */
uint32_t lum_blocks_begin(const struct lum_blocks_grid *grid, uint32_t k, uint32_t n, uint32_t size);

struct lum_blocks_input {
    uint32_t w, h;
    const float *x, *r;       /* luminance, w * h, row by row */
    const float *r_halves[2]; /* independent, r is their mean; NULL: there are none */
};
/* Over the blocks that count. NAN for all when none does. */
struct lum_blocks_result {
    struct lum_blocks_grid grid;
    uint32_t n_counted, n_dark;
    size_t n_nonfinite; /* pixels left out of their blocks in both pictures */
    double mean;        /* of the whole picture x, dark blocks too, over that of r */
    double median, p5, p25, p75, p95, lowest, highest;
    double mean_stderr; /* of the reference, relative: of its mean. NAN where a block is one pixel and there are no
                           halves */
    double stderr_median, stderr_p95; /* the same, of its blocks */
};
/* ret_ratios (may be NULL): nx * ny, row by row; NAN: dark. */
LUM_MUST_USE enum lum_status lum_blocks_compare(const struct lum_blocks_input *input, double *ret_ratios,
                                                struct lum_blocks_result *ret_result, struct lum_error *err);

#endif

/* From the fast frame to the truth: while a scene rests, path traced samples take over from a biased frame, tile by tile, as soon
 * as they are the better of the two. Internal to core/render.
 *
 * The shown picture is c = w y + (1 - w) b, with b the frame and y the mean of the samples so far. y is unbiased and its
 * noise independent of b, so the expected squared error is w^2 v + (1 - w)^2 e with v the variance of y and e the
 * squared error of b. The least would have w = e / (e + v); for the eye, to which grain is worse than a smooth error, v counts
 * several times. Both are measured: the samples are kept in two independent halves
 * A and B, so v = (A - B)^2 / 4, and (b - A)(b - B) is an unbiased estimate of e, since the noise of A and B cancels in the
 * mean (algorithms B3). Means are over a tile and its eight neighbours. The frame gets better, too: when the samples have
 * doubled, and in the end every so many, it is made again with finer shadows, as long as there are any. */
#ifndef LUM_CORE_RENDER_REFINE_H
#define LUM_CORE_RENDER_REFINE_H

#include "core/render/frame.h"

/* Sums over the pixels of a tile, of luminance. */
struct lum_tile_error {
    double frame, noise, mean; /* (b - A)(b - B); (A - B)^2 / 4; (A + B) / 2 */
    float weight;              /* of the samples */
};
struct lum_refinement {
    struct lum_film truth;
    uint32_t *tile_spp;    /* of truth */
    struct lum_rgb *frame; /* b: w * h */
    bool taken;              /* there is one */
    bool finest;             /* its shadows are as fine as they get */
    uint32_t n_frames;       /* that were begun of the picture */
    uint32_t next_frame_spp; /* samples at which the next one is due */
    struct lum_tile_error *errors;
    double error_rel;      /* of what lum_refine_blend made: root mean square error over mean luminance; NAN: unknown */
};

LUM_MUST_USE enum lum_status lum_refine_init(struct lum_refinement *r, const struct lum_tiling *tiling, struct lum_error *err);
void lum_refine_finish(struct lum_refinement *r); /* accepts a zeroed one */

/* Forgets all samples, and the frame. */
void lum_refine_begin(struct lum_refinement *r, const struct lum_tiling *tiling);
/* Takes the film as the frame. */
void lum_refine_take(struct lum_refinement *r, const struct lum_tiling *tiling, const struct lum_film *frame);

/* Writes the blend to film. Every pixel has as many samples in one half as in the other. */
void lum_refine_blend(struct lum_refinement *r, const struct lum_tiling *tiling, struct lum_film *film, uint64_t *nonfinite);

#endif

/* The fast frame corrected by what path traced samples say of it.
 *
 * The frame F is biased and without noise, the samples P of the same picture are noisy and without bias. Their residual
 * P - F is small, smooth where the frame is wrong smoothly, and its mean over many pixels is known long before any
 * pixel of P is. So
 *
 *   picture = F + albedo * filter((P - F) / albedo)
 *
 * What the eye sees that shines by itself, such as lamps and skies, is no part of F and P: no filter takes it
 * elsewhere. Of that a pixel shows the mean of its samples, and of the frame as if it were one more.
 *
 * Samples are divided by the albedo that they met, which is then that of the pixel: textures, which pixels of the frame
 * show the middle of, are no noise. The frame is as bright as its light, whatever its pixel's middle is painted like.
 *
 * The frame is a control variate, whose remainder is filtered along surfaces, as widely as each place allows. The
 * samples come in two independent halves, which tell how widely. With A_k and B_k the residuals of the two after filter
 * level k (0: as they are),
 *
 *   error of level k = ((A_k - B_0)^2 + (B_k - A_0)^2) / 2 - (A_0 - B_0)^2 / 2 - (A_k - B_k)^2 / 4
 *   noise in that    = (A_k - B_k)^2 / 4
 *
 * are unbiased for the mean of both halves, since their noise is independent; the first is bias and noise, the second
 * noise alone. One more level is none at all, the frame as it is: its error is that of the widest level without its
 * noise, and (A_k + S) (B_k + S) of it, with S the pixel's share of outliers (outliers.h), which it then does without;
 * what that leaves out of the samples' light goes to the pixels around. Each pixel takes the levels with the least
 * error, so that the picture ends at the mean of P itself. It chooses by its neighbours' errors: then its own A and B
 * tell, by the same formula, what the error of the picture is.
 *
 * Filter: a-trous wavelets that stop at edges (Dammertz et al. 2010). Choice by cross-validation: Rousselle et al.
 * 2012. Internal to core/render. */
#ifndef LUM_CORE_RENDER_RESIDUAL_H
#define LUM_CORE_RENDER_RESIDUAL_H

#include "core/film/error_map.h"
#include "core/render/deferred.h"

struct lum_residual_memory;

struct lum_residual {
    const struct lum_rgb *frame; /* F: w * h */
    const struct lum_rgb *shine; /* what the frame shows besides, if truth keeps what is first; else NULL */
    /* P: halves A and B. Where a half has no sample, that of the pixel beside it is taken, in the same pair of columns
     * and on the same surface; where there is none either, the half gives nothing. */
    const struct lum_film *truth;
    const struct lum_surfaces *guide; /* what the eye sees */
    const uint32_t *neighbours; /* that the frame was smoothed by at edges (lum_edge_neighbours); NULL: it was not */
    float per_pixel;            /* size of a pixel at distance 1 */
    struct lum_film *picture;   /* out */
    /* out: sums over the pixels, of luminance */
    double error, mean; /* squared error, and the picture */
    double doubt; /* standard deviation of error, an estimate that may be below 0: from its terms, block by block */
    uint64_t nonfinite; /* must be 0 */
};

/* Keeps its memory in *memory from call to call (NULL at first); freed by lum_residual_finish. On failure the picture
 * is as before, or, LUM_ERR_CANCELLED, in part. The result does not depend on the number of threads. */
LUM_MUST_USE enum lum_status lum_residual_apply(struct lum_residual *r, struct lum_residual_memory **memory,
                                                const struct lum_stage_runner *runner, struct lum_error *err);
void lum_residual_finish(struct lum_residual_memory *memory); /* accepts NULL */

/* Where the picture that was last made is off. Thread: none may write the memory. */
void lum_residual_add_errors(const struct lum_residual_memory *memory, struct lum_error_map *map);

#endif

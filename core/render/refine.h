/* From the fast frame to the truth: while a scene rests, path traced samples correct a biased frame, first where many
 * pixels agree and in the end pixel by pixel (residual.h). Internal to core/render. */
#ifndef LUM_CORE_RENDER_REFINE_H
#define LUM_CORE_RENDER_REFINE_H

#include "core/render/residual.h"

struct lum_refinement {
    struct lum_film truth;
    uint32_t *tile_spp;    /* of truth */
    struct lum_rgb *frame; /* the fast frame, w * h, without what shines by itself: */
    struct lum_rgb *shine;
    bool taken;        /* there is one */
    uint32_t next_spp; /* samples at which the picture is next made of both */
    bool owed;         /* it is due, and not made: that was cut short */
    struct lum_residual_memory *memory;
    struct lum_film_error error; /* of that picture */
    double noise;                /* bound of the error of the samples alone; NAN: unknown */
};

LUM_MUST_USE enum lum_status lum_refine_init(struct lum_refinement *r, const struct lum_tiling *tiling,
                                             struct lum_error *err);
void lum_refine_finish(struct lum_refinement *r); /* accepts a zeroed one */

/* Forgets all samples, and the frame. */
void lum_refine_begin(struct lum_refinement *r, const struct lum_tiling *tiling);
/* Takes the film as the frame, which the pass has made from what is in deferred. */
void lum_refine_take(struct lum_refinement *r, const struct lum_pass *pass, const struct lum_deferred *deferred,
                     const struct lum_film *frame);

/* The picture is due: spp samples of every pixel, as many in one half as in the other, or one. Making it takes up to as
 * long as a sample of every pixel, hence not after each; but after the last pair of max_spp (0: there is no end). */
bool lum_refine_is_due(const struct lum_refinement *r, uint32_t spp, uint32_t max_spp);
/* Writes it to film. deferred: what the frame was made from. Without memory for it the film stays as it is. */
enum lum_status lum_refine_apply(struct lum_refinement *r, uint32_t spp, const struct lum_deferred *deferred,
                                 float per_pixel, struct lum_film *film, const struct lum_stage_runner *runner);

#endif

/* Direct light of the many lights that have no layer of their own, for methods with soft shadows by samples.
 *
 * Of a light that brings little to a tile only one pixel in 2, 4, 8 or 16 of the pattern asks whether it sees it, and counts
 * it as many times: so a window of 4 x 4 holds a sample of every light, and the more of a light the more it brings. The
 * filter of the pattern puts them together. Lights that cannot bring more than 1/512 of a tile's own brightness all
 * together are left out of it. The sum is kept at the lights' present power: any edit of one makes it anew. */
#ifndef LUM_CORE_ESTIMATOR_CROWD_H
#define LUM_CORE_ESTIMATOR_CROWD_H

#include "core/render/frame.h"

struct lum_crowd {
    bool on;             /* there are such lights, and one of them is soft */
    struct lum_rgb *raw; /* w * h: radiance of a white surface, from the samples of the pixel */
    struct lum_rgb *smooth;
    uint8_t *done, *joined; /* per tile: raw, smooth are up to date */
};

LUM_MUST_USE bool lum_crowd_reserve(struct lum_crowd *crowd, const struct lum_pass *pass); /* false: memory is short */
void lum_crowd_finish(struct lum_crowd *crowd);
void lum_crowd_forget(struct lum_crowd *crowd, const struct lum_pass *pass);

/* Part of tile's light that is summed here: added to radiance, by slot. */
void lum_crowd_add(const struct lum_pass *pass, uint32_t tile, uint32_t n_pixels, struct lum_rgb *inout_radiance);

extern const struct lum_estimator lum_crowd_trace, lum_crowd_join;

#endif

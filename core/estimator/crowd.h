/* Direct light of the many lights that have no layer of their own, for methods with soft shadows by samples.
 *
 * Of a light that brings little to a tile only one pixel in 2, 4, 8 or 16 of the pattern asks whether it sees it, and counts
 * it as many times: so a window of 4 x 4 holds a sample of every light, and the more of a light the more it brings. The
 * filter of the pattern puts them together. Lights that cannot bring more than 1/512 of a tile's own brightness all
 * together are left out of it. The sum is kept at the lights' present power: any edit of one makes it anew.
 *
 * That takes no ray: which samples see their light is kept in two bits each, and which samples there are is decided by the
 * power that each light had when it was first seen to shine, unless it has become LUM_CROWD_BRIGHTER times as bright since. A view
 * that is opened later may take others, as with virtual point lights. */
#ifndef LUM_CORE_ESTIMATOR_CROWD_H
#define LUM_CORE_ESTIMATOR_CROWD_H

#include "core/render/frame.h"

#define LUM_CROWD_BYTES ((size_t)256 << 20) /* of bits; 1440 x 900: 800 lights. With more of them nothing is kept */
#define LUM_CROWD_BRIGHTER 4.0f

struct lum_crowd_light {
    struct lum_vec3 p; /* of the ball around it, scene space */
    float radius;
    float reference; /* luminance of the power by which its samples are planned; 0: it has not shone yet */
};

struct lum_crowd {
    bool on;             /* there are such lights, and one of them is soft */
    struct lum_rgb *raw; /* w * h: radiance of a white surface, from the samples of the pixel */
    struct lum_rgb *smooth;
    struct lum_rgb *gloss;  /* same: what else the samples bring */
    uint8_t *done, *joined; /* per tile: raw, smooth are up to date */
    uint8_t *cut;           /* per tile: octaves of lights that are sampled; CUT_OPEN: not decided (crowd.c) */
    struct lum_crowd_light *lights; /* by light of the snapshot */
    uint8_t *seen;          /* by tile, light and pixel, two bits: asked, visible. NULL: there is no room */
    uint32_t n_lights;      /* that there is room for */
};

/* Makes it ready for the lights of the pass's snapshot. False: memory is short. */
LUM_MUST_USE bool lum_crowd_reserve(struct lum_crowd *crowd, const struct lum_pass *pass);
void lum_crowd_finish(struct lum_crowd *crowd);
/* Nothing is known any more, not even which lights there are; or only what their powers are. */
void lum_crowd_forget(struct lum_crowd *crowd, const struct lum_pass *pass);
void lum_crowd_relight(struct lum_crowd *crowd, const struct lum_pass *pass);

/* Part of tile's light that is summed here: added to radiance, by slot. */
void lum_crowd_add(const struct lum_pass *pass, uint32_t tile, uint32_t n_pixels, struct lum_rgb *inout_radiance);

extern const struct lum_estimator lum_crowd_trace, lum_crowd_join;

#endif

/* Direct light of the many lights that have no layer of their own, for methods with soft shadows by samples.
 *
 * Of a light that brings little to a tile only one pixel in 2, 4, ... 256 asks whether it sees it, and counts it as many
 * times: so a window of 4 x 4, 8 x 8 or 16 x 16 pixels holds a sample of every light, and the more of a light the more it
 * brings. Filters as wide as these windows put them together (crowd_join.c): a light that brings 1/1000 has shadows without
 * detail, and costs a ray every 64 pixels. Lights that cannot bring more than 1/512 of a tile's own brightness all together
 * are left out of it. The sum is kept at the lights' present power: any edit of one makes it anew.
 *
 * That takes no ray: which samples see their light is kept in two bits each, and which samples there are is decided by the
 * power that each light had when it was first seen to shine, unless it has become LUM_CROWD_BRIGHTER times as bright since,
 * nearly all other light of the tile is off, or something moved or was painted. A view that is opened later may take
 * others, as with virtual point lights. What moves makes only those samples forgotten whose rays it can have met. */
#ifndef LUM_CORE_EFFECT_DIRECT_CROWD_H
#define LUM_CORE_EFFECT_DIRECT_CROWD_H

#include "core/pass/pass.h"

#define LUM_CROWD_BYTES ((size_t)256 << 20) /* of bits; 1440 x 900: 800 lights. With more of them nothing is kept */
#define LUM_CROWD_BRIGHTER 4.0f

struct lum_crowd_light {
    struct lum_light light; /* as its bits know it */
    struct lum_vec3 p;      /* of the ball around it, scene space */
    float radius;
    float reference; /* luminance of the power by which its samples are planned; 0: it has not shone yet */
};

/* What is summed apart, as pixels that it is filtered over have other things in common. */
enum lum_crowd_part {
    LUM_CROWD_DIFFUSE, /* radiance of a white surface */
    LUM_CROWD_GLOSS,   /* what else the samples bring */
    LUM_CROWD_PARTS
};

#define LUM_CROWD_WINDOWS 3u /* of 4, 8 and 16 pixels a side */

#define LUM_CUT_OPEN UINT8_MAX            /* not decided */
#define LUM_CUT_FORGOTTEN (UINT8_MAX - 1) /* nor do the tile's bits mean anything */

struct lum_crowd {
    bool on; /* there are such lights, and one of them is soft */
    /* w * h each: from lights that a window holds a sample of; the last, when all are joined: the filtered sum of all */
    struct lum_rgb *sum[LUM_CROWD_PARTS][LUM_CROWD_WINDOWS];
    _Atomic bool used[LUM_CROWD_WINDOWS]; /* some sample is in it */
    uint8_t *done;                        /* per tile: its samples are in the sums */
    uint8_t *joined;                      /* per packet: steps of joining that it has gone through */
    uint8_t *cut;                         /* per tile: octaves of lights that are sampled (crowd_trace.c), or LUM_CUT_ */
    struct lum_crowd_light *lights;       /* by light of the snapshot */
    uint8_t *seen;     /* by tile, light and pixel, two bits: asked, visible. NULL: there is no room */
    uint32_t n_lights; /* that there is room for */
    bool moved;        /* lights may have: lum_crowd_reserve forgets who sees those that did */
};

#define LUM_CROWD_TILE_BYTES (LUM_TILE_PIXELS / 4u)
/* The bits of a light in a tile, by slot. */
static inline uint8_t *lum_crowd_bits(const struct lum_crowd *c, uint32_t tile, uint32_t light)
{
    return c->seen + ((size_t)tile * c->n_lights + light) * LUM_CROWD_TILE_BYTES;
}

/* Makes it ready for the lights of the pass's snapshot. False: memory is short. */
LUM_MUST_USE bool lum_crowd_reserve(struct lum_crowd *crowd, const struct lum_pass *pass);
void lum_crowd_finish(struct lum_crowd *crowd);
/* Nothing is known any more, not even which lights there are. */
void lum_crowd_forget(struct lum_crowd *crowd, const struct lum_pass *pass);
/* What is known is added up anew: at other powers alone; or planned anew, too. */
void lum_crowd_relight(struct lum_crowd *crowd, const struct lum_pass *pass);
void lum_crowd_reshade(struct lum_crowd *crowd, const struct lum_pass *pass);
/* The same after what pass->swept says, which is known: of what may have changed it is forgotten, and who sees which light. */
void lum_crowd_follow_motion(struct lum_crowd *crowd, const struct lum_pass *pass);

/* Part of tile's light that is summed here: added to radiance, by slot. */
void lum_crowd_add(const struct lum_pass *pass, uint32_t tile, uint32_t n_pixels, struct lum_rgb *inout_radiance);

#endif

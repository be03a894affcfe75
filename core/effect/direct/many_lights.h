/* Direct light of the many lights that have no layer of their own, for methods with soft shadows by samples.
 *
 * Of a light that brings little to a tile only one pixel in 2, 4, ... 256 asks whether it sees it, and counts it as
 * many times: so a window of 4 x 4, 8 x 8 or 16 x 16 pixels holds a sample of every light, and the more of a light the
 * more it brings. Filters as wide as these windows put them together (many_lights_join.c): a light that brings 1/1000
 * has shadows without detail, and costs a ray every 128 pixels. Lights that cannot bring more than 1/512 of a tile's
 * own brightness all together are left out of it. The sum is kept at the lights' present power: any edit of one makes
 * it anew.
 *
 * That takes no ray: which samples see their light is kept in two bits each, and which samples there are is decided by
 * the power that each light had when it was first seen to shine, unless it has become LUM_MANY_LIGHTS_BRIGHTER times as
 * bright since, nearly all other light of the tile is off, or something moved or was painted. A view that is opened
 * later may take others, as with virtual point lights. What moves makes only those samples forgotten whose rays it can
 * have met. */
#ifndef LUM_CORE_EFFECT_DIRECT_MANY_LIGHTS_H
#define LUM_CORE_EFFECT_DIRECT_MANY_LIGHTS_H

#include "core/pass/pass.h"

#define LUM_MANY_LIGHTS_BYTES                                                                                          \
    ((size_t)256 << 20) /* of bits; 1440 x 900: 800 lights. With more of them nothing is kept */
#define LUM_MANY_LIGHTS_BRIGHTER 4.0f

struct lum_sampled_light {
    struct lum_light light; /* as its bits know it */
    uint32_t salt;          /* by its id: of its points, and of which pixels take them */
    struct lum_vec3 p;      /* of the ball around it, scene space */
    float radius;
    float reference; /* luminance of the power by which its samples are planned; 0: it has not shone yet */
};

/* What is summed apart, as pixels that it is filtered over have other things in common. */
enum lum_many_lights_part {
    LUM_MANY_LIGHTS_DIFFUSE, /* radiance of a white surface */
    LUM_MANY_LIGHTS_GLOSS,   /* what else the samples bring */
    LUM_MANY_LIGHTS_PARTS
};

#define LUM_MANY_LIGHTS_WINDOWS 3u /* of 4, 8 and 16 pixels a side */

#define LUM_CUT_OPEN UINT8_MAX            /* not decided */
#define LUM_CUT_FORGOTTEN (UINT8_MAX - 1) /* nor do the tile's bits mean anything */

struct lum_many_lights {
    bool on; /* there are such lights, and one of them is soft */
    /* w * h each: from lights that a window holds a sample of; the last, when all are joined: the filtered sum of all
     */
    struct lum_rgb *sum[LUM_MANY_LIGHTS_PARTS][LUM_MANY_LIGHTS_WINDOWS];
    _Atomic bool used[LUM_MANY_LIGHTS_WINDOWS]; /* some sample is in it */
    struct lum_memo summed;                     /* by tile: its samples are in the sums */
    struct lum_memo joined;                     /* by cell: steps of joining that it has gone through */
    uint8_t *cut; /* per tile: octaves of lights that are sampled (many_lights_trace.c), or LUM_CUT_ */
    struct lum_sampled_light *lights; /* by light of the snapshot */
    uint8_t *visibility;              /* by tile, light and pixel, two bits: asked, visible. NULL: there is no room */
    uint32_t n_lights;                /* that there is room for */
    bool moved;                       /* lights may have: lum_many_lights_reserve forgets who sees those that did */
};

#define LUM_MANY_LIGHTS_TILE_BYTES (LUM_TILE_PIXELS / 4u)
/* The bits of a light in a tile, by slot. */
static inline uint8_t *lum_many_lights_bits(const struct lum_many_lights *c, uint32_t tile, uint32_t light)
{
    return c->visibility + ((size_t)tile * c->n_lights + light) * LUM_MANY_LIGHTS_TILE_BYTES;
}

/* Makes it ready for the lights of the pass's snapshot. False: memory is short. */
LUM_MUST_USE bool lum_many_lights_reserve(struct lum_many_lights *many_lights, const struct lum_pass *pass);
void lum_many_lights_finish(struct lum_many_lights *many_lights);
/* Nothing is known any more, not even which lights there are. */
void lum_many_lights_forget(struct lum_many_lights *many_lights, const struct lum_pass *pass);
/* What is known is added up anew: at other powers alone; or planned anew, too. */
void lum_many_lights_relight(struct lum_many_lights *many_lights);
void lum_many_lights_reshade(struct lum_many_lights *many_lights, const struct lum_pass *pass);
/* The same after what pass->motion_mask says, which is known: of what may have changed it is forgotten, and who sees
 * which light. */
void lum_many_lights_follow_motion(struct lum_many_lights *many_lights, const struct lum_pass *pass);

/* Part of tile's light that is summed here: added to radiance, by slot. */
void lum_many_lights_add(const struct lum_pass *pass, uint32_t tile, uint32_t n_pixels, struct lum_rgb *inout_radiance);

#endif

/* Asks whether pixels see samples of a light: what the stages that trace have in common. */
#ifndef LUM_CORE_EFFECT_AREA_SHADOW_PENUMBRA_ASK_H
#define LUM_CORE_EFFECT_AREA_SHADOW_PENUMBRA_ASK_H

#include "core/effect/area_shadow/penumbra.h"
#include "core/interleave/interleave.h"

/* Shadow rays of one layer that wait to be traced together. */
struct lum_penumbra_batch {
    const struct lum_pass *pass;
    struct lum_layer *layer;
    struct lum_counters *counters;
    struct lum_rays rays;
    size_t pixel[LUM_RAY_BATCH];
    uint16_t bit[LUM_RAY_BATCH];
    uint32_t n_asked; /* samples */
};

void lum_penumbra_begin(struct lum_penumbra_batch *ret_batch, const struct lum_pass *pass, struct lum_layer *layer,
                        struct lum_counters *counters);
/* Finds out whether the pixel sees sample k, which it does not know; at the latest when flushed. */
void lum_penumbra_ask(struct lum_penumbra_batch *b, const struct lum_penumbra_view *view, uint32_t k);
void lum_penumbra_flush(struct lum_penumbra_batch *b);

/* ---- in a packet ---- */

#define LUM_SOFT_ACROSS (LUM_PACKET_SIDE / LUM_SOFT_SIDE)

/* Some of the tiles of the pattern in a packet. */
struct lum_soft_sets {
    bool in[LUM_SOFT_ACROSS * LUM_SOFT_ACROSS];
};

/* The one that pixel (x, y) of the packet is in. */
static inline uint32_t lum_soft_set_at(uint32_t x, uint32_t y)
{
    return y / LUM_SOFT_SIDE * LUM_SOFT_ACROSS + x / LUM_SOFT_SIDE;
}

/* Which strata are asked for first: of lights without a closed form, whose light is the sum of the samples, all. */
uint16_t lum_penumbra_first_points(const struct lum_pass *pass, const struct lum_layer *layer);
/* Asks those pixels of the packet's tiles of the pattern in `sets` that begin with one of these strata for it; and flushes. */
void lum_penumbra_trace(struct lum_penumbra_batch *b, struct lum_tile_rect r, uint16_t strata, const struct lum_soft_sets *sets);
/* Counts the samples of the packet's tiles of the pattern. */
void lum_penumbra_count(const struct lum_pass *pass, struct lum_soft *s, struct lum_tile_rect r);

#endif

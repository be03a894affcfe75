/* Asks whether pixels see samples of a light: what the stages that trace have in common. */
#ifndef LUM_CORE_EFFECT_AREA_SHADOW_AREA_TRACE_H
#define LUM_CORE_EFFECT_AREA_SHADOW_AREA_TRACE_H

#include "core/effect/area_shadow/area_shadow.h"
#include "core/interleave/interleave.h"

/* Shadow rays of one layer that wait to be traced together. */
struct lum_area_batch {
    const struct lum_pass *pass;
    struct lum_layer *layer;
    struct lum_counters *counters;
    struct lum_rays rays;
    size_t pixel[LUM_RAY_BATCH];
    uint16_t bit[LUM_RAY_BATCH];
    uint32_t n_asked; /* samples */
};

void lum_area_begin(struct lum_area_batch *ret_batch, const struct lum_pass *pass, struct lum_layer *layer,
                    struct lum_counters *counters);
/* Finds out whether the pixel sees sample k, which it does not know; at the latest when flushed. */
void lum_area_trace(struct lum_area_batch *b, const struct lum_area_view *view, uint32_t k);
void lum_area_flush(struct lum_area_batch *b);

/* ---- in a cell ---- */

#define LUM_AREA_ACROSS (LUM_CELL_SIDE / LUM_AREA_SIDE)

/* Some of the tiles of the pattern in a cell. */
struct lum_area_subsets {
    bool in[LUM_AREA_ACROSS * LUM_AREA_ACROSS];
};

/* The one that pixel (x, y) of the cell is in. */
static inline uint32_t lum_area_subset_at(uint32_t x, uint32_t y)
{
    return y / LUM_AREA_SIDE * LUM_AREA_ACROSS + x / LUM_AREA_SIDE;
}

/* Which strata are asked for first: of lights without a closed form, whose light is the sum of the samples, all. */
uint16_t lum_area_first_points(const struct lum_pass *pass, const struct lum_layer *layer);
/* Asks those pixels of the cell's tiles of the pattern in `subsets` that begin with one of these strata for it; and
 * flushes. */
void lum_area_trace_batch(struct lum_area_batch *b, struct lum_tile_rect r, uint16_t strata,
                          const struct lum_area_subsets *subsets);
/* Counts the samples of the cell's tiles of the pattern. */
void lum_area_count(const struct lum_pass *pass, struct lum_area_visibility *s, struct lum_tile_rect r);

#endif

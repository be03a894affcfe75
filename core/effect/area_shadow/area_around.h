/* What the shadow samples around each pixel of a tile say of one light: all that the stages after the rays ask. Where
 * all samples agree no window is summed up. */
#ifndef LUM_CORE_EFFECT_AREA_SHADOW_AREA_AROUND_H
#define LUM_CORE_EFFECT_AREA_SHADOW_AREA_AROUND_H

#include "core/effect/area_shadow/area_window.h"

#define LUM_AROUND_SIDE (LUM_TILE_SIDE / LUM_AREA_SIDE) /* tiles of the pattern along a side of a tile */
#define LUM_AROUND_SUBSETS (LUM_AROUND_SIDE * LUM_AROUND_SIDE)

/* One tile, one layer at a time. About 40 KiB. */
struct lum_area_around {
    const struct lum_pass *pass;
    const struct lum_layer *layer;
    struct lum_tile_rect r;
    struct lum_tiling subsets;
    bool exact;     /* the layer's light has a closed form */
    uint32_t stale; /* bit y * LUM_AROUND_SIDE + x, by tile of the pattern: those that are asked about */
    uint8_t around[LUM_AROUND_SUBSETS]; /* lum_area_around */
    uint8_t
        says[LUM_TILE_PIXELS]; /* LUM_AREA_ bits of all samples in the window of each pixel, of its surface or not */
    struct lum_area_window window;
};

/* tile: of pass->tiling. */
void lum_area_around_init(struct lum_area_around *ret_around, const struct lum_pass *pass, uint32_t tile);
/* Looks at the samples of a layer, for the tiles of the pattern in `stale`. */
void lum_area_around_read(struct lum_area_around *a, const struct lum_layer *layer, uint32_t stale);
/* The share of the light that pixel (x, y) of the tile gets, which wants it and is in one of these. ret_moments: those
 * behind the share, if the light has no closed form and any of it arrives. */
float lum_area_around_ratio(const struct lum_area_around *a, uint32_t x, uint32_t y, struct lum_moments *ret_moments);

/* Which tile of the pattern pixel (x, y) of a tile is in. */
static inline uint32_t lum_around_subset(uint32_t x, uint32_t y)
{
    return y / LUM_AREA_SIDE * LUM_AROUND_SIDE + x / LUM_AREA_SIDE;
}

/* ---- what is stale ---- */

/* True when nothing that a tile of the picture is resolved from has changed since it was: what a tile takes from others
 * lies within two tiles of the pattern, so in those that touch it. */
bool lum_around_settled(const struct lum_pass *pass, const struct lum_area_visibility *area, uint32_t tile);
/* Joins the hashes of each tile of the pattern in tile r of the picture and of the eight around it: what is made of
 * nine such. Returns those for which that is not what they were made of. hashes, made: per tile of the pattern, of the
 * picture. */
uint32_t lum_around_find_stale(const struct lum_pass *pass, struct lum_tile_rect r, const uint64_t *hashes,
                               const uint64_t *made, uint64_t ret_known[LUM_AROUND_SUBSETS]);
/* Says that these are made now. */
void lum_around_made(const struct lum_pass *pass, struct lum_tile_rect r, uint32_t stale,
                     const uint64_t known[LUM_AROUND_SUBSETS], uint64_t *inout_made);

#endif

/* Which pixels of a pass interpolate records.. */
#ifndef LUM_CORE_EFFECT_INDIRECT_INTERPOLATED_H
#define LUM_CORE_EFFECT_INDIRECT_INTERPOLATED_H

#include "core/effect/indirect/kept_candidates.h"

/* Pixels of the tile that interpolate. coarse: those of a quarter of the resolution; lone: the others. At full
 * resolution all are coarse. */
struct lum_interpolated {
    struct lum_pixel_mask coarse, lone;
    struct lum_kept_candidates kept; /* of all of them */
};
/* Of estimators that interpolate records. */
extern const struct lum_state_kind lum_interpolated_kind;
/* How many tiles have points: those of the picture, and as many again where sheets show what arrives on their far side
 * (lum_tile_is_far). */
static inline uint32_t lum_interpolated_tiles(const struct lum_pass *pass)
{
    return pass->snapshot->has_sheets && pass->on[LUM_EFFECT_TRANSMISSION] ? 2 * pass->tiling.n : pass->tiling.n;
}
/* Nothing comes through sheets in this tile, until somebody says so. False: nobody asks for it. */
bool lum_begin_far_sides(const struct lum_pass *pass, uint32_t tile);
/* A pixel of a sheet shows this irradiance of its far side: as it is, since records are smooth. */
void lum_show_far_side(const struct lum_pass *pass, uint32_t tile, uint32_t slot, struct lum_rgb irradiance);
/* Found once, and kept. Thread: the worker that has the tile. */
struct lum_interpolated *lum_interpolated_of(const struct lum_pass *pass, uint32_t tile);
/* w * h, found with the pixels: from which samples of a quarter of the resolution a pixel takes (lum_upsample_taps). */
const uint8_t *lum_taps_of(const struct lum_pass *pass);

static inline struct lum_pixel_mask lum_interpolated_all(const struct lum_interpolated *s)
{
    struct lum_pixel_mask all;
    for (uint32_t k = 0; k < LUM_PIXEL_MASK_WORDS; k++)
        all.bits[k] = s->coarse.bits[k] | s->lone.bits[k];
    return all;
}

#endif

/* Which pixels of a pass interpolate records.. */
#ifndef LUM_CORE_EFFECT_INDIRECT_SITES_H
#define LUM_CORE_EFFECT_INDIRECT_SITES_H

#include "core/effect/indirect/nearby.h"

/* Pixels of the square that interpolate. coarse: those of a quarter of the resolution; lone: the others. At full resolution all are
 * coarse. */
struct lum_square_sites {
    struct lum_sites coarse, lone;
    struct lum_nearby nearby; /* of all of them */
};
/* Of estimators that interpolate records. */
extern const struct lum_state_kind lum_sites_kind;
/* Found once, and kept. Thread: the worker that has the tile. */
struct lum_square_sites *lum_sites_of(const struct lum_pass *pass, uint32_t tile);
/* w * h, found with the sites: from which samples of a quarter of the resolution a pixel takes (lum_upsample_taps). */
const uint8_t *lum_taps_of(const struct lum_pass *pass);

static inline struct lum_sites lum_sites_all(const struct lum_square_sites *s)
{
    struct lum_sites all;
    for (uint32_t k = 0; k < LUM_SQUARE_WORDS; k++)
        all.bits[k] = s->coarse.bits[k] | s->lone.bits[k];
    return all;
}

#endif

/* Which pixels of a pass interpolate records. Internal to core/estimator. */
#ifndef LUM_CORE_ESTIMATOR_SITES_H
#define LUM_CORE_ESTIMATOR_SITES_H

#include "core/estimator/nearby.h"

/* Pixels of the square that interpolate. coarse: those of a quarter of the resolution; lone: the others. At full resolution all are
 * coarse. */
struct lum_square_sites {
    struct lum_sites coarse, lone;
    struct lum_nearby nearby; /* of all of them */
};
/* Found once, and kept in pass->components. Thread: the worker that has the tile. */
struct lum_square_sites *lum_sites_of(const struct lum_pass *pass, uint32_t tile);

static inline struct lum_sites lum_sites_all(const struct lum_square_sites *s)
{
    struct lum_sites all;
    for (uint32_t k = 0; k < LUM_SQUARE_WORDS; k++)
        all.bits[k] = s->coarse.bits[k] | s->lone.bits[k];
    return all;
}

#endif

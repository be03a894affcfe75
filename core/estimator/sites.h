/* Which pixels of a pass interpolate records. Internal to core/estimator. */
#ifndef LUM_CORE_ESTIMATOR_SITES_H
#define LUM_CORE_ESTIMATOR_SITES_H

#include "core/estimator/square.h"

/* Pixels of the square that interpolate. coarse: those of a quarter of the resolution; lone: the others. At full resolution all are
 * coarse. */
struct lum_square_sites {
    struct lum_sites coarse, lone;
};
/* Found once, and kept in pass->components. Thread: the worker that has the tile. */
const struct lum_square_sites *lum_sites_of(const struct lum_pass *pass, uint32_t tile);

#endif

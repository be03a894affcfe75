/* First hits through pixel centres. */
#ifndef LUM_CORE_PASS_GBUFFER_H
#define LUM_CORE_PASS_GBUFFER_H

#include "core/pass/basis.h"
#include "core/pass/memo.h"
#include "core/pass/surfaces.h"

/* First hits through pixel centres, one batch per tile. */
struct lum_gbuffer {
    struct lum_hits *tiles;
    struct lum_memo made; /* by tile */
    uint64_t stamp;       /* changes with what the buffer shows, but for what lum_motion_mask.changed says */
    struct lum_basis basis;
};

extern const struct lum_estimator lum_stage_gbuffer;

#endif

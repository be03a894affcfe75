/* Which effects a scene calls for: anything else costs nothing. */
#ifndef LUM_CORE_TRACE_DEMAND_H
#define LUM_CORE_TRACE_DEMAND_H

#include "core/trace/effect.h"

/* What the snapshot calls for, and why: the first thing that does, or why nothing does. */
struct lum_demand {
    bool on[LUM_EFFECT_COUNT];
    char why[LUM_EFFECT_COUNT][LUM_ID_MAX + 64];
};
struct lum_snapshot;
void lum_demand_derive(const struct lum_snapshot *snapshot, struct lum_demand *ret_demand);
/* What a view chooses: anti-aliasing, and effects that it forces off or on (bits LUM_EFFECT_BIT; off wins). */
void lum_demand_choose(struct lum_demand *demand, bool antialias, uint32_t effects_off, uint32_t effects_on);

#endif

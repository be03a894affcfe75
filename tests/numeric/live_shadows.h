/* `live` with direct light alone. */
#ifndef LUM_TESTS_NUMERIC_LIVE_SHADOWS_H
#define LUM_TESTS_NUMERIC_LIVE_SHADOWS_H

#include "tests/support/rig.h"

static inline void set_live(struct rig *r, uint32_t budget)
{
    r->settings.method = lum_method_find("live");
    r->settings.effects_off = 1u << LUM_EFFECT_INDIRECT_DIFFUSE;
    r->settings.max_spp = 1;
    r->settings.antialias = false;
    r->settings.shadow_budget = budget;
}

#endif

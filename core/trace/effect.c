#include "core/trace/effect.h"

#include <string.h>

#define TEXT(NAME, name) #name,
const char *const lum_effect_names[LUM_EFFECT_COUNT] = {LUM_EFFECTS(TEXT)};

bool lum_effect_find(const char *name, size_t n_name, enum lum_effect *ret_effect)
{
    for (int e = 0; e < LUM_EFFECT_COUNT; e++)
        if (strlen(lum_effect_names[e]) == n_name && memcmp(lum_effect_names[e], name, n_name) == 0) {
            *ret_effect = (enum lum_effect)e;
            return true;
        }
    return false;
}

const char *lum_ray_kind_name(enum lum_ray_kind kind)
{
    if (kind == LUM_RAY_PRIMARY)
        return "primary";
    if (kind < LUM_RAY_VPL)
        return lum_effect_names[kind - LUM_RAY_PRIMARY - 1];
    return kind == LUM_RAY_VPL ? "vpl" : "probe";
}

#include "core/trace/effect.h"

#include <string.h>

const char *const lum_effect_names[LUM_EFFECT_COUNT] = {
    [LUM_EFFECT_DIRECT] = "direct",           [LUM_EFFECT_SOFT_SHADOW] = "soft_shadow",
    [LUM_EFFECT_ENVIRONMENT] = "environment", [LUM_EFFECT_INDIRECT_DIFFUSE] = "indirect_diffuse",
    [LUM_EFFECT_REFLECTION] = "reflection",   [LUM_EFFECT_TRANSMISSION] = "transmission",
    [LUM_EFFECT_GLOSSY] = "glossy",           [LUM_EFFECT_MEDIA] = "media",
    [LUM_EFFECT_ANTIALIAS] = "antialias",
};

bool lum_effect_find(const char *name, size_t n_name, enum lum_effect *ret_effect)
{
    for (int e = 0; e < LUM_EFFECT_COUNT; e++)
        if (strlen(lum_effect_names[e]) == n_name && memcmp(lum_effect_names[e], name, n_name) == 0) {
            *ret_effect = (enum lum_effect)e;
            return true;
        }
    return false;
}

const char *const lum_ray_kind_names[LUM_RAY_KIND_COUNT] = {
    [LUM_RAY_PRIMARY] = "primary",
    [LUM_RAY_DIRECT] = "direct",
    [LUM_RAY_SOFT_SHADOW] = "soft_shadow",
    [LUM_RAY_ENVIRONMENT] = "environment",
    [LUM_RAY_INDIRECT_DIFFUSE] = "indirect_diffuse",
    [LUM_RAY_REFLECTION] = "reflection",
    [LUM_RAY_TRANSMISSION] = "transmission",
    [LUM_RAY_GLOSSY] = "glossy",
    [LUM_RAY_MEDIA] = "media",
    [LUM_RAY_ANTIALIAS] = "antialias",
    [LUM_RAY_VPL] = "vpl",
    [LUM_RAY_PROBE] = "probe",
};

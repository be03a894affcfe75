#include "core/method/method.h"

#include <stdio.h>
#include <string.h>

#include "core/effect/ais/ais.h"
#include "core/effect/antialias/antialias.h"
#include "core/effect/area_shadow/area_shadow.h"
#include "core/effect/direct/direct.h"
#include "core/effect/fog/airlight.h"
#include "core/effect/fog/scattered.h"
#include "core/effect/gloss/gloss.h"
#include "core/effect/indirect/records.h"
#include "core/effect/path/path.h"
#include "core/effect/specular/specular.h"
#include "core/pass/vpls.h"

#define AIS_EFFECTS                                                                                                    \
    {                                                                                                                  \
        [LUM_EFFECT_DIRECT] = &lum_estimator_shadow, [LUM_EFFECT_SOFT_SHADOW] = &lum_estimator_ais_shadow,             \
        [LUM_EFFECT_ENVIRONMENT] = &lum_estimator_ais_shadow,                                                          \
        [LUM_EFFECT_INDIRECT_DIFFUSE] = &lum_estimator_ais_indirect, [LUM_EFFECT_GLOSSY] = &lum_estimator_ais_gloss,   \
        [LUM_EFFECT_MEDIA] = &lum_estimator_ais_media                                                                  \
    }

/* The thesis' "RT", and what its caches add. */
#define CACHED_EFFECTS(cached)                                                                                         \
    {                                                                                                                  \
        [LUM_EFFECT_DIRECT] = &lum_estimator_shadow, [LUM_EFFECT_SOFT_SHADOW] = &lum_estimator_shadow,                 \
        [LUM_EFFECT_ENVIRONMENT] = &lum_estimator_shadow, [LUM_EFFECT_INDIRECT_DIFFUSE] = &(cached)                    \
    }

static const struct lum_method methods[] = {
    {
        .name = "whitted",
        .summary = "primary rays, direct light with shadows, mirror and glass; no indirect light",
        .serves =
            {
                [LUM_EFFECT_DIRECT] = &lum_estimator_shadow,
                [LUM_EFFECT_SOFT_SHADOW] = &lum_estimator_shadow,
                [LUM_EFFECT_ENVIRONMENT] = &lum_estimator_shadow,
            },
    },
    {
        .name = "igi",
        .summary = "instant global illumination (Wald et al. 2002): interleaved virtual point lights and light samples",
        .pattern = LUM_AIS_SIDE,
        .ais = &lum_ais_igi,
        .serves =
            {
                [LUM_EFFECT_DIRECT] = &lum_estimator_shadow,
                [LUM_EFFECT_SOFT_SHADOW] = &lum_estimator_ais_shadow,
                [LUM_EFFECT_ENVIRONMENT] = &lum_estimator_ais_shadow,
                [LUM_EFFECT_INDIRECT_DIFFUSE] = &lum_estimator_igi_indirect,
                [LUM_EFFECT_GLOSSY] = &lum_estimator_ais_gloss,
            },
        .filters = {&lum_filter_ais},
    },
    {
        .name = "ais",
        .summary = "adaptive interleaved sampling (thesis, chapter 5): refined where its guidance asks for it",
        .pattern = LUM_AIS_SIDE,
        .ais = &lum_ais_adaptive,
        .serves = AIS_EFFECTS,
        .filters = {&lum_filter_ais},
    },
    {
        .name = "ais-max",
        .summary = "the same, refined fully everywhere",
        .pattern = LUM_AIS_SIDE,
        .ais = &lum_ais_full,
        .serves = AIS_EFFECTS,
        .filters = {&lum_filter_ais},
    },
    {
        .name = "irrcache",
        .summary = "irradiance cache (Ward et al. 1988): records sample the hemisphere; shared without a wait (thesis, "
                   "chapter 7)",
        .hard_shadows = true,
        .cache = &lum_cache_irradiance,
        .serves = CACHED_EFFECTS(lum_estimator_cached_free),
    },
    {
        .name = "ic",
        .summary = "instant caching (thesis, chapter 6): records sum virtual point lights; made anew after every edit",
        .hard_shadows = true,
        .cache = &lum_cache_instant,
        .serves = CACHED_EFFECTS(lum_estimator_cached),
        .pattern = 3,
        .filters = {&lum_stage_gloss},
    },
    {
        .name = "tic",
        .summary = "temporal instant caching: the same, and an edit traces only what it may have changed",
        .hard_shadows = true,
        .cache = &lum_cache_temporal,
        .serves = CACHED_EFFECTS(lum_estimator_cached),
        .pattern = 3,
        .filters = {&lum_stage_gloss},
    },
    {
        .name = "live",
        .summary = "soft shadows, fog, indirect light from a cache that edits bring up to date, gloss; then path "
                   "tracing while the scene rests",
        .refines = true,
        .cache = &lum_cache_live,
        .serves =
            {
                [LUM_EFFECT_DIRECT] = &lum_estimator_shadow,
                [LUM_EFFECT_SOFT_SHADOW] = &lum_estimator_area_shadow,
                [LUM_EFFECT_ENVIRONMENT] = &lum_estimator_area_shadow,
                [LUM_EFFECT_INDIRECT_DIFFUSE] = &lum_estimator_cached,
                [LUM_EFFECT_REFLECTION] = &lum_estimator_specular,
                [LUM_EFFECT_TRANSMISSION] = &lum_estimator_specular,
                [LUM_EFFECT_GLOSSY] = &lum_estimator_glossy,
                [LUM_EFFECT_MEDIA] = &lum_estimator_airlight,
                [LUM_EFFECT_SCATTERING] = &lum_estimator_scattered,
                [LUM_EFFECT_ANTIALIAS] = &lum_estimator_edges,
            },
        .pattern = 4,
        .filters = {&lum_stage_gloss, &lum_stage_gloss_wide, &lum_stage_upsample},
    },
    {
        .name = "path",
        .summary = "unbiased path tracing with next-event estimation: the reference",
        .progressive = true,
        .serves =
            {
                [LUM_EFFECT_DIRECT] = &lum_estimator_path,
                [LUM_EFFECT_SOFT_SHADOW] = &lum_estimator_path,
                [LUM_EFFECT_ENVIRONMENT] = &lum_estimator_path,
                [LUM_EFFECT_INDIRECT_DIFFUSE] = &lum_estimator_path,
                [LUM_EFFECT_REFLECTION] = &lum_estimator_path,
                [LUM_EFFECT_TRANSMISSION] = &lum_estimator_path,
                [LUM_EFFECT_GLOSSY] = &lum_estimator_path,
                [LUM_EFFECT_MEDIA] = &lum_estimator_path,
                [LUM_EFFECT_SCATTERING] = &lum_estimator_path,
                [LUM_EFFECT_ANTIALIAS] = &lum_estimator_path,
            },
    },
};

const struct lum_method *lum_methods(size_t *ret_n)
{
    *ret_n = LUM_ARRAY_LEN(methods);
    return methods;
}

const struct lum_method *lum_method_find(const char *name)
{
    for (size_t i = 0; i < LUM_ARRAY_LEN(methods); i++)
        if (strcmp(methods[i].name, name) == 0)
            return &methods[i];
    return NULL;
}

bool lum_method_adds_samples(const struct lum_method *method)
{
    return method->progressive || method->refines;
}

bool lum_method_counts_vpls(const struct lum_method *method)
{
    const struct lum_estimator *indirect = method->serves[LUM_EFFECT_INDIRECT_DIFFUSE];
    return method->cache || (indirect && indirect->then == &lum_stage_vpls);
}

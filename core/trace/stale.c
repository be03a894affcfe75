#include "core/trace/stale.h"

#define BIT(product) (1u << LUM_PRODUCT_##product)

/* In the order of enum lum_edit_kind. */
static const uint32_t made_stale[LUM_EDIT_COUNT] = {
    [LUM_EDIT_GEOMETRY] = BIT(GBUFFER) | BIT(SURFACES) | BIT(VISIBILITY) | BIT(PLACES) | BIT(RESPONSE) | BIT(SHARED) |
                          BIT(COMPONENTS) | BIT(UNIT_LIGHT) | BIT(EDGES) | BIT(VPL_PATHS) | BIT(VPL_FLUX) |
                          BIT(RECORDS) | BIT(AOVS) | BIT(CAUSTICS),
    [LUM_EDIT_MATERIAL] = BIT(SURFACES) | BIT(PLACES) | BIT(RESPONSE) | BIT(SHARED) | BIT(COMPONENTS) |
                          BIT(UNIT_LIGHT) | BIT(EDGES) | BIT(VPL_PATHS) | BIT(VPL_FLUX) | BIT(RECORDS) | BIT(AOVS) |
                          BIT(CAUSTICS),
    [LUM_EDIT_LIGHT_SHAPE] = BIT(SURFACES) | BIT(OWN_LAYER) | BIT(PLACES) | BIT(SHARED) | BIT(COMPONENTS) |
                             BIT(UNIT_LIGHT) | BIT(EDGES) | BIT(VPL_PATHS) | BIT(VPL_FLUX) | BIT(RECORDS) |
                             BIT(CAUSTICS),
    /* Sums alone. No first hit, no visibility, no response: they are kept, so that a dimmed light traces no ray. */
    [LUM_EDIT_LIGHT_POWER] = BIT(SHARED) | BIT(COMPONENTS) | BIT(VPL_FLUX) | BIT(RECORDS),
    [LUM_EDIT_MEDIUM] =
        BIT(RESPONSE) | BIT(SHARED) | BIT(COMPONENTS) | BIT(UNIT_LIGHT) | BIT(VPL_PATHS) | BIT(VPL_FLUX) | BIT(RECORDS),
    [LUM_EDIT_CAMERA] = BIT(GBUFFER) | BIT(SURFACES) | BIT(VISIBILITY) | BIT(RESPONSE) | BIT(SHARED) | BIT(COMPONENTS) |
                        BIT(UNIT_LIGHT) | BIT(EDGES) | BIT(AOVS),
    [LUM_EDIT_METHOD] =
        BIT(LAYERS) | BIT(VISIBILITY) | BIT(RESPONSE) | BIT(SHARED) | BIT(COMPONENTS) | BIT(UNIT_LIGHT) | BIT(EDGES),
    [LUM_EDIT_DEPTH] = BIT(RESPONSE) | BIT(SHARED) | BIT(COMPONENTS) | BIT(UNIT_LIGHT),
    [LUM_EDIT_SHADOW_SAMPLES] = BIT(VISIBILITY) | BIT(RESPONSE) | BIT(SHARED) | BIT(COMPONENTS) | BIT(UNIT_LIGHT),
    [LUM_EDIT_VPLS] = BIT(COMPONENTS),
    [LUM_EDIT_CACHE] = BIT(COMPONENTS),
    /* As if materials that the eye sees had changed, and no other. */
    [LUM_EDIT_QUANTITY] = BIT(SURFACES) | BIT(RESPONSE) | BIT(SHARED) | BIT(COMPONENTS) | BIT(UNIT_LIGHT) | BIT(EDGES),
};

bool lum_is_stale(uint32_t edits, enum lum_product product)
{
    for (int e = 0; e < LUM_EDIT_COUNT; e++)
        if (edits >> e & 1u && made_stale[e] >> product & 1u)
            return true;
    return false;
}

uint32_t lum_edits_of_versions(const struct lum_versions *a, const struct lum_versions *b)
{
    return lum_edit_if(a->geometry != b->geometry, LUM_EDIT_GEOMETRY) |
           lum_edit_if(a->material != b->material, LUM_EDIT_MATERIAL) |
           lum_edit_if(a->light_shape != b->light_shape, LUM_EDIT_LIGHT_SHAPE) |
           lum_edit_if(a->light_power != b->light_power, LUM_EDIT_LIGHT_POWER) |
           lum_edit_if(a->medium != b->medium, LUM_EDIT_MEDIUM);
}

struct lum_versions lum_versions_seen(const struct lum_snapshot *s, bool media)
{
    struct lum_versions v = s->versions;
    if (!media || s->n_media == 0)
        v.medium = 0; /* that of no scene: they count from 1 */
    return v;
}

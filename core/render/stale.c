#include "core/render/stale.h"

#include <string.h>

#include "core/render/frame.h"

#define BIT(product) (1u << LUM_PRODUCT_##product)

/* DESIGN 2, in the order of enum lum_edit_kind. */
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
};

bool lum_is_stale(uint32_t edits, enum lum_product product)
{
    for (int e = 0; e < LUM_EDIT_COUNT; e++)
        if (edits >> e & 1u && made_stale[e] >> product & 1u)
            return true;
    return false;
}

static uint32_t bit_if(bool changed, enum lum_edit_kind edit)
{
    return changed ? LUM_EDIT_BIT(edit) : 0;
}

uint32_t lum_edits_of_versions(const struct lum_versions *a, const struct lum_versions *b)
{
    return bit_if(a->geometry != b->geometry, LUM_EDIT_GEOMETRY) |
           bit_if(a->material != b->material, LUM_EDIT_MATERIAL) |
           bit_if(a->light_shape != b->light_shape, LUM_EDIT_LIGHT_SHAPE) |
           bit_if(a->light_power != b->light_power, LUM_EDIT_LIGHT_POWER) |
           bit_if(a->medium != b->medium, LUM_EDIT_MEDIUM);
}

bool lum_camera_equal(const struct lum_camera *a, const struct lum_camera *b)
{
    return a->position.x == b->position.x && a->position.y == b->position.y && a->position.z == b->position.z &&
           a->target.x == b->target.x && a->target.y == b->target.y && a->target.z == b->target.z &&
           a->up.x == b->up.x && a->up.y == b->up.y && a->up.z == b->up.z && a->vfov_deg == b->vfov_deg;
}

uint32_t lum_edits_of_settings(const struct lum_view_settings *a, const struct lum_view_settings *b)
{
    bool same_eye = lum_camera_equal(&a->camera, &b->camera) && a->w == b->w && a->h == b->h;
    bool same_method = a->method == b->method && a->seed == b->seed && a->carry_shadows == b->carry_shadows &&
                       a->layers_bytes == b->layers_bytes;
    bool same_cache =
        a->storage == b->storage && a->cache_accuracy == b->cache_accuracy && a->deterministic == b->deterministic;
    return bit_if(!same_eye, LUM_EDIT_CAMERA) | bit_if(!same_method, LUM_EDIT_METHOD) |
           bit_if(a->max_depth != b->max_depth, LUM_EDIT_DEPTH) |
           bit_if(a->shadow_samples != b->shadow_samples, LUM_EDIT_SHADOW_SAMPLES) |
           bit_if(a->n_vpls != b->n_vpls, LUM_EDIT_VPLS) | bit_if(!same_cache, LUM_EDIT_CACHE);
}

bool lum_view_same_picture(const struct lum_view_settings *a, const struct lum_view_settings *b)
{
    return lum_edits_of_settings(a, b) == 0 && a->antialias == b->antialias && a->effects_off == b->effects_off &&
           a->effects_on == b->effects_on;
}

struct lum_versions lum_versions_seen(const struct lum_snapshot *s, bool media)
{
    struct lum_versions v = s->versions;
    if (!media || s->n_media == 0)
        v.medium = 0; /* that of no scene: they count from 1 */
    return v;
}

/* A kind of light that is switched off to its last lamp calls for nothing, but what was found out about it stays true:
 * kinds of light differ only where the settings say so. Without any light, nothing is shown of what depends on effects.
 */
static bool same_effects(const struct lum_basis *basis, const struct lum_pass *pass)
{
    const uint32_t lights = LUM_EFFECT_BIT(LUM_EFFECT_DIRECT) | LUM_EFFECT_BIT(LUM_EFFECT_SOFT_SHADOW) |
                            LUM_EFFECT_BIT(LUM_EFFECT_ENVIRONMENT);
    bool same = ((basis->settings.effects_off ^ pass->settings->effects_off) & lights) == 0;
    for (uint32_t e = 0; e < LUM_EFFECT_COUNT; e++)
        same =
            same && (LUM_EFFECT_BIT(e) & lights || pass->snapshot->lights.n_active == 0 || basis->on[e] == pass->on[e]);
    return same;
}

uint32_t lum_basis_renew(struct lum_basis *basis, const struct lum_pass *pass)
{
    uint32_t edits = LUM_EDITS_ALL;
    if (basis->valid) {
        edits = lum_edits_of_versions(&basis->versions, &pass->snapshot->versions) |
                lum_edits_of_settings(&basis->settings, pass->settings) |
                bit_if(!same_effects(basis, pass), LUM_EDIT_METHOD);
    }
    basis->valid = true;
    basis->versions = pass->snapshot->versions;
    basis->settings = *pass->settings;
    if (pass->snapshot->lights.n_active > 0)
        memcpy(basis->on, pass->on, sizeof basis->on);
    return edits;
}

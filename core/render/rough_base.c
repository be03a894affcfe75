#include "core/render/rough_base.h"

#include <string.h>

#include "core/trace/stale.h"

void lum_rough_base_finish(struct lum_rough_base *base)
{
    lum_free(base->fine);
    lum_free(base->coarse);
    lum_free(base->kept);
    *base = (struct lum_rough_base){0};
}

void lum_rough_rest(const struct lum_pass *pass, uint32_t tile, struct lum_rgb *ret_radiance)
{
    const struct lum_light_table *lights = &pass->snapshot->lights;
    const struct lum_layers *l = pass->layers;
    struct lum_tile_rect r = lum_tile_at(&pass->tiling, tile);
    struct lum_rgb known[LUM_TILE_PIXELS] = {{0}};
    bool media = pass->on[LUM_EFFECT_MEDIA] && !pass->settings->illuminance;
    for (uint32_t a = 0; a < lights->n_active; a++) {
        uint32_t k = l->layer_of[lights->active[a]];
        if (k != LUM_NO_OBJECT)
            lum_layer_add(&l->layers[k], tile, r.w * r.h, lights->lights[lights->active[a]].power, known);
    }
    for (uint32_t i = 0; i < r.w * r.h; i++) {
        uint32_t x = r.x + i % r.w, y = r.y + i / r.w;
        size_t pixel = (size_t)y * pass->tiling.w + x;
        struct lum_rgb part = media ? lum_rgb_mul(known[i], lum_pass_transmittance(pass, pixel)) : known[i];
        ret_radiance[i] = lum_rgb_mad(lum_film_mean(pass->film, x, y), part, -1.0f);
    }
}

static bool take(struct lum_rgb **ret_rest, const struct lum_pass *pass)
{
    struct lum_rgb *rest = lum_calloc((size_t)pass->tiling.w * pass->tiling.h, sizeof *rest);
    struct lum_rgb of_tile[LUM_TILE_PIXELS];
    for (uint32_t t = 0; rest && t < pass->tiling.n; t++) {
        struct lum_tile_rect r = lum_tile_at(&pass->tiling, t);
        lum_rough_rest(pass, t, of_tile);
        for (uint32_t y = 0; y < r.h; y++)
            memcpy(rest + (size_t)(r.y + y) * pass->tiling.w + r.x, of_tile + y * r.w, r.w * sizeof *rest);
    }
    *ret_rest = rest;
    return rest;
}

void lum_rough_base_take(struct lum_rough_base *base, const struct lum_pass *fine, const struct lum_pass *coarse)
{
    lum_rough_base_finish(base);
    base->kept = lum_calloc(fine->tiling.n, 1);
    base->coarse_w = coarse->tiling.w, base->coarse_h = coarse->tiling.h;
    base->settings = *fine->settings;
    base->versions = fine->snapshot->versions;
    if (!base->kept || !take(&base->fine, fine) || !take(&base->coarse, coarse))
        lum_rough_base_finish(base);
    else
        memset(base->kept, 1, fine->tiling.n);
}

bool lum_rough_base_follow(struct lum_rough_base *base, const struct lum_pass *fine, const struct lum_pass *coarse)
{
    const uint32_t followed =
        LUM_EDIT_BIT(LUM_EDIT_GEOMETRY) | LUM_EDIT_BIT(LUM_EDIT_LIGHT_SHAPE) | LUM_EDIT_BIT(LUM_EDIT_LIGHT_POWER);
    const struct lum_versions *now = &fine->snapshot->versions;
    if (!base->fine)
        return false;
    bool moved = now->geometry != base->versions.geometry;
    if (!lum_view_same_picture(&base->settings, fine->settings) ||
        base->settings.preview_eased != fine->settings->preview_eased || base->coarse_w != coarse->tiling.w ||
        base->coarse_h != coarse->tiling.h || lum_edits_of_versions(&base->versions, now) & ~followed ||
        (moved && !lum_motion_mask_is_known(fine->motion_mask))) {
        lum_rough_base_finish(base);
        return false;
    }
    for (uint32_t t = 0; moved && t < fine->tiling.n; t++)
        if (lum_motion_mask_near_tile(fine->motion_mask, &fine->tiling, t))
            base->kept[t] = 0;
    base->versions.geometry = now->geometry;
    return true;
}

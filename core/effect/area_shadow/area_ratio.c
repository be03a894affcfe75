/* The visible share of each light that is known in closed form, around every pixel: the first half of resolving. What
 * it found is printed, too: where it stays what it was, nothing is resolved anew. */
#include "core/effect/area_shadow/area_around.h"

#include <string.h>

#include "core/light/irradiance.h"

static uint64_t add_to_hash(uint64_t hash, float ratio)
{
    uint32_t bits;
    memcpy(&bits, &ratio, sizeof bits);
    hash = (hash ^ bits) * 0x9e3779b97f4a7c15u;
    return hash ^ hash >> 32;
}

/* One tile of the pattern, number k of those in the tile. */
static void share_subset(const struct lum_area_around *a, struct lum_area_visibility *area, uint32_t k)
{
    uint32_t x0 = k % LUM_AROUND_SIDE * LUM_AREA_SIDE, y0 = k / LUM_AROUND_SIDE * LUM_AREA_SIDE;
    uint32_t subset = (a->r.y + y0) / LUM_AREA_SIDE * a->subsets.nx + (a->r.x + x0) / LUM_AREA_SIDE;
    struct lum_tile_rect r = lum_tile_at(&a->subsets, subset);
    bool mixed = a->around[k] == (LUM_AREA_LIT | LUM_AREA_DARK);
    uint64_t hash = area->hashes[subset] ^ a->around[k];
    for (uint32_t i = 0; i < r.w * r.h; i++) {
        size_t pixel = (size_t)(r.y + i / r.w) * a->pass->tiling.w + r.x + i % r.w;
        struct lum_moments m;
        float ratio = a->around[k] & LUM_AREA_LIT ? 1.0f : 0.0f;
        if (mixed && lum_area_wants(a->pass, a->layer, pixel))
            ratio = lum_area_around_ratio(a, x0 + i % r.w, y0 + i / r.w, &m);
        area->ratio[pixel] = ratio;
        hash = mixed ? add_to_hash(hash, ratio) : hash;
    }
    area->ratio_hashes[subset] = hash;
}

static void share_tile(const struct lum_pass *pass, uint32_t tile, struct lum_counters *counters)
{
    (void)counters;
    struct lum_area_around around;
    struct lum_tile_rect r = lum_tile_at(&pass->tiling, tile);
    uint64_t known[LUM_AROUND_SUBSETS];
    uint32_t a = 0;
    bool begun = false;
    if (pass->settings->max_depth == 0)
        return;
    for (struct lum_layer *layer; (layer = lum_area_next(pass, &a));) {
        if (!lum_light_has_irradiance(&pass->layers->unit.lights.lights[layer->index]) ||
            lum_around_settled(pass, &layer->area, tile))
            continue;
        uint32_t stale = lum_around_find_stale(pass, r, layer->area.hashes, layer->area.shared, known);
        if (!stale)
            continue;
        if (!begun)
            lum_area_around_init(&around, pass, tile);
        begun = true;
        lum_area_around_read(&around, layer, stale);
        for (uint32_t left = stale; left; left &= left - 1)
            share_subset(&around, &layer->area, (uint32_t)__builtin_ctz(left));
        lum_around_made(pass, r, stale, known, layer->area.shared);
    }
}

const struct lum_estimator lum_area_ratio = {.name = "area shadow, ratio",
                                             .stage = LUM_STAGE_FILTER,
                                             .tile = share_tile,
                                             .surfaces = true,
                                             .then = &lum_area_resolve};

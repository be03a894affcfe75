/* The visible share of each light that is known in closed form, around every pixel: the first half of resolving. What
 * it found is printed, too: where it stays what it was, nothing is resolved anew. */
#include "core/effect/area_shadow/penumbra_around.h"

#include <string.h>

#include "core/light/irradiance.h"

static uint64_t add_to_print(uint64_t print, float share)
{
    uint32_t bits;
    memcpy(&bits, &share, sizeof bits);
    print = (print ^ bits) * 0x9e3779b97f4a7c15u;
    return print ^ print >> 32;
}

/* One tile of the pattern, number k of those in the tile. */
static void share_set(const struct lum_penumbra_around *a, struct lum_soft *soft, uint32_t k)
{
    uint32_t x0 = k % LUM_AROUND_SIDE * LUM_SOFT_SIDE, y0 = k / LUM_AROUND_SIDE * LUM_SOFT_SIDE;
    uint32_t set = (a->r.y + y0) / LUM_SOFT_SIDE * a->sets.nx + (a->r.x + x0) / LUM_SOFT_SIDE;
    struct lum_tile_rect r = lum_tile_at(&a->sets, set);
    bool mixed = a->around[k] == (LUM_SOFT_LIT | LUM_SOFT_DARK);
    uint64_t print = soft->prints[set] ^ a->around[k];
    for (uint32_t i = 0; i < r.w * r.h; i++) {
        size_t pixel = (size_t)(r.y + i / r.w) * a->pass->tiling.w + r.x + i % r.w;
        struct lum_moments m;
        float share = a->around[k] & LUM_SOFT_LIT ? 1.0f : 0.0f;
        if (mixed && lum_penumbra_wants(a->pass, a->layer, pixel))
            share = lum_penumbra_around_share(a, x0 + i % r.w, y0 + i / r.w, &m);
        soft->share[pixel] = share;
        print = mixed ? add_to_print(print, share) : print;
    }
    soft->share_prints[set] = print;
}

static void share_tile(const struct lum_pass *pass, uint32_t tile, struct lum_counters *counters)
{
    (void)counters;
    struct lum_penumbra_around around;
    struct lum_tile_rect r = lum_tile_at(&pass->tiling, tile);
    uint64_t known[LUM_AROUND_SETS];
    uint32_t a = 0;
    bool begun = false;
    if (pass->settings->max_depth == 0)
        return;
    for (struct lum_layer *layer; (layer = lum_penumbra_next(pass, &a));) {
        if (!lum_light_has_irradiance(&pass->layers->unit.lights.lights[layer->index]) ||
            lum_around_settled(pass, &layer->soft, tile))
            continue;
        uint32_t stale = lum_around_find_stale(pass, r, layer->soft.prints, layer->soft.shared, known);
        if (!stale)
            continue;
        if (!begun)
            lum_penumbra_around_init(&around, pass, tile);
        begun = true;
        lum_penumbra_around_read(&around, layer, stale);
        for (uint32_t left = stale; left; left &= left - 1)
            share_set(&around, &layer->soft, (uint32_t)__builtin_ctz(left));
        lum_around_made(pass, r, stale, known, layer->soft.shared);
    }
}

const struct lum_estimator lum_penumbra_share = {.name = "penumbra, share",
                                                 .stage = LUM_STAGE_FILTER,
                                                 .tile = share_tile,
                                                 .surfaces = true,
                                                 .then = &lum_penumbra_resolve};

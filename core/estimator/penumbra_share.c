/* The visible share of each light that is known in closed form, around every pixel: the first half of resolving. */
#include "core/estimator/penumbra_around.h"

#include "core/light/irradiance.h"

static void share_layer(struct lum_penumbra_around *a, struct lum_layer *layer, uint32_t stale)
{
    lum_penumbra_around_read(a, layer, stale);
    for (uint32_t y = 0; y < a->r.h; y++)
        for (uint32_t x = 0; x < a->r.w; x++) {
            size_t pixel = (size_t)(a->r.y + y) * a->pass->tiling.w + a->r.x + x;
            struct lum_moments m;
            if ((stale >> lum_around_set(x, y) & 1) && lum_penumbra_wants(a->pass, layer, pixel))
                layer->soft.share[pixel] = lum_penumbra_around_share(a, x, y, &m);
        }
}

static void share_tile(const struct lum_pass *pass, uint32_t tile, struct lum_counters *counters)
{
    (void)counters;
    struct lum_penumbra_around around;
    struct lum_tile_rect r = lum_tile_at(&pass->tiling, tile);
    uint64_t known[LUM_AROUND_SETS];
    uint32_t a = 0;
    bool begun = false;
    for (struct lum_layer *layer; (layer = lum_penumbra_next(pass, &a));) {
        uint32_t stale = lum_around_find_stale(pass, r, layer->soft.prints, layer->soft.shared, known);
        if (!stale)
            continue;
        if (!begun)
            lum_penumbra_around_init(&around, pass, tile);
        begun = true;
        if (lum_light_has_irradiance(&pass->layers->unit.lights.lights[layer->index]))
            share_layer(&around, layer, stale);
        lum_around_made(pass, r, stale, known, layer->soft.shared);
    }
}

const struct lum_estimator lum_penumbra_share = {.name = "penumbra, share",
                                                 .stage = LUM_STAGE_FILTER,
                                                 .tile = share_tile,
                                                 .surfaces = true,
                                                 .then = &lum_penumbra_resolve};

/* The visible share of each light that is known in closed form, around every pixel: the first half of resolving. What
 * it found is printed, too: where it stays what it was, nothing is resolved anew. */
#include "core/estimator/penumbra_around.h"

#include <string.h>

#include "core/light/irradiance.h"

/* What resolving takes from a tile of the pattern, apart from its surfaces. */
static uint64_t print_of(const struct lum_pass *pass, const struct lum_soft *soft, struct lum_tile_rect r)
{
    uint64_t print = 0;
    for (uint32_t i = 0; i < r.w * r.h; i++) {
        size_t pixel = (size_t)(r.y + i / r.w) * pass->tiling.w + r.x + i % r.w;
        uint32_t bits;
        memcpy(&bits, &soft->share[pixel], sizeof bits);
        print = lum_soft_print((print ^ bits) * 0xd6e8feb86659fd93u, soft->seen[pixel]);
    }
    return print;
}

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

static void find_prints(const struct lum_penumbra_around *a, const struct lum_soft *soft, uint32_t stale,
                        uint64_t ret_print[LUM_AROUND_SETS])
{
    for (uint32_t left = stale; left; left &= left - 1) {
        uint32_t k = (uint32_t)__builtin_ctz(left);
        uint32_t x = a->r.x / LUM_SOFT_SIDE + k % LUM_AROUND_SIDE, y = a->r.y / LUM_SOFT_SIDE + k / LUM_AROUND_SIDE;
        ret_print[k] = print_of(a->pass, soft, lum_tile_at(&a->sets, y * a->sets.nx + x));
    }
}

static void share_tile(const struct lum_pass *pass, uint32_t tile, struct lum_counters *counters)
{
    (void)counters;
    struct lum_penumbra_around around;
    struct lum_tile_rect r = lum_tile_at(&pass->tiling, tile);
    uint64_t known[LUM_AROUND_SETS], found[LUM_AROUND_SETS];
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
        share_layer(&around, layer, stale);
        find_prints(&around, &layer->soft, stale, found);
        lum_around_made(pass, r, stale, found, layer->soft.share_prints);
        lum_around_made(pass, r, stale, known, layer->soft.shared);
    }
}

const struct lum_estimator lum_penumbra_share = {.name = "penumbra, share",
                                                 .stage = LUM_STAGE_FILTER,
                                                 .tile = share_tile,
                                                 .surfaces = true,
                                                 .then = &lum_penumbra_resolve};

/* Further strata, as many as lum_penumbra_plan asks for. */
#include "core/effect/area_shadow/penumbra_ask.h"

static void refine_pixel(struct lum_penumbra_batch *b, uint32_t x, uint32_t y, uint32_t goal)
{
    size_t pixel = (size_t)y * b->pass->tiling.w + x;
    struct lum_seen seen = b->layer->soft.seen[pixel];
    uint32_t known = seen.traced | seen.visible, n = (uint32_t)__builtin_popcount(known);
    uint32_t set = lum_pattern_set(LUM_SOFT_SIDE, x, y);
    struct lum_penumbra_view view;
    if (n >= goal)
        return;
    lum_penumbra_look(b->pass, b->layer, pixel, &view);
    for (uint32_t i = 0; i < LUM_SOFT_POINTS && n < goal; i++) {
        uint32_t k = lum_pattern_next(LUM_SOFT_SIDE, set, i);
        if (known >> k & 1)
            continue;
        lum_penumbra_ask(b, &view, k);
        n++;
    }
}

static bool refine_layer(struct lum_penumbra_batch *b, struct lum_tile_rect r)
{
    struct lum_tiling sets = lum_soft_tiling(b->pass);
    bool any = false;
    for (uint32_t y = r.y; y < r.y + r.h; y += LUM_SOFT_SIDE)
        for (uint32_t x = r.x; x < r.x + r.w; x += LUM_SOFT_SIDE) {
            uint32_t set = y / LUM_SOFT_SIDE * sets.nx + x / LUM_SOFT_SIDE, goal = b->layer->soft.goal[set];
            if (goal == 0)
                continue;
            struct lum_tile_rect t = lum_tile_at(&sets, set);
            for (uint32_t i = 0; i < t.w * t.h; i++)
                refine_pixel(b, t.x + i % t.w, t.y + i / t.w, goal);
            any = true;
        }
    lum_penumbra_flush(b);
    return any;
}

static void close_sets(const struct lum_pass *pass, struct lum_soft *s, struct lum_tile_rect r)
{
    struct lum_tiling sets = lum_soft_tiling(pass);
    for (uint32_t y = r.y / LUM_SOFT_SIDE; y * LUM_SOFT_SIDE < r.y + r.h; y++)
        for (uint32_t x = r.x / LUM_SOFT_SIDE; x * LUM_SOFT_SIDE < r.x + r.w; x++)
            s->open[y * sets.nx + x] = 0;
}

static void refine_packet(const struct lum_pass *pass, uint32_t packet, struct lum_counters *counters)
{
    struct lum_tile_rect r = lum_tile_at(&pass->packets, packet);
    struct lum_penumbra_batch b;
    uint32_t a = 0;
    for (struct lum_layer *layer; pass->settings->max_depth > 0 && (layer = lum_penumbra_next(pass, &a));) {
        lum_penumbra_begin(&b, pass, layer, counters);
        if (refine_layer(&b, r))
            lum_penumbra_count(pass, &layer->soft, r);
        if (pass->layers->refined_share > 0.0f)
            close_sets(pass, &layer->soft, r);
    }
}

const struct lum_estimator lum_penumbra_refine = {
    .name = "penumbra, refine",
    .stage = LUM_STAGE_REFINE,
    .begin = lum_penumbra_plan,
    .tile = refine_packet,
    .packets = true,
    .surfaces = true,
    .then = &lum_penumbra_share,
};

/* Further strata, as many as lum_area_plan asks for. */
#include "core/effect/area_shadow/area_trace.h"

static void refine_pixel(struct lum_area_batch *b, uint32_t x, uint32_t y, uint32_t goal)
{
    size_t pixel = (size_t)y * b->pass->tiling.w + x;
    struct lum_visibility visibility = b->layer->area.visibility[pixel];
    uint32_t known = visibility.traced | visibility.visible, n = (uint32_t)__builtin_popcount(known);
    uint32_t subset = lum_pattern_subset(LUM_AREA_SIDE, x, y);
    struct lum_area_view view;
    if (n >= goal)
        return;
    lum_area_look(b->pass, b->layer, pixel, &view);
    for (uint32_t i = 0; i < LUM_AREA_POINTS && n < goal; i++) {
        uint32_t k = lum_pattern_next(LUM_AREA_SIDE, subset, i);
        if (known >> k & 1)
            continue;
        lum_area_trace(b, &view, k);
        n++;
    }
}

static bool refine_layer(struct lum_area_batch *b, struct lum_tile_rect r)
{
    struct lum_tiling subsets = lum_area_tiling(b->pass);
    bool any = false;
    for (uint32_t y = r.y; y < r.y + r.h; y += LUM_AREA_SIDE)
        for (uint32_t x = r.x; x < r.x + r.w; x += LUM_AREA_SIDE) {
            uint32_t subset = y / LUM_AREA_SIDE * subsets.nx + x / LUM_AREA_SIDE, goal = b->layer->area.goal[subset];
            if (goal == 0)
                continue;
            struct lum_tile_rect t = lum_tile_at(&subsets, subset);
            for (uint32_t i = 0; i < t.w * t.h; i++)
                refine_pixel(b, t.x + i % t.w, t.y + i / t.w, goal);
            any = true;
        }
    lum_area_flush(b);
    return any;
}

static void close_subset(const struct lum_pass *pass, struct lum_area_visibility *s, struct lum_tile_rect r)
{
    struct lum_tiling subsets = lum_area_tiling(pass);
    for (uint32_t y = r.y / LUM_AREA_SIDE; y * LUM_AREA_SIDE < r.y + r.h; y++)
        for (uint32_t x = r.x / LUM_AREA_SIDE; x * LUM_AREA_SIDE < r.x + r.w; x++)
            s->open[y * subsets.nx + x] = 0;
}

static void refine_cell(const struct lum_pass *pass, uint32_t cell, struct lum_counters *counters)
{
    struct lum_tile_rect r = lum_tile_at(&pass->cells, cell);
    struct lum_area_batch b;
    uint32_t a = 0;
    for (struct lum_layer *layer; pass->settings->max_depth > 0 && (layer = lum_area_next(pass, &a));) {
        lum_area_begin(&b, pass, layer, counters);
        if (refine_layer(&b, r))
            lum_area_count(pass, &layer->area, r);
        if (pass->layers->refined_share > 0.0f)
            close_subset(pass, &layer->area, r);
    }
}

const struct lum_estimator lum_area_refine = {
    .name = "area shadow, refine",
    .stage = LUM_STAGE_REFINE,
    .begin = lum_area_plan,
    .tile = refine_cell,
    .cells = true,
    .surfaces = true,
    .then = &lum_area_ratio,
};

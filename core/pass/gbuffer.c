#include "core/pass/pass.h"

static void gbuffer_tile(const struct lum_pass *pass, uint32_t tile, struct lum_counters *counters)
{
    struct lum_gbuffer *g = pass->gbuffer;
    if (lum_memo_step(&g->made, tile))
        return;
    struct lum_rays rays;
    lum_tile_center_rays(pass, tile, &rays);
    counters->rays[LUM_RAY_PRIMARY] += rays.n;
    struct lum_trace trace = lum_trace_of_eye(pass->snapshot, counters);
    struct lum_hits before;
    bool compare = lum_motion_mask_is_known(pass->motion_mask) && pass->motion_mask->stamp == g->stamp;
    if (compare)
        before = g->tiles[tile];
    lum_trace_closest(&trace, &rays, &g->tiles[tile]);
    g->tiles[tile].white = pass->settings->illuminance;
    if (compare)
        lum_motion_mask_compare(pass->motion_mask, &pass->tiling, tile, &before, &g->tiles[tile]);
    lum_memo_set(&g->made, tile, 1);
}

const struct lum_estimator lum_stage_gbuffer = {.name = "gbuffer", .stage = LUM_STAGE_GBUFFER, .tile = gbuffer_tile};

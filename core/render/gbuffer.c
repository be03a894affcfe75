/* The deferred pipeline's first and last stage: first hits through pixel centres, and the sum of the layers. */
#include "core/estimator/components.h"
#include "core/estimator/layers.h"
#include "core/render/deferred.h"

static void gbuffer_tile(const struct lum_pass *pass, uint32_t tile, struct lum_counters *counters)
{
    struct lum_gbuffer *g = pass->gbuffer;
    if (g->done[tile])
        return;
    struct lum_rays rays;
    lum_tile_center_rays(pass, tile, &rays);
    counters->rays[LUM_RAY_PRIMARY] += rays.n;
    struct lum_trace trace = lum_trace_of_eye(pass->snapshot, counters);
    struct lum_hits before;
    bool compare = lum_swept_is_known(pass->swept) && pass->swept->stamp == g->stamp;
    if (compare)
        before = g->tiles[tile];
    lum_trace_closest(&trace, &rays, &g->tiles[tile]);
    if (compare)
        lum_swept_compare(pass->swept, &pass->tiling, tile, &before, &g->tiles[tile]);
    g->done[tile] = 1;
}

static void composite_tile(const struct lum_pass *pass, uint32_t tile, struct lum_counters *counters)
{
    if (pass->tile_spp[tile] >= pass->target_spp)
        return;
    struct lum_rgb radiance[LUM_TILE_PIXELS];
    struct lum_tile_rect r = lum_tile_at(&pass->tiling, tile);
    lum_layers_sum(pass, tile, r.w * r.h, radiance);
    for (uint32_t i = 0; i < r.w * r.h; i++) {
        uint32_t x = r.x + i % r.w, y = r.y + i / r.w;
        size_t pixel = (size_t)y * pass->tiling.w + x;
        if (pass->components)
            radiance[i] = lum_components_radiance(pass, pixel, radiance[i]);
        if (pass->components && pass->components->radiance) {
            pass->components->radiance[pixel] = radiance[i]; /* the film is the next stage's */
            continue;
        }
        lum_film_set(pass->film, x, y, radiance[i], &counters->nonfinite);
    }
    if (!pass->components || !pass->components->radiance)
        pass->tile_spp[tile] = pass->target_spp;
}

const struct lum_estimator lum_stage_gbuffer = {.name = "gbuffer", .stage = LUM_STAGE_GBUFFER, .tile = gbuffer_tile};
const struct lum_estimator lum_stage_composite = {
    .name = "composite", .stage = LUM_STAGE_COMPOSITE, .tile = composite_tile};

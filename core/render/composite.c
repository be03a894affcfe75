/* The last stage of deferred methods: the sum of layers and components. */
#include "core/render/deferred.h"

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

const struct lum_estimator lum_stage_composite = {
    .name = "composite", .stage = LUM_STAGE_COMPOSITE, .tile = composite_tile};

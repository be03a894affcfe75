/* The last stage of deferred methods: the sum of layers and components. */
#include "core/method/method.h"
#include "core/render/deferred.h"

/* Of the buffers that come into the picture so. */
static struct lum_rgb sum_of(const struct lum_pass *pass, enum lum_adds adds, size_t pixel)
{
    const struct lum_components *c = pass->components;
    struct lum_rgb sum = lum_grey(0.0f);
    for (int e = 0; e < LUM_EFFECT_COUNT; e++) {
        const struct lum_rgb *smooth = c->buffer[e].smooth;
        if (smooth && lum_effect_rows[e]->adds == adds)
            sum = lum_rgb_add(sum, smooth[pixel]);
    }
    return sum;
}

static struct lum_rgb add_components(const struct lum_pass *pass, size_t pixel, struct lum_rgb layers)
{
    struct lum_rgb white = sum_of(pass, LUM_ADDS_WHITE, pixel);
    struct lum_rgb sum = lum_rgb_add(layers, lum_rgb_mul(pass->surfaces->albedo[pixel], white));
    sum = lum_rgb_add(sum, sum_of(pass, LUM_ADDS_SURFACE, pixel));
    if (pass->settings->illuminance) /* what is before the eye takes no light from the surface */
        return sum;
    if (pass->on[LUM_EFFECT_MEDIA])
        sum = lum_rgb_mul(sum, lum_pass_transmittance(pass, pixel));
    return lum_rgb_add(sum, sum_of(pass, LUM_ADDS_AIR, pixel));
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
            radiance[i] = add_components(pass, pixel, radiance[i]);
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

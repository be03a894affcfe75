/* Light by way of glossy surfaces: from each pixel that shows one, a path is sent off by its glossy lobe and traced on
 * as the path tracer does. What it meets that shines is weighted against the light sampling of the other estimators. */
#include "core/estimator/components.h"
#include "core/estimator/path.h"

/* Paths start at the glossy pixels of a ray batch tile. */
static void add_paths(const struct lum_pass *pass, uint32_t tile, struct lum_wave *w)
{
    struct lum_tile_rect r = lum_tile_at(&pass->tiling, tile);
    struct lum_rays eye;
    lum_tile_center_rays(pass, tile, &eye);
    for (uint32_t i = 0; i < eye.n; i++) {
        uint32_t x = r.x + i % r.w, y = r.y + i / r.w;
        if (!(pass->surfaces->kind[(size_t)y * pass->tiling.w + x] & LUM_PIXEL_GLOSS))
            continue;
        struct lum_vec3 d = lum_rays_direction(&eye, i), wo = lum_v3_neg(d);
        struct lum_surface s;
        struct lum_bsdf b;
        lum_snapshot_surface(pass->snapshot, &pass->gbuffer->tiles[tile], i, d, &s);
        lum_bsdf_init(&b, &pass->snapshot->materials[s.material], &s, wo);
        lum_wave_add_gloss(w, i, lum_sampler_at(x, y, 0, pass->settings->seed), s.p, &b, wo);
    }
}

static void glossy_batch(const struct lum_pass *pass, uint32_t tile, struct lum_counters *counters)
{
    struct lum_wave w;
    lum_wave_begin(&w, pass->snapshot, counters, pass->settings->max_depth, lum_pass_effects_off(pass));
    add_paths(pass, tile, &w);
    if (w.rays.n == 0)
        return;
    lum_wave_run(&w, 1);
    struct lum_tile_rect r = lum_tile_at(&pass->tiling, tile);
    for (uint32_t i = 0; i < r.w * r.h; i++)
        lum_component_add(pass->components, LUM_COMPONENT_GLOSS,
                          (size_t)(r.y + i / r.w) * pass->tiling.w + r.x + i % r.w, w.radiance[i]);
}

static void glossy_packet(const struct lum_pass *pass, uint32_t packet, struct lum_counters *counters)
{
    if (pass->settings->max_depth == 0 || lum_components_enter(pass, LUM_STAGE_GLOSSY, packet))
        return;
    struct lum_tile_rect r = lum_tile_at(&pass->packets, packet);
    for (uint32_t y = r.y / LUM_TILE_SIDE; y * LUM_TILE_SIDE < r.y + r.h; y++)
        for (uint32_t x = r.x / LUM_TILE_SIDE; x * LUM_TILE_SIDE < r.x + r.w; x++)
            glossy_batch(pass, y * pass->tiling.nx + x, counters);
}
_Static_assert(LUM_PACKET_SIDE % LUM_TILE_SIDE == 0, "a packet is made of ray batch tiles");

const struct lum_estimator lum_estimator_glossy = {
    .name = "glossy",
    .stage = LUM_STAGE_GLOSSY,
    .tile = glossy_packet,
    .packets = true,
    .components = LUM_COMPONENT_BIT(LUM_COMPONENT_GLOSS),
};

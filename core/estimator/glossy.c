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

/* A path that found a small bright thing by a rare way would stand out as a dot for as long as the frame shows, so that
 * no path is let be brighter than this many times the mean of its tile. What that takes away, refinement brings back.
 */
#define BRIGHTEST 6.0f

static void tame(struct lum_rgb *radiance, uint32_t n)
{
    for (int round = 0; round < 2; round++) { /* the first mean is still that of the outliers, too */
        float sum = 0.0f, lit = 0.0f;
        for (uint32_t i = 0; i < n; i++) {
            float y = lum_luminance(radiance[i]);
            sum += y;
            lit += y > 0.0f ? 1.0f : 0.0f;
        }
        float most = lit > 0.0f ? BRIGHTEST * sum / lit : 0.0f;
        for (uint32_t i = 0; i < n; i++) {
            float y = lum_luminance(radiance[i]);
            if (y > most)
                radiance[i] = lum_rgb_scale(radiance[i], most / y);
        }
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
    tame(w.radiance, r.w * r.h);
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

/* Direct light at the surfaces that the eye sees: light by light, hard shadows from points and directions, soft ones
 * from everything that has an area, at a fixed number of samples. Also what shines itself, and the background. */
#include "core/effect/direct/direct.h"
#include "core/math/sampler.h"
#include "core/scene/surface.h"

/* First hit of pixel `slot`: emission goes to the layers, the surface, if it scatters with spread, to the vertices. */
static void visit_pixel(const struct lum_pass *pass, uint32_t tile, uint32_t slot, struct lum_vec3 d,
                        struct lum_vertices *vertices)
{
    const struct lum_snapshot *unit = &pass->layers->unit;
    const struct lum_hits *hits = &pass->gbuffer->tiles[tile];
    if (hits->object[slot] == LUM_NO_OBJECT) {
        if (!hits->white && unit->lights.environment != LUM_NO_OBJECT) {
            struct lum_emission e = {slot, unit->lights.environment, lum_lights_background(&unit->lights, d, true)};
            lum_layers_add(pass, tile, &e, LUM_LAYER_DIRECT);
        }
        return;
    }
    struct lum_surface s;
    lum_snapshot_surface(unit, hits, slot, d, &s);
    if (s.instance == LUM_NO_OBJECT) {
        struct lum_emission e = {slot, s.light, s.emission};
        lum_layers_add(pass, tile, &e, LUM_LAYER_DIRECT);
        return;
    }
    struct lum_bsdf *b = &vertices->bsdf[vertices->n];
    struct lum_vec3 wo = lum_v3_neg(d);
    lum_bsdf_init(b, &unit->materials[s.material], &s, wo);
    if (!lum_rgb_black(b->emission))
        lum_layers_add(pass, tile, &(struct lum_emission){slot, s.light, b->emission}, LUM_LAYER_DIRECT);
    if (!lum_bsdf_spreads(b))
        return;
    struct lum_tile_rect r = lum_tile_at(&pass->tiling, tile);
    lum_vertices_push(vertices, slot, s.p, wo,
                      lum_sampler_at(r.x + slot % r.w, r.y + slot / r.w, 0, pass->settings->seed).pixel_seed);
}

/* A matte pixel that does not shine, as the eye saw it: nothing of it has to be looked up. False: it is no such one. */
static bool visit_matte(const struct lum_pass *pass, uint32_t slot, uint32_t x, uint32_t y,
                        struct lum_vertices *vertices)
{
    const struct lum_surfaces *s = pass->surfaces;
    const uint32_t others = LUM_PIXEL_GLOSS | LUM_PIXEL_SPECULAR | LUM_PIXEL_SHINES | LUM_PIXEL_SHEET;
    size_t pixel = (size_t)y * pass->tiling.w + x;
    if (!s || !(s->kind[pixel] & LUM_PIXEL_DIFFUSE) || (s->kind[pixel] & others))
        return false;
    struct lum_bsdf *b = &vertices->bsdf[vertices->n];
    *b = lum_bsdf_white(s->n[pixel], s->ng[pixel]);
    b->diffuse = s->albedo[pixel];
    b->alpha = 0.0f; /* which is that of gloss */
    lum_vertices_push(vertices, slot, s->p[pixel], lum_v3_neg(lum_center_direction(pass, x, y)),
                      lum_sampler_at(x, y, 0, pass->settings->seed).pixel_seed);
    return true;
}

/* True when no light is kept in layers, so that a surface which does not shine has nothing to add. */
static bool only_shine_counts(const struct lum_pass *pass)
{
    const struct lum_light_table *lights = &pass->snapshot->lights;
    for (uint32_t a = 0; a < lights->n_active; a++) {
        enum lum_effect e = lum_light_effect(&lights->lights[lights->active[a]]);
        if (pass->on[e] && lum_method_serves(pass->settings->method, e) == &lum_estimator_shadow)
            return false;
    }
    return pass->surfaces != NULL;
}

static void shadow_tile(const struct lum_pass *pass, uint32_t tile, struct lum_counters *counters)
{
    if (lum_layers_reached(pass, tile, LUM_LAYER_DIRECT))
        return;
    lum_layers_blacken(pass, tile, LUM_LAYER_DIRECT);
    struct lum_vertices vertices;
    vertices.n = 0;
    struct lum_tile_rect r = lum_tile_at(&pass->tiling, tile);
    bool only_shine = only_shine_counts(pass);
    for (uint32_t i = 0; i < r.w * r.h; i++) {
        uint32_t x = r.x + i % r.w, y = r.y + i / r.w;
        if (only_shine && !(pass->surfaces->kind[(size_t)y * pass->tiling.w + x] & LUM_PIXEL_SHINES))
            continue;
        if (!visit_matte(pass, i, x, y, &vertices))
            visit_pixel(pass, tile, i, lum_center_direction(pass, x, y), &vertices);
    }
    if (pass->settings->max_depth > 0)
        lum_layers_light(pass, tile, &vertices, LUM_LAYER_DIRECT, counters);
    lum_layers_reach(pass, tile, LUM_LAYER_DIRECT);
}

const struct lum_estimator lum_estimator_shadow = {
    .name = "shadow", .stage = LUM_STAGE_DIRECT, .tile = shadow_tile, .layering = LUM_LAYERING_HARD};

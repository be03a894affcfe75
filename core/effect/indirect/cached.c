/* Indirect diffuse light from the records of a cache, into its component: the radiance of a white surface. */
#include "core/effect/indirect/records.h"
#include "core/effect/indirect/interpolated.h"
#include "core/material/bsdf.h"
#include "core/pass/components.h"
#include "core/scene/surface.h"

#include <string.h>

/* ---- which pixels ---- */

struct interpolated {
    struct lum_interpolated *of; /* by tile */
    uint8_t *known;              /* by tile */
    uint8_t *taps;               /* by pixel */
    uint32_t n_tiles;            /* lum_interpolated_tiles, the most there were */
};

static void finish(void *state)
{
    struct interpolated *s = state;
    for (uint32_t t = 0; t < s->n_tiles; t++)
        lum_kept_candidates_finish(&s->of[t].kept);
    lum_free(s->of);
    lum_free(s->known);
    lum_free(s->taps);
    *s = (struct interpolated){0};
}

static bool reserve(void *state, const struct lum_pass *pass)
{
    struct interpolated *s = state;
    uint32_t n = lum_interpolated_tiles(pass);
    if (s->n_tiles >= n)
        return true;
    finish(s);
    s->of = lum_calloc(n, sizeof *s->of);
    s->known = lum_calloc(n, 1);
    s->taps = lum_calloc((size_t)pass->tiling.w * pass->tiling.h, 1);
    s->n_tiles = s->of ? n : 0;
    return s->of && s->known && s->taps;
}

static void invalidate(void *state, const struct lum_pass *pass, const struct lum_outcome *outcome)
{
    struct interpolated *s = state;
    if (outcome->neighbours == LUM_FATE_STALE)
        memset(s->known, 0, s->n_tiles);
    for (uint32_t t = 0; outcome->neighbours == LUM_FATE_MOVED && t < s->n_tiles; t++)
        if (lum_motion_mask_around_tile(pass->motion_mask, &pass->tiling, t % pass->tiling.n))
            s->known[t] = 0;
}

const struct lum_state_kind lum_interpolated_kind = {sizeof(struct interpolated), reserve, invalidate, finish};

/* True when the method interpolates every second pixel of every second row, and those that none of these serves. */
static bool is_quarter(const struct lum_pass *pass)
{
    const struct lum_method *m = pass->settings->method;
    for (size_t i = 0; i < LUM_ARRAY_LEN(m->filters); i++)
        if (m->filters[i] == &lum_stage_upsample)
            return true;
    return false;
}

/* Which pixels of the tile interpolate records, and from which of them the others take. */
static void find_pixels(const struct lum_pass *pass, uint32_t tile, struct lum_interpolated *ret_pixels,
                        uint8_t *inout_taps)
{
    struct lum_tile_rect r = lum_tile_at(&pass->tiling, tile);
    bool quarter = is_quarter(pass);
    struct lum_guide guide = lum_components_guide(pass);
    struct lum_filter f = {.guide = &guide, .need = LUM_PIXEL_DIFFUSE, .side = 1, .apart = 1, .step = 2};
    struct lum_pixel_mask coarse = {0}, lone = {0};
    for (uint32_t y = r.y; y < r.y + r.h; y++)
        for (uint32_t x = r.x; x < r.x + r.w; x++) {
            uint32_t slot = (y - r.y) * LUM_TILE_SIDE + (x - r.x);
            size_t pixel = (size_t)y * guide.w + x;
            bool wanted = guide.kind[pixel] & LUM_PIXEL_DIFFUSE;
            uint8_t taps = wanted && quarter ? lum_upsample_taps(&f, x, y) : 0;
            inout_taps[pixel] = taps;
            if (wanted && (!quarter || (x % 2 == 0 && y % 2 == 0)))
                lum_pixel_mask_set(&coarse, slot);
            else if (wanted && taps == 0)
                lum_pixel_mask_set(&lone, slot);
        }
    ret_pixels->coarse = coarse;
    ret_pixels->lone = lone;
    ret_pixels->kept.known = false;
}

/* Which pixels of the tile show sheets. */
static void find_sheets(const struct lum_pass *pass, uint32_t tile, struct lum_interpolated *ret_pixels)
{
    struct lum_tile_rect r = lum_tile_at(&pass->tiling, tile % pass->tiling.n);
    struct lum_pixel_mask sheets = {0};
    for (uint32_t y = 0; y < r.h; y++)
        for (uint32_t x = 0; x < r.w; x++)
            if (pass->surfaces->kind[(size_t)(r.y + y) * pass->tiling.w + r.x + x] & LUM_PIXEL_SHEET)
                lum_pixel_mask_set(&sheets, y * LUM_TILE_SIDE + x);
    ret_pixels->coarse = sheets;
    ret_pixels->lone = (struct lum_pixel_mask){0};
    ret_pixels->kept.known = false;
}

struct lum_interpolated *lum_interpolated_of(const struct lum_pass *pass, uint32_t tile)
{
    struct interpolated *s = lum_pass_state(pass, &lum_interpolated_kind);
    if (!s->known[tile] && lum_tile_is_far(pass, tile))
        find_sheets(pass, tile, &s->of[tile]);
    else if (!s->known[tile])
        find_pixels(pass, tile, &s->of[tile], s->taps);
    s->known[tile] = 1;
    return &s->of[tile];
}

const uint8_t *lum_taps_of(const struct lum_pass *pass)
{
    const struct interpolated *s = lum_pass_state(pass, &lum_interpolated_kind);
    return s->taps;
}

/* ---- irradiance ---- */

/* Interpolates at some pixels. step 2: out is a picture of a quarter of the resolution. */
static void interpolate(const struct lum_pass *pass, uint32_t tile, const struct lum_pixel_mask *mask,
                        const struct lum_lookup *lookup, const struct lum_candidates *candidates, uint32_t step,
                        struct lum_rgb *out)
{
    struct lum_tile_points points;
    struct lum_rgb irradiance[LUM_TILE_PIXELS];
    struct lum_tile_rect r = lum_tile_at(&pass->tiling, tile);
    uint32_t pitch = lum_filter_size(pass->tiling.w, step);
    if (lum_pixel_mask_none(mask))
        return;
    lum_tile_points_load(&points, pass, tile, mask);
    lum_tile_points_interpolate(lookup, candidates, &points, irradiance);
    for (uint32_t i = 0; i < points.n; i++) {
        uint32_t x = (r.x + points.slot[i] % LUM_TILE_SIDE) / step, y = (r.y + points.slot[i] / LUM_TILE_SIDE) / step;
        out[(size_t)y * pitch + x] = lum_rgb_scale(irradiance[i], LUM_INV_PI);
    }
}

void lum_show_far_side(const struct lum_pass *pass, uint32_t tile, uint32_t slot, struct lum_rgb irradiance)
{
    size_t pixel = lum_tile_pixel(pass, tile, slot);
    uint32_t w = pass->tiling.w;
    struct lum_rgb albedo = lum_surfaces_far_albedo(pass, (uint32_t)(pixel % w), (uint32_t)(pixel / w));
    pass->components->buffer[LUM_EFFECT_TRANSMISSION].smooth[pixel] =
        lum_rgb_scale(lum_rgb_mul(irradiance, albedo), LUM_INV_PI);
}

bool lum_begin_far_sides(const struct lum_pass *pass, uint32_t tile)
{
    struct lum_rgb *smooth = pass->components->buffer[LUM_EFFECT_TRANSMISSION].smooth;
    struct lum_tile_rect r = lum_tile_at(&pass->tiling, tile);
    for (uint32_t y = r.y; smooth && y < r.y + r.h; y++)
        memset(smooth + (size_t)y * pass->tiling.w + r.x, 0, r.w * sizeof *smooth);
    return smooth;
}

static void interpolate_far_side(const struct lum_pass *pass, uint32_t tile, const struct lum_lookup *lookup)
{
    uint32_t far = pass->tiling.n + tile;
    struct lum_interpolated *sheets = lum_begin_far_sides(pass, tile) ? lum_interpolated_of(pass, far) : NULL;
    struct lum_tile_points points;
    struct lum_rgb irradiance[LUM_TILE_PIXELS];
    struct lum_candidates list;
    if (!sheets || lum_pixel_mask_none(&sheets->coarse))
        return;
    lum_kept_candidates_update(&sheets->kept, pass, far, &sheets->coarse, lookup);
    lum_tile_points_load(&points, pass, far, &sheets->coarse);
    lum_tile_points_interpolate(lookup, lum_kept_candidates_list(&sheets->kept, &list), &points, irradiance);
    for (uint32_t i = 0; i < points.n; i++)
        lum_show_far_side(pass, tile, points.slot[i], irradiance[i]);
}

static void cached_tile(const struct lum_pass *pass, uint32_t tile, struct lum_counters *counters)
{
    if (lum_components_enter(pass, LUM_EFFECT_INDIRECT_DIFFUSE, tile))
        return;
    struct lum_interpolated *mask = lum_interpolated_of(pass, tile);
    struct lum_pixel_mask all = lum_interpolated_all(mask);
    struct lum_lookup lookup = lum_lookup_of(pass->records->cache, pass, counters->worker);
    interpolate_far_side(pass, tile, &lookup);
    if (lum_pixel_mask_none(&all))
        return;
    struct lum_rgb *raw = pass->components->buffer[LUM_EFFECT_INDIRECT_DIFFUSE].raw;
    struct lum_rgb *smooth = pass->components->buffer[LUM_EFFECT_INDIRECT_DIFFUSE].smooth;
    struct lum_candidates list;
    bool quarter = is_quarter(pass);
    lum_kept_candidates_update(&mask->kept, pass, tile, &all, &lookup);
    const struct lum_candidates *c = lum_kept_candidates_list(&mask->kept, &list);
    interpolate(pass, tile, &mask->coarse, &lookup, c, quarter ? 2 : 1, quarter ? raw : smooth);
    interpolate(pass, tile, &mask->lone, &lookup, c, 1, smooth);
}

const struct lum_estimator lum_estimator_cached = {
    .name = "cached",
    .stage = LUM_STAGE_INDIRECT,
    .tile = cached_tile,
    .state = &lum_interpolated_kind,
    .components = LUM_EFFECT_BIT(LUM_EFFECT_INDIRECT_DIFFUSE),
    .surfaces = true,
    .then = &lum_stage_records,
};

const struct lum_effect_row lum_effect_indirect_diffuse = {.demand = lum_demand_by_surface,
                                                           .scatter = LUM_SCATTER_DIFFUSE,
                                                           .why = "passes its light on to other surfaces",
                                                           .why_not = "no object is matte and not black",
                                                           .adds = LUM_ADDS_WHITE,
                                                           .guided = true};

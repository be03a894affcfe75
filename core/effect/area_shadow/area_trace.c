#include "core/effect/area_shadow/area_trace.h"

#include "core/light/irradiance.h"
#include "core/math/color.h"

void lum_area_begin(struct lum_area_batch *b, const struct lum_pass *pass, struct lum_layer *layer,
                    struct lum_counters *counters)
{
    b->pass = pass;
    b->layer = layer;
    b->counters = counters;
    b->rays.n = 0;
    b->n_asked = 0;
}

/* Stratum `bit` of the pixel is visible, and about to be noted. Which one stands for all does not hang on the order. */
static void keep_left(const struct lum_area_batch *b, size_t pixel, uint16_t bit, struct lum_rgb left)
{
    const struct lum_area_visibility *s = &b->layer->area;
    uint32_t w = b->pass->tiling.w,
             own = lum_pattern_subset(LUM_AREA_SIDE, (uint32_t)(pixel % w), (uint32_t)(pixel / w));
    if (bit == 1u << own || !(s->visibility[pixel].traced & s->visibility[pixel].visible))
        s->left[pixel] = lum_transmittance_pack(left);
}

void lum_area_flush(struct lum_area_batch *b)
{
    if (b->rays.n == 0)
        return;
    uint8_t occluded[LUM_RAY_BATCH];
    struct lum_rgb left[LUM_RAY_BATCH];
    struct lum_trace trace = lum_trace_of_light(b->pass->snapshot, b->counters, lum_pass_panes(b->pass));
    lum_trace_light(&trace, &b->rays, occluded, left);
    b->counters->rays[lum_light_ray_kind(&b->layer->light)] += b->rays.n;
    for (uint32_t i = 0; i < b->rays.n; i++) {
        struct lum_visibility *visibility = &b->layer->area.visibility[b->pixel[i]];
        if (trace.panes && !occluded[i])
            keep_left(b, b->pixel[i], b->bit[i], left[i]);
        visibility->traced |= b->bit[i];
        if (!occluded[i])
            visibility->visible |= b->bit[i];
    }
    b->rays.n = 0;
}

void lum_area_trace(struct lum_area_batch *b, const struct lum_area_view *view, uint32_t k)
{
    size_t pixel = view->pixel;
    struct lum_visibility *visibility = &b->layer->area.visibility[pixel];
    uint16_t bit = (uint16_t)(1u << k);
    struct lum_light_sample ls;
    enum lum_area_side side = lum_area_sample(view, k, &ls);
    b->n_asked++;
    if (side == LUM_AREA_OPEN) {
        uint32_t i = b->rays.n;
        if (lum_shadow_ray(&b->rays, b->pass->surfaces->p[pixel], b->pass->surfaces->ng[pixel], ls.wi, ls.distance)) {
            b->pixel[i] = pixel;
            b->bit[i] = bit;
            if (b->rays.n == LUM_RAY_BATCH)
                lum_area_flush(b);
            return;
        }
    }
    if (side != LUM_AREA_NEEDLESS)
        visibility->traced |= bit;
    if (side != LUM_AREA_HIDDEN)
        visibility->visible |= bit;
}

/* ---- in a cell ---- */

uint16_t lum_area_first_points(const struct lum_pass *pass, const struct lum_layer *layer)
{
    bool exact = lum_light_has_irradiance(&pass->layers->unit.lights.lights[layer->index]);
    return exact ? layer->area.first_points : UINT16_MAX;
}

static void ask_first(struct lum_area_batch *b, size_t pixel, uint32_t k)
{
    struct lum_visibility visibility = b->layer->area.visibility[pixel];
    struct lum_area_view view;
    if ((visibility.traced | visibility.visible) >> k & 1)
        return;
    lum_area_look(b->pass, b->layer, pixel, &view);
    lum_area_trace(b, &view, k);
}

/* All pixels of the cell that begin with stratum k: their rays end near one point of the light. subsets: only those in
 * such tiles of the pattern. */
static void trace_stratum(struct lum_area_batch *b, struct lum_tile_rect r, uint32_t k,
                          const struct lum_area_subsets *subsets)
{
    uint32_t dx, dy;
    lum_pattern_pixel(LUM_AREA_SIDE, k, &dx, &dy);
    for (uint32_t y = dy; y < r.h; y += LUM_AREA_SIDE)
        for (uint32_t x = dx; x < r.w; x += LUM_AREA_SIDE)
            if (subsets->in[lum_area_subset_at(x, y)])
                ask_first(b, (size_t)(r.y + y) * b->pass->tiling.w + r.x + x, k);
}

void lum_area_trace_batch(struct lum_area_batch *b, struct lum_tile_rect r, uint16_t strata,
                          const struct lum_area_subsets *subsets)
{
    for (uint32_t left = strata; left; left &= left - 1)
        trace_stratum(b, r, (uint32_t)__builtin_ctz(left), subsets);
    lum_area_flush(b);
}
_Static_assert(LUM_CELL_SIDE % LUM_AREA_SIDE == 0 && LUM_CELL_SIDE % LUM_TILE_SIDE == 0,
               "packets are made of whole tiles of the pattern, and of the picture");

void lum_area_count(const struct lum_pass *pass, struct lum_area_visibility *s, struct lum_tile_rect r)
{
    struct lum_tiling subsets = lum_area_tiling(pass);
    for (uint32_t y = r.y / LUM_TILE_SIDE; y * LUM_TILE_SIDE < r.y + r.h; y++)
        for (uint32_t x = r.x / LUM_TILE_SIDE; x * LUM_TILE_SIDE < r.x + r.w; x++)
            s->told[y * pass->tiling.nx + x] = pass->layers->n_passes;
    for (uint32_t y = r.y / LUM_AREA_SIDE; y * LUM_AREA_SIDE < r.y + r.h; y++)
        for (uint32_t x = r.x / LUM_AREA_SIDE; x * LUM_AREA_SIDE < r.x + r.w; x++) {
            struct lum_tile_rect t = lum_tile_at(&subsets, y * subsets.nx + x);
            struct lum_visibility_tally sum = {0};
            uint64_t hash = 0;
            uint32_t dimmed = 0;
            for (uint32_t i = 0; i < t.w * t.h; i++) {
                size_t pixel = (size_t)(t.y + i / t.w) * pass->tiling.w + t.x + i % t.w;
                struct lum_visibility visibility = s->visibility[pixel];
                hash = lum_area_visibility_hash(hash, visibility);
                if (s->left && s->left[pixel]) {
                    hash ^= s->left[pixel];
                    dimmed |= s->left[pixel];
                }
                sum.known += (uint16_t)__builtin_popcount(visibility.traced | visibility.visible);
                sum.traced += (uint16_t)__builtin_popcount(visibility.traced);
                sum.visible += (uint16_t)__builtin_popcount(visibility.traced & visibility.visible);
            }
            s->tally[y * subsets.nx + x] = sum;
            s->hashes[y * subsets.nx + x] = hash;
            if (s->left)
                s->dimmed[y * subsets.nx + x] = dimmed != 0;
        }
}

/* The first stratum of the other pixels, where those that were asked first do not agree. */
#include "core/effect/area_shadow/area_trace.h"

/* Those that do not agree with those around. */
static void find_mixed(const struct lum_pass *pass, const struct lum_area_visibility *s, struct lum_tile_rect r,
                       struct lum_area_subsets *ret_mixed)
{
    struct lum_tiling subsets = lum_area_tiling(pass);
    uint8_t first[LUM_AREA_ACROSS + 2][LUM_AREA_ACROSS + 2] = {0}, row[LUM_AREA_ACROSS + 2][LUM_AREA_ACROSS];
    uint32_t x0 = r.x / LUM_AREA_SIDE, y0 = r.y / LUM_AREA_SIDE;
    for (uint32_t y = y0 > 0 ? y0 - 1 : 0; y < y0 + LUM_AREA_ACROSS + 1 && y < subsets.ny; y++)
        for (uint32_t x = x0 > 0 ? x0 - 1 : 0; x < x0 + LUM_AREA_ACROSS + 1 && x < subsets.nx; x++)
            first[y + 1 - y0][x + 1 - x0] = s->first[y * subsets.nx + x];
    for (uint32_t y = 0; y < LUM_AREA_ACROSS + 2; y++)
        for (uint32_t x = 0; x < LUM_AREA_ACROSS; x++)
            row[y][x] = first[y][x] | first[y][x + 1] | first[y][x + 2];
    for (uint32_t y = 0; y < LUM_AREA_ACROSS; y++)
        for (uint32_t x = 0; x < LUM_AREA_ACROSS; x++)
            ret_mixed->in[y * LUM_AREA_ACROSS + x] =
                (row[y][x] | row[y + 1][x] | row[y + 2][x]) == (LUM_AREA_LIT | LUM_AREA_DARK);
}

/* Drops what a tile of the pattern knows beyond what is asked first, so that a picture does not depend on what was
 * there before. (What refinement found out where all had agreed from the start stays.) */
static void drop_others(const struct lum_pass *pass, struct lum_area_visibility *s, struct lum_tile_rect t)
{
    for (uint32_t y = 0; y < t.h; y++)
        for (uint32_t x = 0; x < t.w; x++) {
            struct lum_visibility *visibility = &s->visibility[(size_t)(t.y + y) * pass->tiling.w + t.x + x];
            uint32_t k = lum_pattern_subset(LUM_AREA_SIDE, x, y);
            uint16_t keep = (uint16_t)(s->first_points & 1u << k);
            visibility->traced &= keep;
            visibility->visible &= keep;
            if (s->left && !(visibility->traced & visibility->visible))
                s->left[(size_t)(t.y + y) * pass->tiling.w + t.x + x] = 0;
        }
}

/* Drops what others know where they are not asked any more. True: any did. */
static bool drop_where_agreed(const struct lum_pass *pass, struct lum_area_visibility *s, struct lum_tile_rect r,
                              const struct lum_area_subsets *mixed)
{
    struct lum_tiling subsets = lum_area_tiling(pass);
    bool dropped = false;
    for (uint32_t y = r.y / LUM_AREA_SIDE; y * LUM_AREA_SIDE < r.y + r.h; y++)
        for (uint32_t x = r.x / LUM_AREA_SIDE; x * LUM_AREA_SIDE < r.x + r.w; x++) {
            uint32_t subset = y * subsets.nx + x;
            bool all = mixed->in[lum_area_subset_at(x * LUM_AREA_SIDE - r.x, y * LUM_AREA_SIDE - r.y)];
            if (s->all_asked[subset] == all)
                continue;
            if (!all)
                drop_others(pass, s, lum_tile_at(&subsets, subset));
            dropped |= !all;
            s->all_asked[subset] = all;
            s->open[subset] = 1;
        }
    return dropped;
}

/* True when the cell was filled since it was last asked, and since one that touches it last said something new. */
static bool is_filled(const struct lum_pass *pass, const struct lum_area_visibility *s, uint32_t cell)
{
    return s->filled[cell] >= s->asked[cell] && s->filled[cell] >= lum_latest_around(s->changed, &pass->cells, cell);
}

static void fill_cell(const struct lum_pass *pass, uint32_t cell, struct lum_counters *counters)
{
    struct lum_tile_rect r = lum_tile_at(&pass->cells, cell);
    struct lum_area_batch b;
    uint32_t a = 0;
    for (struct lum_layer *layer; pass->settings->max_depth > 0 && (layer = lum_area_next(pass, &a));) {
        struct lum_area_visibility *s = &layer->area;
        struct lum_area_subsets mixed;
        uint16_t others = (uint16_t)~lum_area_first_points(pass, layer);
        bool dropped = false;
        if (is_filled(pass, s, cell))
            continue;
        lum_area_begin(&b, pass, layer, counters);
        if (others) {
            find_mixed(pass, s, r, &mixed);
            dropped = drop_where_agreed(pass, s, r, &mixed);
            lum_area_trace_batch(&b, r, others, &mixed);
        }
        if (dropped || b.n_asked || s->asked[cell] > s->filled[cell])
            lum_area_count(pass, s, r);
        s->filled[cell] = pass->layers->n_passes;
    }
}

const struct lum_estimator lum_area_fill = {
    .name = "area shadow, fill",
    .stage = LUM_STAGE_SHADOW,
    .tile = fill_cell,
    .cells = true,
    .surfaces = true,
    .then = &lum_area_refine,
};

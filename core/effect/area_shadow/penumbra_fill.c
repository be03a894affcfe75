/* The first stratum of the other pixels, where those that were asked first do not agree. */
#include "core/effect/area_shadow/penumbra_ask.h"

/* Those that do not agree with those around. */
static void find_mixed(const struct lum_pass *pass, const struct lum_soft *s, struct lum_tile_rect r,
                       struct lum_soft_sets *ret_mixed)
{
    struct lum_tiling sets = lum_soft_tiling(pass);
    uint8_t first[LUM_SOFT_ACROSS + 2][LUM_SOFT_ACROSS + 2] = {0}, row[LUM_SOFT_ACROSS + 2][LUM_SOFT_ACROSS];
    uint32_t x0 = r.x / LUM_SOFT_SIDE, y0 = r.y / LUM_SOFT_SIDE;
    for (uint32_t y = y0 > 0 ? y0 - 1 : 0; y < y0 + LUM_SOFT_ACROSS + 1 && y < sets.ny; y++)
        for (uint32_t x = x0 > 0 ? x0 - 1 : 0; x < x0 + LUM_SOFT_ACROSS + 1 && x < sets.nx; x++)
            first[y + 1 - y0][x + 1 - x0] = s->first[y * sets.nx + x];
    for (uint32_t y = 0; y < LUM_SOFT_ACROSS + 2; y++)
        for (uint32_t x = 0; x < LUM_SOFT_ACROSS; x++)
            row[y][x] = first[y][x] | first[y][x + 1] | first[y][x + 2];
    for (uint32_t y = 0; y < LUM_SOFT_ACROSS; y++)
        for (uint32_t x = 0; x < LUM_SOFT_ACROSS; x++)
            ret_mixed->in[y * LUM_SOFT_ACROSS + x] =
                (row[y][x] | row[y + 1][x] | row[y + 2][x]) == (LUM_SOFT_LIT | LUM_SOFT_DARK);
}

/* Drops what a tile of the pattern knows beyond what is asked first, so that a picture does not depend on what was
 * there before. (What refinement found out where all had agreed from the start stays.) */
static void drop_others(const struct lum_pass *pass, struct lum_soft *s, struct lum_tile_rect t)
{
    for (uint32_t y = 0; y < t.h; y++)
        for (uint32_t x = 0; x < t.w; x++) {
            struct lum_seen *seen = &s->seen[(size_t)(t.y + y) * pass->tiling.w + t.x + x];
            uint32_t k = lum_pattern_set(LUM_SOFT_SIDE, x, y);
            uint16_t keep = (uint16_t)(s->first_points & 1u << k);
            seen->traced &= keep;
            seen->visible &= keep;
            if (s->left && !(seen->traced & seen->visible))
                s->left[(size_t)(t.y + y) * pass->tiling.w + t.x + x] = 0;
        }
}

/* Drops what others know where they are not asked any more. True: any did. */
static bool drop_where_agreed(const struct lum_pass *pass, struct lum_soft *s, struct lum_tile_rect r,
                              const struct lum_soft_sets *mixed)
{
    struct lum_tiling sets = lum_soft_tiling(pass);
    bool dropped = false;
    for (uint32_t y = r.y / LUM_SOFT_SIDE; y * LUM_SOFT_SIDE < r.y + r.h; y++)
        for (uint32_t x = r.x / LUM_SOFT_SIDE; x * LUM_SOFT_SIDE < r.x + r.w; x++) {
            uint32_t set = y * sets.nx + x;
            bool all = mixed->in[lum_soft_set_at(x * LUM_SOFT_SIDE - r.x, y * LUM_SOFT_SIDE - r.y)];
            if (s->all_asked[set] == all)
                continue;
            if (!all)
                drop_others(pass, s, lum_tile_at(&sets, set));
            dropped |= !all;
            s->all_asked[set] = all;
            s->open[set] = 1;
        }
    return dropped;
}

/* True when the packet was filled since it was last asked, and since one that touches it last said something new. */
static bool is_filled(const struct lum_pass *pass, const struct lum_soft *s, uint32_t packet)
{
    uint32_t x0 = packet % pass->packets.nx, y0 = packet / pass->packets.nx, news = s->asked[packet];
    for (uint32_t y = y0 > 0 ? y0 - 1 : 0; y <= y0 + 1 && y < pass->packets.ny; y++)
        for (uint32_t x = x0 > 0 ? x0 - 1 : 0; x <= x0 + 1 && x < pass->packets.nx; x++) {
            uint32_t at = y * pass->packets.nx + x;
            news = s->changed[at] > news ? s->changed[at] : news;
        }
    return s->filled[packet] >= news;
}

static void fill_packet(const struct lum_pass *pass, uint32_t packet, struct lum_counters *counters)
{
    struct lum_tile_rect r = lum_tile_at(&pass->packets, packet);
    struct lum_penumbra_batch b;
    uint32_t a = 0;
    for (struct lum_layer *layer; pass->settings->max_depth > 0 && (layer = lum_penumbra_next(pass, &a));) {
        struct lum_soft *s = &layer->soft;
        struct lum_soft_sets mixed;
        uint16_t others = (uint16_t)~lum_penumbra_first_points(pass, layer);
        bool dropped = false;
        if (is_filled(pass, s, packet))
            continue;
        lum_penumbra_begin(&b, pass, layer, counters);
        if (others) {
            find_mixed(pass, s, r, &mixed);
            dropped = drop_where_agreed(pass, s, r, &mixed);
            lum_penumbra_trace(&b, r, others, &mixed);
        }
        if (dropped || b.n_asked || s->asked[packet] > s->filled[packet])
            lum_penumbra_count(pass, s, r);
        s->filled[packet] = pass->layers->n_passes;
    }
}

const struct lum_estimator lum_penumbra_fill = {
    .name = "penumbra, fill",
    .stage = LUM_STAGE_SHADOW,
    .tile = fill_packet,
    .packets = true,
    .surfaces = true,
    .then = &lum_penumbra_refine,
};

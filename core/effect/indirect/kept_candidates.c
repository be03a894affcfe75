#include "core/effect/indirect/kept_candidates.h"

#include <string.h>

#include "core/effect/indirect/interpolated.h"
#include "core/effect/indirect/records.h"

void lum_kept_candidates_finish(struct lum_kept_candidates *kept)
{
    lum_free(kept->records);
    *kept = (struct lum_kept_candidates){0};
}

/* By size of the picture alone: what is listed must not depend on memory. */
static uint32_t most_within_budget(const struct lum_pass *pass)
{
    size_t most = LUM_KEPT_CANDIDATES_BYTES / (lum_interpolated_tiles(pass) * sizeof(struct lum_cache_record *));
    return most < LUM_TILE_RECORDS ? (uint32_t)most : LUM_TILE_RECORDS - 1;
}

static bool reserve(struct lum_kept_candidates *kept, uint32_t n, uint32_t most)
{
    if (n <= kept->capacity)
        return true;
    if (n > most)
        return false;
    uint32_t capacity = n + n / 2 + 4 < most ? n + n / 2 + 4 : most;
    struct lum_cache_record **records = lum_calloc(capacity, sizeof(struct lum_cache_record *));
    if (!records)
        return false;
    if (kept->n > 0)
        memcpy(records, kept->records, kept->n * sizeof(struct lum_cache_record *));
    lum_free(kept->records);
    kept->records = records;
    kept->capacity = capacity;
    return true;
}

static void find_all(struct lum_kept_candidates *kept, const struct lum_pass *pass, uint32_t tile,
                     const struct lum_pixel_mask *mask, const struct lum_lookup *lookup)
{
    struct lum_tile_points points;
    struct lum_cache_record *found[LUM_TILE_RECORDS];
    struct lum_candidates c = {0, found};
    lum_tile_points_load(&points, pass, tile, mask);
    kept->box = lum_tile_points_box_of(&points, 0, points.n);
    kept->n = 0;
    kept->known = true;
    kept->served = false;
    kept->listed = lum_tile_points_find(lookup, &points, &c) && reserve(kept, c.n, most_within_budget(pass));
    if (!kept->listed || c.n == 0)
        return;
    memcpy(kept->records, found, c.n * sizeof(struct lum_cache_record *));
    kept->n = c.n;
}

/* A record in the place of one that is gone was born later. */
static void drop_gone(struct lum_kept_candidates *kept)
{
    uint32_t n = 0;
    for (uint32_t k = 0; k < kept->n; k++)
        if (lum_store_holds(kept->records[k]) && kept->records[k]->born <= kept->born)
            kept->records[n++] = kept->records[k];
    kept->served = kept->served && n == kept->n;
    kept->n = n;
}

static void add_new(struct lum_kept_candidates *kept, const struct lum_lookup *lookup, uint32_t most)
{
    const struct lum_cache *cache = lookup->cache;
    struct lum_candidates c = {kept->n, kept->records};
    for (uint64_t b = kept->born + 1; b <= cache->n_born; b++) {
        struct lum_cache_record *r = cache->recent[b % LUM_CACHE_RECENT];
        if (r->born != b || !lum_store_holds(r) || !lum_tile_points_box_may_meet(lookup, &kept->box, r))
            continue;
        if (!reserve(kept, kept->n + 1, most)) {
            kept->listed = false;
            return;
        }
        kept->records[kept->n++] = r;
    }
    if (kept->n == c.n)
        return;
    c = (struct lum_candidates){kept->n, kept->records};
    lum_tile_points_sort(&c);
}

void lum_kept_candidates_update(struct lum_kept_candidates *kept, const struct lum_pass *pass, uint32_t tile,
                                const struct lum_pixel_mask *mask, const struct lum_lookup *lookup)
{
    const struct lum_cache *cache = lookup->cache;
    uint64_t removed = atomic_load_explicit(&cache->removed, memory_order_relaxed);
    if (kept->known && kept->holding == pass->records->holding && kept->pixel == lookup->pixel &&
        cache->n_born - kept->born < LUM_CACHE_RECENT && (kept->listed || cache->n_born == kept->born)) {
        if (kept->removed != removed)
            drop_gone(kept);
        add_new(kept, lookup, most_within_budget(pass));
    } else {
        find_all(kept, pass, tile, mask, lookup);
    }
    kept->holding = pass->records->holding;
    kept->pixel = lookup->pixel;
    kept->born = cache->n_born;
    kept->removed = removed;
}

#include "core/effect/indirect/nearby.h"

#include <string.h>

#include "core/effect/indirect/records.h"

void lum_nearby_finish(struct lum_nearby *nearby)
{
    lum_free(nearby->records);
    *nearby = (struct lum_nearby){0};
}

/* By size of the picture alone: what is listed must not depend on memory. */
static uint32_t most_within_budget(const struct lum_pass *pass)
{
    size_t most = LUM_NEARBY_BYTES / (pass->tiling.n * sizeof(struct lum_cache_record *));
    return most < LUM_SQUARE_RECORDS ? (uint32_t)most : LUM_SQUARE_RECORDS - 1;
}

static bool reserve(struct lum_nearby *nearby, uint32_t n, uint32_t most)
{
    if (n <= nearby->capacity)
        return true;
    if (n > most)
        return false;
    uint32_t capacity = n + n / 2 + 4 < most ? n + n / 2 + 4 : most;
    struct lum_cache_record **records = lum_calloc(capacity, sizeof(struct lum_cache_record *));
    if (!records)
        return false;
    if (nearby->n > 0)
        memcpy(records, nearby->records, nearby->n * sizeof(struct lum_cache_record *));
    lum_free(nearby->records);
    nearby->records = records;
    nearby->capacity = capacity;
    return true;
}

static void find_all(struct lum_nearby *nearby, const struct lum_pass *pass, uint32_t tile,
                     const struct lum_sites *sites, const struct lum_lookup *lookup)
{
    struct lum_square square;
    struct lum_cache_record *found[LUM_SQUARE_RECORDS];
    struct lum_candidates c = {0, found};
    lum_square_load(&square, pass, tile, sites);
    nearby->box = lum_square_box_of(&square, 0, square.n);
    nearby->n = 0;
    nearby->known = true;
    nearby->served = false;
    nearby->listed = lum_square_find(lookup, &square, &c) && reserve(nearby, c.n, most_within_budget(pass));
    if (!nearby->listed || c.n == 0)
        return;
    memcpy(nearby->records, found, c.n * sizeof(struct lum_cache_record *));
    nearby->n = c.n;
}

/* A record in the place of one that is gone was born later. */
static void drop_gone(struct lum_nearby *nearby)
{
    uint32_t n = 0;
    for (uint32_t k = 0; k < nearby->n; k++)
        if (lum_store_holds(nearby->records[k]) && nearby->records[k]->born <= nearby->born)
            nearby->records[n++] = nearby->records[k];
    nearby->served = nearby->served && n == nearby->n;
    nearby->n = n;
}

static void add_new(struct lum_nearby *nearby, const struct lum_lookup *lookup, uint32_t most)
{
    const struct lum_cache *cache = lookup->cache;
    struct lum_candidates c = {nearby->n, nearby->records};
    for (uint64_t b = nearby->born + 1; b <= cache->n_born; b++) {
        struct lum_cache_record *r = cache->recent[b % LUM_CACHE_RECENT];
        if (r->born != b || !lum_store_holds(r) || !lum_square_box_may_meet(lookup, &nearby->box, r))
            continue;
        if (!reserve(nearby, nearby->n + 1, most)) {
            nearby->listed = false;
            return;
        }
        nearby->records[nearby->n++] = r;
    }
    if (nearby->n == c.n)
        return;
    c = (struct lum_candidates){nearby->n, nearby->records};
    lum_square_sort(&c);
}

void lum_nearby_update(struct lum_nearby *nearby, const struct lum_pass *pass, uint32_t tile,
                       const struct lum_sites *sites, const struct lum_lookup *lookup)
{
    const struct lum_cache *cache = lookup->cache;
    uint64_t removed = atomic_load_explicit(&cache->removed, memory_order_relaxed);
    if (nearby->known && nearby->holding == pass->records->holding && nearby->pixel == lookup->pixel &&
        cache->n_born - nearby->born < LUM_CACHE_RECENT && (nearby->listed || cache->n_born == nearby->born)) {
        if (nearby->removed != removed)
            drop_gone(nearby);
        add_new(nearby, lookup, most_within_budget(pass));
    } else {
        find_all(nearby, pass, tile, sites, lookup);
    }
    nearby->holding = pass->records->holding;
    nearby->pixel = lookup->pixel;
    nearby->born = cache->n_born;
    nearby->removed = removed;
}

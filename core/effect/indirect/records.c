#include "core/effect/indirect/records.h"

#include <string.h>

#include "core/base/team.h"
#include "core/effect/indirect/interpolated.h"
#include "core/math/sampler.h"
#include "core/pass/share.h"

/* Records that are built together, of one neighbourhood; fewer where they would make less than CHUNKS_MIN chunks:
 * rounds are small, and all workers wait for the last. Not by their number, on which no picture depends. */
#define CHUNK_MAX 16u
#define CHUNKS_MIN 32u

struct lum_records_memory {
    uint32_t n_blocks;
    struct lum_pixel_mask *unserved; /* by tile */
    _Atomic uint64_t *found;         /* a bit by record's index: some tile has looked it up */
    size_t found_words;
    struct lum_cache_record **batch; /* to be built, or refreshed */
    uint32_t batch_capacity;
    /* what the records were made for; complete: and all of them were */
    bool complete;
    struct lum_versions versions;
    uint64_t surfaces, removed; /* removed: of the cache; more since: some may be gone */
    const struct lum_method *method;
};

/* One run. */
struct run {
    struct lum_cache *cache;
    struct lum_records_memory *memory;
    const struct lum_pass *pass;
    const struct lum_stage_runner *runner;
    struct lum_cache_counts *counts;
    void (*make)(const struct lum_cache_job *job); /* what is done with the batch */
    uint32_t n_batch;
    bool note;                                                 /* which records are found */
    enum { NOT_FULL, FULL_AT_ASKING, FULL_AT_INSERTING } full; /* the store has no room */
};

static void destroy_memory(struct lum_records_memory *m)
{
    if (!m)
        return;
    lum_free(m->unserved);
    lum_free((void *)m->found);
    lum_free(m->batch);
    lum_free(m);
}

void lum_records_finish(struct lum_records *records, struct lum_caches *caches)
{
    lum_cache_release(caches, records->cache);
    destroy_memory(records->memory);
    *records = (struct lum_records){.holding = records->holding};
}

/* ---- memory ---- */

static bool reserve_blocks(struct lum_records_memory *m, uint32_t n)
{
    if (m->n_blocks == n)
        return true;
    lum_free(m->unserved);
    m->unserved = lum_calloc(n, sizeof *m->unserved);
    m->n_blocks = m->unserved ? n : 0;
    return m->unserved != NULL;
}

static bool reserve_found(struct lum_records_memory *m, uint32_t n_records)
{
    size_t words = ((size_t)n_records + 63) / 64;
    if (words > m->found_words) {
        lum_free((void *)m->found);
        words += words / 2;
        m->found = lum_calloc(words, sizeof *m->found);
        m->found_words = m->found ? words : 0;
        return m->found != NULL;
    }
    for (size_t i = 0; i < words; i++)
        atomic_store_explicit(&m->found[i], 0, memory_order_relaxed);
    return true;
}

/* What is in the batch stays. */
static bool reserve_batch(struct lum_records_memory *m, uint32_t n)
{
    if (n <= m->batch_capacity)
        return true;
    uint32_t capacity = n + n / 2;
    struct lum_cache_record **batch = lum_calloc(capacity, sizeof(struct lum_cache_record *));
    if (!batch)
        return false;
    if (m->batch)
        memcpy(batch, m->batch, m->batch_capacity * sizeof(struct lum_cache_record *));
    lum_free(m->batch);
    m->batch = batch;
    m->batch_capacity = capacity;
    return true;
}

static enum lum_status reserve(struct run *run, struct lum_error *err)
{
    struct lum_records_memory *m = run->memory;
    if (reserve_blocks(m, lum_interpolated_tiles(run->pass)) && reserve_found(m, lum_store_limit(run->cache->store)))
        return LUM_OK;
    return lum_fail(err, LUM_ERR_NOMEM, "size", "out of memory for the records of %u x %u pixels", run->pass->tiling.w,
                    run->pass->tiling.h);
}

/* ---- who is served ---- */

/* Those of the tile's pixels that nobody was known to serve. */
static void serve_block(const struct run *run, uint32_t tile, uint32_t worker)
{
    struct lum_interpolated *mask = lum_interpolated_of(run->pass, tile);
    struct lum_kept_candidates *kept = &mask->kept;
    struct lum_pixel_mask *unserved = &run->memory->unserved[tile], all = lum_interpolated_all(mask);
    struct lum_lookup lookup = lum_lookup_of(run->cache, run->pass, worker);
    struct lum_candidates list;
    _Atomic uint64_t *found = run->note ? run->memory->found : NULL;
    if (lum_pixel_mask_none(unserved))
        return;
    lum_kept_candidates_update(kept, run->pass, tile, &all, &lookup);
    const struct lum_candidates *c = lum_kept_candidates_list(kept, &list);
    if (c && kept->served) {
        if (found)
            lum_tile_points_note(c, found);
        *unserved = (struct lum_pixel_mask){0};
        return;
    }
    struct lum_tile_points block;
    lum_tile_points_load(&block, run->pass, tile, unserved);
    lum_tile_points_serve(&lookup, c, &block, unserved, found);
    kept->served = lum_pixel_mask_none(unserved);
}

/* All pixels of a tile. */
static void look_at_block(void *ctx, uint32_t tile, struct lum_counters *counters)
{
    const struct run *run = ctx;
    run->memory->unserved[tile] = lum_interpolated_all(lum_interpolated_of(run->pass, tile));
    serve_block(run, tile, counters->worker);
}

/* Those that were not served when last looked at. */
static void look_again(void *ctx, uint32_t tile, struct lum_counters *counters)
{
    serve_block(ctx, tile, counters->worker);
}

static enum lum_status look(struct run *run, bool note, bool again)
{
    run->note = note;
    return lum_stage_loop(run->runner, lum_interpolated_tiles(run->pass), again ? look_again : look_at_block, run);
}

/* ---- stale records ---- */

static uint32_t chunk_size(const struct run *run)
{
    uint32_t size = run->n_batch / CHUNKS_MIN;
    return size < 1 ? 1 : size < CHUNK_MAX ? size : CHUNK_MAX;
}

static uint32_t n_chunks(const struct run *run)
{
    return (run->n_batch + chunk_size(run) - 1) / chunk_size(run);
}

static uint32_t chunk_length(const struct run *run, uint32_t chunk)
{
    uint32_t size = chunk_size(run), n = run->n_batch - chunk * size;
    return n < size ? n : size;
}

/* What others get of a record: whether it is still there, and if it is, all of it. */
static size_t told_bytes(const struct run *run)
{
    return sizeof(uint64_t) + lum_cache_told_bytes(run->cache);
}

/* A refresh may have removed it; new ones are private until they are inserted. */
static size_t tell(const struct run *run, struct lum_cache_record *r, unsigned char *at)
{
    uint64_t held = run->make == run->cache->key.kind->build || lum_store_holds(r);
    memcpy(at, &held, sizeof held);
    return sizeof held + (held ? lum_cache_tell(run->cache, r, at + sizeof held) : 0);
}

static size_t hear(const struct run *run, struct lum_cache_record *r, const unsigned char *at, uint32_t worker)
{
    uint64_t held;
    memcpy(&held, at, sizeof held);
    if (held)
        return sizeof held + lum_cache_hear(run->cache, r, at + sizeof held);
    if (lum_store_remove(run->cache->store, worker, r))
        atomic_fetch_add_explicit(&run->cache->removed, 1, memory_order_relaxed);
    return sizeof held;
}

static size_t make_chunk(void *ctx, uint32_t chunk, void *left, struct lum_counters *counters)
{
    const struct run *run = ctx;
    struct lum_cache_record **records = run->memory->batch + chunk * chunk_size(run);
    uint32_t n = chunk_length(run, chunk);
    run->make(&(struct lum_cache_job){
        .cache = run->cache,
        .snapshot = run->pass->snapshot,
        .records = records,
        .n = n,
        .pixel = run->pass->footprint,
        .eye = run->pass->eye.o,
        .worker = counters->worker,
        .counters = counters,
    });
    size_t n_bytes = 0;
    for (uint32_t i = 0; left && i < n; i++)
        n_bytes += tell(run, records[i], (unsigned char *)left + n_bytes);
    return n_bytes;
}

static void take_chunk_over(void *ctx, uint32_t chunk, const void *left, uint32_t worker)
{
    const struct run *run = ctx;
    struct lum_cache_record **records = run->memory->batch + chunk * chunk_size(run);
    const unsigned char *at = left;
    for (uint32_t i = 0; i < chunk_length(run, chunk); i++)
        at += hear(run, records[i], at, worker);
}

/* The batch, by all workers, and by all members of a team. */
static enum lum_status make_batch(struct run *run, void (*make)(const struct lum_cache_job *job))
{
    run->make = make;
    const struct lum_shared_loop loop = {n_chunks(run), chunk_size(run) * told_bytes(run), make_chunk, take_chunk_over,
                                         run};
    return lum_stage_share(run->runner, &loop);
}

/* Those of the records found that are stale; the others are reused as they are. */
static bool list_stale(struct run *run)
{
    uint32_t limit = lum_store_limit(run->cache->store);
    run->n_batch = 0;
    for (uint32_t word = 0; word * 64 < limit; word++) {
        uint64_t bits = atomic_load_explicit(&run->memory->found[word], memory_order_relaxed);
        for (; bits; bits &= bits - 1) {
            struct lum_cache_record *r = lum_store_at(run->cache->store, 64 * word + (uint32_t)__builtin_ctzll(bits));
            if (!r || !lum_cache_is_stale(run->cache, r)) {
                run->counts->reused += r != NULL;
                continue;
            }
            if (!reserve_batch(run->memory, run->n_batch + 1))
                return false;
            run->memory->batch[run->n_batch++] = r;
        }
    }
    return true;
}

static enum lum_status refresh(struct run *run, struct lum_error *err)
{
    if (!list_stale(run))
        return lum_fail(err, LUM_ERR_NOMEM, "", "out of memory for the records of a picture");
    if (run->n_batch == 0)
        return LUM_OK;
    uint64_t removed = atomic_load(&run->cache->removed);
    enum lum_status status = make_batch(run, run->cache->key.kind->refresh);
    if (status != LUM_OK)
        return status; /* cancelled: some are still stale, and refreshed again */
    removed = atomic_load(&run->cache->removed) - removed;
    for (uint32_t i = 0; i < run->n_batch; i++)
        run->memory->batch[i]->epoch = run->cache->epoch;
    atomic_fetch_add(&run->cache->updated, run->n_batch - (removed < run->n_batch ? (uint32_t)removed : run->n_batch));
    return removed > 0 ? look(run, false, false) : LUM_OK;
}

/* ---- rounds ---- */

/* The pixel nearest to the middle of a block of a tile, of those that are not served; LUM_TILE_PIXELS: all are. */
static uint32_t middle_site(const struct lum_pixel_mask *s, uint32_t x0, uint32_t y0, uint32_t side)
{
    uint32_t best = LUM_TILE_PIXELS, least = UINT32_MAX;
    for (uint32_t y = y0; y < y0 + side; y++)
        for (uint32_t x = x0; x < x0 + side; x++) {
            int32_t dx = 2 * (int32_t)(x - x0) + 1 - (int32_t)side, dy = 2 * (int32_t)(y - y0) + 1 - (int32_t)side;
            uint32_t d = (uint32_t)(dx * dx + dy * dy);
            if (d < least && lum_pixel_mask_has(s, y * LUM_TILE_SIDE + x)) {
                least = d;
                best = y * LUM_TILE_SIDE + x;
            }
        }
    return best;
}

void lum_records_create(struct lum_cache_record *r, const struct lum_pass *pass, size_t pixel, bool far)
{
    const struct lum_surfaces *s = pass->surfaces;
    const struct lum_snapshot *snapshot = pass->snapshot;
    uint32_t object = s->object[pixel];
    r->p = s->p[pixel];
    r->n = lum_v3_mul(s->n[pixel], far ? -1.0f : 1.0f);
    r->ng = lum_v3_mul(s->ng[pixel], far ? -1.0f : 1.0f);
    r->object = object < snapshot->n_instances ? lum_hash64_text(snapshot->instances[object].id) : 0;
}

/* A new record at a pixel; false: there is no room for it. */
static bool request(struct run *run, uint32_t tile, uint32_t slot)
{
    struct lum_records_memory *m = run->memory;
    struct lum_cache_record *r = reserve_batch(m, run->n_batch + 1) ? lum_store_new(run->cache->store, 0) : NULL;
    if (!r)
        return false;
    lum_records_create(r, run->pass, lum_tile_pixel(run->pass, tile, slot), lum_tile_is_far(run->pass, tile));
    r->epoch = run->cache->epoch;
    m->batch[run->n_batch++] = r;
    return true;
}

/* One for each block of `side` pixels of a tile. */
static bool request_in_tile(struct run *run, uint32_t tile, uint32_t side)
{
    const struct lum_pixel_mask *s = &run->memory->unserved[tile];
    for (uint32_t y = 0; y < LUM_TILE_SIDE; y += side)
        for (uint32_t x = 0; x < LUM_TILE_SIDE; x += side) {
            uint32_t slot = middle_site(s, x, y, side);
            if (slot < LUM_TILE_PIXELS && !request(run, tile, slot))
                return false;
        }
    return true;
}

/* One for each block of `side` tiles, in that of them which is nearest to its middle. first: 0, or of the far sides. */
static bool request_in_block(struct run *run, uint32_t first, uint32_t x0, uint32_t y0, uint32_t side)
{
    const struct lum_tiling *t = &run->pass->tiling;
    uint32_t best = UINT32_MAX, least = UINT32_MAX;
    for (uint32_t y = y0; y < y0 + side && y < t->ny; y++)
        for (uint32_t x = x0; x < x0 + side && x < t->nx; x++) {
            int32_t dx = 2 * (int32_t)(x - x0) + 1 - (int32_t)side, dy = 2 * (int32_t)(y - y0) + 1 - (int32_t)side;
            uint32_t d = (uint32_t)(dx * dx + dy * dy), tile = first + y * t->nx + x;
            if (d < least && !lum_pixel_mask_none(&run->memory->unserved[tile])) {
                least = d;
                best = tile;
            }
        }
    return best == UINT32_MAX || request(run, best, middle_site(&run->memory->unserved[best], 0, 0, LUM_TILE_SIDE));
}

static bool request_all(struct run *run, uint32_t side)
{
    const struct lum_tiling *t = &run->pass->tiling;
    uint32_t n = lum_interpolated_tiles(run->pass);
    run->n_batch = 0;
    if (side <= LUM_TILE_SIDE) {
        for (uint32_t tile = 0; tile < n; tile++)
            if (!lum_pixel_mask_none(&run->memory->unserved[tile]) && !request_in_tile(run, tile, side))
                return false;
        return true;
    }
    for (uint32_t first = 0; first < n; first += t->n)
        for (uint32_t y = 0; y < t->ny; y += side / LUM_TILE_SIDE)
            for (uint32_t x = 0; x < t->nx; x += side / LUM_TILE_SIDE)
                if (!request_in_block(run, first, x, y, side / LUM_TILE_SIDE))
                    return false;
    return true;
}

static void drop_batch(struct run *run)
{
    for (uint32_t i = 0; i < run->n_batch; i++)
        lum_store_drop(run->cache->store, 0, run->memory->batch[i]);
    run->n_batch = 0;
}

bool lum_records_are_sound(const struct lum_cache_record *r)
{
    bool sound = r->radius > 0.0f && isfinite(r->radius) && lum_rgb_finite(r->irradiance);
    for (uint32_t k = 0; k < 3; k++)
        sound = sound && lum_rgb_finite(r->gradient[k]);
    return sound;
}

/* By one thread, in order: so the tree, too, is the same for any number of them. What is not finite is a bug of the
 * kind, counted where all of them are. */
static bool insert_batch(struct run *run)
{
    for (uint32_t i = 0; i < run->n_batch; i++) {
        struct lum_cache_record *r = run->memory->batch[i];
        bool sound = lum_records_are_sound(r);
        run->runner->counters[0].nonfinite += !sound;
        if (sound && lum_store_insert(run->cache->store, 0, r)) {
            lum_cache_count(run->cache, r);
            atomic_fetch_add(&run->cache->created, 1);
            continue;
        }
        lum_store_drop(run->cache->store, 0, r);
        if (sound)
            run->full = FULL_AT_INSERTING;
    }
    bool apart = run->cache->key.storage == LUM_STORAGE_LOCAL; /* others do not find what is in worker 0's own tree */
    if (apart && lum_store_end_frame(run->cache->store, NULL) != LUM_OK)
        run->full = FULL_AT_INSERTING;
    return !run->full;
}

/* A store that has reached its size is full at all members of a team; one that memory is short for, at one, which would
 * make room while the others go on. Where a member stops is told when it stops, and by the others before each round, so
 * that they meet here: one that is full with what it inserts, and others that are full with what they ask for next, are
 * not at the same step. */
static void agree(const struct run *run)
{
    if (run->runner->team)
        lum_team_compare(run->runner->team, run->full, "the room for records of indirect light");
}

static enum lum_status make_round(struct run *run, uint32_t side)
{
    run->full = request_all(run, side) ? NOT_FULL : FULL_AT_ASKING;
    agree(run);
    if (run->full)
        drop_batch(run);
    if (run->n_batch == 0)
        return LUM_OK;
    enum lum_status status = make_batch(run, run->cache->key.kind->build);
    if (status != LUM_OK) { /* cancelled: some were not built */
        drop_batch(run);
        return status;
    }
    if (!insert_batch(run))
        return LUM_OK;
    return side > 1 ? look(run, false, true) : LUM_OK;
}

static enum lum_status make_rounds(struct run *run, struct lum_error *err)
{
    run->full = NOT_FULL;
    enum lum_status status = reserve(run, err);
    if (status == LUM_OK)
        status = look(run, true, false);
    if (status == LUM_OK)
        status = refresh(run, err);
    for (uint32_t side = LUM_RECORDS_BLOCK; side > 0 && status == LUM_OK && !run->full; side /= 2)
        status = make_round(run, side);
    if (status == LUM_OK)
        agree(run);
    return status;
}

/* ---- a run ---- */

enum lum_status lum_records_update(struct lum_records *records, struct lum_caches *caches,
                                   const struct lum_cache_key *key, const struct lum_cache_update *update,
                                   struct lum_error *err)
{
    if (!records->cache || !lum_cache_key_equal(key, &records->cache->key)) {
        struct lum_cache *cache = NULL;
        enum lum_status status = lum_cache_acquire(caches, key, &cache, err);
        if (status != LUM_OK)
            return status;
        lum_cache_release(caches, records->cache);
        records->cache = cache;
        records->holding++;
        if (records->memory)
            records->memory->complete = false; /* it was of the other one, and keys come back */
    }
    struct lum_cache *cache = records->cache;
    uint64_t updated = atomic_load(&cache->updated), removed = atomic_load(&cache->removed);
    enum lum_status status = lum_cache_update(cache, update, err);
    records->counts = (struct lum_cache_counts){
        .updated = atomic_load(&cache->updated) - updated,
        .removed = atomic_load(&cache->removed) - removed,
        .records = cache->store ? lum_store_count(cache->store) : 0,
    };
    return status;
}

/* True when the picture is what it was when its records were completed. */
static bool is_complete(const struct run *run)
{
    const struct lum_records_memory *m = run->memory;
    return m->complete && m->removed == atomic_load(&run->cache->removed) &&
           m->surfaces == run->pass->surfaces->version &&
           lum_versions_equal(&m->versions, &run->pass->snapshot->versions) && m->method == run->pass->settings->method;
}

static void remember(struct run *run)
{
    struct lum_records_memory *m = run->memory;
    m->complete = true;
    m->surfaces = run->pass->surfaces->version;
    m->removed = atomic_load(&run->cache->removed);
    m->versions = run->pass->snapshot->versions;
    m->method = run->pass->settings->method;
    (void)reserve_found(m, lum_store_limit(run->cache->store)); /* now, and not in the frames that follow */
}

/* While there is no room, others give way, or what the cache holds. */
static enum lum_status run_twice(struct run *run, struct lum_error *err)
{
    bool cleared = false;
    enum lum_status status = make_rounds(run, err);
    while (status == LUM_OK && run->full && lum_cache_make_room(run->cache, &cleared)) {
        run->counts->reused = 0;
        status = make_rounds(run, err);
    }
    if (status == LUM_OK && run->full)
        status = lum_fail(err, LUM_ERR_LIMIT, "size", "the cache has no room for the records of one picture: %u",
                          lum_store_count(run->cache->store));
    enum lum_status end = lum_store_end_frame(run->cache->store, status == LUM_OK ? err : NULL);
    return status != LUM_OK ? status : end;
}

enum lum_status lum_records_run(struct lum_records *records, const struct lum_pass *pass,
                                const struct lum_stage_runner *runner, struct lum_error *err)
{
    struct lum_cache *cache = records->cache;
    if (!records->memory && !(records->memory = lum_calloc(1, sizeof *records->memory)))
        return lum_fail(err, LUM_ERR_NOMEM, "", "out of memory for the records of a picture");
    struct run run = {
        .cache = cache, .memory = records->memory, .pass = pass, .runner = runner, .counts = &records->counts};
    if (is_complete(&run))
        return LUM_OK;
    records->memory->complete = false;
    uint64_t created = atomic_load(&cache->created), updated = atomic_load(&cache->updated);
    uint64_t removed = atomic_load(&cache->removed);
    enum lum_status status = run_twice(&run, err);
    records->counts.records = lum_store_count(cache->store);
    records->counts.created += atomic_load(&cache->created) - created;
    records->counts.updated += atomic_load(&cache->updated) - updated;
    records->counts.removed += atomic_load(&cache->removed) - removed;
    runner->stats->cache = records->counts;
    if (status == LUM_OK)
        remember(&run);
    return status;
}

static enum lum_status run_stage(struct lum_pass *pass, const struct lum_stage_runner *runner, struct lum_error *err)
{
    return lum_records_run(pass->records, pass, runner, err);
}

const struct lum_estimator lum_stage_records = {
    .name = "records", .stage = LUM_STAGE_RECORDS, .run = run_stage, .surfaces = true, .then = &lum_stage_cache};

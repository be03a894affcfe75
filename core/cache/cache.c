/* The registry of a scene's caches, and how an edit reaches them. */
#include "core/cache/cache.h"

#include "core/scene/motion.h"
#include "core/trace/stale.h"

/* A cache and who holds it. */
struct entry {
    struct lum_cache cache; /* first: what callers have is the address of both */
    struct entry *next;
    struct lum_caches *owner;
    uint32_t n_users;
    uint64_t used; /* greater: used later */
};

struct lum_caches {
    struct entry *entries;
    uint32_t n_workers;
    uint64_t n_used;
    struct lum_budget budget;
};

static struct entry *entry_of(struct lum_cache *cache)
{
    return (struct entry *)cache;
}

/* ---- one cache ---- */

static void forget_state(struct lum_cache *cache)
{
    if (cache->kind_state && cache->key.kind->finish)
        cache->key.kind->finish(cache);
    else
        lum_free(cache->kind_state);
    cache->kind_state = NULL;
}

void lum_cache_clear(struct lum_cache *cache)
{
    if (cache->store) {
        atomic_fetch_add_explicit(&cache->removed, lum_store_count(cache->store), memory_order_relaxed);
        lum_store_clear(cache->store);
    }
    forget_state(cache);
}

static void take_snapshot(struct lum_cache *cache, const struct lum_snapshot *s)
{
    if (s)
        lum_snapshot_ref(s);
    lum_snapshot_unref(cache->snapshot);
    cache->snapshot = s;
}

/* ---- what records take ---- */

static uint32_t n_slots(const struct lum_cache *cache)
{
    return lum_vpl_slots(cache->key.n_vpls, cache->key.n_sky);
}

static bool keeps_left(const struct lum_cache *cache)
{
    return cache->key.panes && cache->key.kind->left;
}

size_t lum_cache_bytes_of_kind(const struct lum_cache *cache)
{
    return cache->key.kind->record_bytes(n_slots(cache));
}

size_t lum_cache_record_bytes(const struct lum_cache *cache)
{
    size_t bytes = lum_cache_bytes_of_kind(cache);
    if (keeps_left(cache))
        bytes += ((n_slots(cache) + 15u) & ~15u) * sizeof(uint32_t);
    return bytes;
}

uint32_t *lum_cache_left(const struct lum_cache *cache, struct lum_cache_record *record)
{
    if (!keeps_left(cache))
        return NULL;
    return (uint32_t *)(void *)((char *)record + lum_cache_bytes_of_kind(cache));
}

static void destroy_entry(struct entry *e)
{
    forget_state(&e->cache);
    lum_store_destroy(e->cache.store);
    lum_vpl_finish(&e->cache.vpls);
    lum_snapshot_unref(e->cache.snapshot);
    lum_free(e);
}

static enum lum_status make_store(struct lum_cache *cache, struct lum_error *err)
{
    struct lum_store_config config = {
        .storage = cache->key.storage,
        .lo = lum_v3(-LUM_SCENE_REACH, -LUM_SCENE_REACH, -LUM_SCENE_REACH), /* objects come, and the store stays */
        .hi = lum_v3(LUM_SCENE_REACH, LUM_SCENE_REACH, LUM_SCENE_REACH),
        .n_workers = entry_of(cache)->owner->n_workers,
        .budget = &entry_of(cache)->owner->budget,
        .record_bytes = lum_cache_record_bytes(cache),
    };
    /* alike with and without a sky: what its records alone need is all that it costs */
    struct lum_cache with_sky = {.key = cache->key};
    with_sky.key.n_sky = LUM_VPL_SKY;
    size_t most = lum_cache_record_bytes(&with_sky);
    size_t fit = LUM_CACHE_BYTES / most;
    config.capacity = fit > LUM_STORE_MAX ? LUM_STORE_MAX : fit > 0 ? (uint32_t)fit : 1;
    return lum_store_create(&config, &cache->store, err);
}

static enum lum_status update_vpls(struct lum_cache *cache, const struct lum_cache_update *u,
                                   const struct lum_motion *since, struct lum_error *err)
{
    struct lum_vpl_request request = {
        .snapshot = u->snapshot,
        .n = cache->key.n_vpls,
        .max_bounces = cache->key.max_bounces,
        .seed = cache->key.seed,
        .media = cache->key.media,
        .scatters = cache->key.scatters,
        .lobes_off = cache->key.lobes_off,
        .gloss = cache->key.gloss,
        .pool = u->pool,
        .counters = u->counters,
        .n_sky = cache->key.n_sky,
        .tries = cache->key.kind->tries,
        .since = since,
        .since_geometry = cache->snapshot ? cache->snapshot->versions.geometry : 0,
    };
    enum lum_status status = lum_vpl_update(&cache->vpls, &request, err);
    if (status == LUM_OK)
        cache->moved = cache->vpls.moved;
    return status;
}

/* Nothing changed that an irradiance may depend on. */
static bool is_current(const struct lum_cache *cache, const struct lum_snapshot *snapshot)
{
    if (!cache->snapshot || !lum_normalisation_equal(&cache->snapshot->norm, &snapshot->norm))
        return false;
    struct lum_versions was = lum_versions_seen(cache->snapshot, cache->key.media);
    struct lum_versions now = lum_versions_seen(snapshot, cache->key.media);
    return !lum_is_stale(lum_edits_of_versions(&was, &now), LUM_PRODUCT_RECORDS);
}

/* The VPLs are new. */
static void tell_kind(struct lum_cache *cache, const struct lum_cache_update *u, const struct lum_motion *motion)
{
    cache->epoch++;
    if (!(cache->spacing > 0.0f)) /* nothing shone yet: no record knows a VPL */
        cache->spacing = cache->vpls.spacing;
    if (!motion->everything)
        cache->key.kind->change(cache, u, motion);
    else if (cache->snapshot) /* there may be records */
        lum_cache_clear(cache);
    if (lum_store_count(cache->store) == 0)
        cache->spacing = cache->vpls.spacing;
}

enum lum_status lum_cache_update(struct lum_cache *cache, const struct lum_cache_update *u, struct lum_error *err)
{
    entry_of(cache)->used = ++entry_of(cache)->owner->n_used;
    bool current = is_current(cache, u->snapshot);
    struct lum_motion motion = {.everything = true};
    if (!current && cache->snapshot && cache->key.kind->lasting)
        lum_motion_between(cache->snapshot, u->snapshot, &motion);
    enum lum_status status = cache->store ? LUM_OK : make_store(cache, err);
    if (status == LUM_OK && cache->key.kind->vpls)
        status = update_vpls(cache, u, &motion, err);
    if (status != LUM_OK) {
        lum_cache_clear(cache);
        take_snapshot(cache, NULL);
        return status;
    }
    if (!current)
        tell_kind(cache, u, &motion);
    take_snapshot(cache, u->snapshot);
    return LUM_OK;
}

/* ---- the registry ---- */

enum lum_status lum_caches_create(uint32_t n_workers, struct lum_caches **ret_caches, struct lum_error *err)
{
    struct lum_caches *caches = lum_calloc(1, sizeof *caches);
    if (!caches)
        return lum_fail(err, LUM_ERR_NOMEM, "", "out of memory for the irradiance caches");
    caches->n_workers = n_workers;
    caches->budget.limit = SIZE_MAX;
    *ret_caches = caches;
    return LUM_OK;
}

void lum_caches_destroy(struct lum_caches *caches)
{
    if (!caches)
        return;
    for (struct entry *e = caches->entries, *next; e; e = next) {
        next = e->next;
        destroy_entry(e);
    }
    lum_free(caches);
}

void lum_caches_set_limit(struct lum_caches *caches, size_t bytes)
{
    caches->budget.limit = bytes;
}

void lum_caches_forget(struct lum_caches *caches)
{
    for (struct entry *e = caches->entries; e; e = e->next) {
        lum_cache_clear(&e->cache);
        take_snapshot(&e->cache, NULL);
        e->cache.vpls.valid = false;
        lum_vpl_forget_rays(&e->cache.vpls);
    }
}

void lum_caches_measure(const struct lum_caches *caches, struct lum_caches_size *ret_size)
{
    *ret_size = (struct lum_caches_size){.record_bytes = atomic_load(&caches->budget.used)};
    for (const struct entry *e = caches->entries; e; e = e->next) {
        struct lum_store_stats stats;
        if (!e->cache.store)
            continue;
        lum_store_stats(e->cache.store, &stats);
        ret_size->records += lum_store_count(e->cache.store);
        ret_size->bytes += stats.bytes;
    }
}

bool lum_cache_key_equal(const struct lum_cache_key *a, const struct lum_cache_key *b)
{
    return a->kind == b->kind && a->storage == b->storage && a->n_vpls == b->n_vpls && a->n_sky == b->n_sky &&
           a->max_bounces == b->max_bounces && a->seed == b->seed && a->accuracy == b->accuracy &&
           a->media == b->media && a->scatters == b->scatters && a->lobes_off == b->lobes_off && a->gloss == b->gloss &&
           a->panes == b->panes;
}

enum lum_status lum_cache_acquire(struct lum_caches *caches, const struct lum_cache_key *key,
                                  struct lum_cache **ret_cache, struct lum_error *err)
{
    struct entry *e = caches->entries;
    while (e && !lum_cache_key_equal(&e->cache.key, key))
        e = e->next;
    if (!e) {
        e = lum_calloc(1, sizeof *e);
        if (!e)
            return lum_fail(err, LUM_ERR_NOMEM, "", "out of memory for an irradiance cache");
        e->cache.key = *key;
        e->owner = caches;
        e->next = caches->entries;
        caches->entries = e;
    }
    e->n_users++;
    *ret_cache = &e->cache;
    return LUM_OK;
}

/* Frees the idle cache that was used longest ago, if there are more than `most`. */
static bool drop_one_idle(struct lum_caches *caches, uint32_t most)
{
    struct entry **oldest = NULL;
    uint32_t n_idle = 0;
    for (struct entry **at = &caches->entries; *at; at = &(*at)->next) {
        if ((*at)->n_users > 0)
            continue;
        n_idle++;
        if (!oldest || (*at)->used < (*oldest)->used)
            oldest = at;
    }
    if (n_idle <= most)
        return false;
    struct entry *e = *oldest;
    *oldest = e->next;
    destroy_entry(e);
    return true;
}

void lum_cache_release(struct lum_caches *caches, struct lum_cache *cache)
{
    if (!cache)
        return;
    entry_of(cache)->n_users--;
    entry_of(cache)->used = ++caches->n_used;
    drop_one_idle(caches, LUM_CACHES_IDLE);
}

/* ---- when memory is used up ---- */

/* The cache, of another view, that was used longest ago begins anew, without its memory. False: none has any. */
static bool empty_another(struct lum_caches *caches, const struct lum_cache *but)
{
    struct entry *oldest = NULL;
    for (struct entry *e = caches->entries; e; e = e->next)
        if (&e->cache != but && e->cache.store && (!oldest || e->used < oldest->used))
            oldest = e;
    if (!oldest)
        return false;
    lum_cache_clear(&oldest->cache);
    lum_store_destroy(oldest->cache.store);
    oldest->cache.store = NULL; /* its next update makes another */
    lum_vpl_forget_rays(&oldest->cache.vpls);
    lum_cache_lose_count(&oldest->cache);
    take_snapshot(&oldest->cache, NULL);
    return true;
}

bool lum_cache_make_room(struct lum_cache *cache, bool *inout_cleared)
{
    struct lum_caches *caches = entry_of(cache)->owner;
    bool is_short = atomic_exchange(&caches->budget.refused, false);
    if (is_short && drop_one_idle(caches, 0))
        return true;
    bool again = !*inout_cleared || (is_short && empty_another(caches, cache));
    lum_cache_clear(cache); /* it holds mostly what nobody looks at any more, or half a picture */
    *inout_cleared = true;
    return again;
}

/* The storages from within: what a cache's cost, and how many searches a second they serve, by threads.
 *
 * Searches: the records lie at random on the faces of a cube, as many as a picture has and with balls as large as
 * there; the points that are looked up lie between them. Each job does some thousand operations. Storages and crews
 * take turns, forwards and backwards. Each sweep begins with the same records. */
#include <stdio.h>

#include "core/cache/cache.h"
#include "core/cache/kind.h"
#include "core/math/sampler.h"
#include "core/render/view.h"
#include "tests/bench/irrcache.h"

/* ---- caches ---- */

enum lum_status irr_cache_acquire(struct lum_caches *caches, const struct lum_view_settings *settings, bool panes,
                                  struct lum_cache **ret_cache, struct lum_error *err)
{
    struct lum_cache_key key = {
        .kind = &lum_cache_irradiance,
        .storage = settings->storage,
        .n_vpls = settings->n_vpls,
        .max_bounces = settings->max_depth - 1,
        .seed = settings->seed,
        .accuracy = settings->cache_accuracy,
        .panes = panes,
    };
    return lum_cache_acquire(caches, &key, ret_cache, err);
}

void irr_cache_release(struct lum_caches *caches, struct lum_cache *cache)
{
    lum_cache_release(caches, cache);
}

bool irr_cache_is_used(const struct lum_cache *cache)
{
    return cache->store != NULL;
}

void irr_cache_empty(struct lum_cache *cache)
{
    if (cache->store)
        lum_store_clear(cache->store);
}

double irr_cache_overhead(const struct lum_cache *cache)
{
    struct lum_store_stats s = {0};
    if (cache->store)
        lum_store_stats(cache->store, &s);
    switch (cache->key.storage) {
    case LUM_STORAGE_LOCK:
        return (double)s.lock_wait_ns * 1e-9;
    case LUM_STORAGE_LOCAL:
        return (double)s.merge_ns * 1e-9;
    case LUM_STORAGE_WAITFREE:
        return (double)s.contended;
    default:
        return 0.0;
    }
}

/* ---- lookups ---- */

enum { RECORDS = 3000, OPS = 2048, FOUND_MAX = 64 };
/* Of the cube's side: some seven balls hold each point. */
#define RADIUS 0.067f

struct sweep {
    struct lum_store *store;
    bool mixed;
    _Atomic uint64_t n_found, n_failed;
};

/* A point of the surface of [0, 1]^3, by number. */
static struct lum_vec3 point_at(uint32_t number, uint32_t salt, struct lum_vec3 *ret_n)
{
    float u[3];
    for (uint32_t k = 0; k < 3; k++)
        u[k] = (float)(lum_hash_combine(lum_hash_combine(salt, k), number) >> 8) * 0x1p-24f;
    uint32_t face = lum_hash_combine(salt ^ 77u, number) % 6u, axis = face / 2u;
    u[axis] = face % 2u ? 1.0f : 0.0f;
    float n[3] = {0.0f, 0.0f, 0.0f};
    n[axis] = face % 2u ? -1.0f : 1.0f;
    *ret_n = lum_v3(n[0], n[1], n[2]);
    return lum_v3(u[0], u[1], u[2]);
}

static bool insert(struct lum_store *store, uint32_t worker, uint32_t number, uint32_t salt)
{
    struct lum_cache_record *r = lum_store_new(store, worker);
    if (!r)
        return false;
    r->p = point_at(number, salt, &r->n);
    r->ng = r->n;
    r->radius = RADIUS;
    return lum_store_insert(store, worker, r);
}

static void sweep_job(void *ctx, uint32_t job, uint32_t worker)
{
    struct sweep *s = ctx;
    struct lum_cache_record *found[FOUND_MAX];
    uint64_t n_found = 0, n_failed = 0;
    for (uint32_t i = 0; i < OPS; i++) {
        struct lum_vec3 n;
        uint32_t number = job * OPS + i;
        if (s->mixed && i % IRR_INSERT_EVERY == 0)
            n_failed += !insert(s->store, worker, number, 2);
        else
            n_found += lum_store_find(s->store, worker, point_at(number, 1, &n), found, FOUND_MAX);
    }
    atomic_fetch_add(&s->n_found, n_found);
    atomic_fetch_add(&s->n_failed, n_failed);
}

/* A store and the pool that works on it. */
struct config {
    struct lum_store *store;
    struct lum_pool *pool;
    struct irr_lookups *out;
    bool mixed;
};

static bool refill(struct lum_store *store)
{
    lum_store_clear(store);
    for (uint32_t i = 0; i < RECORDS; i++)
        if (!insert(store, 0, i, 0))
            return false;
    struct lum_error err = {0};
    return lum_store_end_frame(store, &err) == LUM_OK;
}

static bool time_sweep(struct config *c, uint32_t n_jobs, size_t round, bool second)
{
    struct sweep s = {.store = c->store, .mixed = c->mixed};
    if (!refill(c->store))
        return fprintf(stderr, "lumend-bench: out of memory for records\n"), false;
    int64_t begin_ns = lum_clock_ns();
    (void)lum_pool_run(c->pool, n_jobs, sweep_job, &s, NULL);
    double seconds = (double)(lum_clock_ns() - begin_ns) * 1e-9;
    double n_ops = (double)n_jobs * OPS, n_searches = c->mixed ? n_ops * (1.0 - 1.0 / IRR_INSERT_EVERY) : n_ops;
    if (s.n_failed)
        return fprintf(stderr, "lumend-bench: out of memory for records\n"), false;
    c->out->per_s[round] += 0.5 * n_searches / seconds;
    c->out->found = (double)s.n_found / n_searches;
    c->out->n = round + second;
    return true;
}

static bool make_config(struct config *c, struct lum_pool *pool, enum irr_storage storage, uint32_t capacity)
{
    struct lum_error err = {0};
    struct lum_store_config config = {
        .storage = (enum lum_storage)storage,
        .hi = {1.0f, 1.0f, 1.0f},
        .n_workers = lum_pool_size(pool),
        .record_bytes = sizeof(struct lum_cache_record),
        .capacity = capacity,
    };
    c->pool = pool;
    if (lum_store_create(&config, &c->store, &err) == LUM_OK)
        return true;
    fprintf(stderr, "lumend-bench: %s\n", err.text);
    return false;
}

enum { CONFIGS = 2 * IRR_STORAGES * IRR_CREWS };

static bool measure(struct config *configs, size_t n, bool quick)
{
    uint32_t n_jobs = quick ? 16 : 64;
    size_t rounds = quick ? 2 : IRR_ROUNDS;
    for (size_t round = 0; round < rounds; round++) {
        fprintf(stderr, "irrcache: lookups, round %zu of %zu\n", round + 1, rounds);
        for (size_t i = 0; i < 2 * n; i++)
            if (!time_sweep(&configs[i < n ? i : 2 * n - 1 - i], n_jobs, round, i >= n))
                return false;
    }
    return true;
}

bool irr_measure_lookups(struct irr_study *study, bool quick)
{
    struct lum_pool *pools[IRR_CREWS] = {NULL};
    struct config configs[CONFIGS] = {{0}};
    struct lum_error err = {0};
    size_t n = 0;
    bool ok = true;
    uint32_t capacity = RECORDS + (quick ? 16 : 64) * OPS / IRR_INSERT_EVERY + 64 * irr_threads[IRR_CREWS - 1];
    for (uint32_t crew = 0; ok && crew < study->n_crews; crew++) {
        ok = lum_pool_create(irr_threads[crew], &pools[crew], &err) == LUM_OK;
        if (!ok)
            fprintf(stderr, "lumend-bench: %s\n", err.text);
        for (int k = 0; ok && k < 2 * IRR_STORAGES; k++) {
            enum irr_storage storage = (enum irr_storage)(k / 2);
            if (storage == IRR_TRA && irr_threads[crew] > 1)
                continue;
            struct config *c = &configs[n++];
            c->mixed = k % 2;
            c->out = &study->lookups[k % 2][storage][crew];
            ok = make_config(c, pools[crew], storage, capacity);
        }
    }
    ok = ok && measure(configs, n, quick);
    for (size_t i = 0; i < n; i++)
        lum_store_destroy(configs[i].store);
    for (uint32_t crew = 0; crew < IRR_CREWS; crew++)
        lum_pool_destroy(pools[crew]);
    return ok;
}

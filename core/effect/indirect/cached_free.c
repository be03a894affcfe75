/* Records made as the thesis publishes it (listings 7.1 to 7.4): a pixel that finds none makes one at once, and shares
 * it through the store. Who finds what depends on who came first, and so does the picture, by what is let pass in
 * interpolation. */
#include "core/effect/indirect/records.h"
#include "core/effect/indirect/interpolated.h"
#include "core/pass/components.h"
#include "core/pass/pass.h"

struct free_run {
    const struct lum_pass *pass;
    struct lum_cache *cache;
    const _Atomic bool *cancel; /* NULL: nobody does */
    _Atomic uint64_t *previous; /* bit by index: records from before the run that nobody has used in it */
    uint32_t n_history;         /* bits */
    uint32_t stride;            /* job k is tile k * stride, modulo their number, with which it has no common divisor */
};

static uint32_t common_divisor(uint32_t a, uint32_t b)
{
    return b == 0 ? a : common_divisor(b, a % b);
}

/* About the golden section of n tiles: then each is far from those before it, and workers are far apart at any time.
 * Side by side they would make the same records, each before it finds the other's: `cornell` took 2,676 in the order of
 * the tiles with one worker, 2,735 with two, and takes 2,333 with either, with the same error. */
static uint32_t stride_of(uint32_t n)
{
    uint32_t stride = (uint32_t)(0.618034 * n);
    while (stride > 1 && common_divisor(stride, n) != 1)
        stride--;
    return stride > 0 ? stride : 1;
}

static void note_use(const struct free_run *run, uint32_t index)
{
    uint64_t bit = 1ull << (index % 64);
    if (index < run->n_history && (atomic_load_explicit(&run->previous[index / 64], memory_order_relaxed) & bit))
        atomic_fetch_and_explicit(&run->previous[index / 64], ~bit, memory_order_relaxed);
}

static bool list_previous(struct free_run *run)
{
    const struct lum_store *store = run->cache->store;
    run->n_history = lum_store_limit(store);
    run->previous = lum_calloc(run->n_history / 64 + 1, sizeof *run->previous);
    for (uint32_t i = 0; run->previous && i < run->n_history; i++)
        if (lum_store_at(store, i))
            atomic_fetch_or_explicit(&run->previous[i / 64], 1ull << (i % 64), memory_order_relaxed);
    return run->previous != NULL;
}

static uint64_t count_unused(const struct free_run *run)
{
    uint64_t n = 0;
    for (uint32_t word = 0; word * 64 < run->n_history; word++)
        n += (uint64_t)__builtin_popcountll(atomic_load_explicit(&run->previous[word], memory_order_relaxed));
    return n;
}

static bool is_cancelled(const struct free_run *run)
{
    return run->cancel && atomic_load_explicit(run->cancel, memory_order_relaxed);
}

/* What the records around a point say: getIrradiance of listing 7.1. False: there are none. */
static bool look_up(const struct free_run *run, struct lum_vec3 p, struct lum_vec3 n, uint32_t worker,
                    struct lum_rgb *ret_irradiance)
{
    struct lum_cache_record *found[LUM_TILE_RECORDS];
    struct lum_lookup l = lum_lookup_of(run->cache, run->pass, worker);
    uint32_t n_found = lum_store_find(l.store, worker, p, found, LUM_TILE_RECORDS);
    struct lum_rgb sum = lum_grey(0.0f);
    float weights = 0.0f;
    for (uint32_t k = 0; k < n_found; k++) {
        if (!lum_record_is_fine(&l, found[k]))
            continue;
        float w = lum_weight_of(&l.weighting, l.metric, found[k], p, n);
        sum = lum_rgb_mad(sum, found[k]->irradiance, w);
        weights += w;
        if (w > 0.0f)
            note_use(run, found[k]->index);
    }
    if (!(weights > 0.0f)) /* what counts here serves: of WARD, which is all that comes here (of TENTS it is half) */
        return false;
    *ret_irradiance = lum_rgb_scale(sum, 1.0f / weights);
    return true;
}

/* ComputeIrradianceRT and insert. False: there is no room for a record. */
static bool make_record(const struct free_run *run, size_t pixel, bool far, struct lum_counters *counters,
                        struct lum_rgb *ret_irradiance)
{
    const struct lum_pass *pass = run->pass;
    struct lum_cache *cache = run->cache;
    struct lum_cache_record *r = lum_store_new(cache->store, counters->worker);
    if (!r)
        return false;
    lum_records_create(r, pass, pixel, far);
    r->epoch = cache->epoch;
    cache->key.kind->build(&(struct lum_cache_job){
        .cache = cache,
        .snapshot = pass->snapshot,
        .records = &r,
        .n = 1,
        .pixel = pass->footprint,
        .eye = pass->eye.o,
        .worker = counters->worker,
        .counters = counters,
    });
    bool sound = lum_records_are_sound(r);
    *ret_irradiance = sound ? r->irradiance : lum_grey(0.0f);
    counters->nonfinite += !sound;
    if (sound && lum_store_insert(cache->store, counters->worker, r)) {
        atomic_fetch_add_explicit(&cache->created, 1, memory_order_relaxed);
        return true;
    }
    lum_store_drop(cache->store, counters->worker, r);
    atomic_fetch_add_explicit(&cache->discarded, 1, memory_order_relaxed);
    return true;
}

/* ComputeIndirectDiffuse at a pixel; far: behind what it shows. False: there is no room. */
static bool find_irradiance(const struct free_run *run, size_t pixel, bool far, struct lum_counters *counters,
                            struct lum_rgb *ret_irradiance)
{
    const struct lum_surfaces *s = run->pass->surfaces;
    struct lum_vec3 n = lum_v3_mul(s->n[pixel], far ? -1.0f : 1.0f);
    return look_up(run, s->p[pixel], n, counters->worker, ret_irradiance) ||
           (!is_cancelled(run) && make_record(run, pixel, far, counters, ret_irradiance));
}

/* The same for the pixels of a tile, row by row. */
static void free_tile(void *ctx, uint32_t job, struct lum_counters *counters)
{
    const struct free_run *run = ctx;
    const struct lum_pass *pass = run->pass;
    uint32_t tile = (uint32_t)((uint64_t)job * run->stride % pass->tiling.n);
    const struct lum_surfaces *s = pass->surfaces;
    struct lum_rgb *smooth = pass->components->buffer[LUM_EFFECT_INDIRECT_DIFFUSE].smooth;
    struct lum_tile_rect r = lum_tile_at(&pass->tiling, tile);
    if (lum_components_enter(pass, LUM_EFFECT_INDIRECT_DIFFUSE, tile))
        return;
    bool sheets = lum_begin_far_sides(pass, tile);
    for (uint32_t i = 0; i < r.w * r.h; i++) {
        size_t pixel = (size_t)(r.y + i / r.w) * pass->tiling.w + r.x + i % r.w;
        struct lum_rgb irradiance = lum_grey(0.0f), behind = lum_grey(0.0f);
        bool matte = s->kind[pixel] & LUM_PIXEL_DIFFUSE, sheet = sheets && s->kind[pixel] & LUM_PIXEL_SHEET;
        if ((matte && !find_irradiance(run, pixel, false, counters, &irradiance)) ||
            (sheet && !find_irradiance(run, pixel, true, counters, &behind))) {
            lum_memo_set(&pass->components->made[LUM_EFFECT_INDIRECT_DIFFUSE], tile, 0); /* see run_freely */
            return;
        }
        if (matte)
            smooth[pixel] = lum_rgb_scale(irradiance, LUM_INV_PI);
        if (sheet)
            lum_show_far_side(pass, tile, i / r.w * LUM_TILE_SIDE + i % r.w, behind);
    }
}

static bool is_done(const struct lum_pass *pass)
{
    return lum_memo_is_whole(&pass->components->made[LUM_EFFECT_INDIRECT_DIFFUSE]);
}

static void all_tiles(void *ctx, uint32_t job, struct lum_counters *counters)
{
    (void)job;
    const struct free_run *run = ctx;
    for (uint32_t t = 0; t < run->pass->tiling.n && !is_cancelled(run); t++)
        free_tile(ctx, t, counters);
}

/* All tiles that are not done; by one thread where the store is for one. */
static enum lum_status run_tiles(struct free_run *run, const struct lum_stage_runner *runner)
{
    bool alone = run->cache->key.storage == LUM_STORAGE_SERIAL;
    enum lum_status status =
        alone ? lum_stage_loop(runner, 1, all_tiles, run) : lum_stage_loop(runner, run->pass->tiling.n, free_tile, run);
    return status == LUM_OK && is_cancelled(run) ? LUM_ERR_CANCELLED : status;
}

/* While there is no room, others give way, or what the cache holds. */
static enum lum_status run_freely(const struct lum_pass *pass, const struct lum_stage_runner *runner,
                                  struct lum_error *err)
{
    struct lum_records *records = pass->records;
    struct free_run run = {
        .pass = pass, .cache = records->cache, .cancel = runner->cancel, .stride = stride_of(pass->tiling.n)};
    struct lum_store *store = run.cache->store;
    if (is_done(pass))
        return LUM_OK;
    if (!list_previous(&run))
        return lum_fail(err, LUM_ERR_NOMEM, "", "out of memory for the records of a picture");
    uint64_t created = atomic_load(&run.cache->created), discarded = atomic_load(&run.cache->discarded);
    uint64_t removed = atomic_load(&run.cache->removed);
    uint64_t previous = count_unused(&run);
    bool cleared = false;
    enum lum_status status = run_tiles(&run, runner);
    while (status == LUM_OK && !is_done(pass) && lum_cache_make_room(run.cache, &cleared)) {
        if (cleared)
            run.n_history = 0;
        status = run_tiles(&run, runner);
    }
    records->counts.reused = run.n_history > 0 ? previous - count_unused(&run) : 0;
    lum_free((void *)run.previous);
    if (status == LUM_OK && !is_done(pass))
        status = lum_fail(err, LUM_ERR_LIMIT, "size", "the cache has no room for the records of one picture");
    records->counts.removed += atomic_load(&run.cache->removed) - removed;
    if (atomic_load(&run.cache->created) > created)
        lum_cache_lose_count(run.cache);
    enum lum_status end = lum_store_end_frame(store, status == LUM_OK ? err : NULL);
    records->counts.records = lum_store_count(store);
    records->counts.created += atomic_load(&run.cache->created) - created;
    records->counts.discarded += atomic_load(&run.cache->discarded) - discarded;
    runner->stats->cache = records->counts;
    return status != LUM_OK ? status : end;
}

static void cached_tile(void *ctx, uint32_t tile, struct lum_counters *counters)
{
    lum_estimator_cached.tile(ctx, tile, counters);
}

/* In two phases where the picture must not depend on the threads. */
static enum lum_status run_stage(struct lum_pass *pass, const struct lum_stage_runner *runner, struct lum_error *err)
{
    if (!pass->settings->deterministic)
        return run_freely(pass, runner, err);
    enum lum_status status = lum_records_run(pass->records, pass, runner, err);
    struct lum_pass copy = *pass;
    return status == LUM_OK ? lum_stage_loop(runner, pass->tiling.n, cached_tile, &copy) : status;
}

const struct lum_estimator lum_estimator_cached_free = {
    .name = "cached_free",
    .stage = LUM_STAGE_INDIRECT,
    .run = run_stage,
    .state = &lum_interpolated_kind,
    .components = LUM_EFFECT_BIT(LUM_EFFECT_INDIRECT_DIFFUSE),
    .surfaces = true,
    .then = &lum_stage_cache,
};

/* Proof sketch of the shared store. `reader`: inside lum_store_find or _overlap; `writer`: inside lum_store_insert.
 *
 * Every published record is found. A writer sees to it that each node from the root to its own has the child's pointer,
 * and then the child's bit (DEEPER, or HOLDS for the last) in the node's word, before it sets the READY bit of its
 * lane; it sets the child's bit itself if it does not see it, also where another thread attached the child. Words
 * change by atomic or/and only, so each change heads a release sequence that all later changes continue: a reader that
 * loads (acquire) a word with a bit set sees what the setter of that bit had seen and written: for a child's bit the
 * pointer and the child's zeroed memory; for READY the lane and the record. A reader that begins after the insertion
 * returned (in the order of happens-before) therefore finds all bits on the way, by coherence. Pages of a node are
 * chained the same way. That a search looks into every cell that may hold what is sought, with all roundings: octree.c,
 * can_reach.
 *
 * No reader sees half a record. Lanes are written between CLAIMED, which one thread alone can win (fetch_or tells the
 * bit's former value), and READY. Readers look at READY lanes only, and what they read there does not change until it
 * is reclaimed. An object's unwritten memory is never reachable: nodes and pages are zero, that is empty, when a CAS
 * attaches them.
 *
 * Each operation ends in a bounded number of its own steps, whatever the others do. Insertion: at most LUM_OCTREE_DEPTH
 * levels down, each with at most one CAS (who loses it goes on in the winner's child: listing 7.4 threw the sample
 * away), then along the node's pages, eight claims and one CAS each; a page without a free lane was filled by others,
 * so there are at most capacity / 8 + 1 of them. Search: the same nodes and pages; those are finite, and no step
 * repeats. lum_store_new: 64 claims in each chunk at most, and as many chunks as there are. Removal: one CAS, one
 * fetch_or. The one exception is memory: every 64 KiB of tree and every 64 records a worker asks lum_calloc, and malloc
 * may take a lock. Memory is kept, so that this ends once the cache has reached its size.
 *
 * Removal under readers is safe: quiescent-state reclamation by frames. A removal only sets bits (state, DEAD); lane,
 * record and index stay as they are. They are used again after lum_store_end_frame, which runs while nobody is inside:
 * each worker has passed a point where it holds no record, and the synchronisation that tells the caller so (the pool's
 * barrier) orders its last reads before the next use.
 *
 * `lock` runs the same code inside a mutex, `serial` by one thread, `local` with one root for each worker: its searches
 * go through the common tree, which nobody changes in a frame but for DEAD bits, and its own. */
#include "core/cache/store.h"

#include <pthread.h>
#include <string.h>

#include "core/cache/octree.h"
#include "core/cache/slab.h"

const char *const lum_storage_names[LUM_STORAGE_COUNT] = {
    [LUM_STORAGE_SERIAL] = "serial",
    [LUM_STORAGE_LOCK] = "lock",
    [LUM_STORAGE_LOCAL] = "local",
    [LUM_STORAGE_WAITFREE] = "waitfree",
};

/* Removals that are not worth it to build a tree anew. */
enum { BUILD_SLACK = 4096 };

/* lum_record.state */
enum { STATE_FREE, STATE_PRIVATE, STATE_LOCAL, STATE_SHARED, STATE_REMOVED };

/* What one worker alone touches while others are inside. */
struct worker {
    _Alignas(LUM_CACHE_LINE) struct lum_octree_arena arena;
    struct lum_octree_node *own; /* local: its tree; NULL: empty */
    uint32_t chunk;              /* of the slab */
    uint32_t removed;            /* index of the record that it took out last; LUM_SLAB_NONE: none in this frame */
    struct lum_store_stats stats;
};

struct lum_store {
    /* immutable */
    enum lum_storage storage;
    uint32_t n_workers;
    struct lum_octree_cell cell;
    /* shared as the proof says */
    struct lum_slab slab;
    struct lum_octree_node *root;
    pthread_mutex_t lock;
    /* one thread alone */
    struct lum_octree_arena arena; /* of the root, of what was merged and of what was built anew */
    uint64_t removed_since_build;  /* of the tree */
    struct worker workers[];
};

bool lum_storage_find(const char *name, enum lum_storage *ret_storage)
{
    for (int i = 0; i < LUM_STORAGE_COUNT; i++)
        if (strcmp(name, lum_storage_names[i]) == 0) {
            *ret_storage = (enum lum_storage)i;
            return true;
        }
    return false;
}

/* ---- life ---- */

#define COORDINATE_MAX 0x1p60f /* so that squares of distances stay finite */

static bool box_ok(struct lum_vec3 lo, struct lum_vec3 hi)
{
    return lo.x <= hi.x && lo.y <= hi.y && lo.z <= hi.z && lo.x >= -COORDINATE_MAX && lo.y >= -COORDINATE_MAX &&
           lo.z >= -COORDINATE_MAX && hi.x <= COORDINATE_MAX && hi.y <= COORDINATE_MAX && hi.z <= COORDINATE_MAX;
}

static enum lum_status check_config(const struct lum_store_config *c, struct lum_error *err)
{
    if ((int)c->storage < 0 || c->storage >= LUM_STORAGE_COUNT)
        return lum_fail(err, LUM_ERR_INVALID, "storage", "there is no storage %d", (int)c->storage);
    if (!box_ok(c->lo, c->hi))
        return lum_fail(err, LUM_ERR_INVALID, "box", "the box is inside out, not finite or larger than 2^60");
    if (c->n_workers < 1 || c->n_workers > LUM_STORE_WORKERS_MAX)
        return lum_fail(err, LUM_ERR_INVALID, "n_workers", "%u workers: 1 to %u", c->n_workers, LUM_STORE_WORKERS_MAX);
    if (c->record_bytes < sizeof(struct lum_cache_record) || c->record_bytes % 8 != 0)
        return lum_fail(err, LUM_ERR_INVALID, "record_bytes", "%zu bytes: a multiple of 8, at least %zu",
                        c->record_bytes, sizeof(struct lum_cache_record));
    if (c->capacity < 1 || c->capacity > LUM_STORE_MAX)
        return lum_fail(err, LUM_ERR_INVALID, "capacity", "%u records: 1 to %u", c->capacity, LUM_STORE_MAX);
    return LUM_OK;
}

enum lum_status lum_store_create(const struct lum_store_config *config, struct lum_store **ret_store,
                                 struct lum_error *err)
{
    enum lum_status status = check_config(config, err);
    if (status != LUM_OK)
        return status;
    struct lum_store *s = lum_calloc(1, sizeof *s + config->n_workers * sizeof s->workers[0]);
    if (!s)
        return lum_fail(err, LUM_ERR_NOMEM, "", "no memory for a cache");
    pthread_mutex_init(&s->lock, NULL); /* cannot fail: default attributes */
    s->storage = config->storage;
    s->n_workers = config->n_workers;
    s->cell = lum_octree_root_cell(config->lo, config->hi);
    for (uint32_t w = 0; w < s->n_workers; w++)
        s->workers[w].chunk = s->workers[w].removed = LUM_SLAB_NONE;
    if (!lum_slab_init(&s->slab, config->record_bytes, config->capacity, config->budget) ||
        !(s->root = lum_octree_node_new(&s->arena))) {
        lum_store_destroy(s);
        return lum_fail(err, LUM_ERR_NOMEM, "", "no memory for a cache of %u records", config->capacity);
    }
    *ret_store = s;
    return LUM_OK;
}

void lum_store_destroy(struct lum_store *store)
{
    if (!store)
        return;
    for (uint32_t w = 0; w < store->n_workers; w++)
        lum_octree_arena_finish(&store->workers[w].arena);
    lum_octree_arena_finish(&store->arena);
    lum_slab_finish(&store->slab);
    pthread_mutex_destroy(&store->lock);
    lum_free(store);
}

/* ---- the four storages ---- */

/* The clock is read only by who has to wait. */
static void enter(struct lum_store *s, struct worker *w)
{
    if (s->storage != LUM_STORAGE_LOCK || pthread_mutex_trylock(&s->lock) == 0)
        return;
    int64_t t0_ns = lum_clock_ns();
    pthread_mutex_lock(&s->lock);
    w->stats.lock_wait_ns += lum_clock_ns() - t0_ns;
}

static void leave(struct lum_store *s)
{
    if (s->storage == LUM_STORAGE_LOCK)
        pthread_mutex_unlock(&s->lock);
}

struct lum_cache_record *lum_store_new(struct lum_store *store, uint32_t worker)
{
    uint32_t index;
    struct lum_cache_record *r = lum_slab_take(&store->slab, &store->workers[worker].chunk, &index);
    if (!r)
        return NULL;
    /* all but the state, which lum_store_at may look at meanwhile */
    enum { STATE = offsetof(struct lum_cache_record, state), AFTER = STATE + sizeof r->state };
    memset(r, 0, STATE);
    memset((unsigned char *)r + AFTER, 0, sizeof *r - AFTER);
    r->index = index;
    atomic_store_explicit(&r->state, STATE_PRIVATE, memory_order_relaxed);
    return r;
}

void lum_store_drop(struct lum_store *store, uint32_t worker, struct lum_cache_record *record)
{
    (void)worker;
    atomic_store_explicit(&record->state, STATE_FREE, memory_order_relaxed);
    lum_slab_give(&store->slab, record->index);
}

static struct lum_octree_insertion insertion_of(const struct lum_store *s, struct lum_octree_arena *arena,
                                                const struct lum_cache_record *r)
{
    return (struct lum_octree_insertion){.cell = &s->cell, .arena = arena, .entry = {r->p, r->radius, r->index}};
}

/* Place and state are written before the lane is published: who finds the record may remove it at once. */
static bool share(struct lum_store *s, struct worker *w, struct lum_cache_record *r)
{
    if (s->storage == LUM_STORAGE_LOCAL && !w->own && !(w->own = lum_octree_node_new(&w->arena)))
        return false;
    struct lum_octree_insertion in = insertion_of(s, &w->arena, r);
    bool done = lum_octree_reserve(s->storage == LUM_STORAGE_LOCAL ? w->own : s->root, &in);
    w->stats.contended += in.contended;
    if (!done)
        return false;
    lum_slab_note(&s->slab, r->index)->place = in.place;
    atomic_store_explicit(&r->state, s->storage == LUM_STORAGE_LOCAL ? STATE_LOCAL : STATE_SHARED,
                          memory_order_release);
    lum_octree_publish(in.place);
    w->stats.inserted++;
    return true;
}

bool lum_store_insert(struct lum_store *store, uint32_t worker, struct lum_cache_record *record)
{
    struct worker *w = &store->workers[worker];
    enter(store, w);
    bool done = share(store, w, record);
    leave(store);
    return done;
}

uint32_t lum_store_overlap(struct lum_store *store, uint32_t worker, struct lum_vec3 lo, struct lum_vec3 hi,
                           struct lum_cache_record **ret_records, uint32_t max)
{
    struct worker *w = &store->workers[worker];
    struct lum_octree_query q = {&store->cell, &store->slab, lo, hi, ret_records, 0, max};
    enter(store, w);
    lum_octree_search(store->root, &q);
    if (w->own)
        lum_octree_search(w->own, &q);
    leave(store);
    if (q.n <= max)
        return q.n;
    w->stats.overflowed += q.n - max;
    return max;
}

uint32_t lum_store_find(struct lum_store *store, uint32_t worker, struct lum_vec3 p,
                        struct lum_cache_record **ret_records, uint32_t max)
{
    return lum_store_overlap(store, worker, p, p, ret_records, max);
}

bool lum_store_remove(struct lum_store *store, uint32_t worker, struct lum_cache_record *record)
{
    struct worker *w = &store->workers[worker];
    uint32_t state = atomic_load_explicit(&record->state, memory_order_acquire);
    if (state != STATE_SHARED && state != STATE_LOCAL)
        return false;
    if (!atomic_compare_exchange_strong_explicit(&record->state, &state, STATE_REMOVED, memory_order_acq_rel,
                                                 memory_order_acquire))
        return false; /* another worker removed it: no other change is possible in a frame */
    struct lum_slab_note *note = lum_slab_note(&store->slab, record->index);
    enter(store, w);
    lum_octree_hide(note->place);
    leave(store);
    note->next = w->removed;
    w->removed = record->index;
    w->stats.removed++;
    return true;
}

/* ---- by one thread ---- */

bool lum_store_holds(const struct lum_cache_record *record)
{
    uint32_t state = atomic_load_explicit(&record->state, memory_order_acquire);
    return state == STATE_SHARED || state == STATE_LOCAL;
}

struct lum_cache_record *lum_store_at(const struct lum_store *store, uint32_t index)
{
    if (index >= store->slab.capacity || !lum_slab_chunk_of(&store->slab, index))
        return NULL;
    struct lum_cache_record *r = lum_slab_at(&store->slab, index);
    return lum_store_holds(r) ? r : NULL;
}

uint32_t lum_store_limit(const struct lum_store *store)
{
    return lum_slab_limit(&store->slab);
}

uint32_t lum_store_count(const struct lum_store *store)
{
    struct lum_store_stats stats;
    lum_store_stats(store, &stats);
    return (uint32_t)(stats.inserted - stats.removed);
}

/* What was taken out gives back its lane and its memory. */
static void reclaim(struct lum_store *s)
{
    for (uint32_t w = 0; w < s->n_workers; w++) {
        for (uint32_t i = s->workers[w].removed; i != LUM_SLAB_NONE; i = lum_slab_note(&s->slab, i)->next) {
            lum_octree_free_lane(lum_slab_note(&s->slab, i)->place);
            atomic_store_explicit(&lum_slab_at(&s->slab, i)->state, STATE_FREE, memory_order_relaxed);
            lum_slab_give(&s->slab, i);
            s->removed_since_build++;
        }
        s->workers[w].removed = LUM_SLAB_NONE;
    }
}

/* Listing 7.3, the end of the frame: in the order of the indices, whichever worker's tree a record is in. Where memory
 * runs short, the rest stays where it is, and the next end of a frame tries again. */
static bool merge(struct lum_store *s)
{
    for (uint32_t i = 0; i < lum_store_limit(s); i++) {
        struct lum_cache_record *r = lum_store_at(s, i);
        if (!r || atomic_load_explicit(&r->state, memory_order_relaxed) != STATE_LOCAL)
            continue;
        struct lum_octree_insertion in = insertion_of(s, &s->arena, r);
        if (!lum_octree_reserve(s->root, &in))
            return false;
        struct lum_slab_note *note = lum_slab_note(&s->slab, i);
        lum_octree_free_lane(note->place);
        note->place = in.place;
        atomic_store_explicit(&r->state, STATE_SHARED, memory_order_relaxed);
        lum_octree_publish(in.place);
    }
    for (uint32_t w = 0; w < s->n_workers; w++) {
        s->workers[w].own = NULL;
        lum_octree_arena_rewind(&s->workers[w].arena);
    }
    return true;
}

/* Nodes outlive their records: where things move about, the tree would grow for ever. So it is built anew once more
 * records were removed from it than it holds; that doubles the cost of an insertion at most. Without memory for that
 * the old one stays. */
static void build_anew(struct lum_store *s)
{
    uint32_t limit = lum_store_limit(s);
    struct lum_octree_arena arena = {0};
    struct lum_octree_node *root = lum_octree_node_new(&arena);
    struct lum_place *places = lum_calloc(limit, sizeof *places);
    bool done = root && places;
    for (uint32_t i = 0; done && i < limit; i++) {
        const struct lum_cache_record *r = lum_store_at(s, i);
        if (!r)
            continue;
        struct lum_octree_insertion in = insertion_of(s, &arena, r);
        done = lum_octree_reserve(root, &in);
        places[i] = in.place;
        if (done)
            lum_octree_publish(in.place);
    }
    if (done) {
        for (uint32_t i = 0; i < limit; i++)
            if (places[i].page)
                lum_slab_note(&s->slab, i)->place = places[i];
        lum_octree_arena_finish(&s->arena);
        for (uint32_t w = 0; w < s->n_workers; w++)
            lum_octree_arena_rewind(&s->workers[w].arena);
        s->arena = arena;
        s->root = root;
        s->removed_since_build = 0;
    } else {
        lum_octree_arena_finish(&arena);
    }
    lum_free(places);
}

static void restart_slab(struct lum_store *s)
{
    lum_slab_restart(&s->slab);
    for (uint32_t w = 0; w < s->n_workers; w++)
        s->workers[w].chunk = LUM_SLAB_NONE;
}

enum lum_status lum_store_end_frame(struct lum_store *store, struct lum_error *err)
{
    reclaim(store);
    bool merged = true;
    if (store->storage == LUM_STORAGE_LOCAL) {
        int64_t t0_ns = lum_clock_ns();
        merged = merge(store);
        store->workers[0].stats.merge_ns += lum_clock_ns() - t0_ns;
    }
    if (merged && store->removed_since_build > lum_store_count(store) + BUILD_SLACK)
        build_anew(store);
    restart_slab(store);
    return merged ? LUM_OK : lum_fail(err, LUM_ERR_NOMEM, "", "no memory to merge the records of the workers");
}

void lum_store_clear(struct lum_store *store)
{
    reclaim(store);
    uint32_t limit = lum_store_limit(store);
    for (uint32_t i = 0; i < limit; i++) {
        struct lum_cache_record *r = lum_store_at(store, i);
        if (!r)
            continue;
        atomic_store_explicit(&r->state, STATE_FREE, memory_order_relaxed);
        lum_slab_give(&store->slab, i);
        store->workers[0].stats.removed++;
    }
    for (uint32_t w = 0; w < store->n_workers; w++) {
        store->workers[w].own = NULL;
        lum_octree_arena_rewind(&store->workers[w].arena);
    }
    lum_octree_arena_rewind(&store->arena);
    store->root = lum_octree_node_new(&store->arena); /* its first block is still there */
    store->removed_since_build = 0;
    restart_slab(store);
}

void lum_store_stats(const struct lum_store *store, struct lum_store_stats *ret_stats)
{
    struct lum_store_stats sum = {.bytes = sizeof *store + store->n_workers * sizeof store->workers[0] +
                                           store->arena.bytes + atomic_load(&store->slab.bytes)};
    for (uint32_t w = 0; w < store->n_workers; w++) {
        const struct lum_store_stats *s = &store->workers[w].stats;
        sum.inserted += s->inserted;
        sum.removed += s->removed;
        sum.contended += s->contended;
        sum.overflowed += s->overflowed;
        sum.lock_wait_ns += s->lock_wait_ns;
        sum.merge_ns += s->merge_ns;
        sum.bytes += store->workers[w].arena.bytes;
    }
    *ret_stats = sum;
}

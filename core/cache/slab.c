#include "core/cache/slab.h"

bool lum_slab_init(struct lum_slab *slab, size_t record_bytes, uint32_t capacity, struct lum_budget *budget)
{
    uint32_t n_chunks = (capacity + LUM_SLAB_CHUNK - 1) / LUM_SLAB_CHUNK;
    *slab =
        (struct lum_slab){.record_bytes = record_bytes, .budget = budget, .capacity = capacity, .n_chunks = n_chunks};
    slab->chunks = lum_calloc(n_chunks, sizeof *slab->chunks);
    slab->free = lum_calloc(n_chunks, sizeof *slab->free);
    if (!slab->chunks || !slab->free)
        return false;
    slab->bytes = n_chunks * (sizeof *slab->chunks + sizeof *slab->free);
    for (uint32_t c = 0; c < n_chunks; c++)
        slab->free[c] = UINT64_MAX;
    if (capacity % LUM_SLAB_CHUNK)
        slab->free[n_chunks - 1] = (UINT64_C(1) << capacity % LUM_SLAB_CHUNK) - 1;
    return true;
}

static size_t chunk_bytes(const struct lum_slab *slab)
{
    return sizeof(struct lum_slab_chunk) + LUM_SLAB_CHUNK * slab->record_bytes;
}

static void give_back(struct lum_slab *slab)
{
    if (slab->budget)
        atomic_fetch_sub_explicit(&slab->budget->used, chunk_bytes(slab), memory_order_relaxed);
}

/* Counts a chunk more. Two that ask at once may both be refused where there is room for one. */
static bool may_grow(struct lum_slab *slab)
{
    struct lum_budget *b = slab->budget;
    if (!b)
        return true;
    size_t bytes = chunk_bytes(slab), used = atomic_fetch_add_explicit(&b->used, bytes, memory_order_relaxed);
    if (used <= b->limit && bytes <= b->limit - used)
        return true;
    give_back(slab);
    atomic_store_explicit(&b->refused, true, memory_order_relaxed);
    return false;
}

void lum_slab_finish(struct lum_slab *slab)
{
    for (uint32_t c = 0; slab->chunks && c < slab->n_chunks; c++) {
        if (slab->chunks[c])
            give_back(slab);
        lum_free(slab->chunks[c]);
    }
    lum_free(slab->free);
    lum_free(slab->chunks);
}

/* Two workers may come here for one chunk, when records run out: the memory of the first is used. */
static bool chunk_has_memory(struct lum_slab *slab, uint32_t c)
{
    struct lum_slab_chunk *old = atomic_load_explicit(&slab->chunks[c], memory_order_acquire);
    if (old)
        return true;
    size_t bytes = chunk_bytes(slab);
    if (!may_grow(slab))
        return atomic_load_explicit(&slab->chunks[c], memory_order_acquire) != NULL; /* another's was the last */
    struct lum_slab_chunk *fresh = lum_calloc(1, bytes);
    if (!fresh) {
        give_back(slab);
        return false;
    }
    if (atomic_compare_exchange_strong_explicit(&slab->chunks[c], &old, fresh, memory_order_acq_rel,
                                                memory_order_acquire))
        atomic_fetch_add_explicit(&slab->bytes, bytes, memory_order_relaxed);
    else {
        give_back(slab);
        lum_free(fresh);
    }
    return true;
}

/* At most 64 tries: a bit that was seen and is gone was taken by another. */
static struct lum_cache_record *take_from(struct lum_slab *slab, uint32_t c, uint32_t *ret_index)
{
    uint64_t seen = atomic_load_explicit(&slab->free[c], memory_order_relaxed);
    if (!seen || !chunk_has_memory(slab, c))
        return NULL;
    for (; seen; seen &= seen - 1) {
        uint64_t bit = seen & -seen;
        /* acquire: pairs with lum_slab_give, whose thread may have written the record */
        if (atomic_fetch_and_explicit(&slab->free[c], ~bit, memory_order_acquire) & bit) {
            *ret_index = c * LUM_SLAB_CHUNK + (uint32_t)__builtin_ctzll(bit);
            return lum_slab_at(slab, *ret_index);
        }
    }
    return NULL;
}

struct lum_cache_record *lum_slab_take(struct lum_slab *slab, uint32_t *chunk, uint32_t *ret_index)
{
    struct lum_cache_record *r = NULL;
    while (*chunk < slab->n_chunks || *chunk == LUM_SLAB_NONE) {
        if (*chunk != LUM_SLAB_NONE && (r = take_from(slab, *chunk, ret_index)))
            return r;
        if (*chunk != LUM_SLAB_NONE && !slab->chunks[*chunk])
            return NULL; /* no memory: tries again with this chunk */
        *chunk = atomic_fetch_add_explicit(&slab->cursor, 1u, memory_order_relaxed);
    }
    for (uint32_t c = 0; c < slab->n_chunks; c++)
        if ((r = take_from(slab, c, ret_index)))
            return r;
    return NULL;
}

void lum_slab_give(struct lum_slab *slab, uint32_t index)
{
    atomic_fetch_or_explicit(&slab->free[index / LUM_SLAB_CHUNK], UINT64_C(1) << index % LUM_SLAB_CHUNK,
                             memory_order_release);
}

/* Chunks that may have memory: those before. */
static uint32_t touched(const struct lum_slab *slab)
{
    uint32_t cursor = atomic_load_explicit(&slab->cursor, memory_order_relaxed);
    uint32_t n = cursor > slab->high ? cursor : slab->high;
    return n < slab->n_chunks ? n : slab->n_chunks;
}

void lum_slab_restart(struct lum_slab *slab)
{
    slab->high = touched(slab);
    uint32_t c = 0;
    while (c < slab->n_chunks && !slab->free[c])
        c++;
    slab->cursor = c;
}

uint32_t lum_slab_limit(const struct lum_slab *slab)
{
    uint32_t n = touched(slab);
    return n == slab->n_chunks ? slab->capacity : n * LUM_SLAB_CHUNK;
}

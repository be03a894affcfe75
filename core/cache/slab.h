/* The memory of a store's records (store.h): chunks of 64 that stay where they are, and who may use which.
 *
 * A word per chunk has a bit for each free record. Each worker takes records from a chunk of its own, the lowest free
 * one first, and goes on to the next chunk that no other worker has; when all are taken, from any that has one left, so
 * that the capacity is met exactly. Which index comes next depends only on the calls, as long as one thread makes them.
 */
#ifndef LUM_CORE_CACHE_SLAB_H
#define LUM_CORE_CACHE_SLAB_H

#include "core/cache/store.h"

#define LUM_SLAB_CHUNK 64u       /* records: one word tells which are free */
#define LUM_SLAB_NONE UINT32_MAX /* no chunk yet */

struct lum_octree_page;
/* Where in the octree a record is. */
struct lum_place {
    struct lum_octree_page *page;
    uint32_t lane;
};

/* What the store keeps of a record beside it. */
struct lum_slab_note {
    struct lum_place place;
    uint32_t next; /* index of the next one that its worker took out in this frame */
};

struct lum_slab_chunk {
    struct lum_slab_note notes[LUM_SLAB_CHUNK];
    _Alignas(LUM_CACHE_LINE) unsigned char records[];
};

struct lum_slab {
    size_t record_bytes;
    struct lum_budget *budget; /* NULL: none */
    uint32_t capacity, n_chunks;
    _Atomic(struct lum_slab_chunk *) *chunks; /* NULL: no memory yet */
    _Atomic uint64_t *free;                   /* bit i of word c: record 64 c + i is */
    _Atomic uint32_t cursor;                  /* the next chunk that no worker has had in this frame */
    uint32_t high;                            /* chunks before it may have memory; and those before the cursor */
    _Atomic size_t bytes;
};

/* budget: may be NULL. False: memory is short; finish it all the same. */
LUM_MUST_USE bool lum_slab_init(struct lum_slab *slab, size_t record_bytes, uint32_t capacity,
                                struct lum_budget *budget);
void lum_slab_finish(struct lum_slab *slab); /* accepts a zeroed one */

/* A record that is nobody else's, as it was left. chunk: the worker's own, LUM_SLAB_NONE at first. NULL: all are taken,
 * or memory is short. Thread: any. */
struct lum_cache_record *lum_slab_take(struct lum_slab *slab, uint32_t *chunk, uint32_t *ret_index);
void lum_slab_give(struct lum_slab *slab, uint32_t index); /* Thread: any */
/* Starts over with the lowest chunk that has a free record; the workers' chunks become LUM_SLAB_NONE. Thread: one
 * alone. */
void lum_slab_restart(struct lum_slab *slab);

static inline struct lum_slab_chunk *lum_slab_chunk_of(const struct lum_slab *slab, uint32_t index)
{
    return atomic_load_explicit(&slab->chunks[index / LUM_SLAB_CHUNK], memory_order_acquire);
}
/* The memory of an index that was taken once. */
static inline struct lum_cache_record *lum_slab_at(const struct lum_slab *slab, uint32_t index)
{
    return (void *)(lum_slab_chunk_of(slab, index)->records + (index % LUM_SLAB_CHUNK) * slab->record_bytes);
}
static inline struct lum_slab_note *lum_slab_note(const struct lum_slab *slab, uint32_t index)
{
    return &lum_slab_chunk_of(slab, index)->notes[index % LUM_SLAB_CHUNK];
}
uint32_t lum_slab_limit(const struct lum_slab *slab); /* all indices that were ever taken are less */

#endif

/* The octree of a store (store.h), without the records: nodes, their entries, and the memory of both.
 *
 * A node holds the entries of its cell in pages of eight: the position and the squared radius of each lie beside the
 * index of its record, so that a search touches no record that does not reach the point. The first page is part of the
 * node.
 *
 * Every function but those for one thread alone may be called by any number of threads at once, each with an arena of
 * its own. Why that is safe, and what never waits: tables.c. */
#ifndef LUM_CORE_CACHE_OCTREE_H
#define LUM_CORE_CACHE_OCTREE_H

#include "core/cache/slab.h"

#define LUM_OCTREE_LANES 8u /* records of a page, tested together: floats of an AVX register */
/* Levels below the root: cells down to 1/65536 of the root. Smaller records lie in the smallest cells. The centre of
 * each cell is exact in a float (octree.c). */
#define LUM_OCTREE_DEPTH 16u

/* Bits of a page's word, for lane i of it: each is set at most once between two ends of a frame. */
#define LUM_LANE_CLAIMED(i) (UINT64_C(1) << (i))      /* somebody fills it in */
#define LUM_LANE_READY(i) (UINT64_C(1) << (8u + (i))) /* filled in */
#define LUM_LANE_DEAD(i) (UINT64_C(1) << (16u + (i))) /* taken out */
/* Of a node's first page, for the children. What lies in a child itself reaches half its side beyond it, what lies
 * deeper a quarter: knowing which there is saves a search half of the nodes. */
#define LUM_CHILD_DEEPER(i) (UINT64_C(1) << (24u + (i))) /* there may be entries below child i */
#define LUM_CHILD_HOLDS(i) (UINT64_C(1) << (32u + (i)))  /* and in it */

/* Three cache lines; a search reads the first, and the others only if a lane is in use. */
struct lum_octree_page {
    _Atomic uint64_t word;
    uint32_t index[LUM_OCTREE_LANES]; /* of the records; this and what follows: unchanging while ready */
    _Atomic(struct lum_octree_page *) next;
    _Alignas(LUM_CACHE_LINE) float x[LUM_OCTREE_LANES];
    float y[LUM_OCTREE_LANES], z[LUM_OCTREE_LANES], r2[LUM_OCTREE_LANES];
};

/* Begins with its page. */
struct lum_octree_node {
    struct lum_octree_page page;
    _Atomic(struct lum_octree_node *) child[8]; /* bit 0: the upper half in x, 1: y, 2: z */
};

/* The cube of the root. */
struct lum_octree_cell {
    struct lum_vec3 centre;
    float half; /* of its side */
};

/* Memory of nodes and pages, for one thread: blocks that are filled one after the other. Zeroed: none yet. */
struct lum_octree_block;
struct lum_octree_arena {
    struct lum_octree_block *first, *current;
    struct lum_octree_node *spare_node; /* one that lost its place to another thread's, still zero */
    struct lum_octree_page *spare_page;
    size_t bytes;
};
/* Zeroed; NULL: memory is short. */
struct lum_octree_node *lum_octree_node_new(struct lum_octree_arena *arena);
void lum_octree_arena_rewind(struct lum_octree_arena *arena); /* everything in it is gone, the blocks stay */
void lum_octree_arena_finish(struct lum_octree_arena *arena);

/* The least cube that suits: its corners and its side are such that all cells are exact. lo, hi: finite, lo <= hi. */
struct lum_octree_cell lum_octree_root_cell(struct lum_vec3 lo, struct lum_vec3 hi);

struct lum_octree_entry {
    struct lum_vec3 p;
    float radius;
    uint32_t index;
};
struct lum_octree_insertion {
    const struct lum_octree_cell *cell;
    struct lum_octree_arena *arena;
    struct lum_octree_entry entry;
    struct lum_place place; /* out */
    uint32_t contended;     /* out: other threads that attached a node or page first */
};
/* Writes the entry into a free lane, but does not yet show it. False: memory is short; nothing changed. */
LUM_MUST_USE bool lum_octree_reserve(struct lum_octree_node *root, struct lum_octree_insertion *insertion);

/* From now on searches find it. */
static inline void lum_octree_publish(struct lum_place place)
{
    atomic_fetch_or_explicit(&place.page->word, LUM_LANE_READY(place.lane), memory_order_release);
}
/* From now on none does. The lane stays as it is for those who found it before. */
static inline void lum_octree_hide(struct lum_place place)
{
    atomic_fetch_or_explicit(&place.page->word, LUM_LANE_DEAD(place.lane), memory_order_release);
}
/* The lane can be used again. Thread: one alone. */
static inline void lum_octree_free_lane(struct lum_place place)
{
    uint64_t bits = LUM_LANE_CLAIMED(place.lane) | LUM_LANE_READY(place.lane) | LUM_LANE_DEAD(place.lane);
    atomic_fetch_and_explicit(&place.page->word, ~bits, memory_order_relaxed);
}

/* Records whose ball meets the box lo .. hi (a point: lo = hi). */
struct lum_octree_query {
    const struct lum_octree_cell *cell;
    const struct lum_slab *slab;
    struct lum_vec3 lo, hi;
    struct lum_cache_record **records; /* the first max of those found */
    uint32_t n, max;                   /* n: found so far, also those that there was no room for; searches add to it */
};
void lum_octree_search(const struct lum_octree_node *root, struct lum_octree_query *query);

#endif

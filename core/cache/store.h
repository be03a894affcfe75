/* Where the records of a cache live: an octree over the scene, with four ways for threads to share it (thesis, 7.2).
 *
 *   serial    one thread inserts, and none searches meanwhile (listing 7.1)
 *   lock      one mutex around every search and every insertion (listing 7.2)
 *   local     each worker inserts into a tree of its own and searches that and the common one; lum_store_end_frame
 *             merges them (listing 7.3)
 *   waitfree  no thread ever waits for another (listing 7.4, with the repairs of NOTES R4)
 *
 * One tree, one search and one record layout serve all four; they differ only in what stands around an insertion and a
 * search.
 *
 * A record is a point of a surface that counts at points nearer to it than its radius, and serves those of them that
 * its owner's weight says (weight.h): a point that is served needs no record of its own. It lies in the node whose side
 * is the least that is still at least twice the radius, so that a search descends into those children only whose cell,
 * grown by half its side, holds the point. What else a record carries is its owner's: a struct that begins with struct
 * lum_cache_record.
 *
 * Life of a record: lum_store_new (the caller's alone) -> filled in -> lum_store_insert (shared; p, n, radius and
 * object never change again) -> lum_store_remove (no later search returns it) -> its memory is used again after the end
 * of a frame by which every worker has passed lum_store_end_frame: whoever found it earlier in the frame may still read
 * it. */
#ifndef LUM_CORE_CACHE_STORE_H
#define LUM_CORE_CACHE_STORE_H

#include "core/base/base.h"
#include "core/cache/caches.h"
#include "core/math/rgb.h"
#include "core/math/vec.h"

struct lum_cache_record {
    struct lum_vec3 p, n, ng; /* scene space; n: unit shading normal, on the side of the surface that it serves; ng:
                               * geometric, on the same side, for where rays start */
    float radius;             /* > 0; counts at points nearer than this */
    uint32_t index;           /* of the record in its store, 0 .. capacity - 1; given by lum_store_new */
    float footprint; /* size of the pixel for which the record is as coarse as it is; 0: any pixel could be smaller */
    uint64_t object; /* what it lies on: lum_hash64_text of the object's id */
    struct lum_rgb irradiance;  /* what it is for; scene units */
    struct lum_rgb gradient[3]; /* change of irradiance by moving along x, y, z, per scene unit; 0: the kind has none */
    uint64_t epoch; /* of its cache: what it is up to date with. Set by whoever builds or refreshes it, after that */
    uint64_t born;  /* greater than of all that were inserted before it (lum_cache_count); 0: nobody counted */
    _Atomic uint32_t state; /* private to the store */
};

struct lum_store;

/* Memory that the records of several stores may take together. */
struct lum_budget {
    size_t limit;
    _Atomic size_t used;
    _Atomic bool refused; /* a store asked for more; whoever deals with it takes it back */
};

struct lum_store_config {
    enum lum_storage storage;
    struct lum_vec3 lo, hi;    /* box of the scene; points outside are found all the same, only less quickly */
    uint32_t n_workers;        /* workers 0 .. n_workers - 1 may use it at once; 1 .. LUM_STORE_WORKERS_MAX */
    size_t record_bytes;       /* sizeof the owner's struct, a multiple of 8 */
    uint32_t capacity;         /* records at most, 1 .. LUM_STORE_MAX */
    struct lum_budget *budget; /* borrowed; NULL: none. Where it is used up, memory is short */
};
#define LUM_STORE_MAX (1u << 22)    /* half as many as the largest view has pixels */
#define LUM_STORE_WORKERS_MAX 1024u /* more than machines have: what is above it is a mistake of the caller */

LUM_MUST_USE enum lum_status lum_store_create(const struct lum_store_config *config, struct lum_store **ret_store,
                                              struct lum_error *err);
void lum_store_destroy(struct lum_store *store); /* accepts NULL */

/* ---- by workers, at the same time (serial: who inserts is alone) ---- */

/* A record that is zero, but for its index; what its owner's struct adds has any value, for whoever builds it to write.
 * NULL: the store is full, or memory is short. */
struct lum_cache_record *lum_store_new(struct lum_store *store, uint32_t worker);
/* Gives back one that was not inserted. */
void lum_store_drop(struct lum_store *store, uint32_t worker, struct lum_cache_record *record);
/* Shares it. From now on searches of all workers find it (local: of this worker only, until the end of the frame).
 * False: memory for the tree is short; the record is still the caller's. */
LUM_MUST_USE bool lum_store_insert(struct lum_store *store, uint32_t worker, struct lum_cache_record *record);
/* Records whose ball holds p, at most max of them, in no certain order; returns how many. More than max: those left out
 * are counted in the statistics. */
uint32_t lum_store_find(struct lum_store *store, uint32_t worker, struct lum_vec3 p,
                        struct lum_cache_record **ret_records, uint32_t max);
/* Records whose ball meets the box lo .. hi. */
uint32_t lum_store_overlap(struct lum_store *store, uint32_t worker, struct lum_vec3 lo, struct lum_vec3 hi,
                           struct lum_cache_record **ret_records, uint32_t max);
/* Takes it out. Any worker may, while others search; taking it out twice is the same as once. True: it was this call
 * that did. */
bool lum_store_remove(struct lum_store *store, uint32_t worker, struct lum_cache_record *record);
/* Record by index; NULL: there is none. For going over all: 0 .. lum_store_limit - 1, in the order of their indices.
 * While others insert, those records may be among them or not. */
struct lum_cache_record *lum_store_at(const struct lum_store *store, uint32_t index);
/* True from when it was inserted until it is removed. Its memory may be another's since. */
bool lum_store_holds(const struct lum_cache_record *record);
uint32_t lum_store_limit(const struct lum_store *store);

/* ---- by one thread, while no worker is inside ---- */

/* Merges the trees of `local`, and frees what was removed. */
LUM_MUST_USE enum lum_status lum_store_end_frame(struct lum_store *store, struct lum_error *err);
void lum_store_clear(struct lum_store *store);           /* all records are gone; memory stays */
uint32_t lum_store_count(const struct lum_store *store); /* records that are there */

struct lum_store_stats {
    uint64_t inserted, removed;
    uint64_t contended;   /* waitfree: insertions whose CAS another thread won; nothing is lost by it */
    uint64_t overflowed;  /* records that a search had no room for */
    int64_t lock_wait_ns; /* lock: time spent waiting, summed over the workers */
    int64_t merge_ns;     /* local: time spent merging */
    size_t bytes;         /* memory held */
};
void lum_store_stats(const struct lum_store *store, struct lum_store_stats *ret_stats); /* since creation */

#endif

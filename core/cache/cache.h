/* The shared irradiance cache: records of indirect irradiance on surfaces, made where somebody looks, found again by
 * every later frame of every view, and brought up to date when the scene changes.
 *
 * A kind (kind.h) says how records are made and kept true. Where they are placed, how they are stored, found and
 * interpolated is the same for all. A struct lum_caches (caches.h) holds the caches of a scene by what they depend on
 * besides it (struct lum_cache_key).
 *
 * data flow of a pass: lum_cache_update (what did the edit make stale?) -> rounds of (request: pixels that no record
 * serves; place: sorted and thinned; build) and refresh (stale records that somebody looks at) -> interpolate. Each
 * step is a parallel loop with a barrier; every one is a pure function of what was there before it, so that the picture
 * does not depend on the number of threads. `irrcache` can also run freely, as published: a pixel that finds nothing
 * makes a record at once, and shares it (settings.deterministic false). */
#ifndef LUM_CORE_CACHE_CACHE_H
#define LUM_CORE_CACHE_CACHE_H

#include "core/cache/caches.h"
#include "core/cache/kind.h"
#include "core/cache/store.h"
#include "core/math/vec.h"
#include "core/vpl/vpl.h"

struct lum_counters;

struct lum_cache_key {
    const struct lum_cache_kind *kind;
    enum lum_storage storage;
    uint32_t n_vpls, max_bounces, seed; /* of the VPLs; n_vpls: rays of a hemisphere for kinds without */
    float accuracy;                     /* a of Ward: error that is let pass; less is finer */
    bool media;                         /* light is dimmed by media */
    bool scatters;                      /* and goes on where they scatter it (struct lum_vpl_request) */
    uint32_t lobes_off;                 /* of LUM_VPL_LOBES: what light does not go on by */
    bool gloss;                         /* VPLs send on what glossy surfaces reflect (struct lum_vpl_request) */
    bool panes;                         /* there are panes, and light goes through them */
    uint32_t n_sky;                     /* slots for the sky: LUM_VPL_SKY, or 0: records hold indirect light alone */
};
bool lum_cache_key_equal(const struct lum_cache_key *a, const struct lum_cache_key *b);

/* The cache for these settings, made if need be and counted: one lum_cache_release each. Caches that nobody holds are
 * kept while memory allows (LUM_CACHES_IDLE), the last used last: a viewer that comes back finds its records. */
#define LUM_CACHES_IDLE 2u
LUM_MUST_USE enum lum_status lum_cache_acquire(struct lum_caches *caches, const struct lum_cache_key *key,
                                               struct lum_cache **ret_cache, struct lum_error *err);
void lum_cache_release(struct lum_caches *caches, struct lum_cache *cache); /* accepts NULL */

/* So many of the records that were inserted last are remembered in order. */
#define LUM_CACHE_RECENT 1024u

struct lum_cache {
    struct lum_cache_key key;
    struct lum_store *store; /* NULL until the first update */
    uint64_t n_born;         /* records that were ever inserted, counted on when the order of some is not known */
    struct lum_cache_record *recent[LUM_CACHE_RECENT]; /* record b, counted from 1, at b % LUM_CACHE_RECENT */
    struct lum_vpl_set vpls;
    float spacing;         /* vpls.spacing when the cache was last empty. Bounds follow this one, so that what
                            * records keep of a VPL stays right while other VPLs move */
    const uint64_t *moved; /* vpls.moved: those that the last update put elsewhere; NULL: the kind has none */
    const struct lum_snapshot *snapshot; /* held: what it is up to date with; NULL: nothing */
    uint64_t epoch;                      /* counts the updates that changed something; records remember theirs */
    bool immediate;   /* `tic`: records are brought up to date at once when the scene changes, as algorithm 1 is
                       * printed. False, as caches are made: when somebody looks at them, which never traces more */
    void *kind_state; /* the kind's own; NULL again as soon as all records are gone */
    _Atomic uint64_t created, updated, removed, discarded; /* since creation */
};

/* Size of a pixel of a pass at a point. */
static inline float lum_cache_footprint(float pixel, struct lum_vec3 eye, struct lum_vec3 p)
{
    return pixel * lum_length(lum_v3_sub(p, eye));
}

/* A record, and what follows it; as its kind has it, without what lum_cache_left says. */
size_t lum_cache_record_bytes(const struct lum_cache *cache);
size_t lum_cache_bytes_of_kind(const struct lum_cache *cache);
/* By VPL that the record sees: what panes leave of its light (lum_transmittance_pack). NULL: there are none. */
uint32_t *lum_cache_left(const struct lum_cache *cache, struct lum_cache_record *record);

/* All of a record that another cache of the same scene needs to have it, too; at most lum_cache_told_bytes, a multiple
 * of 8. Both return how many bytes it is. Thread: one for each record. */
size_t lum_cache_told_bytes(const struct lum_cache *cache);
size_t lum_cache_tell(const struct lum_cache *cache, struct lum_cache_record *record, void *ret_told);
size_t lum_cache_hear(const struct lum_cache *cache, struct lum_cache_record *record, const void *told);

/* Records of a cache take at most this. */
#define LUM_CACHE_BYTES ((size_t)512 << 20)

/* Brings VPLs up to date with the snapshot and tells the kind what changed; nothing when only the camera did, and no
 * ray when only powers did. pool has at most the n_workers of the caches. Thread: the director. On failure the cache is
 * empty, but usable. */
struct lum_cache_update {
    const struct lum_snapshot *snapshot;
    struct lum_pool *pool;
    struct lum_counters *counters;
};
LUM_MUST_USE enum lum_status lum_cache_update(struct lum_cache *cache, const struct lum_cache_update *update,
                                              struct lum_error *err);

/* Counts a record that was inserted, so that who knows those before it need not search for it. Thread: as
 * lum_cache_update. */
static inline void lum_cache_count(struct lum_cache *cache, struct lum_cache_record *record)
{
    record->born = ++cache->n_born;
    cache->recent[record->born % LUM_CACHE_RECENT] = record;
}
/* Records came in an order that nobody knows, or the store is another: what anybody knows of them is void. */
static inline void lum_cache_lose_count(struct lum_cache *cache)
{
    cache->n_born += LUM_CACHE_RECENT + 1;
}

/* All records are gone, and what the kind keeps for them. Thread: as lum_cache_update. */
void lum_cache_clear(struct lum_cache *cache);

/* A store had no room. True: something gave way, so that it is worth another try; from a try to the next inout_cleared
 * tells what was done, and is false at first. Thread: as lum_cache_update. */
bool lum_cache_make_room(struct lum_cache *cache, bool *inout_cleared);

/* True when the record may not be what it would be if it were built now: whoever wants to use it refreshes it first. */
static inline bool lum_cache_is_stale(const struct lum_cache *cache, const struct lum_cache_record *record)
{
    return cache->key.kind->refresh && record->epoch != cache->epoch;
}

#endif

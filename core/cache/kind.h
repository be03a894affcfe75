/* A kind of irradiance cache says how records are made and kept true: `irrcache` samples the hemisphere (chapter 7),
 * `ic` and `tic` sum virtual point lights (chapter 6), `live` does so with visibility bits. A kind is one row and one
 * file. */
#ifndef LUM_CORE_CACHE_KIND_H
#define LUM_CORE_CACHE_KIND_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "core/cache/weight.h"
#include "core/math/vec.h"

struct lum_cache;
struct lum_cache_record;
struct lum_cache_update;
struct lum_counters;
struct lum_motion;
struct lum_snapshot;

/* Some records of one cache, for one worker. */
struct lum_cache_job {
    struct lum_cache *cache;
    const struct lum_snapshot *snapshot;
    struct lum_cache_record *const *records;
    uint32_t n;
    float pixel; /* size of a pixel at distance 1 from the eye: no finer than needed */
    struct lum_vec3 eye;
    uint32_t worker;
    struct lum_counters *counters;
};

struct lum_cache_kind {
    const char *name;
    enum lum_metric metric;
    bool vpls;      /* sums virtual point lights */
    bool sky;       /* and takes the diffuse light of an even sky with them */
    uint32_t tries; /* of struct lum_vpl_request */
    uint32_t spare; /* the set has so many VPLs for each that settings ask for, of which each record looks at its own
                       choice; 0: one */
    bool gloss;     /* of struct lum_cache_key */
    bool lasting;   /* false: forgets all records whenever the scene changes (`ic`, `irrcache`) */
    size_t (*record_bytes)(uint32_t n_vpls);
    bool left; /* keeps what panes leave on the way to each VPL, where there are any (lum_cache_left) */
    /* Bits of those that it sees: what is kept of others is never read. NULL: of all it may be. */
    const uint64_t *(*sees)(const struct lum_cache_record *record);
    /* Fills new records whose p, n, ng and object are set: radius, irradiance, gradient, and all that is its own.
     * Thread: any worker. */
    void (*build)(const struct lum_cache_job *job);
    /* Brings records up to date that lum_cache_is_stale. NULL: never stale. Records that can no longer be trusted are
     * removed. */
    void (*refresh)(const struct lum_cache_job *job);
    /* The scene changed: cache->snapshot -> update->snapshot, with motion between them; the VPLs are already new
     * (moved: bit by slot), and so is the epoch. Not called when motion is everything: then all records are gone.
     * Powers, fluxes and media may have changed too: versions of both snapshots tell. Decides what is stale; must not
     * trace more than the immediate update of the thesis does. NULL: lasting is false. Thread: the director, no pass is
     * under way; may use update->pool. */
    void (*change)(struct lum_cache *cache, const struct lum_cache_update *update, const struct lum_motion *motion);
    void (*finish)(struct lum_cache *cache); /* frees cache->kind_state; NULL: lum_free does */
};
extern const struct lum_cache_kind lum_cache_irradiance, lum_cache_instant, lum_cache_temporal, lum_cache_live;

#endif

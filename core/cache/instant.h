/* Records of instant caching (thesis, chapter 6), kinds `ic` and `tic`. Internal to core/cache, but for what studies
 * and tests ask of `tic`.
 *
 * The thesis keeps the colour that each VPL contributes, as RGBE, 4 bytes a VPL. Here the same 4 bytes hold what is the
 * record's own part of it, the bounded geometry term (6.2.2), with the visibility as its sign; the rest is the VPL's
 * flux, the same for all records. So no step of 1/256 is taken, light that changes its power or colour traces no ray, a
 * ray that was in shadow is told from one that faces away, and a VPL that comes into view again needs no new term.
 *
 * "Removing the previous contribution and adding the new one" is read as summing all of them again where one changed,
 * in the order of the slots: 0.1 us a record, and nothing drifts (NOTES R5). */
#ifndef LUM_CORE_CACHE_INSTANT_H
#define LUM_CORE_CACHE_INSTANT_H

#include "core/cache/cache.h"
#include "core/cache/kind.h"

struct lum_instant_record {
    struct lum_cache_record base;
    float term[]; /* by slot, as struct lum_gather says: negative: in shadow; LUM_VPL_UNKNOWN: it was black, and nobody
                     asked */
};

/* Records that are worked on together, so that rays towards one VPL start near each other. */
#define LUM_INSTANT_GROUP 64u

/* In scenes with panes lum_cache_left says what they leave of each VPL that a record sees.
 *
 * The terms of these slots, for all records of the job: at most LUM_INSTANT_GROUP. Returns the rays. */
uint64_t lum_instant_trace(const struct lum_cache_job *job, const uint32_t *slots, uint32_t n_slots);
/* What bounds the geometry term. */
struct lum_bound lum_instant_bound(const struct lum_cache *cache);
/* The record's irradiance: the sum of what it sees. */
void lum_instant_sum(const struct lum_cache_job *job, struct lum_instant_record *record);

/* ---- kind `tic` ---- */

void lum_instant_refresh(const struct lum_cache_job *job);
void lum_instant_change(struct lum_cache *cache, const struct lum_cache_update *update,
                        const struct lum_motion *motion);
void lum_instant_finish(struct lum_cache *cache);

/* What updates did, by the cases of algorithm 1; since all
 * records were last gone. */
struct lum_instant_counts {
    uint64_t vpl_rays;   /* cases 1 and 2: to VPLs that moved, against the scene */
    uint64_t mover_rays; /* case 3: against what moved, where it is now */
    uint64_t box_tests;  /* case 4: rays in shadow, against where it was */
    uint64_t scene_rays; /* case 4: those of them that met a box, against the scene */
    uint64_t removed;    /* case 5: records where something was */
    uint64_t aged;       /* records that nobody had looked at for LUM_SINCE_EPOCHS changes */
};
struct lum_instant_counts lum_cache_temporal_counts(const struct lum_cache *cache);

#endif

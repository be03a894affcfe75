/* Records of a cache as one view sees them: which of its pixels are served, where new records go, and the irradiance
 * that pixels interpolate.
 *
 * Two phases: rounds of request and build, then interpolation. In a round, every block of the picture that shows a
 * point which no record serves gets one new record, at that of these points which is nearest to its middle. Blocks
 * begin at LUM_RECORDS_BLOCK pixels a side, and are halved each round down to single pixels: so a round adds few
 * records where one reaches far, those that it adds are a block apart, and most points find themselves served by what
 * an earlier round made. After the last round, every point is served. Everything depends only on what the round before
 * left: the picture is the same for any number of threads. Records that the view looks at and that are stale are
 * refreshed before the rounds, each once.
 *
 * Candidates are looked up once for each tile of LUM_TILE_SIDE pixels, with the box of its surface points, and not
 * pixel by pixel. */
#ifndef LUM_CORE_EFFECT_INDIRECT_RECORDS_H
#define LUM_CORE_EFFECT_INDIRECT_RECORDS_H

#include "core/cache/cache.h"
#include "core/pass/pass.h"

#define LUM_RECORDS_BLOCK 64u /* halved down to 1 */

struct lum_stage_runner;
struct lum_records_memory;

struct lum_records {
    struct lum_cache *cache;           /* held for the view; NULL: its method has none */
    uint64_t holding;                  /* counts the caches that it held: an address may come back */
    struct lum_records_memory *memory; /* kept from pass to pass: no allocation in a frame at rest */
    struct lum_cache_counts counts;    /* of the last pass */
};
void lum_records_finish(struct lum_records *records,
                        struct lum_caches *caches); /* accepts a zeroed one; keeps the count */

/* Takes the cache for the key, in place of the one that was held, and brings it up to date. Begins the counts of a
 * pass. */
LUM_MUST_USE enum lum_status lum_records_update(struct lum_records *records, struct lum_caches *caches,
                                                const struct lum_cache_key *key, const struct lum_cache_update *update,
                                                struct lum_error *err);

/* Refresh and rounds: afterwards every point that is interpolated in the pass is served. Needs pass->surfaces, and a
 * cache that is up to date with the snapshot. Does nothing where neither the picture nor the scene has changed since
 * the last time. */
LUM_MUST_USE enum lum_status lum_records_run(struct lum_records *records, const struct lum_pass *pass,
                                             const struct lum_stage_runner *runner, struct lum_error *err);

/* Puts a new record on the surface that a pixel shows; far: on the other side of it. */
void lum_records_create(struct lum_cache_record *record, const struct lum_pass *pass, size_t pixel, bool far);
/* What a kind may not get wrong: a record that others would multiply by is finite, and its radius above 0. */
bool lum_records_are_sound(const struct lum_cache_record *record);

extern const struct lum_estimator lum_stage_cache;   /* fills in pass->records */
extern const struct lum_estimator lum_stage_records; /* lum_records_run, as a stage */
/* Indirect light, interpolated at every pixel; in methods that filter by lum_stage_upsample, at one pixel in four.
 */
extern const struct lum_estimator lum_estimator_cached;
extern const struct lum_estimator lum_stage_upsample; /* filter: to full resolution */
extern const struct lum_estimator
    lum_estimator_cached_free; /* as published, where settings.deterministic is false (cached_free.c) */

#endif

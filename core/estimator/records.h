/* Records of a cache as one view sees them: which of its pixels are served, where new records go, and the irradiance that
 * pixels interpolate.
 *
 * Two phases: rounds of request and build, then interpolation. In a round, pixels on a grid that no record serves ask for one;
 * the requests are sorted and thinned (none is served by another's record that comes earlier), and what is left is built in
 * parallel. The grid starts coarse and halves each round down to single pixels, so that most pixels find themselves served by
 * what an earlier round made. Everything depends only on what the round before left: the picture is the same for any number of
 * threads. Records that pixels look at and that are stale are refreshed before the rounds, each once.
 *
 * Candidates are looked up once for each square of LUM_RECORDS_SIDE pixels, with the box of its surface points, and not pixel by
 * pixel. */
#ifndef LUM_CORE_ESTIMATOR_RECORDS_H
#define LUM_CORE_ESTIMATOR_RECORDS_H

#include "core/cache/cache.h"
#include "core/render/frame.h"

struct lum_stage_runner;

struct lum_records {
    struct lum_cache *cache; /* held for the view; NULL: its method has none */
    uint64_t epoch;          /* of the cache, as of the last pass */
    void *memory;            /* requests and candidate lists, kept from pass to pass */
    struct lum_cache_counts counts; /* of the last pass */
};
void lum_records_finish(struct lum_records *records, struct lum_caches *caches); /* accepts a zeroed one */

/* Refresh and rounds: afterwards every diffuse pixel of the pass is served. Needs pass->surfaces and pass->cache. */
enum lum_status lum_records_run(struct lum_records *records, const struct lum_pass *pass,
                                const struct lum_stage_runner *runner, struct lum_error *err);

#endif

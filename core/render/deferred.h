/* The buffers of deferred methods and how their stages follow each other. Internal to core/render.
 *
 * G-buffer -> surfaces -> virtual point lights -> the estimators that serve the effects which are on, by the order of enum
 * lum_stage -> the method's filter -> composite. Each stage is a parallel loop and ends at a barrier; each is memoised and
 * does nothing where nothing changed. */
#ifndef LUM_CORE_RENDER_DEFERRED_H
#define LUM_CORE_RENDER_DEFERRED_H

#include "core/estimator/components.h"
#include "core/estimator/layers.h"
#include "core/estimator/records.h"
#include "core/vpl/vpl.h"

struct lum_deferred {
    struct lum_gbuffer gbuffer;
    struct lum_surfaces surfaces;
    struct lum_swept swept;
    struct lum_layers layers;
    struct lum_components components;
    struct lum_vpl_set vpls; /* of methods without a cache */
    uint32_t n_vpls;         /* that shone in the last frame */
    struct lum_records records;
    struct lum_caches *caches; /* borrowed: where methods with a cache find theirs */
};
void lum_deferred_finish(struct lum_deferred *d); /* accepts a zeroed one; keeps the stamps */

void lum_deferred_forget(struct lum_deferred *d); /* makes everything stale; the buffers stay */

/* How stages run: over whose threads, with whose counters, into which statistics. */
struct lum_stage_runner {
    struct lum_pool *pool;
    struct lum_counters *counters; /* by worker */
    const _Atomic bool *cancel;
    struct lum_pass_stats *stats;
};
enum lum_status lum_stage_run(const struct lum_stage_runner *runner, const struct lum_pass *pass,
                              const struct lum_estimator *stage);

/* A parallel loop within a stage that has a `run` of its own. Rays and time are counted by effect. */
enum lum_status lum_stage_loop(const struct lum_stage_runner *runner, uint32_t n,
                               void (*fn)(void *ctx, uint32_t job, struct lum_counters *counters), void *ctx);

/* Makes the G-buffer stale if the pass looks at something else. */
LUM_MUST_USE enum lum_status lum_deferred_look(struct lum_deferred *d, struct lum_pass *pass, struct lum_error *err);
/* A pass as far as what the eye sees: first hits and surfaces. As if the rest had been cancelled. Fills in those of *pass. */
LUM_MUST_USE enum lum_status lum_deferred_see(struct lum_deferred *d, struct lum_pass *pass,
                                              const struct lum_stage_runner *runner, struct lum_error *err);
/* All stages of a pass. Fills in the buffers of *pass. */
LUM_MUST_USE enum lum_status lum_deferred_run(struct lum_deferred *d, struct lum_pass *pass,
                                              const struct lum_stage_runner *runner, struct lum_error *err);

void lum_swept_finish(struct lum_swept *swept);
/* Finds out what moved since the last call, whose picture the surfaces show; NULL: the method has none. Out of memory, it is not
 * known. */
void lum_swept_update(struct lum_swept *swept, const struct lum_pass *pass, const struct lum_surfaces *surfaces);
/* Decides of the squares of a tile that may have changed, by its first hits before and now; others have changed where a ray found
 * another of two surfaces in the same place. Thread: any; one a tile. */
void lum_swept_compare(struct lum_swept *swept, const struct lum_tiling *tiling, uint32_t tile, const struct lum_hits *before,
                       const struct lum_hits *now);

void lum_surfaces_finish(struct lum_surfaces *s);
LUM_MUST_USE enum lum_status lum_surfaces_update(struct lum_surfaces *s, const struct lum_pass *pass, struct lum_error *err);

#endif

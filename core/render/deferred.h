/* The buffers of deferred methods and how their stages follow each other. Internal to core/render.
 *
 * G-buffer -> surfaces -> virtual point lights -> the estimators that serve the effects which are on, by the order of
 * enum lum_stage -> the method's filter -> composite. Each stage is a parallel loop and ends at a barrier; each is
 * memoised and does nothing where nothing changed. */
#ifndef LUM_CORE_RENDER_DEFERRED_H
#define LUM_CORE_RENDER_DEFERRED_H

#include "core/pass/components.h"
#include "core/effect/direct/layers.h"
#include "core/effect/indirect/records.h"
#include "core/pass/gbuffer.h"
#include "core/vpl/vpl.h"

struct lum_deferred {
    struct lum_gbuffer gbuffer;
    struct lum_surfaces surfaces;
    struct lum_motion_mask motion_mask;
    struct lum_layers layers;
    struct lum_components components;
    struct lum_states states; /* of estimators */
    struct lum_vpl_set vpls;  /* of methods without a cache */
    uint32_t n_vpls;          /* that shone in the last frame */
    struct lum_records records;
    bool keeps_surfaces;       /* they are made whether a stage asks for them or not: rough pictures do (rough.h) */
    struct lum_caches *caches; /* borrowed: where methods with a cache find theirs */
};
void lum_deferred_finish(struct lum_deferred *d); /* accepts a zeroed one; keeps the stamps */

extern const struct lum_estimator lum_stage_composite; /* layers to film */

void lum_deferred_forget(struct lum_deferred *d); /* makes everything stale; the buffers stay */

/* Makes the G-buffer stale if the pass looks at something else. */
LUM_MUST_USE enum lum_status lum_deferred_look(struct lum_deferred *d, struct lum_pass *pass, struct lum_error *err);
/* A pass as far as what the eye sees: first hits and surfaces. As if the rest had been cancelled. Fills in those of
 * *pass. */
LUM_MUST_USE enum lum_status lum_deferred_see(struct lum_deferred *d, struct lum_pass *pass,
                                              const struct lum_stage_runner *runner, struct lum_error *err);
/* All stages of a pass. Fills in the buffers of *pass. */
LUM_MUST_USE enum lum_status lum_deferred_run(struct lum_deferred *d, struct lum_pass *pass,
                                              const struct lum_stage_runner *runner, struct lum_error *err);

#endif

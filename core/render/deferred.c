#include "core/render/deferred.h"
#include "core/effect/direct/direct.h"
#include "core/effect/indirect/records.h"
#include "core/method/method.h"
#include "core/render/rough_known.h"

#include <assert.h>
#include <string.h>

static void finish_gbuffer(struct lum_gbuffer *g)
{
    lum_free(g->tiles);
    lum_memo_finish(&g->made);
    *g = (struct lum_gbuffer){.stamp = g->stamp};
}

void lum_deferred_finish(struct lum_deferred *d)
{
    finish_gbuffer(&d->gbuffer);
    lum_surfaces_finish(&d->surfaces);
    lum_motion_mask_finish(&d->motion_mask);
    lum_layers_finish(&d->layers);
    lum_components_finish(&d->components);
    lum_states_finish(&d->states);
    lum_vpl_finish(&d->vpls);
    lum_records_finish(&d->records, d->caches);
}

/* All other stages look for the G-buffer's stamp. */
void lum_deferred_forget(struct lum_deferred *d)
{
    d->gbuffer.basis.versions.geometry = d->layers.basis.versions.geometry = UINT64_MAX; /* no snapshot's */
    lum_motion_mask_finish(&d->motion_mask);
    d->vpls.valid = false;
}

/* ---- what is stale ---- */

enum lum_status lum_deferred_look(struct lum_deferred *d, struct lum_pass *pass, struct lum_error *err)
{
    struct lum_gbuffer *g = pass->gbuffer = &d->gbuffer;
    if (!g->tiles)
        g->tiles = lum_calloc(pass->tiling.n, sizeof *g->tiles);
    if (!g->tiles || !lum_memo_reserve(&g->made, pass->tiling.n))
        return lum_fail(err, LUM_ERR_NOMEM, "size", "out of memory for the G-buffer");
    uint32_t edits = lum_basis_renew(&g->basis, pass);
    for (uint32_t t = 0; t < pass->tiling.n; t++)
        g->tiles[t].white = pass->settings->illuminance;
    if (!lum_is_stale(edits, LUM_PRODUCT_GBUFFER))
        return LUM_OK;
    bool moved_only = !lum_is_stale(edits & ~LUM_EDIT_BIT(LUM_EDIT_GEOMETRY), LUM_PRODUCT_GBUFFER);
    if (moved_only && lum_motion_mask_is_known(pass->motion_mask)) {
        for (uint32_t t = 0; t < pass->tiling.n; t++)
            if (lum_motion_mask_tile(pass->motion_mask, &pass->tiling, t))
                lum_memo_set(&g->made, t, 0);
        return LUM_OK;
    }
    lum_memo_forget(&g->made);
    g->stamp++;
    return LUM_OK;
}

/* ---- the stages of a pass ---- */

/* Estimators by effect, what goes with them, filters, and what every method has: `live` has 23. */
#define STAGES_MAX 32u

struct plan {
    const struct lum_estimator *stages[STAGES_MAX];
    uint32_t n;
    bool surfaces, components;
};

static void plan_stage(struct plan *plan, const struct lum_estimator *stage)
{
    uint32_t at = plan->n;
    for (uint32_t i = 0; i < plan->n; i++)
        if (plan->stages[i] == stage)
            return;
    assert(plan->n < STAGES_MAX); /* the table of methods decides it, and nobody outside */
    while (at > 0 && plan->stages[at - 1]->stage > stage->stage) {
        plan->stages[at] = plan->stages[at - 1];
        at--;
    }
    plan->stages[at] = stage;
    plan->n++;
    plan->surfaces = plan->surfaces || stage->surfaces;
    plan->components = plan->components || stage->components;
    if (stage->vpls)
        plan_stage(plan, &lum_stage_cache);
    if (stage->then)
        plan_stage(plan, stage->then);
}

/* What is before the eye, and means over edges. (Mirrors, glass and gloss find no pixel.) */
static bool is_of_luminance(enum lum_effect e)
{
    return lum_effect_rows[e]->adds == LUM_ADDS_AIR || e == LUM_EFFECT_ANTIALIAS;
}

static struct plan make_plan(const struct lum_deferred *d, const struct lum_pass *pass)
{
    const struct lum_method *method = pass->settings->method;
    struct plan plan = {.n = 0};
    /* Runs even without a light: it also shows what shines by itself. */
    plan_stage(&plan, &lum_estimator_shadow);
    plan_stage(&plan, &lum_stage_composite);
    for (int e = 0; e < LUM_EFFECT_COUNT; e++)
        if (pass->on[e] && !(pass->settings->illuminance && is_of_luminance((enum lum_effect)e)))
            plan_stage(&plan, lum_method_serves(method, e));
    for (size_t i = 0; i < LUM_ARRAY_LEN(method->filters) && method->filters[i]; i++)
        plan_stage(&plan, method->filters[i]);
    plan.components = plan.components || method->filters[0] || method->cache;
    plan.surfaces = plan.surfaces || plan.components || d->keeps_surfaces;
    if (plan.surfaces)
        plan_stage(&plan, &lum_stage_surfaces);
    return plan;
}

static enum lum_status run_whole(const struct lum_stage_runner *runner, struct lum_pass *pass,
                                 const struct lum_estimator *stage, struct lum_error *err)
{
    int64_t begin_ns = lum_clock_ns();
    enum lum_status status = stage->run(pass, runner, err);
    runner->stats->stage_ms[stage->stage] += (double)(lum_clock_ns() - begin_ns) * 1e-6;
    return status;
}

/* First hits, before anything asks what has changed: of that they decide. Where something moved before the same eye
 * they are found even if the pass is cancelled, so that all others hear of it. */
static enum lum_status look_first(struct lum_deferred *d, struct lum_pass *pass, const struct lum_stage_runner *runner,
                                  struct lum_error *err)
{
    struct lum_stage_runner whole = *runner;
    enum lum_status status = lum_deferred_look(d, pass, err);
    if (lum_motion_mask_is_known(&d->motion_mask) && d->motion_mask.stamp == d->gbuffer.stamp)
        whole.cancel = NULL;
    if (status == LUM_OK)
        status = lum_stage_run(&whole, pass, &lum_stage_gbuffer);
    d->motion_mask.stamp = d->gbuffer.stamp;
    return status;
}

/* Of methods without components all is stale that was kept by one that has them. */
static enum lum_status update_states(struct lum_deferred *d, struct lum_pass *pass, const struct plan *plan,
                                     struct lum_error *err)
{
    const struct lum_state_kind *kinds[STAGES_MAX];
    struct lum_outcome outcome = {LUM_FATE_STALE, LUM_FATE_STALE};
    enum lum_status status = LUM_OK;
    for (uint32_t i = 0; i < plan->n; i++)
        kinds[i] = plan->stages[i]->state;
    if (plan->components) {
        pass->components = &d->components;
        status = lum_components_update(&d->components, pass, &outcome, err);
    }
    if (status == LUM_OK)
        status = lum_states_update(&d->states, pass, kinds, plan->n, &outcome, err);
    pass->states = &d->states;
    return status;
}

/* What the buffers of a pass hold of what it asks for; all hear of what has changed. */
static enum lum_status see(struct lum_deferred *d, struct lum_pass *pass, const struct plan *plan,
                           const struct lum_stage_runner *runner, struct lum_error *err)
{
    pass->gbuffer = &d->gbuffer;
    pass->layers = &d->layers;
    lum_motion_mask_update(&d->motion_mask, pass, plan->surfaces ? &d->surfaces : NULL);
    pass->motion_mask = &d->motion_mask;
    pass->kept_vpls = &d->vpls;
    pass->kept_records = &d->records;
    pass->caches = d->caches;
    pass->cached_sky = LUM_NO_OBJECT;
    for (uint32_t i = 0; i < plan->n; i++)
        if (plan->stages[i]->prepare)
            plan->stages[i]->prepare(pass);
    enum lum_status status = look_first(d, pass, runner, err);
    if (status == LUM_OK)
        status = lum_layers_update(&d->layers, pass, d->gbuffer.stamp, err);
    if (status == LUM_OK && plan->surfaces) {
        pass->surfaces = &d->surfaces;
        status = lum_surfaces_update(&d->surfaces, pass, err);
    }
    if (status == LUM_OK)
        status = update_states(d, pass, plan, err);
    if (status != LUM_OK)
        lum_motion_mask_finish(&d->motion_mask); /* some have not heard of what moved */
    return status;
}

enum lum_status lum_deferred_see(struct lum_deferred *d, struct lum_pass *pass, const struct lum_stage_runner *runner,
                                 struct lum_error *err)
{
    struct plan plan = make_plan(d, pass);
    enum lum_status status = see(d, pass, &plan, runner, err);
    return status == LUM_OK && plan.surfaces ? lum_stage_run(runner, pass, &lum_stage_surfaces) : status;
}

enum lum_status lum_deferred_run(struct lum_deferred *d, struct lum_pass *pass, const struct lum_stage_runner *runner,
                                 struct lum_error *err)
{
    struct plan plan = make_plan(d, pass);
    runner->stats->n_vpls = 0;
    enum lum_status status = see(d, pass, &plan, runner, err);
    for (uint32_t i = 0; i < plan.n && status == LUM_OK; i++)
        status = plan.stages[i]->run ? run_whole(runner, pass, plan.stages[i], err)
                                     : lum_stage_run(runner, pass, plan.stages[i]);
    if (d->layers.starved) {
        lum_layers_finish(&d->layers);
        return lum_fail(err, LUM_ERR_NOMEM, "", "out of memory for what mirrors and glass show of lights");
    }
    if (status != LUM_OK)
        return status;
    d->n_vpls = runner->stats->n_vpls;
    lum_rough_known_all(&d->layers);
    return LUM_OK;
}

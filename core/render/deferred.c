#include "core/render/deferred.h"
#include "core/effect/direct/direct.h"

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

#define STAGES_MAX                                                                                                     \
    32u /* estimators by effect, what goes with them, filters, and what every method has: `live` has 21 */

struct plan {
    const struct lum_estimator *stages[STAGES_MAX];
    uint32_t n;
    bool vpls, cache, surfaces, components;
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
    plan->vpls = plan->vpls || stage->vpls;
    plan->cache = plan->cache || stage->cache;
    plan->surfaces = plan->surfaces || stage->surfaces;
    plan->components = plan->components || stage->components;
    if (stage->then)
        plan_stage(plan, stage->then);
}

static struct plan make_plan(const struct lum_pass *pass)
{
    const struct lum_method *method = pass->settings->method;
    struct plan plan = {.n = 0};
    /* Runs even without a light: it also shows what shines by itself. */
    plan_stage(&plan, &lum_estimator_shadow);
    plan_stage(&plan, &lum_stage_composite);
    for (int e = 0; e < LUM_EFFECT_COUNT; e++)
        if (pass->on[e])
            plan_stage(&plan, method->serves[e]);
    for (size_t i = 0; i < LUM_ARRAY_LEN(method->filters) && method->filters[i]; i++)
        plan_stage(&plan, method->filters[i]);
    plan.components = plan.components || method->filters[0] || method->cache;
    plan.surfaces = plan.surfaces || plan.components;
    if (plan.surfaces)
        plan_stage(&plan, &lum_stage_surfaces);
    return plan;
}

/* Slots that moved without a VPL, then or now, and those of the sky, are no lights that anybody saw move. */
static void count_vpls(const struct lum_vpl_set *set, struct lum_pass_stats *stats)
{
    stats->n_vpls = set->n_lit;
    stats->n_vpls_moved = 0;
    for (uint32_t i = 0; set->n_moved > 0 && i < set->n_bounced; i++)
        if (set->moved[i / 64] >> (i % 64) & 1)
            stats->n_vpls_moved += set->flux[0][i] > 0.0f || set->flux[1][i] > 0.0f || set->flux[2][i] > 0.0f;
}

static enum lum_status update_vpls(struct lum_deferred *d, struct lum_pass *pass, const struct lum_stage_runner *runner,
                                   struct lum_error *err)
{
    int64_t begin_ns = lum_clock_ns();
    const struct lum_view_settings *set = pass->settings;
    struct lum_vpl_request request = {
        .snapshot = pass->snapshot,
        .n = set->n_vpls,
        .max_bounces = set->max_depth > 0 ? set->max_depth - 1 : 0,
        .seed = set->seed,
        .media = pass->on[LUM_EFFECT_MEDIA],
        .lobes_off = pass->settings->effects_off & LUM_VPL_LOBES,
        .pool = runner->pool,
        .counters = runner->counters,
    };
    enum lum_status status = lum_vpl_update(&d->vpls, &request, err);
    runner->stats->stage_ms[LUM_STAGE_VPLS] += (double)(lum_clock_ns() - begin_ns) * 1e-6;
    if (status != LUM_OK)
        return status;
    pass->vpls = &d->vpls;
    count_vpls(&d->vpls, runner->stats);
    return LUM_OK;
}

static bool has_sky(const struct lum_light_table *lights)
{
    for (uint32_t i = 0; i < lights->n_lights; i++)
        if (lights->lights[i].kind == LUM_EMIT_ENVIRONMENT)
            return true;
    return false;
}

/* Records bring the diffuse light of the sky, unless the view switched it off; also while it is switched off in the
 * scene, so that they last until it shines again. */
static bool caches_sky(const struct lum_pass *pass)
{
    const struct lum_view_settings *set = pass->settings;
    return pass->on[LUM_EFFECT_INDIRECT_DIFFUSE] && set->max_depth > 0 && set->method->cache &&
           set->method->cache->sky && !(set->effects_off & LUM_EFFECT_BIT(LUM_EFFECT_ENVIRONMENT)) &&
           has_sky(&pass->snapshot->lights);
}

static uint32_t cached_sky(const struct lum_pass *pass)
{
    const struct lum_light_table *lights = &pass->snapshot->lights;
    bool shines = lights->environment != LUM_NO_OBJECT && lum_light_is_even_sky(&lights->lights[lights->environment]);
    return shines && caches_sky(pass) ? lights->environment : LUM_NO_OBJECT;
}

static uint32_t n_vpls_of(const struct lum_view_settings *set)
{
    uint32_t spare = set->method->cache->spare, n = spare > 0 ? set->n_vpls * spare : set->n_vpls;
    return n < LUM_VPL_MAX ? n : LUM_VPL_MAX;
}

static struct lum_cache_key cache_key(const struct lum_pass *pass)
{
    const struct lum_view_settings *set = pass->settings;
    return (struct lum_cache_key){
        .kind = set->method->cache,
        .storage = set->storage,
        .n_vpls = n_vpls_of(set),
        .max_bounces = set->max_depth > 0 ? set->max_depth - 1 : 0,
        .seed = set->seed,
        .accuracy = set->cache_accuracy,
        .media = pass->on[LUM_EFFECT_MEDIA],
        .lobes_off = pass->settings->effects_off & LUM_VPL_LOBES,
        .gloss = set->method->cache->gloss,
        .panes = lum_pass_panes(pass),
        .n_sky = caches_sky(pass) ? LUM_VPL_SKY : 0,
    };
}

static enum lum_status update_cache(struct lum_deferred *d, struct lum_pass *pass,
                                    const struct lum_stage_runner *runner, struct lum_error *err)
{
    int64_t begin_ns = lum_clock_ns();
    struct lum_cache_key key = cache_key(pass);
    struct lum_cache_update update = {pass->snapshot, runner->pool, runner->counters};
    enum lum_status status = lum_records_update(&d->records, d->caches, &key, &update, err);
    runner->stats->stage_ms[LUM_STAGE_CACHE] += (double)(lum_clock_ns() - begin_ns) * 1e-6;
    if (status != LUM_OK)
        return status;
    pass->records = &d->records;
    if (!key.kind->vpls)
        return LUM_OK;
    pass->vpls = &d->records.cache->vpls;
    count_vpls(pass->vpls, runner->stats);
    return LUM_OK;
}

static enum lum_status run_whole(const struct lum_stage_runner *runner, const struct lum_pass *pass,
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
    pass->cached_sky = cached_sky(pass);
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
    struct plan plan = make_plan(pass);
    enum lum_status status = see(d, pass, &plan, runner, err);
    return status == LUM_OK && plan.surfaces ? lum_stage_run(runner, pass, &lum_stage_surfaces) : status;
}

enum lum_status lum_deferred_run(struct lum_deferred *d, struct lum_pass *pass, const struct lum_stage_runner *runner,
                                 struct lum_error *err)
{
    struct plan plan = make_plan(pass);
    runner->stats->n_vpls = 0;
    enum lum_status status = see(d, pass, &plan, runner, err);
    if (status == LUM_OK && plan.cache)
        status = update_cache(d, pass, runner, err);
    else if (status == LUM_OK && plan.vpls)
        status = update_vpls(d, pass, runner, err);
    for (uint32_t i = 0; i < plan.n && status == LUM_OK; i++)
        status = plan.stages[i]->run ? run_whole(runner, pass, plan.stages[i], err)
                                     : lum_stage_run(runner, pass, plan.stages[i]);
    if (pass->records)
        runner->stats->cache = pass->records->counts;
    if (d->layers.starved) {
        lum_layers_finish(&d->layers);
        return lum_fail(err, LUM_ERR_NOMEM, "", "out of memory for what mirrors and glass show of lights");
    }
    if (status == LUM_OK)
        d->n_vpls = runner->stats->n_vpls;
    return status;
}

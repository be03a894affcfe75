/* Passes of a view: which stages are stale, which estimators run, what it cost. */
#include <string.h>

#include "core/base/team.h"
#include "core/effect/path/path.h"
#include "core/math/sampler.h"
#include "core/path/guide.h"
#include "core/trace/stale.h"
#include "core/vpl/portals.h"
#include "core/render/view_state.h"

struct lum_view_settings lum_view_settings_default(void)
{
    return (struct lum_view_settings){
        .camera = {.position = {0, 1, 3}, .target = {0, 1, 0}, .up = {0, 1, 0}, .vfov_deg = 45},
        .w = 600,
        .h = 400,
        .method = lum_method_find("live"),
        .max_depth = LUM_DEPTH_DEFAULT,
        .shadow_samples = 16,
        .shadow_budget = 100000,
        .layers_bytes = LUM_LAYERS_BYTES,
        .antialias = true,
        .n_vpls = LUM_VPL_DEFAULT,
        .storage = LUM_STORAGE_WAITFREE,
        .cache_accuracy = LUM_CACHE_ACCURACY,
    };
}

enum lum_status lum_view_create(struct lum_pool *pool, struct lum_view **ret_view, struct lum_error *err)
{
    struct lum_view *view = lum_calloc(1, sizeof *view);
    struct lum_counters *counters = lum_calloc(lum_pool_size(pool), sizeof *counters);
    if (!view || !counters) {
        lum_free(view);
        lum_free(counters);
        return lum_fail(err, LUM_ERR_NOMEM, "", "out of memory for a view");
    }
    view->pool = pool;
    view->counters = counters;
    *ret_view = view;
    return LUM_OK;
}

/* Frees all that depends on the size of the picture. */
static void drop_buffers(struct lum_view *v)
{
    lum_film_finish(&v->film);
    lum_deferred_finish(&v->deferred);
    lum_refine_finish(&v->refinement);
    lum_rough_base_finish(&v->base);
    lum_mix_finish(&v->mix);
    v->whole = v->mixed = false;
    lum_free(v->tile_spp);
    lum_aov_finish(&v->aov);
    lum_effect_noise_finish(&v->effect_noise);
    v->tile_spp = NULL;
    v->tiling = (struct lum_tiling){0};
    v->rendered = false;
}

void lum_view_destroy(struct lum_view *view)
{
    if (!view)
        return;
    lum_view_destroy(view->rough);
    lum_view_destroy(view->half);
    drop_buffers(view);
    lum_path_guide_destroy(view->guide);
    lum_measure_finish(&view->measurement);
    lum_measure_finish(&view->rough_measurement);
    lum_caches_destroy(view->own_caches);
    lum_free(view->counters);
    lum_free(view);
}

void lum_view_share(struct lum_view *view, struct lum_caches *caches)
{
    view->deferred.caches = caches;
}

void lum_view_join(struct lum_view *view, struct lum_team *team)
{
    view->team = team;
}

void lum_view_forget(struct lum_view *view)
{
    lum_deferred_forget(&view->deferred);
    lum_rough_base_finish(&view->base);
    view->rendered = view->whole = view->mixed = false;
    if (view->rough)
        lum_view_forget(view->rough);
    if (view->half)
        lum_view_forget(view->half);
}

const struct lum_film *lum_view_film(const struct lum_view *view)
{
    return &view->film;
}

enum lum_status lum_view_error_map(const struct lum_view *view, struct lum_error_map *ret_map, struct lum_error *err)
{
    enum lum_status status = lum_error_map_init(ret_map, &view->film, err);
    if (status != LUM_OK)
        return status;
    bool own = isfinite(view->error.bound); /* its own samples tell */
    bool rough = view->previewed && lum_view_least_spp(view->tile_spp, view->tiling.n) == 0;
    const struct lum_measurement *shown = rough ? &view->rough_measurement : &view->measurement;
    if (own && view->settings.method->refines)
        lum_residual_add_errors(view->refinement.memory, ret_map);
    else if (own)
        lum_error_map_add_halves(ret_map, &view->film);
    else if (shown->probes)
        lum_error_probes_add_errors(shown->probes, &view->film, ret_map);
    lum_error_map_settle(ret_map);
    return LUM_OK;
}

const uint8_t *lum_view_guidance(const struct lum_view *view, enum lum_effect effect)
{
    const struct lum_components *c = &view->deferred.components;
    if (!view->rendered || !lum_effect_rows[effect]->guided || c->basis.settings.method != view->settings.method)
        return NULL;
    return c->buffer[effect].iterations;
}

/* ---- what is stale ---- */

static enum lum_status check_settings(const struct lum_view_settings *s, struct lum_error *err)
{
    if (s->w < 1 || s->h < 1 || s->w > 65536 || s->h > 65536)
        return lum_fail(err, LUM_ERR_INVALID, "size", "a picture has 1 to 65536 pixels a side, not %u x %u", s->w,
                        s->h);
    if (!s->method)
        return lum_fail(err, LUM_ERR_INVALID, "method", "no method was chosen");
    uint32_t roughest = s->method->progressive ? LUM_PREVIEW_WHOLE : LUM_PREVIEW_MAX;
    if (s->preview > roughest)
        return lum_fail(err, LUM_ERR_INVALID, "preview", "must be 0 to %u, not %u", roughest, s->preview);
    if (s->shadow_samples < 1 || s->shadow_samples > 16)
        return lum_fail(err, LUM_ERR_INVALID, "shadow_samples", "must be 1 to 16, not %u", s->shadow_samples);
    if (s->n_vpls < 1 || s->n_vpls > LUM_VPL_MAX)
        return lum_fail(err, LUM_ERR_INVALID, "vpls", "must be 1 to %u, not %u", LUM_VPL_MAX, s->n_vpls);
    if ((unsigned)s->storage >= LUM_STORAGE_COUNT)
        return lum_fail(err, LUM_ERR_INVALID, "storage", "there is no storage %d", (int)s->storage);
    if (!(s->cache_accuracy >= LUM_CACHE_ACCURACY_MIN && s->cache_accuracy <= LUM_CACHE_ACCURACY_MAX))
        return lum_fail(err, LUM_ERR_INVALID, "cache_accuracy", "must be %g to %g, not %g",
                        (double)LUM_CACHE_ACCURACY_MIN, (double)LUM_CACHE_ACCURACY_MAX, (double)s->cache_accuracy);
    return LUM_OK;
}

static enum lum_status resize(struct lum_view *v, uint32_t w, uint32_t h, struct lum_error *err)
{
    if (v->film.w == w && v->film.h == h)
        return LUM_OK;
    drop_buffers(v);
    enum lum_status status = lum_film_init(&v->film, w, h, err);
    if (status != LUM_OK)
        return status;
    v->tiling = lum_tiling_make(w, h, LUM_TILE_SIDE);
    v->tile_spp = lum_calloc(v->tiling.n, sizeof *v->tile_spp);
    if (v->tile_spp)
        return LUM_OK;
    drop_buffers(v);
    return lum_fail(err, LUM_ERR_NOMEM, "size", "out of memory for a picture of %u x %u", w, h);
}

static void forget_noise(struct lum_view *v)
{
    for (int e = 0; e < LUM_EFFECT_COUNT; e++)
        v->noise[e] = (double)NAN;
}

/* Effects that fog alone calls for, where what it scatters is left out, or the method's frames have none of it: there
 * is nothing to compute. Of caches that have the light of gloss it is in the indirect light of surfaces. */
static uint32_t fogs_alone(const struct lum_view *v, const struct lum_view_settings *s, bool frame)
{
    uint32_t by_fog = v->demand.by_fog & ~s->effects_on;
    if (s->effects_off & (LUM_EFFECT_BIT(LUM_EFFECT_SCATTERING) | LUM_EFFECT_BIT(LUM_EFFECT_MEDIA)))
        return by_fog;
    if (!frame || s->method->progressive)
        return 0;
    bool in_cache = s->method->cache && s->method->cache->gloss;
    return in_cache ? by_fog & ~LUM_EFFECT_BIT(LUM_EFFECT_INDIRECT_DIFFUSE) : by_fog;
}

/* Derives the demand and starts the film anew if anything that it shows changed. Tiles keep the older picture until
 * their first new sample. */
static void refresh_film(struct lum_view *v, struct lum_pass *pass)
{
    const struct lum_versions *now = &pass->snapshot->versions;
    bool same_scene = v->rendered && lum_versions_equal(now, &v->versions);
    bool same = same_scene && lum_view_same_picture(&v->settings, pass->settings);
    if (!same_scene)
        lum_demand_derive(pass->snapshot, &v->demand);
    v->whole = v->whole && lum_view_same_picture(&v->settings, pass->settings);
    if (!same) {
        bool power_alone = v->rendered && lum_view_same_picture(&v->settings, pass->settings) &&
                           lum_edits_of_versions(&v->versions, now) == LUM_EDIT_BIT(LUM_EDIT_LIGHT_POWER);
        v->mixed = v->mixed && power_alone;
        v->relit = power_alone && (v->relit || lum_view_least_spp(v->tile_spp, v->tiling.n) > 0);
        memset(v->tile_spp, 0, v->tiling.n * sizeof *v->tile_spp);
        v->previewed = false;
        v->error = LUM_FILM_ERROR_UNKNOWN;
        forget_noise(v);
        bool alike = v->rendered && lum_view_same_error(&v->settings, pass->settings);
        lum_measure_begin(&v->measurement, alike);
        lum_measure_begin(&v->rough_measurement, alike && v->settings.preview == pass->settings->preview &&
                                                     v->settings.preview_eased == pass->settings->preview_eased);
    }
    v->versions = *now;
    v->settings = *pass->settings;
    v->rendered = true;
    v->chosen = v->demand;
    /* On a white surface light arrives by way of others even if no other scatters it evenly. */
    uint32_t indirect = LUM_EFFECT_BIT(LUM_EFFECT_INDIRECT_DIFFUSE), alone = fogs_alone(v, pass->settings, true);
    bool called = pass->settings->illuminance && (!v->demand.on[LUM_EFFECT_INDIRECT_DIFFUSE] || (alone & indirect));
    lum_demand_choose(&v->chosen, pass->settings->antialias, pass->settings->effects_off,
                      pass->settings->effects_on | (called ? indirect : 0));
    alone &= called ? ~indirect : UINT32_MAX;
    for (int e = 0; e < LUM_EFFECT_COUNT; e++)
        pass->on[e] = v->chosen.on[e] && lum_method_serves(pass->settings->method, e) && !(alone & LUM_EFFECT_BIT(e));
}

/* Samples that every pixel has. The fast frame of a method that refines counts as one. */
static uint32_t view_spp(const struct lum_view *v, const struct lum_method *method)
{
    uint32_t spp = lum_view_least_spp(v->tile_spp, v->tiling.n);
    if (spp > 0 && method->refines && v->refinement.tile_spp)
        spp = 1 + lum_view_least_spp(v->refinement.tile_spp, v->tiling.n);
    return spp;
}

/* ---- a pass ---- */

/* Every kind of light that the scene has. */
static bool shows_every_light(const struct lum_view *v, const struct lum_pass *pass)
{
    static const enum lum_effect kinds[] = {LUM_EFFECT_DIRECT, LUM_EFFECT_SOFT_SHADOW, LUM_EFFECT_ENVIRONMENT};
    for (size_t i = 0; i < LUM_ARRAY_LEN(kinds); i++)
        if (v->demand.on[kinds[i]] && !pass->on[kinds[i]])
            return false;
    return true;
}

/* One alone does without; of a team all have to. */
static void is_short_of_memory(const struct lum_view *v, const char *why)
{
    if (v->team)
        v->team->kind->give_up(v->team, why);
}

/* Portals for path traced samples, but for rough ones, which are fewer than the rays that look for them. NULL: there
 * are none. */
static const struct lum_portals *find_portals(struct lum_view *v, const struct lum_pass *pass)
{
    const struct lum_snapshot *s = pass->snapshot;
    if (pass->block > 1 || s->lights.environment == LUM_NO_OBJECT)
        return NULL;
    struct lum_versions now = lum_versions_seen(s, false);
    if (!v->portals_known || lum_is_stale(lum_edits_of_versions(&v->portals_versions, &now), LUM_PRODUCT_VPL_PATHS)) {
        struct lum_vpl_request request = {.snapshot = s, .pool = v->pool, .counters = &v->counters[0]};
        struct lum_error unused; /* without memory samples are as they are without portals */
        if (lum_vpl_find_portals(&v->portals, &request, &unused) != LUM_OK) {
            is_short_of_memory(v, "out of memory for what lies before windows");
            v->portals.n = 0;
        }
        v->portals_versions = now;
        v->portals_known = true;
    }
    return v->portals.n > 0 ? &v->portals : NULL;
}

/* One more path traced sample of every pixel. */
static enum lum_status run_samples(struct lum_view *v, struct lum_pass *pass, const struct lum_stage_runner *runner)
{
    int64_t begin_ns = lum_clock_ns();
    if (!v->guide && pass->target_spp > 1)
        v->guide = lum_path_guide_create();
    if (!v->guide && pass->target_spp > 1)
        is_short_of_memory(v, "out of memory for what guides paths");
    struct lum_guided_pass guided = {pass->snapshot, pass->film, pass->target_spp - 1,
                                     pass->on[LUM_EFFECT_INDIRECT_DIFFUSE] && shows_every_light(v, pass), v->team};
    pass->portals = find_portals(v, pass);
    pass->guide = v->guide && lum_path_guide_begin(v->guide, &guided, v->pool) ? v->guide : NULL;
    runner->stats->stage_ms[LUM_STAGE_PATH] += (double)(lum_clock_ns() - begin_ns) * 1e-6;
    struct lum_error unused;
    if (pass->settings->error_share > 0.0 &&
        (v->effect_noise.sum || lum_effect_noise_init(&v->effect_noise, v->tiling.w, v->tiling.h, &unused) == LUM_OK))
        pass->effect_noise = &v->effect_noise;
    enum lum_status status = lum_stage_run(runner, pass, &lum_estimator_path);
    if (status == LUM_OK && pass->effect_noise && pass->block == 1 && pass->target_spp % 2 == 0)
        lum_effect_noise_read(&v->effect_noise, pass->target_spp, v->noise);
    return status;
}

/* The next sample of every pixel; or first, once per picture, the rough pass. */
static enum lum_status run_path(struct lum_view *v, struct lum_pass *pass, const struct lum_stage_runner *runner)
{
    bool rough = pass->settings->preview > 1 && pass->target_spp == 1 && !v->previewed;
    if (rough)
        pass->block = runner->stats->preview = pass->settings->preview;
    enum lum_status status = run_samples(v, pass, runner);
    if (status == LUM_OK)
        v->previewed = true;
    return status;
}

enum lum_status lum_view_frame(struct lum_view *v, struct lum_pass *pass, const struct lum_stage_runner *runner,
                               struct lum_error *err)
{
    if (!pass->settings->fading)
        lum_mix_finish(&v->mix);
    v->mixed = false;
    bool refines = pass->settings->method->refines;
    enum lum_status status = LUM_OK;
    if (refines && !v->refinement.frame)
        status = lum_refine_init(&v->refinement, &v->tiling, err);
    if (status == LUM_OK)
        status = lum_deferred_run(&v->deferred, pass, runner, err);
    v->whole = status == LUM_OK;
    if (v->whole || v->base.versions.geometry != pass->snapshot->versions.geometry) /* it has not heard of what moved */
        lum_rough_base_finish(&v->base);
    if (status == LUM_OK && refines)
        lum_refine_begin(&v->refinement, &v->tiling);
    if (status != LUM_OK && status != LUM_ERR_CANCELLED) /* it may have got as far as the film */
        memset(v->tile_spp, 0, v->tiling.n * sizeof *v->tile_spp);
    runner->stats->changed = true;
    v->error = LUM_FILM_ERROR_UNKNOWN;
    return status;
}

/* The picture of lights on their way is a sum of two, where it can be; where they rest on it, it is made anew. */
static enum lum_status run_frame(struct lum_view *v, struct lum_pass *pass, const struct lum_stage_runner *runner,
                                 uint32_t spp, struct lum_error *err)
{
    bool mixed = false;
    enum lum_status status = spp == 0 ? lum_view_mix(v, pass, runner, &mixed, err) : LUM_OK;
    if (mixed || status != LUM_OK)
        return status;
    if (spp > 0)
        memset(v->tile_spp, 0, v->tiling.n * sizeof *v->tile_spp);
    return lum_view_frame(v, pass, runner, err);
}

/* Samples draw other random numbers than the frame did: its noise is none of theirs, else they would not show it. */
#define REST_SEED 0x72657374u

/* One path traced sample of every pixel, with every effect that is called for. Now and then the film gets the frame as
 * these correct it. */
static enum lum_status run_refinement(struct lum_view *v, const struct lum_pass *frame,
                                      const struct lum_stage_runner *runner)
{
    struct lum_refinement *r = &v->refinement;
    struct lum_pass pass = *frame;
    struct lum_view_settings settings = *frame->settings;
    settings.seed = lum_hash_u32(settings.seed ^ REST_SEED);
    pass.settings = &settings;
    uint32_t max_spp = pass.settings->max_spp, spp = lum_view_least_spp(r->tile_spp, v->tiling.n);
    enum lum_status status = LUM_OK;
    if (!r->taken)
        lum_refine_take(r, frame, &v->deferred, &v->film);
    pass.film = &r->truth;
    pass.tile_spp = r->tile_spp;
    pass.target_spp = spp + 1;
    uint32_t alone = fogs_alone(v, pass.settings, false);
    for (int e = 0; e < LUM_EFFECT_COUNT; e++)
        pass.on[e] = v->chosen.on[e] && !(alone & LUM_EFFECT_BIT(e));
    if (!r->owed) {
        status = run_samples(v, &pass, runner);
        spp = pass.target_spp;
        r->owed = status == LUM_OK && lum_refine_is_due(r, spp, max_spp > 1 ? max_spp - 1 : 0); /* the frame is one */
    }
    if (!r->owed)
        return status;
    status = lum_refine_apply(r, spp, &v->deferred, pass.eye.per_pixel, &v->film, runner);
    v->error = r->error;
    runner->stats->changed = status == LUM_OK;
    return status;
}

static enum lum_status run_progressive(struct lum_view *v, struct lum_pass *pass, const struct lum_stage_runner *runner)
{
    enum lum_status status = run_path(v, pass, runner);
    uint32_t spp = lum_view_least_spp(v->tile_spp, v->tiling.n);
    if (spp < 2)
        v->error = LUM_FILM_ERROR_UNKNOWN;
    else if (spp % 2 == 0) /* the halves are of equal size: the estimate is at its best */
        v->error = lum_film_error(&v->film);
    runner->stats->changed = true;
    return status;
}

static enum lum_status reserve_caches(struct lum_view *v, struct lum_error *err)
{
    if (v->deferred.caches)
        return LUM_OK;
    enum lum_status status = lum_caches_create(lum_pool_size(v->pool), &v->own_caches, err);
    if (status == LUM_OK)
        lum_view_share(v, v->own_caches);
    return status;
}

static enum lum_status begin_pass(struct lum_view *v, const struct lum_snapshot *snapshot,
                                  const struct lum_view_settings *settings, struct lum_pass *ret_pass,
                                  struct lum_error *err)
{
    struct lum_pass pass = {.snapshot = snapshot, .settings = settings, .block = 1};
    enum lum_status status = check_settings(settings, err);
    if (status == LUM_OK)
        status = lum_eye_init(&pass.eye, &settings->camera, &snapshot->norm, settings->w, settings->h, err);
    if (status == LUM_OK)
        status = resize(v, settings->w, settings->h, err);
    if (status == LUM_OK)
        status = reserve_caches(v, err);
    if (status != LUM_OK)
        return status;
    if (!settings->method->cache) /* else all that a view ever used would be kept for it */
        lum_records_finish(&v->deferred.records, v->deferred.caches);
    pass.footprint = v->block > 0 ? pass.eye.per_pixel / (float)v->block : pass.eye.per_pixel;
    pass.tiling = v->tiling;
    pass.cells = lum_tiling_make(settings->w, settings->h, LUM_CELL_SIDE);
    pass.film = &v->film;
    pass.tile_spp = v->tile_spp;
    *ret_pass = pass;
    return LUM_OK;
}

static void clear_counters(struct lum_view *v)
{
    for (uint32_t w = 0; w < lum_pool_size(v->pool); w++)
        v->counters[w] = (struct lum_counters){.worker = w};
}

/* Also of a pass that does not look at them. */
static uint64_t n_records(const struct lum_view *v, const struct lum_method *method)
{
    const struct lum_cache *cache = method->cache ? v->deferred.records.cache : NULL;
    return cache && cache->store ? lum_store_count(cache->store) : 0;
}

static uint64_t traced(const struct lum_view *v)
{
    uint64_t rays = 0;
    for (uint32_t w = 0; w < lum_pool_size(v->pool); w++)
        for (int k = 0; k < LUM_RAY_KIND_COUNT; k++)
            rays += v->counters[w].rays[k];
    return rays;
}

static void sum_counters(const struct lum_view *v, struct lum_pass_stats *stats)
{
    for (uint32_t w = 0; w < lum_pool_size(v->pool); w++) {
        const struct lum_counters *c = &v->counters[w];
        for (int k = 0; k < LUM_RAY_KIND_COUNT; k++)
            stats->rays[k] += c->rays[k];
        for (int e = 0; e < LUM_EFFECT_COUNT; e++) {
            stats->effects[e].tiles += c->tiles[e];
            stats->effects[e].ns += c->ns[e];
        }
        stats->nonfinite += c->nonfinite;
        stats->bad_rays += c->bad_rays;
        stats->culled_bound = fmax(stats->culled_bound, c->culled_bound);
    }
    for (int e = 0; e < LUM_EFFECT_COUNT; e++)
        stats->effects[e].rays = stats->rays[lum_effect_ray_kind((enum lum_effect)e)];
}

static double noise_of(const struct lum_view *v, const struct lum_method *method)
{
    if (method->progressive)
        return v->error.bound;
    return method->refines && isfinite(v->error.bound) ? v->refinement.noise : (double)NAN;
}

/* As its own samples tell it, else as probes do; where these are few, a single sample's pixels side by side are surer.
 * Where nothing shines a black picture is right. */
static struct lum_film_error known_error(const struct lum_view *v, const struct lum_pass *pass, uint32_t spp)
{
    const struct lum_view_settings *s = pass->settings;
    const struct lum_film_error *probed = &v->measurement.error;
    bool many = isfinite(probed->bound) && v->measurement.n_known >= LUM_MANY_PROBES;
    if (isfinite(v->error.bound))
        return v->error;
    if (spp > 0 && pass->snapshot->lights.n_active == 0 && lum_film_is_black(&v->film))
        return (struct lum_film_error){0.0, 0.0, (double)s->w * s->h, 1.0};
    if (s->method->progressive && spp == 1 && s->error_share > 0.0 && !many) {
        struct lum_film_error said = lum_film_error_at_most(&v->film);
        return isfinite(said.bound) ? said : *probed;
    }
    return *probed;
}

/* Of the picture that the pass made or bettered, in a share of its time. A rough one is seen without the edges and the
 * samples that it will have: those are what it is compared with. */
static void measure(struct lum_view *v, const struct lum_pass *pass, const struct lum_stage_runner *runner,
                    int64_t begin_ns, bool first)
{
    bool rough = runner->stats->preview > 1;
    uint64_t rays = traced(v);
    for (int k = 0; k < LUM_RAY_KIND_COUNT; k++)
        rays += runner->stats->rays[k]; /* of a rough picture's own view */
    if (pass->settings->error_share > 0.0 && (rough || !isfinite(v->error.bound)))
        lum_measure_share(rough ? &v->rough_measurement : &v->measurement, pass, v->chosen.on,
                          (struct lum_measure_cost){rays, (double)(lum_clock_ns() - begin_ns) * 1e-6, first}, runner);
}

/* All is known of the picture's error that is wanted. */
static bool is_measured(const struct lum_view *v, const struct lum_view_settings *s)
{
    return !s->measure_at_rest || s->error_share == 0.0 || isfinite(v->error.bound) ||
           lum_measure_is_done(&v->measurement, s->w, s->h);
}

enum lum_status lum_view_pass(struct lum_view *view, const struct lum_snapshot *snapshot,
                              const struct lum_view_settings *settings, const _Atomic bool *cancel,
                              struct lum_pass_stats *ret_stats, struct lum_error *err)
{
    int64_t begin_ns = lum_clock_ns(), begin_cpu_ns = lum_pool_cpu_ns(view->pool);
    struct lum_pass pass;
    enum lum_status status = begin_pass(view, snapshot, settings, &pass, err);
    if (status != LUM_OK)
        return status;
    refresh_film(view, &pass);
    struct lum_pass_stats stats = {.scene_rev = snapshot->scene_rev, .demand = view->chosen};
    for (int e = 0; e < LUM_EFFECT_COUNT; e++)
        stats.served[e] = lum_method_serves(settings->method, e) != NULL;
    stats.cache.records = n_records(view, settings->method);
    stats.n_vpls = settings->method->progressive ? 0 : view->deferred.n_vpls;
    struct lum_stage_runner runner = {view->pool, view->counters, cancel, &stats, view->team};
    const struct lum_method *method = settings->method;
    uint32_t spp = view_spp(view, method), max_spp = method->progressive || method->refines ? settings->max_spp : 1;
    bool owed = method->refines && spp > 0 && view->refinement.owed;
    if (max_spp == 0 || spp < max_spp || owed || view->mixed) {
        clear_counters(view);
        pass.target_spp = method->progressive ? spp + 1 : 1;
        if (method->progressive)
            status = run_progressive(view, &pass, &runner);
        else if (settings->preview > 1 && spp == 0 && !view->previewed && !view->relit)
            status = lum_view_rough(view, &pass, &runner, err);
        else if (spp > 0 && !view->mixed)
            status = run_refinement(view, &pass, &runner);
        else
            status = run_frame(view, &pass, &runner, spp, err);
        if (status == LUM_OK)
            measure(view, &pass, &runner, begin_ns, spp == 0);
        sum_counters(view, &stats);
        spp = view_spp(view, method);
    } else if (!is_measured(view, settings)) {
        clear_counters(view);
        stats.measuring = true;
        status = lum_measure_more(&view->measurement, &pass, view->chosen.on, &runner);
        sum_counters(view, &stats);
    }
    stats.spp = spp;
    owed = method->refines && spp > 0 && view->refinement.owed;
    stats.complete = max_spp > 0 && spp >= max_spp && !owed && !view->mixed && is_measured(view, settings);
    for (int e = 0; e < LUM_EFFECT_COUNT; e++)
        stats.effects[e].noise = view->noise[e];
    stats.error = stats.preview > 1 ? view->rough_measurement.error : known_error(view, &pass, spp);
    stats.unlit = spp > 0 && !isfinite(stats.error.bound) && lum_film_is_black(&view->film);
    stats.noise = noise_of(view, method);
    stats.cpu_ms = (double)(lum_pool_cpu_ns(view->pool) - begin_cpu_ns) * 1e-6;
    stats.ms = (double)(lum_clock_ns() - begin_ns) * 1e-6;
    *ret_stats = stats;
    return status;
}

/* ---- first-hit buffers ---- */

enum lum_status lum_view_aovs(struct lum_view *view, const struct lum_snapshot *snapshot,
                              const struct lum_view_settings *settings, struct lum_aovs *ret_aovs,
                              struct lum_error *err)
{
    struct lum_pass pass;
    struct lum_pass_stats unused = {0};
    struct lum_stage_runner runner = {view->pool, view->counters, NULL, &unused, NULL};
    enum lum_status status = begin_pass(view, snapshot, settings, &pass, err);
    uint64_t stamp = view->deferred.gbuffer.stamp;
    if (status == LUM_OK)
        status = lum_deferred_look(&view->deferred, &pass, err);
    if (status == LUM_OK)
        status = lum_stage_run(&runner, &pass, &lum_stage_gbuffer);
    if (stamp != view->deferred.gbuffer.stamp && !settings->method->progressive)
        view->rendered = false; /* the frame that rests is of another G-buffer */
    if (status == LUM_OK)
        status = lum_aov_update(&view->aov, &pass, view->pool, err);
    if (status == LUM_OK)
        *ret_aovs = (struct lum_aovs){view->aov.albedo, view->aov.normal_world, view->aov.depth_m, view->aov.instance};
    return status;
}

/* Brings the cache of a method up to date, before its records are looked at. */
#include "core/effect/indirect/records.h"
#include "core/pass/vpls.h"

static bool has_sky(const struct lum_light_table *lights)
{
    for (uint32_t i = 0; i < lights->n_lights; i++)
        if (lights->lights[i].kind == &lum_emitter_environment)
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

/* Others leave the diffuse light of that sky to the records. */
static void prepare(struct lum_pass *pass)
{
    const struct lum_light_table *lights = &pass->snapshot->lights;
    bool shines = lights->environment != LUM_NO_OBJECT && lum_light_is_even_sky(&lights->lights[lights->environment]);
    pass->cached_sky = shines && caches_sky(pass) ? lights->environment : LUM_NO_OBJECT;
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
        .scatters = set->method->cache->gloss && pass->on[LUM_EFFECT_MEDIA] &&
                    !(set->effects_off & LUM_EFFECT_BIT(LUM_EFFECT_SCATTERING)),
        .lobes_off = pass->settings->effects_off & LUM_VPL_LOBES,
        .gloss = set->method->cache->gloss,
        .panes = lum_pass_panes(pass),
        .n_sky = caches_sky(pass) ? LUM_VPL_SKY : 0,
    };
}

static enum lum_status run_cache(struct lum_pass *pass, const struct lum_stage_runner *runner, struct lum_error *err)
{
    struct lum_cache_key key = cache_key(pass);
    struct lum_cache_update update = {pass->snapshot, runner->pool, runner->counters};
    enum lum_status status = lum_records_update(pass->kept_records, pass->caches, &key, &update, err);
    if (status != LUM_OK)
        return status;
    const struct lum_vpl_set *vpls = key.kind->vpls ? &pass->kept_records->cache->vpls : NULL;
    pass->fog_vpls = vpls;
    if (vpls)
        lum_vpls_count(vpls, runner->stats);
    if (!pass->on[LUM_EFFECT_INDIRECT_DIFFUSE])
        return LUM_OK;
    pass->records = pass->kept_records;
    pass->vpls = vpls;
    runner->stats->cache = pass->records->counts;
    return LUM_OK;
}

const struct lum_estimator lum_stage_cache = {
    .name = "cache", .stage = LUM_STAGE_CACHE, .prepare = prepare, .run = run_cache};

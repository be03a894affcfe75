#include "server/director/stats_json.h"

#include <string.h>
#include <sys/resource.h>

#include <cjson/cJSON.h>

#include "protocol/json/json.h"
#include "server/director/caustic_notice.h"

void lum_frame_stats_begin(struct lum_frame_stats *s, uint64_t frame)
{
    memset(s, 0, sizeof *s);
    s->frame = frame;
    s->sum.error = LUM_FILM_ERROR_UNKNOWN;
    s->sum.noise = (double)NAN;
}

void lum_frame_stats_next(struct lum_frame_stats *s, uint64_t frame)
{
    struct lum_pass_stats picture = {.scene_rev = s->sum.scene_rev,
                                     .demand = s->sum.demand,
                                     .n_vpls = s->sum.n_vpls,
                                     .cache.records = s->sum.cache.records,
                                     .spp = s->sum.spp,
                                     .error = s->sum.error,
                                     .noise = s->sum.noise,
                                     .preview = s->sum.preview};
    memcpy(picture.served, s->sum.served, sizeof picture.served);
    s->frame = frame;
    s->n_passes = 0;
    s->sum = picture;
}

/* How many records there are is of the last pass. */
static void add_cache(struct lum_cache_counts *sum, const struct lum_cache_counts *before)
{
    sum->created += before->created;
    sum->updated += before->updated;
    sum->reused += before->reused;
    sum->removed += before->removed;
    sum->discarded += before->discarded;
}

void lum_frame_stats_add(struct lum_frame_stats *s, const struct lum_pass_stats *pass)
{
    struct lum_pass_stats *sum = &s->sum;
    struct lum_pass_stats before = *sum;
    *sum = *pass;
    s->n_passes += !pass->measuring;
    sum->ms += before.ms;
    sum->cpu_ms += before.cpu_ms;
    sum->nonfinite += before.nonfinite;
    sum->bad_rays += before.bad_rays;
    sum->culled_bound = fmax(sum->culled_bound, before.culled_bound);
    add_cache(&sum->cache, &before.cache);
    sum->changed = sum->changed || before.changed;
    for (int i = 0; i < LUM_STAGE_COUNT; i++)
        sum->stage_ms[i] += before.stage_ms[i];
    for (int i = 0; i < LUM_RAY_KIND_COUNT; i++)
        sum->rays[i] += before.rays[i];
    for (int i = 0; i < LUM_EFFECT_COUNT; i++) {
        sum->effects[i].rays += before.effects[i].rays;
        sum->effects[i].tiles += before.effects[i].tiles;
        sum->effects[i].ns += before.effects[i].ns;
    }
}

static struct cJSON *stages_json(const struct lum_pass_stats *p)
{
    cJSON *o = cJSON_CreateObject();
    for (int i = 0; i < LUM_STAGE_COUNT; i++)
        lum_json_add_number(o, lum_stage_names[i], p->stage_ms[i]);
    return o;
}

static struct cJSON *rays_json(const struct lum_pass_stats *p)
{
    cJSON *o = cJSON_CreateObject();
    for (int i = 0; i < LUM_RAY_KIND_COUNT; i++)
        lum_json_add_number(o, lum_ray_kind_name((enum lum_ray_kind)i), (double)p->rays[i]);
    return o;
}

static struct cJSON *effects_json(const struct lum_pass_stats *p)
{
    cJSON *o = cJSON_CreateObject();
    for (int i = 0; i < LUM_EFFECT_COUNT; i++) {
        cJSON *e = cJSON_CreateObject();
        lum_json_add_bool(e, "on", p->demand.on[i]);
        lum_json_add_bool(e, "served", p->served[i]);
        lum_json_add_string(e, "why", p->demand.why[i]);
        lum_json_add_number(e, "rays", (double)p->effects[i].rays);
        lum_json_add_number(e, "tiles", (double)p->effects[i].tiles);
        lum_json_add_number(e, "ns", (double)p->effects[i].ns);
        bool known = isfinite(p->effects[i].noise);
        lum_json_add(e, "noise", known ? cJSON_CreateNumber(p->effects[i].noise) : cJSON_CreateNull());
        lum_json_add(o, lum_effect_names[i], e);
    }
    return o;
}

static struct cJSON *cache_json(const struct lum_cache_counts *c)
{
    cJSON *o = cJSON_CreateObject();
    lum_json_add_number(o, "records", (double)c->records);
    lum_json_add_number(o, "created", (double)c->created);
    lum_json_add_number(o, "updated", (double)c->updated);
    lum_json_add_number(o, "reused", (double)c->reused);
    lum_json_add_number(o, "removed", (double)c->removed);
    lum_json_add_number(o, "discarded", (double)c->discarded);
    return o;
}

static struct cJSON *vpls_json(const struct lum_pass_stats *p)
{
    cJSON *o = cJSON_CreateObject();
    lum_json_add_number(o, "count", p->n_vpls);
    lum_json_add_number(o, "moved", p->n_vpls_moved);
    return o;
}

static void add_amount(cJSON *o, const struct lum_caustic_amount *a)
{
    lum_json_add_number(o, "share", lum_caustic_share(a));
    lum_json_add_number(o, "stderr", lum_caustic_share_stderr(a));
    lum_json_add_number(o, "focused_lm", a->focused_lm);
    lum_json_add_number(o, "arriving_lm", a->arriving_lm);
}

static struct cJSON *caustics_json(const struct lum_caustic_report *r)
{
    if (!r->known)
        return cJSON_CreateNull();
    struct lum_caustic_notice notice = lum_caustic_notice(r);
    cJSON *o = cJSON_CreateObject(), *lights = cJSON_CreateArray();
    add_amount(o, &r->all);
    lum_json_add_string(o, "why", notice.why);
    lum_json_add_string(o, "mend", notice.mend);
    lum_json_add_number(o, "scene_rev", (double)r->scene_rev);
    lum_json_add_number(o, "rays", (double)r->n_rays);
    for (uint32_t i = 0; i < r->n_lights; i++) {
        cJSON *l = cJSON_CreateObject();
        lum_json_add_string(l, "id", r->lights[i].id);
        lum_json_add_string(l, "object", r->lights[i].object);
        add_amount(l, &r->lights[i].amount);
        lum_json_add(lights, NULL, l);
    }
    lum_json_add(o, "lights", lights);
    return o;
}

static struct cJSON *number_or_null(double value)
{
    return isfinite(value) ? cJSON_CreateNumber(value) : cJSON_CreateNull();
}

static struct cJSON *error_json(const struct lum_frame_stats *s)
{
    const struct lum_film_error *e = &s->sum.error;
    if (!isfinite(e->bound))
        return cJSON_CreateNull();
    cJSON *o = cJSON_CreateObject();
    lum_json_add_number(o, "rel", e->rel);
    lum_json_add_number(o, "bound", e->bound);
    lum_json_add_number(o, "probes", e->probes);
    lum_json_add_number(o, "fresh", e->fresh);
    return o;
}

/* null: not known, or never. */
static void add_range(cJSON *o, const char *name, const char *least, const char *most, struct lum_forecast_range range)
{
    lum_json_add(o, name, number_or_null(range.likely));
    lum_json_add(o, least, number_or_null(range.least));
    lum_json_add(o, most, number_or_null(range.most));
}

static struct cJSON *predicted_json(const struct lum_budget_end *end)
{
    if (!end->stopped_by)
        return cJSON_CreateNull();
    cJSON *o = cJSON_CreateObject();
    lum_json_add_string(o, "stopped_by", end->stopped_by);
    add_range(o, "ms", "ms_least", "ms_most", end->ms);
    add_range(o, "error", "error_least", "error_most", end->error);
    return o;
}

static struct cJSON *name_or_null(const char *name)
{
    return name ? cJSON_CreateString(name) : cJSON_CreateNull();
}

struct cJSON *lum_frame_stats_json(const struct lum_frame_stats *s)
{
    const struct lum_pass_stats *p = &s->sum;
    cJSON *o = cJSON_CreateObject();
    bool ok = lum_json_add_number(o, "frame", (double)s->frame) &&
              lum_json_add_number(o, "scene_rev", (double)p->scene_rev) && lum_json_add_number(o, "ms", p->ms) &&
              lum_json_add_number(o, "cpu_ms", p->cpu_ms) && lum_json_add_number(o, "passes", s->n_passes) &&
              lum_json_add_number(o, "spp", p->spp) && lum_json_add(o, "stage_ms", stages_json(p)) &&
              lum_json_add(o, "rays", rays_json(p)) && lum_json_add(o, "effects", effects_json(p)) &&
              lum_json_add(o, "cache", cache_json(&p->cache)) && lum_json_add(o, "vpls", vpls_json(p)) &&
              lum_json_add(o, "caustics", caustics_json(&s->caustics)) &&
              lum_json_add_number(o, "nonfinite", (double)p->nonfinite) &&
              lum_json_add_number(o, "bad_rays", (double)p->bad_rays) &&
              lum_json_add_number(o, "culled_bound", p->culled_bound) && lum_json_add(o, "error", error_json(s)) &&
              lum_json_add_number(o, "spent_ms", s->budget.spent_ms) &&
              lum_json_add(o, "stopped_by", name_or_null(s->stopped_by)) &&
              lum_json_add(o, "budget_verdict", name_or_null(s->budget.verdict)) &&
              lum_json_add(o, "predicted", predicted_json(&s->budget.predicted));
    if (ok)
        return o;
    cJSON_Delete(o);
    return NULL;
}

struct cJSON *lum_run_stats_json(const struct lum_run_stats *s)
{
    struct rusage usage = {0};
    getrusage(RUSAGE_SELF, &usage); /* ru_maxrss is in KiB */
    cJSON *o = cJSON_CreateObject(), *size = cJSON_CreateArray();
    lum_json_add(size, NULL, cJSON_CreateNumber(s->w));
    lum_json_add(size, NULL, cJSON_CreateNumber(s->h));
    bool ok = lum_json_add_string(o, "version", LUMEND_VERSION) && lum_json_add_string(o, "scene", s->scene) &&
              lum_json_add_string(o, "method", s->method) && lum_json_add(o, "size", size) &&
              lum_json_add_number(o, "threads", s->threads) && lum_json_add_number(o, "seed", s->seed) &&
              lum_json_add_string(o, "isa", s->isa) && lum_json_add_number(o, "setup_ms", s->setup_ms) &&
              lum_json_add_number(o, "peak_rss_kb", (double)usage.ru_maxrss);
    if (ok)
        return o;
    cJSON_Delete(o);
    return NULL;
}

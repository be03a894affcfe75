#include "tests/support/closed_kind.h"

#include "core/effect/indirect/records.h"

static _Atomic uint64_t n_refreshes;

uint64_t closed_refreshes(void)
{
    return atomic_load(&n_refreshes);
}

struct lum_rgb closed_irradiance(enum closed_kind kind, struct lum_vec3 p, struct lum_vec3 n)
{
    if (kind == CLOSED_LINEAR || kind == CLOSED_PIXELS_KIND || kind == CLOSED_POINTS)
        return lum_rgb(50.0f + p.x, 50.0f - 0.5f * p.y, 50.0f + 0.25f * p.z);
    if (kind == CLOSED_BROKEN)
        return lum_grey(NAN);
    return lum_rgb(2.0f + sinf(0.3f * p.x), 2.0f + n.y + 0.5f * sinf(0.2f * p.y), 1.5f + n.x * cosf(0.1f * p.z));
}

static void build(const struct lum_cache_job *job, enum closed_kind kind)
{
    for (uint32_t i = 0; i < job->n; i++) {
        struct lum_cache_record *r = job->records[i];
        float footprint = lum_cache_footprint(job->pixel, job->eye, r->p);
        r->radius = lum_max(0.8f + 0.4f * sinf(0.7f * r->p.x) * sinf(0.5f * r->p.z), 2.0f * footprint);
        r->irradiance = closed_irradiance(kind, r->p, r->n);
        if (kind == CLOSED_PIXELS_KIND) {
            r->radius = CLOSED_PIXELS * footprint;
            r->footprint = footprint;
        }
        if (kind == CLOSED_POINTS)
            r->radius = LUM_RAY_OFFSET;
        if (kind == CLOSED_STEEP)
            for (uint32_t k = 0; k < 3; k++)
                r->gradient[k] = lum_grey(k == 1 ? -1e4f : 1e4f);
        if (kind == CLOSED_LINEAR) {
            r->gradient[0].r = 1.0f;
            r->gradient[1].g = -0.5f;
            r->gradient[2].b = 0.25f;
        }
    }
}

static void build_wavy(const struct lum_cache_job *job)
{
    build(job, CLOSED_WAVY);
}

static void build_linear(const struct lum_cache_job *job)
{
    build(job, CLOSED_LINEAR);
}

static void build_pixels(const struct lum_cache_job *job)
{
    build(job, CLOSED_PIXELS_KIND);
}

static void build_broken(const struct lum_cache_job *job)
{
    build(job, CLOSED_BROKEN);
}

static void build_points(const struct lum_cache_job *job)
{
    build(job, CLOSED_POINTS);
}

static void build_steep(const struct lum_cache_job *job)
{
    build(job, CLOSED_STEEP);
}

/* Every seventh record is removed. */
static void refresh(const struct lum_cache_job *job)
{
    for (uint32_t i = 0; i < job->n; i++) {
        struct lum_cache_record *r = job->records[i];
        atomic_fetch_add(&n_refreshes, 1);
        if (lum_cache_is_stale(job->cache, r) && r->index % 7 == 0 &&
            lum_store_remove(job->cache->store, job->worker, r))
            atomic_fetch_add(&job->cache->removed, 1);
    }
}

static void change(struct lum_cache *cache, const struct lum_cache_update *update, const struct lum_motion *motion)
{
    (void)cache;
    (void)update;
    (void)motion;
}

static size_t record_bytes(uint32_t n_vpls)
{
    (void)n_vpls;
    return sizeof(struct lum_cache_record);
}

const struct lum_cache_kind closed_kinds[CLOSED_KIND_COUNT] = {
    [CLOSED_WAVY] = {.name = "wavy", .metric = LUM_METRIC_TENTS, .record_bytes = record_bytes, .build = build_wavy},
    [CLOSED_LINEAR] = {.name = "linear",
                       .metric = LUM_METRIC_WARD,
                       .record_bytes = record_bytes,
                       .build = build_linear},
    [CLOSED_STALE] = {.name = "stale",
                      .metric = LUM_METRIC_TENTS,
                      .lasting = true,
                      .record_bytes = record_bytes,
                      .build = build_wavy,
                      .refresh = refresh,
                      .change = change},
    [CLOSED_BROKEN] = {.name = "broken",
                       .metric = LUM_METRIC_TENTS,
                       .record_bytes = record_bytes,
                       .build = build_broken},
    [CLOSED_POINTS] = {.name = "points",
                       .metric = LUM_METRIC_TENTS,
                       .record_bytes = record_bytes,
                       .build = build_points},
    [CLOSED_STEEP] = {.name = "steep", .metric = LUM_METRIC_TENTS, .record_bytes = record_bytes, .build = build_steep},
    [CLOSED_PIXELS_KIND] = {.name = "pixels",
                            .metric = LUM_METRIC_TENTS,
                            .lasting = true,
                            .record_bytes = record_bytes,
                            .build = build_pixels,
                            .change = change},
};

#define ROW(i)                                                                                                         \
    {                                                                                                                  \
        .name = "closed", .cache = &closed_kinds[i], .serves = {                                                       \
            [LUM_EFFECT_INDIRECT_DIFFUSE] = &lum_estimator_cached                                                      \
        }                                                                                                              \
    }
const struct lum_method closed_methods[CLOSED_KIND_COUNT] = {
    ROW(CLOSED_WAVY),        ROW(CLOSED_LINEAR), ROW(CLOSED_STALE), ROW(CLOSED_BROKEN),
    ROW(CLOSED_PIXELS_KIND), ROW(CLOSED_POINTS), ROW(CLOSED_STEEP)};
const struct lum_method closed_free = {
    .name = "closed_free",
    .cache = &closed_kinds[CLOSED_WAVY],
    .serves = {[LUM_EFFECT_INDIRECT_DIFFUSE] = &lum_estimator_cached_free},
};
const struct lum_method closed_quarter = {
    .name = "closed_quarter",
    .cache = &closed_kinds[CLOSED_WAVY],
    .serves = {[LUM_EFFECT_INDIRECT_DIFFUSE] = &lum_estimator_cached},
    .filters = {&lum_stage_upsample},
};

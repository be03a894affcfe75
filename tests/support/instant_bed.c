#include "tests/support/instant_bed.h"

#include "core/math/sampler.h"
#include "core/scene/surface.h"

struct lum_cache_key instant_key(const struct lum_cache_kind *kind, uint32_t n_vpls, uint32_t max_bounces)
{
    return (struct lum_cache_key){
        .kind = kind, .storage = LUM_STORAGE_WAITFREE, .n_vpls = n_vpls, .max_bounces = max_bounces, .accuracy = 0.25f};
}

void bed_begin(struct instant_bed *b, const struct lum_cache_key *key)
{
    memset(b, 0, sizeof *b);
    rig_begin(&b->rig, 3);
    RIG_OK(lum_caches_create(3, &b->caches, &err));
    RIG_OK(lum_cache_acquire(b->caches, key, &b->cache, &err));
}

void bed_end(struct instant_bed *b)
{
    lum_cache_release(b->caches, b->cache);
    lum_caches_destroy(b->caches);
    rig_end(&b->rig);
}

void bed_tell_cache(struct instant_bed *b)
{
    struct lum_counters counters = {0};
    struct lum_cache_update update = {b->rig.snapshot, b->rig.pool, &counters};
    RIG_OK(lum_cache_update(b->cache, &update, &err));
    assert_int_equal(counters.bad_rays, 0);
    b->rays = counters.rays[LUM_RAY_INDIRECT_DIFFUSE];
}

void bed_publish(struct instant_bed *b)
{
    rig_commit(&b->rig);
    bed_tell_cache(b);
}

struct lum_cache_job bed_job(struct instant_bed *b, struct lum_cache_record *const *records, uint32_t n,
                             struct lum_counters *counters)
{
    return (struct lum_cache_job){
        .cache = b->cache, .snapshot = b->rig.snapshot, .records = records, .n = n, .counters = counters};
}

void bed_build(struct instant_bed *b, struct lum_cache_record *const *records, uint32_t n)
{
    struct lum_counters counters = {0};
    struct lum_cache_job job = bed_job(b, records, n, &counters);
    b->cache->key.kind->build(&job);
    assert_int_equal(counters.bad_rays, 0);
    b->rays = counters.rays[LUM_RAY_INDIRECT_DIFFUSE];
}

/* A new record, not built. */
static struct lum_cache_record *new_record(struct instant_bed *b, struct lum_vec3 p, struct lum_vec3 n)
{
    struct lum_cache_record *r = lum_store_new(b->cache->store, 0);
    assert_non_null(r);
    r->p = p;
    r->n = r->ng = n;
    return r;
}

void bed_insert(struct instant_bed *b, uint32_t first)
{
    bed_build(b, b->records + first, b->n - first);
    for (uint32_t i = first; i < b->n; i++)
        assert_true(lum_store_insert(b->cache->store, 0, b->records[i]));
}

void bed_add(struct instant_bed *b, struct lum_vec3 p, struct lum_vec3 n)
{
    assert_true(b->n < BED_RECORDS);
    b->records[b->n++] = new_record(b, p, n);
}

void bed_add_seen(struct instant_bed *b, struct lum_vec3 eye, uint32_t n, uint32_t seed)
{
    struct lum_rays rays = {.n = 0};
    struct lum_hits hits;
    uint64_t bad = 0;
    struct lum_trace trace = {.top = b->rig.snapshot->top, .bad_rays = &bad};
    for (uint32_t i = 0; i < n; i++) {
        struct lum_sampler sampler = lum_sampler_at(i, 0, 0, seed);
        struct lum_vec2 u = lum_sampler_2d(&sampler, 0);
        float z = 1.0f - 2.0f * u.x, r = sqrtf(lum_max(0.0f, 1.0f - z * z)), phi = 2.0f * LUM_PI * u.y;
        lum_rays_push(&rays, eye, lum_v3(r * cosf(phi), r * sinf(phi), z), INFINITY);
    }
    lum_trace_closest(&trace, &rays, &hits);
    for (uint32_t i = 0; i < n; i++) {
        struct lum_surface s;
        if (hits.object[i] == LUM_NO_OBJECT)
            continue;
        lum_snapshot_surface(b->rig.snapshot, &hits, i, lum_rays_direction(&rays, i), &s);
        if (s.instance == LUM_NO_OBJECT)
            continue;
        bed_add(b, s.p, s.ns);
        b->records[b->n - 1]->ng = s.ng;
        b->records[b->n - 1]->object = b->rig.snapshot->instances[s.instance].hash;
    }
}

void bed_refresh(struct instant_bed *b, uint32_t first, uint32_t n)
{
    struct lum_cache_record *stale[BED_RECORDS];
    struct lum_counters counters = {0};
    uint32_t n_stale = 0;
    for (uint32_t i = first; i < first + n; i++)
        if (b->records[i] && lum_cache_is_stale(b->cache, b->records[i]))
            stale[n_stale++] = b->records[i];
    struct lum_cache_job job = bed_job(b, stale, n_stale, &counters);
    if (n_stale)
        b->cache->key.kind->refresh(&job);
    assert_int_equal(counters.bad_rays, 0);
    b->rays = counters.rays[LUM_RAY_INDIRECT_DIFFUSE];
    for (uint32_t i = 0; i < b->n; i++)
        if (b->records[i] && !lum_store_at(b->cache->store, b->records[i]->index))
            b->records[i] = NULL;
}

void bed_assert_as_built(struct instant_bed *b, const char *what)
{
    for (uint32_t i = 0; i < b->n; i++) {
        struct lum_cache_record *r = b->records[i];
        if (!r || lum_cache_is_stale(b->cache, r))
            continue;
        struct lum_cache_record *fresh = new_record(b, r->p, r->n);
        fresh->ng = r->ng;
        bed_build(b, &fresh, 1);
        if (memcmp(&fresh->irradiance, &r->irradiance, sizeof r->irradiance) != 0)
            fail_msg("%s: record %u has %.9g %.9g %.9g, built anew %.9g %.9g %.9g", what, i, (double)r->irradiance.r,
                     (double)r->irradiance.g, (double)r->irradiance.b, (double)fresh->irradiance.r,
                     (double)fresh->irradiance.g, (double)fresh->irradiance.b);
        lum_store_drop(b->cache->store, 0, fresh);
    }
}

double bed_total(const struct instant_bed *b)
{
    double sum = 0.0;
    for (uint32_t i = 0; i < b->n; i++)
        sum += b->records[i] ? (double)b->records[i]->irradiance.g : 0.0;
    return sum;
}

void bed_lamp(struct instant_bed *b, const char *id, double x, double y, double z, double cd)
{
    struct lum_light_desc l = rig_point(rig_v(x, y, z), cd);
    rig_light(&b->rig, id, &l);
}

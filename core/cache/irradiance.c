/* irrcache: Ward's irradiance cache (Ward, Rubinstein & Clear 1988; thesis, chapter 7).
 *
 * A record samples the hemisphere above it: E = pi / N sum of the radiance that N rays bring, which leave in proportion
 * to their cosine. They are points of an Owen-scrambled Sobol sequence: if N is a power of 4, one in each cell of a
 * square grid over (azimuth, elevation), as Ward stratifies, and one in each cell of the finer splits of either. Where
 * a ray ends a path goes on at random, and each of its vertices samples every light if there are few
 * (path/wave.c): picking one by its flux, an office by day would look at its lamps once in a hundred paths.
 *
 * All records use the same numbers, as all points use the same virtual point lights elsewhere: what is left of the
 * noise varies as slowly over a surface as what its points see, and does not show as blotches. So a record is also the
 * same whoever builds it, in whatever company. */
#include "core/cache/cache.h"
#include "core/cache/kind.h"
#include "core/cache/weight.h"
#include "core/math/sampler.h"
#include "core/path/wave.h"

/* Balls are accuracy * REACH * R in radius, with Ward's R. Up to here the error of pictures at the default accuracy is
 * the noise of 256 rays: with 2/3 of the reach there are 1.6 to 2 times as many records, and no less error. */
#define REACH 1.5f
/* Balls are at least this many pixels in radius. On the built-in scenes at 600 x 400, 4, 6 and 8 made no difference to
 * the error against 8 192 rays at each pixel, and each step saved a tenth of the records. */
#define RADIUS_MIN_PIXELS 8.0f
/* Ward's R is at most this share of the scene's diagonal. In the open, where few rays meet anything, it says little
 * about how fast the light changes. */
#define R_MAX_SHARE 0.1f

/* Sums of the record that is being sampled. */
struct sums {
    double rgb[3];
    double inverse_distance;
};

struct building {
    const struct lum_cache_job *job;
    uint32_t n_rays;               /* of a record */
    struct lum_wave wave;          /* of up to LUM_RAY_BATCH rays, of several records */
    float distance[LUM_RAY_BATCH]; /* by ray */
    struct lum_counters counters;  /* of all rays, whatever they are for */
    float scene;                   /* its diagonal */
};

/* A surface nearer than this counts as this far: one ray that grazes the record's own surface, where that is curved,
 * shall not shrink the ball to nothing. */
static float least_radius(const struct lum_cache_job *job, const struct lum_cache_record *record)
{
    return lum_max(RADIUS_MIN_PIXELS * lum_cache_footprint(job->pixel, job->eye, record->p), LUM_RAY_OFFSET);
}

/* No light can reach a record by way of another surface: no ray is needed to know. */
static bool is_dark(const struct lum_cache_job *job)
{
    const struct lum_snapshot *s = job->snapshot;
    if (s->lights.n_active == 0 || job->cache->key.max_bounces == 0)
        return true;
    for (uint32_t i = 0; i < s->n_materials; i++)
        if (lum_material_scatter(&s->materials[i]))
            return false;
    return true;
}

/* Rays first .. first + n - 1, counted through all records. */
static void trace_rays(struct building *b, uint64_t first, uint32_t n)
{
    const struct lum_cache_job *job = b->job;
    const struct lum_cache_key *key = &job->cache->key;
    uint32_t off = key->lobes_off | LUM_EFFECT_BIT(LUM_EFFECT_SCATTERING); /* it is in none of these methods */
    off |= key->media ? 0 : LUM_EFFECT_BIT(LUM_EFFECT_MEDIA);
    lum_wave_begin(&b->wave, job->snapshot, &b->counters, key->max_bounces + 1, off);
    b->wave.every_light = job->snapshot->lights.n_active <= LUM_WAVE_LIGHTS;
    uint8_t ray_of[LUM_RAY_BATCH]; /* by path that was started */
    for (uint32_t i = 0; i < n; i++) {
        const struct lum_cache_record *record = job->records[(first + i) / b->n_rays];
        struct lum_sampler sampler = lum_sampler_at(0, 0, (uint32_t)((first + i) % b->n_rays), key->seed);
        b->distance[i] = INFINITY;
        if (lum_wave_add_indirect(&b->wave, i, sampler, record->p, record->n, record->ng))
            ray_of[b->wave.rays.n - 1] = (uint8_t)i;
    }
    uint32_t n_traced = b->wave.rays.n;
    lum_wave_step(&b->wave, 1);
    for (uint32_t k = 0; k < n_traced; k++)
        if (b->wave.hits.object[k] != LUM_NO_OBJECT)
            b->distance[ray_of[k]] = b->wave.hits.t[k];
    lum_wave_run(&b->wave, 2);
}

static void add_ray(struct building *b, const struct lum_cache_record *record, uint32_t i, struct sums *sums)
{
    struct lum_rgb radiance = b->wave.radiance[i];
    if (lum_rgb_finite(radiance)) {
        sums->rgb[0] += (double)radiance.r;
        sums->rgb[1] += (double)radiance.g;
        sums->rgb[2] += (double)radiance.b;
    } else {
        b->counters.nonfinite++;
    }
    sums->inverse_distance += 1.0 / (double)lum_max(b->distance[i], least_radius(b->job, record));
}

static void fill(const struct building *b, struct lum_cache_record *record, const struct sums *sums)
{
    double scale = LUM_PI_D / b->n_rays;
    record->irradiance =
        lum_rgb((float)(scale * sums->rgb[0]), (float)(scale * sums->rgb[1]), (float)(scale * sums->rgb[2]));
    float most = R_MAX_SHARE * b->scene, r = most;
    if (sums->inverse_distance > 0.0)
        r = lum_min((float)(b->n_rays / sums->inverse_distance), most);
    float wanted = b->job->cache->key.accuracy * REACH * r, least = least_radius(b->job, record);
    record->radius = lum_max(wanted, least);
    record->footprint = wanted < least ? lum_cache_footprint(b->job->pixel, b->job->eye, record->p) : 0.0f;
}

static void build(const struct lum_cache_job *job)
{
    struct building b;
    b.job = job;
    b.n_rays = job->cache->key.n_vpls;
    b.counters = (struct lum_counters){0};
    b.scene = lum_length(lum_v3_sub(job->snapshot->bounds_hi, job->snapshot->bounds_lo));
    struct sums sums = {0};
    if (is_dark(job)) {
        for (uint32_t k = 0; k < job->n; k++)
            fill(&b, job->records[k], &sums);
        return;
    }
    uint64_t n_rays = (uint64_t)job->n * b.n_rays;
    for (uint64_t first = 0; first < n_rays; first += LUM_RAY_BATCH) {
        uint32_t n = n_rays - first < LUM_RAY_BATCH ? (uint32_t)(n_rays - first) : LUM_RAY_BATCH;
        trace_rays(&b, first, n);
        for (uint32_t i = 0; i < n; i++) {
            struct lum_cache_record *record = job->records[(first + i) / b.n_rays];
            add_ray(&b, record, i, &sums);
            if ((first + i + 1) % b.n_rays == 0) {
                fill(&b, record, &sums);
                sums = (struct sums){0};
            }
        }
    }
    for (int kind = 0; kind < LUM_RAY_KIND_COUNT; kind++)
        job->counters->rays[LUM_RAY_INDIRECT_DIFFUSE] += b.counters.rays[kind];
    job->counters->nonfinite += b.counters.nonfinite;
    job->counters->bad_rays += b.counters.bad_rays;
}

static size_t record_bytes(uint32_t n_vpls)
{
    (void)n_vpls;
    return sizeof(struct lum_cache_record);
}

const struct lum_cache_kind lum_cache_irradiance = {
    .name = "irrcache",
    .metric = LUM_METRIC_WARD,
    .record_bytes = record_bytes,
    .build = build,
};

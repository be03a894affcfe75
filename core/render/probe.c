/* Illuminance at a point. A probe is a white diffuse surface without extent: E = pi times the radiance that it would
 * reflect. The path tracer does both levels at once, direct light by sampling lights and indirect by paths, with the
 * weights that it uses everywhere. */
#include "core/math/sampler.h"
#include "core/path/wave.h"
#include "core/render/view.h"

/* Sums of one job of up to LUM_RAY_BATCH samples; summed in order of jobs, so that the result does not depend on
 * threads. */
struct probe_sums {
    double rgb[3], square; /* of irradiance; of illuminance */
};

struct probe_run {
    const struct lum_snapshot *snapshot;
    struct lum_vec3 p, n;
    uint32_t n_samples, seed;
    struct probe_sums *sums;       /* per job */
    struct lum_counters *counters; /* per worker */
};

static struct lum_bsdf white_with(struct lum_vec3 n)
{
    return (struct lum_bsdf){.frame = lum_frame_from_normal(n),
                             .ng = n,
                             .diffuse = lum_grey(1.0f),
                             .diffuse_prob = 1.0f,
                             .coat_norm = 1.0f,
                             .alpha = 1.0f,
                             .eta = 1.0f};
}

static void probe_job(void *ctx, uint32_t job, uint32_t worker)
{
    const struct probe_run *run = ctx;
    struct lum_counters *c = &run->counters[worker];
    struct lum_bsdf white = white_with(run->n);
    struct lum_wave w;
    lum_wave_begin(&w, run->snapshot, c, LUM_DEPTH_DEFAULT, 0);
    uint32_t first = job * LUM_RAY_BATCH;
    uint32_t n = run->n_samples - first < LUM_RAY_BATCH ? run->n_samples - first : LUM_RAY_BATCH;
    for (uint32_t i = 0; i < n; i++) {
        struct lum_sampler sampler = lum_sampler_at(0, 0, first + i, run->seed);
        lum_wave_add_vertex(&w, i, sampler, run->p, &white, white.ng);
    }
    lum_wave_run(&w, 1);
    struct probe_sums *sums = &run->sums[job];
    for (uint32_t i = 0; i < n; i++) {
        struct lum_rgb e = lum_rgb_scale(w.radiance[i], LUM_PI);
        if (!isfinite(lum_luminance(e))) {
            c->nonfinite++;
            continue;
        }
        sums->rgb[0] += (double)e.r;
        sums->rgb[1] += (double)e.g;
        sums->rgb[2] += (double)e.b;
        sums->square += (double)lum_luminance(e) * (double)lum_luminance(e);
    }
}

static void summarise(const struct probe_run *run, uint32_t n_jobs, struct lum_probe *ret_probe)
{
    double rgb[3] = {0}, square = 0.0, n = (double)run->n_samples;
    for (uint32_t j = 0; j < n_jobs; j++) {
        for (int k = 0; k < 3; k++)
            rgb[k] += run->sums[j].rgb[k];
        square += run->sums[j].square;
    }
    double mean = (0.2126 * rgb[0] + 0.7152 * rgb[1] + 0.0722 * rgb[2]) / n;
    double variance = n > 1.0 ? fmax(0.0, (square / n - mean * mean) / (n - 1.0)) : (double)INFINITY;
    *ret_probe = (struct lum_probe){
        .illuminance_lx = mean,
        .stderr_lx = sqrt(variance),
        .irradiance = lum_rgb((float)(rgb[0] / n), (float)(rgb[1] / n), (float)(rgb[2] / n)),
    };
}

enum lum_status lum_probe_at(struct lum_pool *pool, const struct lum_snapshot *snapshot, struct lum_vec3d point_world,
                             struct lum_vec3 normal, uint32_t n_samples, uint32_t seed, struct lum_probe *ret_probe,
                             uint64_t *ret_rays, struct lum_error *err)
{
    struct lum_vec3 p = lum_world_to_scene(&snapshot->norm, point_world);
    struct lum_vec3 n = lum_normalize(normal);
    if (!(fabsf(p.x) < LUM_RAY_LIMIT && fabsf(p.y) < LUM_RAY_LIMIT && fabsf(p.z) < LUM_RAY_LIMIT))
        return lum_fail(err, LUM_ERR_INVALID, "point", "the point must be finite and near the scene");
    if (!(lum_dot(n, n) > 0.0f))
        return lum_fail(err, LUM_ERR_INVALID, "normal", "the normal must be finite and not zero");
    if (n_samples < 1 || n_samples > (1u << 28))
        return lum_fail(err, LUM_ERR_LIMIT, "samples", "1 to %u samples, not %u", 1u << 28, n_samples);
    uint32_t n_jobs = (n_samples + LUM_RAY_BATCH - 1) / LUM_RAY_BATCH, n_workers = lum_pool_size(pool);
    struct probe_run run = {.snapshot = snapshot, .p = p, .n = n, .n_samples = n_samples, .seed = seed};
    run.sums = lum_calloc(n_jobs, sizeof *run.sums);
    run.counters = lum_calloc(n_workers, sizeof *run.counters);
    enum lum_status status = LUM_ERR_NOMEM;
    if (run.sums && run.counters)
        status = lum_pool_run(pool, n_jobs, probe_job, &run, NULL);
    else
        (void)lum_fail(err, status, "samples", "out of memory for %u samples", n_samples);
    if (status == LUM_OK) {
        summarise(&run, n_jobs, ret_probe);
        *ret_rays = 0;
        for (uint32_t w = 0; w < n_workers; w++)
            for (int k = 0; k < LUM_RAY_KIND_COUNT; k++)
                *ret_rays += run.counters[w].rays[k];
    }
    lum_free(run.sums);
    lum_free(run.counters);
    return status;
}

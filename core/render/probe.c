/* Illuminance at a point. A probe is a white diffuse surface without extent: E = pi times the radiance that it would
 * reflect. The path tracer does both levels at once, direct light by sampling lights and indirect by paths, with the
 * weights that it uses everywhere. */
#include "core/math/sampler.h"
#include "core/path/wave.h"
#include "core/render/view.h"

/* Sums of one job of up to LUM_RAY_BATCH samples; summed in order of jobs, so that the result depends neither on
 * threads nor on slices. */
struct probe_sums {
    double rgb[3], square; /* of irradiance; of illuminance */
};

struct lum_probing {
    const struct lum_snapshot *snapshot; /* held */
    struct lum_vec3 p, n;
    uint32_t n_samples, seed;
    uint32_t n_jobs, n_done; /* of LUM_RAY_BATCH samples each */
    struct probe_sums total; /* of those done */
    uint64_t n_rays;
};

/* Some jobs of it, one after the other from number first on. */
struct slice {
    const struct lum_probing *probing;
    uint32_t first;
    struct probe_sums *sums;       /* per job */
    struct lum_counters *counters; /* per worker */
};

static void probe_job(void *ctx, uint32_t job, uint32_t worker)
{
    const struct slice *slice = ctx;
    const struct lum_probing *g = slice->probing;
    struct lum_counters *c = &slice->counters[worker];
    struct lum_bsdf white = lum_bsdf_white(g->n, g->n);
    struct lum_wave w;
    lum_wave_begin(&w, g->snapshot, c, LUM_DEPTH_DEFAULT, 0);
    uint32_t first = (slice->first + job) * LUM_RAY_BATCH;
    uint32_t n = g->n_samples - first < LUM_RAY_BATCH ? g->n_samples - first : LUM_RAY_BATCH;
    for (uint32_t i = 0; i < n; i++) {
        struct lum_sampler sampler = lum_sampler_at(0, 0, first + i, g->seed);
        lum_wave_add_vertex(&w, i, sampler, g->p, &white, white.ng);
    }
    lum_wave_run(&w, 1);
    struct probe_sums *sums = &slice->sums[job];
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

enum lum_status lum_probing_create(const struct lum_snapshot *snapshot, struct lum_vec3d point_world,
                                   struct lum_vec3 normal, uint32_t n_samples, uint32_t seed,
                                   struct lum_probing **ret_probing, struct lum_error *err)
{
    struct lum_vec3 p = lum_world_to_scene(&snapshot->norm, point_world);
    struct lum_vec3 n = lum_normalize(normal);
    if (!lum_ray_can_start(p))
        return lum_fail(err, LUM_ERR_INVALID, "point", "the point must be finite and near the scene");
    if (!(lum_dot(n, n) > 0.0f))
        return lum_fail(err, LUM_ERR_INVALID, "normal", "the normal must be finite and not zero");
    if (n_samples < 1 || n_samples > (1u << 28))
        return lum_fail(err, LUM_ERR_LIMIT, "samples", "1 to %u samples, not %u", 1u << 28, n_samples);
    struct lum_probing *g = lum_calloc(1, sizeof *g);
    if (!g)
        return lum_fail(err, LUM_ERR_NOMEM, "", "no memory for a probe");
    *g = (struct lum_probing){.snapshot = lum_snapshot_ref(snapshot), .p = p, .n = n, .n_samples = n_samples};
    g->seed = seed;
    g->n_jobs = (n_samples + LUM_RAY_BATCH - 1) / LUM_RAY_BATCH;
    *ret_probing = g;
    return LUM_OK;
}

void lum_probing_destroy(struct lum_probing *g)
{
    if (!g)
        return;
    lum_snapshot_unref(g->snapshot);
    lum_free(g);
}

static void take(struct lum_probing *g, const struct slice *slice, uint32_t n_jobs, uint32_t n_workers)
{
    for (uint32_t j = 0; j < n_jobs; j++) {
        for (int k = 0; k < 3; k++)
            g->total.rgb[k] += slice->sums[j].rgb[k];
        g->total.square += slice->sums[j].square;
    }
    for (uint32_t w = 0; w < n_workers; w++)
        for (int k = 0; k < LUM_RAY_KIND_COUNT; k++)
            g->n_rays += slice->counters[w].rays[k];
    g->n_done += n_jobs;
}

enum lum_status lum_probing_go_on(struct lum_probing *g, struct lum_pool *pool, uint32_t n_samples, bool *ret_more,
                                  struct lum_error *err)
{
    uint32_t n_jobs = n_samples / LUM_RAY_BATCH + (n_samples % LUM_RAY_BATCH > 0), n_workers = lum_pool_size(pool);
    n_jobs = n_jobs < g->n_jobs - g->n_done ? n_jobs : g->n_jobs - g->n_done;
    struct slice slice = {.probing = g, .first = g->n_done};
    slice.sums = lum_calloc(n_jobs, sizeof *slice.sums);
    slice.counters = lum_calloc(n_workers, sizeof *slice.counters);
    enum lum_status status = LUM_ERR_NOMEM;
    if (slice.sums && slice.counters)
        status = lum_pool_run(pool, n_jobs, probe_job, &slice, NULL);
    else
        (void)lum_fail(err, status, "samples", "out of memory for %u samples", n_samples);
    if (status == LUM_OK)
        take(g, &slice, n_jobs, n_workers);
    *ret_more = g->n_done < g->n_jobs;
    lum_free(slice.sums);
    lum_free(slice.counters);
    return status;
}

uint64_t lum_probing_scene_rev(const struct lum_probing *g)
{
    return g->snapshot->scene_rev;
}

void lum_probing_result(const struct lum_probing *g, struct lum_probe *ret_probe, uint64_t *ret_rays)
{
    uint64_t done = (uint64_t)g->n_done * LUM_RAY_BATCH;
    const double *rgb = g->total.rgb;
    double n = (double)(done < g->n_samples ? done : g->n_samples);
    double mean = (0.2126 * rgb[0] + 0.7152 * rgb[1] + 0.0722 * rgb[2]) / n;
    double variance = n > 1.0 ? fmax(0.0, (g->total.square / n - mean * mean) / (n - 1.0)) : (double)INFINITY;
    *ret_probe = (struct lum_probe){
        .illuminance_lx = mean,
        .stderr_lx = sqrt(variance),
        .irradiance = lum_rgb((float)(rgb[0] / n), (float)(rgb[1] / n), (float)(rgb[2] / n)),
    };
    *ret_rays = g->n_rays;
}

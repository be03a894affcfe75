/* Running the stages of a pass. */
#include <assert.h>
#include <string.h>

#include "core/pass/share.h"

#define TEXT(NAME, name) #name,
const char *const lum_stage_names[LUM_STAGE_COUNT] = {LUM_STAGES(TEXT)};

struct loop {
    lum_stage_fn fn;
    void *ctx;
    struct lum_counters *counters;
};

static void count_tile(struct lum_counters *c, const uint64_t before[LUM_RAY_KIND_COUNT])
{
    for (int e = 0; e < LUM_EFFECT_COUNT; e++) {
        enum lum_ray_kind kind = lum_effect_ray_kind((enum lum_effect)e);
        c->tiles[e] += c->rays[kind] > before[kind];
    }
}

void lum_stage_job(lum_stage_fn fn, void *ctx, uint32_t job, struct lum_counters *counters)
{
    uint64_t before[LUM_RAY_KIND_COUNT];
    memcpy(before, counters->rays, sizeof before);
    fn(ctx, job, counters);
    count_tile(counters, before);
}

static void run_job(void *ctx, uint32_t job, uint32_t worker)
{
    const struct loop *loop = ctx;
    lum_stage_job(loop->fn, loop->ctx, job, &loop->counters[worker]);
}

static void sum_rays(const struct lum_stage_runner *runner, uint64_t ret_rays[LUM_RAY_KIND_COUNT])
{
    memset(ret_rays, 0, LUM_RAY_KIND_COUNT * sizeof *ret_rays);
    for (uint32_t w = 0; w < lum_pool_size(runner->pool); w++)
        for (int k = 0; k < LUM_RAY_KIND_COUNT; k++)
            ret_rays[k] += runner->counters[w].rays[k];
}

/* Shares the time of a loop among the effects whose rays were traced in it, by their rays: the only measure that costs
 * nothing, since the rays of different effects travel in one batch, and a look at the clock for each tile took 8 % of
 * a frame. */
static void share_time(const struct lum_stage_runner *runner, const uint64_t before[LUM_RAY_KIND_COUNT], int64_t ns)
{
    uint64_t after[LUM_RAY_KIND_COUNT], all = 0;
    sum_rays(runner, after);
    for (int k = 0; k < LUM_RAY_KIND_COUNT; k++)
        all += after[k] - before[k];
    for (int e = 0; e < LUM_EFFECT_COUNT && all > 0; e++) {
        enum lum_ray_kind kind = lum_effect_ray_kind((enum lum_effect)e);
        runner->counters[0].ns[e] += (int64_t)((double)ns * ((double)(after[kind] - before[kind]) / (double)all));
    }
}

enum lum_status lum_stage_timed(const struct lum_stage_runner *runner, uint32_t n, lum_job_fn fn, void *ctx)
{
    uint64_t before[LUM_RAY_KIND_COUNT];
    sum_rays(runner, before);
    int64_t begin_ns = lum_pool_cpu_ns(runner->pool);
    enum lum_status status = lum_pool_run(runner->pool, n, fn, ctx, runner->cancel);
    share_time(runner, before, lum_pool_cpu_ns(runner->pool) - begin_ns);
    return status;
}

enum lum_status lum_stage_loop(const struct lum_stage_runner *runner, uint32_t n, lum_stage_fn fn, void *ctx)
{
    struct loop loop = {fn, ctx, runner->counters};
    return lum_stage_timed(runner, n, run_job, &loop);
}

struct stage_job {
    const struct lum_pass *pass;
    const struct lum_estimator *stage;
};

static size_t share_tile(void *ctx, uint32_t tile, void *left, struct lum_counters *counters)
{
    const struct stage_job *job = ctx;
    job->stage->share->make(job->pass, tile, left, counters);
    return job->stage->share->bytes(job->pass);
}

static void take_tile_over(void *ctx, uint32_t tile, const void *left, uint32_t worker)
{
    (void)worker;
    const struct stage_job *job = ctx;
    job->stage->share->take_over(job->pass, tile, left);
}

static void run_tile(void *ctx, uint32_t tile, struct lum_counters *counters)
{
    const struct stage_job *job = ctx;
    job->stage->tile(job->pass, tile, counters);
}

enum lum_status lum_stage_run(const struct lum_stage_runner *runner, const struct lum_pass *pass,
                              const struct lum_estimator *stage)
{
    struct stage_job job = {pass, stage};
    int64_t begin_ns = lum_clock_ns();
    if (stage->begin)
        stage->begin(pass);
    uint32_t n = stage->cells ? pass->cells.n : pass->tiling.n;
    enum lum_status status;
    if (runner->team && stage->share)
        status = lum_stage_share(
            runner, &(struct lum_shared_loop){n, stage->share->bytes(pass), share_tile, take_tile_over, &job});
    else
        status = lum_stage_loop(runner, n, run_tile, &job);
    runner->stats->stage_ms[stage->stage] += (double)(lum_clock_ns() - begin_ns) * 1e-6;
    return status;
}

void lum_tile_center_rays(const struct lum_pass *pass, uint32_t tile, struct lum_rays *ret_rays)
{
    struct lum_tile_rect r = lum_tile_at(&pass->tiling, tile);
    ret_rays->n = 0;
    for (uint32_t y = 0; y < r.h; y++)
        for (uint32_t x = 0; x < r.w; x++) {
            struct lum_vec3 d = lum_center_direction(pass, r.x + x, r.y + y);
            lum_rays_push(ret_rays, pass->eye.o, d, INFINITY);
        }
}

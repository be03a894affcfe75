/* Passes that are cancelled where a test wants; link it with -Wl,--wrap=lum_pool_run. One pass at a time. */
#ifndef LUM_TESTS_SUPPORT_CUT_SHORT_H
#define LUM_TESTS_SUPPORT_CUT_SHORT_H

#include "core/base/pool.h"
#include "tests/support/rig.h"

/* Cancels a pass at the `loop`-th time that it hands out jobs, counted from 1, when `jobs` of them are done. 0: does
 * not. */
static uint32_t cut_short_loop;
static _Atomic int cut_short_jobs;
static _Atomic bool cut_short_now;

struct cut_short_counted {
    lum_job_fn fn;
    void *ctx;
};

static inline void cut_short_run(void *ctx, uint32_t job, uint32_t worker)
{
    const struct cut_short_counted *c = ctx;
    c->fn(c->ctx, job, worker);
    if (--cut_short_jobs <= 0)
        cut_short_now = true;
}

enum lum_status __real_lum_pool_run(struct lum_pool *pool, uint32_t n, lum_job_fn fn, void *ctx,
                                    const _Atomic bool *cancel);
enum lum_status __wrap_lum_pool_run(struct lum_pool *pool, uint32_t n, lum_job_fn fn, void *ctx,
                                    const _Atomic bool *cancel);
enum lum_status __wrap_lum_pool_run(struct lum_pool *pool, uint32_t n, lum_job_fn fn, void *ctx,
                                    const _Atomic bool *cancel)
{
    struct cut_short_counted counted = {fn, ctx};
    if (cut_short_loop == 0 || --cut_short_loop > 0)
        return __real_lum_pool_run(pool, n, fn, ctx, cancel);
    return __real_lum_pool_run(pool, n, cut_short_run, &counted, cancel);
}

/* True: the pass was cancelled. ret_loops_left: above 0 when it has not so many. */
static inline bool pass_is_cut_short(struct rig *r, uint32_t loop, uint32_t jobs, struct lum_pass_stats *ret_stats,
                                     uint32_t *ret_loops_left)
{
    struct lum_error err;
    cut_short_now = false;
    cut_short_loop = loop;
    cut_short_jobs = (int)jobs;
    enum lum_status status = lum_view_pass(r->view, r->snapshot, &r->settings, &cut_short_now, ret_stats, &err);
    *ret_loops_left = cut_short_loop;
    cut_short_loop = 0;
    return status == LUM_ERR_CANCELLED;
}

#endif

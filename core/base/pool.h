/* The worker thread pool: a blocking parallel loop.
 *
 * Workers set flush-to-zero and denormals-are-zero (Embree asks for it; it is part of the numerics contract) and own a
 * fixed index 0..n-1 that callers use for per-worker scratch and counters. */
#ifndef LUM_CORE_BASE_POOL_H
#define LUM_CORE_BASE_POOL_H

#include "core/base/base.h"

struct lum_pool;

/* job: 0..n_jobs-1, handed out in increasing order by an atomic counter. worker: index of the thread that runs it. */
typedef void (*lum_job_fn)(void *ctx, uint32_t job, uint32_t worker);

/* n_threads 0: as many as the process may run on (sched_getaffinity). Thread: any. */
LUM_MUST_USE enum lum_status lum_pool_create(uint32_t n_threads, struct lum_pool **ret_pool, struct lum_error *err);
void lum_pool_destroy(struct lum_pool *pool); /* accepts NULL; joins the workers */
uint32_t lum_pool_size(const struct lum_pool *pool);

/* Runs fn for every job and returns when all have ended. Jobs not yet begun are skipped once *cancel (may be NULL)
 * reads true: LUM_ERR_CANCELLED if there were any, else LUM_OK. Thread: one caller at a time (the director). */
enum lum_status lum_pool_run(struct lum_pool *pool, uint32_t n_jobs, lum_job_fn fn, void *ctx,
                             const _Atomic bool *cancel);

/* CPU time that the workers have spent inside jobs since creation. */
int64_t lum_pool_cpu_ns(const struct lum_pool *pool);

/* Sets FTZ and DAZ on the calling thread; for threads that trace rays outside the pool (tests, tools). */
void lum_thread_init_fp(void);

#endif

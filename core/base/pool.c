/* One mutex guards the loop's description; jobs themselves are handed out by an atomic counter without a lock.
 *
 * A loop is published by raising `generation` under the lock. Each worker takes part in each generation exactly once
 * and decrements `busy` when it finds no job left; the caller waits for busy == 0, so fn and ctx outlive their last
 * use. */
#define _GNU_SOURCE
#include "core/base/pool.h"

#include <pthread.h>
#include <sched.h>
#include <stdio.h>
#if defined(__SSE__)
#include <xmmintrin.h>
#endif

/* Estimators keep up to half a MiB of a packet's work there, with sanitizers twice that; the system's own limit may be
 * less.
 */
#define STACK_BYTES ((size_t)4 << 20)

struct worker {
    struct lum_pool *pool;
    pthread_t thread;
    uint32_t index;
    _Alignas(LUM_CACHE_LINE) _Atomic int64_t cpu_ns;
};

struct lum_pool {
    /* immutable */
    struct worker *workers;
    uint32_t n_workers;
    /* guarded by lock */
    pthread_mutex_t lock;
    pthread_cond_t wake, done;
    uint64_t generation;
    uint32_t busy;
    bool quit;
    lum_job_fn fn;
    void *ctx;
    const _Atomic bool *cancel;
    uint32_t n_jobs;
    /* any thread */
    _Alignas(LUM_CACHE_LINE) _Atomic uint32_t next_job;
};

void lum_thread_init_fp(void)
{
#if defined(__SSE__)
    _mm_setcsr(_mm_getcsr() | 0x8040u); /* FTZ | DAZ */
#endif
}

static void run_jobs(struct lum_pool *pool, struct worker *w)
{
    int64_t begin_ns = lum_cpu_clock_ns();
    while (!pool->cancel || !atomic_load_explicit(pool->cancel, memory_order_relaxed)) {
        /* relaxed: the loop's description was read under the lock, and results are published by the final lock */
        uint32_t job = atomic_fetch_add_explicit(&pool->next_job, 1u, memory_order_relaxed);
        if (job >= pool->n_jobs)
            break;
        pool->fn(pool->ctx, job, w->index);
    }
    atomic_fetch_add_explicit(&w->cpu_ns, lum_cpu_clock_ns() - begin_ns, memory_order_relaxed);
}

static void *worker_main(void *arg)
{
    struct worker *w = arg;
    struct lum_pool *pool = w->pool;
    lum_thread_init_fp();
    uint64_t seen = 0;
    pthread_mutex_lock(&pool->lock);
    for (;;) {
        while (!pool->quit && pool->generation == seen)
            pthread_cond_wait(&pool->wake, &pool->lock);
        if (pool->quit)
            break;
        seen = pool->generation;
        pthread_mutex_unlock(&pool->lock);
        run_jobs(pool, w);
        pthread_mutex_lock(&pool->lock);
        if (--pool->busy == 0)
            pthread_cond_signal(&pool->done);
    }
    pthread_mutex_unlock(&pool->lock);
    return NULL;
}

static uint32_t allowed_cpus(void)
{
    cpu_set_t set;
    if (sched_getaffinity(0, sizeof set, &set) != 0)
        return 1;
    int n = CPU_COUNT(&set);
    return n > 0 ? (uint32_t)n : 1u;
}

static bool start(struct worker *w)
{
    pthread_attr_t attr;
    if (pthread_attr_init(&attr) != 0)
        return false;
    bool ok =
        pthread_attr_setstacksize(&attr, STACK_BYTES) == 0 && pthread_create(&w->thread, &attr, worker_main, w) == 0;
    pthread_attr_destroy(&attr);
    return ok;
}

enum lum_status lum_pool_create(uint32_t n_threads, struct lum_pool **ret_pool, struct lum_error *err)
{
    if (n_threads == 0)
        n_threads = allowed_cpus();
    if (n_threads > 1024)
        return lum_fail(err, LUM_ERR_LIMIT, "threads", "at most 1024 threads, not %u", n_threads);
    struct lum_pool *pool = lum_calloc(1, sizeof *pool);
    if (!pool)
        return lum_fail(err, LUM_ERR_NOMEM, "", "out of memory for the worker pool");
    pthread_mutex_init(&pool->lock, NULL);
    pthread_cond_init(&pool->wake, NULL);
    pthread_cond_init(&pool->done, NULL);
    pool->workers = lum_calloc(n_threads, sizeof *pool->workers);
    if (!pool->workers) {
        lum_pool_destroy(pool);
        return lum_fail(err, LUM_ERR_NOMEM, "", "out of memory for %u workers", n_threads);
    }
    for (uint32_t i = 0; i < n_threads; i++) {
        struct worker *w = &pool->workers[i];
        w->pool = pool;
        w->index = i;
        if (!start(w)) {
            lum_pool_destroy(pool);
            return lum_fail(err, LUM_ERR_LIMIT, "threads", "the system refused to start worker thread %u", i);
        }
        pool->n_workers = i + 1;
        char name[16];
        snprintf(name, sizeof name, "lum-worker-%u", i);
        pthread_setname_np(w->thread, name);
    }
    *ret_pool = pool;
    return LUM_OK;
}

void lum_pool_destroy(struct lum_pool *pool)
{
    if (!pool)
        return;
    pthread_mutex_lock(&pool->lock);
    pool->quit = true;
    pthread_cond_broadcast(&pool->wake);
    pthread_mutex_unlock(&pool->lock);
    for (uint32_t i = 0; i < pool->n_workers; i++)
        pthread_join(pool->workers[i].thread, NULL);
    pthread_cond_destroy(&pool->done);
    pthread_cond_destroy(&pool->wake);
    pthread_mutex_destroy(&pool->lock);
    lum_free(pool->workers);
    lum_free(pool);
}

uint32_t lum_pool_size(const struct lum_pool *pool)
{
    return pool->n_workers;
}

enum lum_status lum_pool_run(struct lum_pool *pool, uint32_t n_jobs, lum_job_fn fn, void *ctx,
                             const _Atomic bool *cancel)
{
    pthread_mutex_lock(&pool->lock);
    pool->fn = fn;
    pool->ctx = ctx;
    pool->cancel = cancel;
    pool->n_jobs = n_jobs;
    atomic_store_explicit(&pool->next_job, 0u, memory_order_relaxed);
    pool->busy = pool->n_workers;
    pool->generation++;
    pthread_cond_broadcast(&pool->wake);
    while (pool->busy > 0)
        pthread_cond_wait(&pool->done, &pool->lock);
    uint32_t taken = atomic_load_explicit(&pool->next_job, memory_order_relaxed);
    pthread_mutex_unlock(&pool->lock);
    return taken < n_jobs ? LUM_ERR_CANCELLED : LUM_OK; /* what was taken was done */
}

int64_t lum_pool_cpu_ns(const struct lum_pool *pool)
{
    int64_t sum = 0;
    for (uint32_t i = 0; i < pool->n_workers; i++)
        sum += atomic_load_explicit(&pool->workers[i].cpu_ns, memory_order_relaxed);
    return sum;
}

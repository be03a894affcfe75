/* Reference counts, allocation, the worker pool. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "core/base/pool.h"

static void alloc_is_zeroed_aligned_and_checked(void **state)
{
    (void)state;
    unsigned char *p = lum_calloc(100, 7);
    assert_non_null(p);
    assert_int_equal((uintptr_t)p % 64, 0);
    for (int i = 0; i < 700; i++)
        assert_int_equal(p[i], 0);
    lum_free(p);
    assert_null(lum_calloc(SIZE_MAX, 2));
    lum_alloc_fail_after(2);
    p = lum_calloc(1, 1);
    assert_non_null(p);
    assert_null(lum_calloc(1, 1));
    lum_free(p);
}

struct loop {
    _Atomic uint32_t seen[1000];
    _Atomic uint32_t total;
    _Atomic bool cancel;
    uint32_t cancel_at;
};

static void visit(void *ctx, uint32_t job, uint32_t worker)
{
    struct loop *l = ctx;
    (void)worker;
    atomic_fetch_add(&l->seen[job], 1u);
    atomic_fetch_add(&l->total, 1u);
    if (job == l->cancel_at)
        atomic_store(&l->cancel, true);
}

static void pool_runs_each_job_once(void **state)
{
    (void)state;
    for (uint32_t threads = 1; threads <= 8; threads *= 2) {
        struct lum_pool *pool = NULL;
        assert_int_equal(lum_pool_create(threads, &pool, NULL), LUM_OK);
        for (int round = 0; round < 50; round++) {
            static struct loop l;
            for (int i = 0; i < 1000; i++)
                atomic_store(&l.seen[i], 0u);
            atomic_store(&l.cancel, false);
            l.cancel_at = UINT32_MAX;
            assert_int_equal(lum_pool_run(pool, 1000, visit, &l, &l.cancel), LUM_OK);
            for (int i = 0; i < 1000; i++)
                assert_int_equal(atomic_load(&l.seen[i]), 1);
        }
        lum_pool_destroy(pool);
    }
}

static void pool_cancel_skips_jobs_not_begun(void **state)
{
    (void)state;
    struct lum_pool *pool = NULL;
    assert_int_equal(lum_pool_create(1, &pool, NULL), LUM_OK);
    static struct loop l;
    l.cancel_at = 10;
    assert_int_equal(lum_pool_run(pool, 1000, visit, &l, &l.cancel), LUM_ERR_CANCELLED);
    assert_int_equal(atomic_load(&l.total), 11);
    /* Too late: who is told that the loop was cancelled may rely on there being something left to do. */
    atomic_store(&l.cancel, false);
    l.cancel_at = 999;
    assert_int_equal(lum_pool_run(pool, 1000, visit, &l, &l.cancel), LUM_OK);
    lum_pool_destroy(pool);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(alloc_is_zeroed_aligned_and_checked),
        cmocka_unit_test(pool_runs_each_job_once),
        cmocka_unit_test(pool_cancel_skips_jobs_not_begun),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

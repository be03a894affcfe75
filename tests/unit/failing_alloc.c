#include "tests/unit/failing_alloc.h"

#include <stdatomic.h>
#include <stddef.h>
#include <stdlib.h>

#include <cjson/cJSON.h>

void *__real_malloc(size_t n);
void *__real_calloc(size_t n, size_t size);
void *__real_realloc(void *p, size_t n);
void *__wrap_malloc(size_t n);
void *__wrap_calloc(size_t n, size_t size);
void *__wrap_realloc(void *p, size_t n);

static _Thread_local unsigned countdown; /* 0: off; at 1 the next allocation fails */
static _Thread_local bool hit;
static atomic_uint countdown_of_all;
static atomic_bool hit_of_all;

static bool fails_for_all(void)
{
    unsigned k = atomic_load(&countdown_of_all);
    while (k > 0 && !atomic_compare_exchange_weak(&countdown_of_all, &k, k - 1))
        ;
    if (k != 1)
        return false;
    atomic_store(&hit_of_all, true);
    return true;
}

static bool fails(void)
{
    if (fails_for_all())
        return true;
    if (countdown == 0 || --countdown > 0)
        return false;
    hit = true;
    return true;
}

void *__wrap_malloc(size_t n)
{
    return fails() ? NULL : __real_malloc(n);
}

void *__wrap_calloc(size_t n, size_t size)
{
    return fails() ? NULL : __real_calloc(n, size);
}

void *__wrap_realloc(void *p, size_t n)
{
    return fails() ? NULL : __real_realloc(p, n);
}

void failing_alloc_begin(void)
{
    cJSON_InitHooks(&(cJSON_Hooks){.malloc_fn = __wrap_malloc, .free_fn = free});
}

void failing_alloc_arm(unsigned k)
{
    hit = false;
    countdown = k;
}

void failing_alloc_arm_all(unsigned k)
{
    failing_alloc_arm(0);
    atomic_store(&hit_of_all, false);
    atomic_store(&countdown_of_all, k);
}

bool failing_alloc_disarm(void)
{
    countdown = 0;
    atomic_store(&countdown_of_all, 0);
    return hit || atomic_exchange(&hit_of_all, false);
}

void *failing_malloc(size_t n)
{
    return __wrap_malloc(n);
}

void *failing_realloc(void *p, size_t n)
{
    return __wrap_realloc(p, n);
}

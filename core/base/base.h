/* Small things that everything in core uses: reference counts, aligned memory, the clock. */
#ifndef LUM_CORE_BASE_BASE_H
#define LUM_CORE_BASE_BASE_H

#include <stdatomic.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "core/base/status.h"

#define LUM_ID_MAX 64 /* bytes of a stable string id, without the terminating 0 */
#define LUM_ARRAY_LEN(a) (sizeof(a) / sizeof((a)[0]))
static inline uint32_t lum_min_u32(uint32_t a, uint32_t b)
{
    return a < b ? a : b;
}
#define LUM_CACHE_LINE 64 /* bytes, of x86-64 processors: what two threads write lies on different ones */

/* Asks memory for the line of p, which is read soon: nothing waits for it. The empty statement is for GCC 12, which
 * takes functions that do nothing else for such as do nothing, and drops their calls. */
static inline void lum_ask_memory(const void *p)
{
    __builtin_prefetch(p);
    __asm__ volatile("");
}

/* A reference count. Objects that carry one are immutable once shared. */
struct lum_refs {
    _Atomic uint32_t count;
};

static inline void lum_refs_init(struct lum_refs *r)
{
    atomic_init(&r->count, 1u);
}

static inline void lum_refs_get(struct lum_refs *r)
{
    atomic_fetch_add_explicit(&r->count, 1u, memory_order_relaxed);
}

/* True when the caller dropped the last reference and must free the object. The release/acquire pair orders
 * every former owner's reads before the free. */
static inline bool lum_refs_put(struct lum_refs *r)
{
    return atomic_fetch_sub_explicit(&r->count, 1u, memory_order_acq_rel) == 1u;
}

/* True when the caller's reference is the only one, so that it may write the object in place. */
static inline bool lum_refs_unique(const struct lum_refs *r)
{
    return atomic_load_explicit(&r->count, memory_order_acquire) == 1u;
}

/* Zeroed memory, 64-byte aligned, freed by lum_free. NULL when n * size overflows or memory is short; n * size == 0
 * gives a valid pointer. Thread: any. */
void *lum_calloc(size_t n, size_t size);
void lum_free(void *p);

/* Test hook: the k-th lum_calloc from now on this thread fails (1 = the next); 0 switches it off. */
void lum_alloc_fail_after(uint64_t k);

int64_t lum_clock_ns(void);     /* monotonic wall clock */
int64_t lum_cpu_clock_ns(void); /* CPU time of the calling thread */

/* Log sink of the library: core never prints. Default: nothing. level: 0 error, 1 warning, 2 info, 3 debug. */
struct lum_log {
    void (*write)(void *user, int level, const char *component, const char *text);
    void *user;
};
void lum_log(const struct lum_log *log, int level, const char *component, const char *fmt, ...) LUM_PRINTF(4, 5);

#endif

/* Many arrays in one allocation. Lay them out twice: at first lum_arena_take only measures and returns NULL; after
 * lum_arena_reserve the same calls return the arrays, in the same order. */
#ifndef LUM_CORE_BASE_ARENA_H
#define LUM_CORE_BASE_ARENA_H

#include "core/base/base.h"

/* Zeroed: nothing is laid out. */
struct lum_arena {
    unsigned char *memory; /* NULL: it measures */
    size_t bytes;          /* laid out so far; SIZE_MAX: more than there can be */
};

/* n items of `size` bytes, zeroed, aligned to a cache line. */
static inline void *lum_arena_take(struct lum_arena *a, size_t n, size_t size)
{
    size_t at = a->bytes, most = SIZE_MAX - LUM_CACHE_LINE;
    if (at > most || (size > 0 && n > (most - at) / size)) {
        a->bytes = SIZE_MAX;
        return NULL;
    }
    a->bytes = (at + n * size + LUM_CACHE_LINE - 1) / LUM_CACHE_LINE * LUM_CACHE_LINE;
    return a->memory ? a->memory + at : NULL;
}

/* Allocates what was measured. False: memory is short. */
static inline bool lum_arena_reserve(struct lum_arena *a)
{
    a->memory = lum_calloc(a->bytes, 1);
    a->bytes = 0;
    return a->memory != NULL;
}

static inline void lum_arena_finish(struct lum_arena *a)
{
    lum_free(a->memory);
    *a = (struct lum_arena){0};
}

#endif

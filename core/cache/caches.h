/* What those outside see of the shared irradiance caches: how threads share records, the caches of a scene as a whole,
 * and what a pass did with them. What is in a cache: cache.h and store.h. */
#ifndef LUM_CORE_CACHE_CACHES_H
#define LUM_CORE_CACHE_CACHES_H

#include "core/base/base.h"

enum lum_storage { LUM_STORAGE_SERIAL, LUM_STORAGE_LOCK, LUM_STORAGE_LOCAL, LUM_STORAGE_WAITFREE, LUM_STORAGE_COUNT };
extern const char *const lum_storage_names[LUM_STORAGE_COUNT]; /* "serial", "lock", "local", "waitfree" */
bool lum_storage_find(const char *name, enum lum_storage *ret_storage);

/* The caches of a scene by what they depend on besides it, so that views with the same settings share one, whatever
 * their cameras and sizes. */
struct lum_caches;
/* n_workers: of the pools whose views use it. Thread: the director's alone, but for the workers of a pass. */
LUM_MUST_USE enum lum_status lum_caches_create(uint32_t n_workers, struct lum_caches **ret_caches,
                                               struct lum_error *err);
void lum_caches_destroy(struct lum_caches *caches); /* accepts NULL; all views that share it are gone */
/* Bytes that the records of all of them may take together; without it, as many as there is memory for. Beyond, those
 * give way that no view holds, the one used last last; then the cache that needs more begins anew; then those of other
 * views do. So every picture is complete, as long as the limit has room for the records of any one. */
void lum_caches_set_limit(struct lum_caches *caches, size_t bytes);
/* Makes all of them as new, but for the memory they have: for timing. */
void lum_caches_forget(struct lum_caches *caches);

struct lum_caches_size {
    uint64_t records;
    size_t bytes;        /* of the stores: records, and what finds them */
    size_t record_bytes; /* of these, what counts towards the limit */
};
/* Of all of them together. */
void lum_caches_measure(const struct lum_caches *caches, struct lum_caches_size *ret_size);

/* What passes did; of one pass when it was zeroed before. */
struct lum_cache_counts {
    uint64_t records;                                      /* there now */
    uint64_t created, updated, reused, removed, discarded; /* reused: found by a pixel, and neither new nor updated */
};

#endif

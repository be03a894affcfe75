/* Records on their way to others who share the work. */
#include <string.h>

#include "core/cache/cache.h"
#include "core/cache/kind.h"

#define STATE offsetof(struct lum_cache_record, state) /* and what follows it is the store's */
_Static_assert(STATE % 8 == 0 && sizeof(struct lum_cache_record) % 8 == 0, "what is told is whole words");

/* What the kind adds to its records. */
static size_t own_bytes(const struct lum_cache *cache)
{
    return lum_cache_bytes_of_kind(cache) - sizeof(struct lum_cache_record);
}

size_t lum_cache_told_bytes(const struct lum_cache *cache)
{
    return STATE + lum_cache_record_bytes(cache) - sizeof(struct lum_cache_record);
}

/* Copies what panes leave of each VPL that the record sees, from or to a row of them. Returns its bytes. */
static size_t copy_left(const struct lum_cache *cache, struct lum_cache_record *r, uint32_t *row, bool to_row)
{
    uint32_t *left = lum_cache_left(cache, r);
    const uint64_t *sees = cache->key.kind->sees ? cache->key.kind->sees(r) : NULL;
    uint32_t n = 0;
    for (uint32_t slot = 0; left && slot < cache->vpls.n; slot++) {
        if (sees && !(sees[slot / 64] >> slot % 64 & 1))
            continue;
        if (to_row)
            row[n] = left[slot];
        else
            left[slot] = row[n];
        n++;
    }
    return (n * sizeof *row + 7) / 8 * 8;
}

size_t lum_cache_tell(const struct lum_cache *cache, struct lum_cache_record *r, void *ret_told)
{
    unsigned char *at = ret_told;
    size_t own = own_bytes(cache);
    memcpy(at, r, STATE);
    memcpy(at + STATE, r + 1, own);
    return STATE + own + copy_left(cache, r, (uint32_t *)(void *)(at + STATE + own), true);
}

size_t lum_cache_hear(const struct lum_cache *cache, struct lum_cache_record *r, const void *told)
{
    unsigned char *at = (unsigned char *)told; /* copy_left only reads it */
    size_t own = own_bytes(cache);
    memcpy(r, at, STATE);
    memcpy(r + 1, at + STATE, own);
    return STATE + own + copy_left(cache, r, (uint32_t *)(void *)(at + STATE + own), false);
}

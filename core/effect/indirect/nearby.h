/* Which records may serve the points of a square, kept from pass to pass: where the eye sees what it saw, a pass only takes out
 * those that are gone, and adds those that are new.. */
#ifndef LUM_CORE_EFFECT_INDIRECT_NEARBY_H
#define LUM_CORE_EFFECT_INDIRECT_NEARBY_H

#include "core/effect/indirect/square.h"

/* Of the lists of a picture. Squares for whose list that leaves no room are looked up point by point. */
#define LUM_NEARBY_BYTES ((size_t)128 << 20)

/* Zeroed: nothing is known. */
struct lum_nearby {
    struct lum_cache_record **records; /* in the order of lum_square_find; read only after lum_nearby_update */
    uint32_t n, capacity;
    bool known;  /* what follows; the owner forgets it with the points */
    bool listed; /* false: there are too many, or memory is short. Then points are looked up one by one */
    bool served; /* all points, by them */
    struct lum_square_box box;
    uint64_t holding;       /* of struct lum_records */
    uint64_t born, removed; /* of the cache: up to these they are what they should be */
    float pixel;            /* of struct lum_lookup */
};
void lum_nearby_finish(struct lum_nearby *nearby);

/* Brings it up to date with the cache. sites: all points of the square, at least one. Thread: the worker that has the tile, while
 * nobody inserts or removes. */
void lum_nearby_update(struct lum_nearby *nearby, const struct lum_pass *pass, uint32_t tile, const struct lum_sites *sites,
                       const struct lum_lookup *lookup);

/* For lum_square_serve and lum_square_interpolate. NULL: point by point. */
static inline const struct lum_candidates *lum_nearby_list(const struct lum_nearby *nearby, struct lum_candidates *ret_candidates)
{
    *ret_candidates = (struct lum_candidates){nearby->n, nearby->records};
    return nearby->listed ? ret_candidates : NULL;
}

#endif

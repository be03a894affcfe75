/* Which records may serve the points of a tile, kept from pass to pass: where the eye sees what it saw, a pass only
 * takes out those that are gone, and adds those that are new.. */
#ifndef LUM_CORE_EFFECT_INDIRECT_KEPT_CANDIDATES_H
#define LUM_CORE_EFFECT_INDIRECT_KEPT_CANDIDATES_H

#include "core/effect/indirect/tile_points.h"

/* Of the lists of a picture. Tiles for whose list that leaves no room are looked up point by point. */
#define LUM_KEPT_CANDIDATES_BYTES ((size_t)128 << 20)

/* Zeroed: nothing is known. */
struct lum_kept_candidates {
    struct lum_cache_record *
        *records; /* in the order of lum_tile_points_find; read only after lum_kept_candidates_update */
    uint32_t n, capacity;
    bool known;  /* what follows; the owner forgets it with the points */
    bool listed; /* false: there are too many, or memory is short. Then points are looked up one by one */
    bool served; /* all points, by them */
    struct lum_tile_points_box box;
    uint64_t holding;       /* of struct lum_records */
    uint64_t born, removed; /* of the cache: up to these they are what they should be */
    float pixel;            /* of struct lum_lookup */
};
void lum_kept_candidates_finish(struct lum_kept_candidates *kept);

/* Brings it up to date with the cache. pixels: all points of the tile, at least one. Thread: the worker that has the
 * tile, while nobody inserts or removes. */
void lum_kept_candidates_update(struct lum_kept_candidates *kept, const struct lum_pass *pass, uint32_t tile,
                                const struct lum_pixel_mask *mask, const struct lum_lookup *lookup);

/* For lum_tile_points_serve and lum_tile_points_interpolate. NULL: point by point. */
static inline const struct lum_candidates *lum_kept_candidates_list(const struct lum_kept_candidates *kept,
                                                                    struct lum_candidates *ret_candidates)
{
    *ret_candidates = (struct lum_candidates){kept->n, kept->records};
    return kept->listed ? ret_candidates : NULL;
}

#endif

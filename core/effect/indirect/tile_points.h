/* Surface points of a tile of pixels, all tested against one record at a time, as structures of arrays that the
 * compiler vectorises. */
#ifndef LUM_CORE_EFFECT_INDIRECT_TILE_POINTS_H
#define LUM_CORE_EFFECT_INDIRECT_TILE_POINTS_H

#include "core/cache/cache.h"
#include "core/cache/weight.h"
#include "core/pass/pass.h"

#define LUM_PIXEL_MASK_WORDS (LUM_TILE_PIXELS / 64) /* a bit for each pixel */
/* Records that are found at once. Where there are more, the points are looked up one by one. */
#define LUM_TILE_RECORDS 4096u

/* A bit for each pixel of a tile, row by row, LUM_TILE_SIDE a row. */
struct lum_pixel_mask {
    uint64_t bits[LUM_PIXEL_MASK_WORDS];
};
static inline bool lum_pixel_mask_none(const struct lum_pixel_mask *s)
{
    return (s->bits[0] | s->bits[1] | s->bits[2] | s->bits[3]) == 0;
}
static inline void lum_pixel_mask_set(struct lum_pixel_mask *s, uint32_t slot)
{
    s->bits[slot / 64] |= UINT64_C(1) << slot % 64;
}
static inline void lum_pixel_mask_clear(struct lum_pixel_mask *s, uint32_t slot)
{
    s->bits[slot / 64] &= ~(UINT64_C(1) << slot % 64);
}
static inline bool lum_pixel_mask_has(const struct lum_pixel_mask *s, uint32_t slot)
{
    return s->bits[slot / 64] >> slot % 64 & 1u;
}

/* About 7 KiB: lives on a worker's stack. Arrays are in step; those beyond n, up to the next multiple of 16, are 0. */
struct lum_tile_points {
    uint32_t n;
    _Alignas(64) float px[LUM_TILE_PIXELS];
    float py[LUM_TILE_PIXELS], pz[LUM_TILE_PIXELS], nx[LUM_TILE_PIXELS], ny[LUM_TILE_PIXELS], nz[LUM_TILE_PIXELS];
    uint8_t slot[LUM_TILE_PIXELS];
};
/* tile: of pass->tiling, whose side is that of tiles; or as many more, for the far sides of the sheets that it shows.
 */
static inline bool lum_tile_is_far(const struct lum_pass *pass, uint32_t tile)
{
    return tile >= pass->tiling.n;
}
static inline size_t lum_tile_pixel(const struct lum_pass *pass, uint32_t tile, uint32_t slot)
{
    tile %= pass->tiling.n;
    uint32_t x = tile % pass->tiling.nx * LUM_TILE_SIDE + slot % LUM_TILE_SIDE;
    uint32_t y = tile / pass->tiling.nx * LUM_TILE_SIDE + slot / LUM_TILE_SIDE;
    return (size_t)y * pass->tiling.w + x;
}
void lum_tile_points_load(struct lum_tile_points *ret_points, const struct lum_pass *pass, uint32_t tile,
                          const struct lum_pixel_mask *mask);

/* How records of a cache are looked up and weighed. */
struct lum_lookup {
    const struct lum_cache *cache;
    struct lum_store *store;
    uint32_t worker;
    enum lum_metric metric;
    struct lum_weighting weighting;
    float least_dot; /* of the normals of a record and a point that it serves */
    float pixel;     /* as of struct lum_cache_job */
    struct lum_vec3 eye;
};
struct lum_lookup lum_lookup_of(const struct lum_cache *cache, const struct lum_pass *pass, uint32_t worker);

/* False: its radius was made for pixels more than LUM_RECORD_COARSER times as large as those of the pass where it lies,
 * and the pass has finer ones made. It goes on serving passes that look from as far away as the one that asked for it.
 */
#define LUM_RECORD_COARSER 2.0f
static inline bool lum_record_is_fine(const struct lum_lookup *l, const struct lum_cache_record *r)
{
    return r->footprint <= LUM_RECORD_COARSER * lum_cache_footprint(l->pixel, l->eye, r->p);
}

/* Around points, and around their normals. */
struct lum_tile_points_box {
    struct lum_vec3 lo, hi, n_lo, n_hi;
};
struct lum_tile_points_box lum_tile_points_box_of(const struct lum_tile_points *points, uint32_t from, uint32_t n);
/* False when the record serves no point of the box. */
bool lum_tile_points_box_may_meet(const struct lum_lookup *l, const struct lum_tile_points_box *box,
                                  const struct lum_cache_record *r);

/* Records that may serve some points, in an order that depends on where they lie alone. */
struct lum_candidates {
    uint32_t n;
    struct lum_cache_record **records;
};
void lum_tile_points_sort(struct lum_candidates *candidates);
/* Those of all points of a tile, into an array of LUM_TILE_RECORDS. False: there are more than fit. */
bool lum_tile_points_find(const struct lum_lookup *l, const struct lum_tile_points *points,
                          struct lum_candidates *inout_candidates);

/* Clears the bit of every pixel that a record serves. candidates: of the tile; NULL: they are looked up point by point.
 * found: a bit by record's index, set for all candidates; NULL: not wanted. */
void lum_tile_points_serve(const struct lum_lookup *l, const struct lum_candidates *candidates,
                           struct lum_tile_points *points, struct lum_pixel_mask *mask, _Atomic uint64_t *found);
void lum_tile_points_note(const struct lum_candidates *candidates, _Atomic uint64_t *found);

/* Irradiance at every point: sum of w (E + gradient . d) / sum of w. By point of the tile. A point where nothing serves
 * is black; one that only one record serves has exactly what this one says, and where all say the same, that is it.
 * candidates: as above. */
void lum_tile_points_interpolate(const struct lum_lookup *l, const struct lum_candidates *candidates,
                                 const struct lum_tile_points *points, struct lum_rgb ret_irradiance[LUM_TILE_PIXELS]);

#endif

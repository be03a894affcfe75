/* Surface points of a square of pixels, all tested against one record at a time, as structures of arrays that the compiler
 * vectorises. */
#ifndef LUM_CORE_EFFECT_INDIRECT_SQUARE_H
#define LUM_CORE_EFFECT_INDIRECT_SQUARE_H

#include "core/cache/weight.h"
#include "core/pass/pass.h"

#define LUM_SQUARE_SITES (LUM_TILE_SIDE * LUM_TILE_SIDE)
#define LUM_SQUARE_WORDS (LUM_SQUARE_SITES / 64)
/* Records that are found at once. Where there are more, the points are looked up one by one. */
#define LUM_SQUARE_RECORDS 4096u

/* A bit for each pixel of a square, row by row, LUM_TILE_SIDE a row. */
struct lum_sites {
    uint64_t bits[LUM_SQUARE_WORDS];
};
static inline bool lum_sites_none(const struct lum_sites *s)
{
    return (s->bits[0] | s->bits[1] | s->bits[2] | s->bits[3]) == 0;
}
static inline void lum_sites_set(struct lum_sites *s, uint32_t site)
{
    s->bits[site / 64] |= UINT64_C(1) << site % 64;
}
static inline void lum_sites_clear(struct lum_sites *s, uint32_t site)
{
    s->bits[site / 64] &= ~(UINT64_C(1) << site % 64);
}
static inline bool lum_sites_has(const struct lum_sites *s, uint32_t site)
{
    return s->bits[site / 64] >> site % 64 & 1u;
}

/* About 7 KiB: lives on a worker's stack. Arrays are in step; those beyond n, up to the next multiple of 16, are 0. */
struct lum_square {
    uint32_t n;
    _Alignas(64) float px[LUM_SQUARE_SITES];
    float py[LUM_SQUARE_SITES], pz[LUM_SQUARE_SITES], nx[LUM_SQUARE_SITES], ny[LUM_SQUARE_SITES], nz[LUM_SQUARE_SITES];
    uint8_t site[LUM_SQUARE_SITES];
};
/* tile: of pass->tiling, whose side is that of squares. */
static inline size_t lum_square_pixel(const struct lum_pass *pass, uint32_t tile, uint32_t site)
{
    uint32_t x = tile % pass->tiling.nx * LUM_TILE_SIDE + site % LUM_TILE_SIDE;
    uint32_t y = tile / pass->tiling.nx * LUM_TILE_SIDE + site / LUM_TILE_SIDE;
    return (size_t)y * pass->tiling.w + x;
}
void lum_square_load(struct lum_square *ret_square, const struct lum_pass *pass, uint32_t tile,
                     const struct lum_sites *sites);

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

/* False: its radius was made for pixels more than LUM_RECORD_COARSER times as large as those of the pass where it lies, and the
 * pass has finer ones made. It goes on serving passes that look from as far away as the one that asked for it. */
#define LUM_RECORD_COARSER 2.0f
static inline bool lum_record_is_fine(const struct lum_lookup *l, const struct lum_cache_record *r)
{
    return r->footprint <= LUM_RECORD_COARSER * lum_cache_footprint(l->pixel, l->eye, r->p);
}

/* Around points, and around their normals. */
struct lum_square_box {
    struct lum_vec3 lo, hi, n_lo, n_hi;
};
struct lum_square_box lum_square_box_of(const struct lum_square *square, uint32_t from, uint32_t n);
/* False when the record serves no point of the box. */
bool lum_square_box_may_meet(const struct lum_lookup *l, const struct lum_square_box *box, const struct lum_cache_record *r);

/* Records that may serve some points, in an order that depends on where they lie alone. */
struct lum_candidates {
    uint32_t n;
    struct lum_cache_record **records;
};
void lum_square_sort(struct lum_candidates *candidates);
/* Those of all points of a square, into an array of LUM_SQUARE_RECORDS. False: there are more than fit. */
bool lum_square_find(const struct lum_lookup *l, const struct lum_square *square, struct lum_candidates *inout_candidates);

/* Clears the bit of every site that a record serves. candidates: of the square; NULL: they are looked up point by point. found: a bit by
 * record's index, set for all candidates; NULL: not wanted. */
void lum_square_serve(const struct lum_lookup *l, const struct lum_candidates *candidates, struct lum_square *square,
                      struct lum_sites *sites, _Atomic uint64_t *found);
void lum_square_note(const struct lum_candidates *candidates, _Atomic uint64_t *found);

/* Irradiance at every point: sum of w (E + gradient . d) / sum of w. By point of the square. A point where nothing serves is black;
 * one that only one record serves has exactly what this one says, and where all say the same, that is it. candidates: as above. */
void lum_square_interpolate(const struct lum_lookup *l, const struct lum_candidates *candidates, const struct lum_square *square,
                            struct lum_rgb ret_irradiance[LUM_SQUARE_SITES]);

#endif

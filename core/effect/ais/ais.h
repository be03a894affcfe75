/* Adaptive interleaved sampling, as published (thesis chapter 5), and instant global illumination (Wald et al. 2002),
 * of which it is an extension: one implementation, whose parameters make it the methods `igi`, `ais` and `ais-max`.
 *
 * Every component follows listing 5.1: an initial pass over all pixels of a tile of the pattern, a guidance that looks
 * at what it found, and further passes over the tiles that need them, each pass with sample subsets that the pixel has
 * not used yet:
 *   - ais_shadow.c: SS, listing 5.3: lights with an area and the environment, one by one
 *   - ais_indirect.c: ID, listing 5.2: subsets of the virtual point lights, at a quarter of the resolution (5.2.4)
 *   - ais_media.c: PM, listing 5.4: ray marching through homogeneous media
 *   - ais_filter.c: the discontinuity buffer, component by component, after a barrier
 *
 * A work cell is a square of tiles. Its pixels at one place of the pattern use the same subset, and are visited one
 * after the other: their rays are neighbours and end in one place, which packet tracing needs. */
#ifndef LUM_CORE_EFFECT_AIS_AIS_H
#define LUM_CORE_EFFECT_AIS_AIS_H

#include "core/pass/components.h"

#define LUM_AIS_SIDE 3u /* pixels of the pattern, a side (5.4) */
#define LUM_AIS_SUBSETS (LUM_AIS_SIDE * LUM_AIS_SIDE)
#define LUM_AIS_TILES ((LUM_CELL_SIDE / LUM_AIS_SIDE) * (LUM_CELL_SIDE / LUM_AIS_SIDE)) /* of a cell, at most */
_Static_assert(LUM_AIS_TILES <= LUM_RAY_BATCH, "the pixels of a packet at one place of the pattern are one ray batch");

/* What distinguishes the methods. */
struct lum_ais {
    uint32_t max;  /* iterations, the first one included: SSmaxSamples = IDmaxSamples = PMmaxSamples (5.4) */
    bool adaptive; /* false: every tile gets max iterations */
    uint32_t step; /* indirect light at every step-th pixel of every step-th row */
    bool joined;   /* direct and indirect light in one buffer, and one filter over their sum */
};
extern const struct lum_ais lum_ais_igi, lum_ais_adaptive, lum_ais_full;

static inline const struct lum_ais *lum_ais_of(const struct lum_pass *pass)
{
    return pass->settings->method->ais;
}

/* A work cell at the resolution of its component: pixel (x, y) of it, whose number is y * LUM_CELL_SIDE + x, is pixel
 * (step (x0 + x), step (y0 + y)) of the picture. */
#define LUM_AIS_PIXELS (LUM_CELL_SIDE * LUM_CELL_SIDE)
struct lum_ais_cell {
    const struct lum_pass *pass;
    uint32_t x0, y0, w, h, step;
    uint32_t tiles_x, tiles_y;
    uint8_t tile_x[LUM_AIS_TILES], tile_y[LUM_AIS_TILES]; /* in the order that lists have: along a curve of Morton, so
                                                           * that 16 in a row, which are a ray packet, lie close */
    bool wanted[LUM_AIS_PIXELS];                          /* pixels that the component is computed for */
    uint8_t further[LUM_AIS_TILES];                       /* iterations that each tile gets after the first one */
};
/* Nothing is wanted yet. */
void lum_ais_cell_init(struct lum_ais_cell *ret_cell, const struct lum_pass *pass, uint32_t index, uint32_t step);
/* Wants the pixels whose kind has one of these bits; 0: all. False: there is none. */
bool lum_ais_cell_want(struct lum_ais_cell *p, uint8_t kinds);

static inline size_t lum_ais_pixel(const struct lum_ais_cell *p, uint32_t i) /* number in the picture */
{
    return (size_t)(p->y0 + i / LUM_CELL_SIDE) * p->step * p->pass->tiling.w + (p->x0 + i % LUM_CELL_SIDE) * p->step;
}
static inline uint32_t lum_ais_tile(const struct lum_ais_cell *p, uint32_t i)
{
    return i / LUM_CELL_SIDE / LUM_AIS_SIDE * p->tiles_x + i % LUM_CELL_SIDE / LUM_AIS_SIDE;
}

/* The pixel at a place of the k-th tile; LUM_AIS_PIXELS: there is none, or it is not wanted. */
uint32_t lum_ais_at(const struct lum_ais_cell *p, uint32_t k, uint32_t place);

/* The pixels at a place of the pattern, 0 .. LUM_AIS_SUBSETS - 1, that take part in an iteration, in the tiles' order.
 */
struct lum_ais_list {
    uint32_t n;
    uint16_t pixel[LUM_AIS_TILES];
};
void lum_ais_list_pixels(const struct lum_ais_cell *p, uint32_t place, uint32_t iteration,
                         struct lum_ais_list *ret_list);
/* The subset that they use. */
static inline uint32_t lum_ais_subset(uint32_t place, uint32_t iteration)
{
    return lum_pattern_next(LUM_AIS_SIDE, lum_pattern_subset(LUM_AIS_SIDE, place % LUM_AIS_SIDE, place / LUM_AIS_SIDE),
                            iteration);
}
/* The highest iteration that any tile takes part in. */
uint32_t lum_ais_last_iteration(const struct lum_ais_cell *p);
/* Notes in the guidance map of a component how often the cell's tiles are refined, where it is more than noted before.
 */
void lum_ais_note(const struct lum_ais_cell *p, enum lum_effect component);

extern const struct lum_estimator lum_estimator_ais_shadow;   /* SS: soft_shadow, environment */
extern const struct lum_estimator lum_estimator_ais_gloss;    /* what glossy surfaces reflect of the same samples */
extern const struct lum_estimator lum_estimator_ais_indirect; /* ID */
extern const struct lum_estimator lum_estimator_igi_indirect; /* ID, into the same buffer as SS */
extern const struct lum_estimator lum_estimator_ais_media;    /* PM */
extern const struct lum_estimator lum_filter_ais;

/* How indirect light is filtered. */
struct lum_filter lum_ais_upsampling(const struct lum_pass *pass, const struct lum_guide *guide);

#endif

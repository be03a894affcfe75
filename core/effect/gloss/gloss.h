/* Light by way of glossy surfaces: what is kept of its paths, and what becomes of the light of those that were too
 * bright. */
#ifndef LUM_CORE_EFFECT_GLOSS_GLOSS_H
#define LUM_CORE_EFFECT_GLOSS_GLOSS_H

#include "core/pass/components.h"

/* What the glossy paths of a ray batch tile bring home, and where they went for it. */
struct lum_gain;
struct lum_path_segment;
enum lum_gloss_state {
    LUM_GLOSS_NONE,  /* to be traced */
    LUM_GLOSS_KEPT,  /* gains are of the present scene, and all of them */
    LUM_GLOSS_MOVED, /* but for what moved since the pass before: those whose segments that met are to be traced */
};
struct lum_gloss_tile {
    struct lum_gain *gains;
    struct lum_path_segment *segments;
    uint32_t n, capacity, n_segments, segment_capacity;
    enum lum_gloss_state state;
    bool followed;   /* the segments are all of them */
    float kept, cut; /* sums of luminance: what the pixels got, and what of too bright paths they did not */
};
/* Of the gains of all tiles, and as much again of segments; beyond, a tile is traced anew when a light is dimmed, or
 * anything moves. */
#define LUM_GLOSS_BYTES ((size_t)128 << 20)

/* What a view keeps of it. */
struct lum_gloss {
    struct lum_gloss_tile *tiles; /* by ray batch tile */
    uint32_t n_tiles;
    uint8_t *lit; /* by light: it shone whenever they were traced, so that paths looked for it */
    uint32_t n_lit;
};
extern const struct lum_state_kind lum_gloss_kind; /* of lum_estimator_glossy */

/* Limits what the paths of a tile's n pixels bring, of which n_gloss are glossy, and sums it in kept and cut. */
void lum_gloss_tame(struct lum_gloss_tile *tile, struct lum_rgb *radiance, uint32_t n, uint32_t n_gloss);
/* Of what paths of gloss brought home, and was too bright: the pixels of a rectangle of whole tiles get what the tiles
 * around cut, in proportion to what they have. smooth: w * h. Once all tiles are traced. */
void lum_gloss_give_back(const struct lum_gloss *gloss, const struct lum_pass *pass, const struct lum_tile_rect *r,
                         struct lum_rgb *smooth);

extern const struct lum_estimator lum_estimator_glossy;
extern const struct lum_estimator lum_stage_gloss; /* filter: what glossy surfaces, mirrors and glass show */

#endif

/* Light by way of glossy surfaces: what is kept of its paths, what becomes of the light of those that were too bright,
 * and how that of a pixel's path becomes smooth. */
#ifndef LUM_CORE_EFFECT_GLOSS_GLOSS_H
#define LUM_CORE_EFFECT_GLOSS_GLOSS_H

#include "core/base/arena.h"
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

/* By pixel of the picture, row by row; set where it shows gloss. */
struct lum_gloss_pixels {
    struct lum_rgb *light;  /* what its path brought home, over albedo: so that textures stay sharp */
    struct lum_rgb *albedo; /* of its gloss, lum_bsdf_gloss_albedo */
    struct lum_rgb *hit;    /* r: 1 / distance that its path went to the first thing it met, 0: there was none; g: 1 if
                             * it has a path, 0: roulette ended it before it began, r is 0; b: alpha of its lobe */
    struct lum_rgb *mean;   /* of light, over a window of the pattern */
    float *reach;           /* over how far that is still the light of others: pixels */
    struct lum_arena arena; /* of all of the above */
};

/* What a view keeps of it. */
struct lum_gloss {
    struct lum_gloss_pixels pixels;
    struct lum_gloss_tile *tiles; /* by ray batch tile */
    uint32_t n_tiles;
    uint8_t *lit; /* by light: it shone whenever they were traced, so that paths looked for it */
    uint32_t n_lit;
};
extern const struct lum_state_kind lum_gloss_kind; /* of lum_estimator_glossy */

/* Limits what the paths of a tile's n pixels bring, of which n_gloss are glossy, and sums it in kept and cut. */
void lum_gloss_tame(struct lum_gloss_tile *tile, struct lum_rgb *radiance, uint32_t n, uint32_t n_gloss);
/* Of what paths of gloss brought home, and was too bright: the pixels of a rectangle of whole tiles get what the tiles
 * around cut, in proportion to what they have. light: of the pixels, row by row of r. Once all tiles are traced. */
void lum_gloss_give_back(const struct lum_gloss *gloss, const struct lum_pass *pass, const struct lum_tile_rect *r,
                         struct lum_rgb *light);

extern const struct lum_estimator lum_estimator_glossy;
/* Filters. What mirrors and glass show, and the paths of gloss, by windows of the method's pattern; */
extern const struct lum_estimator lum_stage_gloss;
/* and after that of `live`, these over as much more of their surface as shows about the same. */
extern const struct lum_estimator lum_stage_gloss_wide;

#endif

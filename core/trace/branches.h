/* Where the branches of mirrors and glass went: what moved elsewhere leaves what they show as it was. */
#ifndef LUM_CORE_TRACE_BRANCHES_H
#define LUM_CORE_TRACE_BRANCHES_H

#include "core/scene/motion.h"

/* One segment of the tree of a pixel; or a box of points that the eye sees, corner to corner. */
struct lum_branch {
    struct lum_vec3 from, to;
    bool lit; /* what it ends on, or what is in the box, may be lit: shadow rays go from there to the lights */
    bool box;
};

/* All of a ray batch tile. */
struct lum_branches {
    struct lum_branch *branches;
    uint32_t n, capacity;
    struct lum_bounds ends; /* around those that are lit; lo > hi: there are none */
    bool whole;             /* none was left out */
    bool stale; /* what the eye sees there has changed, or one of them has: since they were followed, or may have */
};
/* Of all tiles. What does not fit is shaded anew when anything moves. */
#define LUM_BRANCHES_BYTES ((size_t)64 << 20)

/* n: tiles; NULL: nothing to do. */
void lum_branches_destroy(struct lum_branches *tiles, uint32_t n);

/* The tile is traced anew. Thread: the worker that has it. */
void lum_branches_begin(struct lum_branches *tile);
/* max: of a tile, by size of the picture alone. Without memory the tile is not whole. */
void lum_branches_add(struct lum_branches *tile, const struct lum_branch *branch, uint32_t max);

/* True when the motion met a branch, or some are not known. */
bool lum_branches_met(const struct lum_branches *tile, const struct lum_motion *motion);
/* True when it met the way from where one ends to a light in these bounds. */
bool lum_branches_light_met(const struct lum_branches *tile, const struct lum_motion *motion,
                            const struct lum_bounds *light);

#endif

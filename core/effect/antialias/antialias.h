/* Anti-aliasing of what one ray a pixel showed. */
#ifndef LUM_CORE_EFFECT_ANTIALIAS_ANTIALIAS_H
#define LUM_CORE_EFFECT_ANTIALIAS_ANTIALIAS_H

#include "core/pass/pass.h"
#include "core/pass/state.h"

extern const struct lum_estimator lum_estimator_edges; /* of surfaces, and then */
extern const struct lum_estimator lum_shadow_edges;    /* of hard shadows */

/* Per pixel at an edge; the fewest with which a slanted edge shows no steps at 8 bits of contrast 1:20. */
#define LUM_EDGE_RAYS 8u
/* Whose radiance a pixel shows, by ray a number of the nine pixels around, row by row, in so many bits. */
#define LUM_NEIGHBOUR_BITS 4u
#define LUM_NEIGHBOUR_MASK 15u
#define LUM_NEIGHBOUR_SELF 4u
_Static_assert(LUM_EDGE_RAYS *LUM_NEIGHBOUR_BITS <= 32, "the neighbours of a pixel's rays fit into a word");
/* All rays of a pixel that no edge runs through. */
#define LUM_NEIGHBOURS_SELF (UINT32_MAX / LUM_NEIGHBOUR_MASK * LUM_NEIGHBOUR_SELF)

/* Of the pixel at `at`, in a picture so wide, the one whose radiance its ray k takes. */
static inline size_t lum_edge_neighbour(uint32_t neighbours, uint32_t k, size_t at, uint32_t width)
{
    uint32_t neighbour = neighbours >> LUM_NEIGHBOUR_BITS * k & LUM_NEIGHBOUR_MASK;
    return at + (size_t)(neighbour / 3) * width + neighbour % 3 - width - 1;
}

/* By pixel, what the last whole frame was smoothed by; NULL: nothing. */
const uint32_t *lum_edge_neighbours(const struct lum_states *states);

#endif

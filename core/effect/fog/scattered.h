/* What fog scatters to the eye of light that surfaces and other fog send, in frames of `live`.
 *
 *   trace   per tile of the picture LUM_SCATTERED_NODES points in the fog before it, at even steps of what the tile can
 *           get: on the ray of a pixel that sees as far. Each draws virtual point lights by what they would bring
 *           (vpl/air.h), and asks a ray of each
 *   sum     what the points scatter on, at present powers: a dimmed light is this alone, without a ray
 *   spread  how much fog lies before a pixel is known exactly; multiplied by the mean over the points before it, of the
 *           tiles around by a quadratic spline. That light varies slowly in the air, whatever stands in it
 * Fog seen in mirrors and through glass has none of it. */
#ifndef LUM_CORE_EFFECT_FOG_SCATTERED_H
#define LUM_CORE_EFFECT_FOG_SCATTERED_H

#include "core/pass/components.h"
#include "core/vpl/air.h"

#define LUM_SCATTERED_NODES 8u
#define LUM_SCATTERED_DRAWS 16u
_Static_assert(LUM_SCATTERED_NODES *LUM_SCATTERED_DRAWS <= LUM_RAY_BATCH, "a tile's rays are one batch");

/* One VPL that a point sees. */
struct lum_scattered_term {
    uint32_t slot;
    struct lum_rgb weight; /* its flux times this is scattered on, of what was drawn */
};
struct lum_scattered_node {
    float t; /* distance from the eye */
    float f; /* share of what its tile can get that is nearer */
    uint32_t n;
    struct lum_scattered_term seen[LUM_SCATTERED_DRAWS];
    struct lum_rgb light; /* mean radiance scattered to the eye, per unit of length and sigma_s, at present powers */
};
struct lum_scattered_tile {
    float from, to; /* where the fog before it begins and ends; from INFINITY: there is none */
    struct lum_scattered_node node[LUM_SCATTERED_NODES]; /* by distance */
};
struct lum_scattered {
    struct lum_scattered_tile *tiles;
    struct lum_memo made; /* by tile: its points and what they see */
    uint64_t places;      /* of the VPLs that they see (lum_vpl_hash_places) */
};

extern const struct lum_estimator lum_estimator_scattered;

#endif

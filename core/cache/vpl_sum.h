/* Irradiance of a point from virtual point lights, given which of them it sees: no ray.
 *
 * The geometry term is lifted: cos cos / r^2 is taken not at the point p, at height h above the tangent plane of the
 * VPL, but at p + (b - h) n_vpl, at height b = sqrt(h^2 + m^4 / (h^2 + m^2)), from m for h = 0 to h + m^4 / (2 h^3) far
 * away. So the term is at most 1 / m^2, smooth, and loses no energy: for VPLs spread evenly over a plane, the sum is
 * the irradiance at the lifted point, which a plane lights exactly as much as p, whatever the direction that p faces.
 * (Clamping the term, or 1 / (r^2 + m^2), loses half and more of the light of walls nearer than the VPLs' spacing:
 * NOTES R1.) But a wall that ends at a distance a loses a share of about (b - h) / a, which is why b must come down to
 * h quickly: with b = sqrt(h^2 + m^2) a closed cube with 256 VPLs loses 2.4 % even in the middle of its floor
 * (tests/numeric/corner_test.c). What faces the same way as the VPL, as within a hollow, is lifted without sinking
 * below its own horizon: in a sphere with 256 VPLs the sum is 7 % too high, and would else be 5 % too low. What ends
 * nearer than that, as slats do, would lose most of its light: it is given back (core/cache/lost.h).
 *
 * All sums are in an order that depends on the number of VPLs alone: floats in LUM_LANES lanes over blocks of
 * LUM_SUM_BLOCK VPLs, lanes and blocks added up in double. No machine, and no history, changes a bit of it. */
#ifndef LUM_CORE_CACHE_VPL_SUM_H
#define LUM_CORE_CACHE_VPL_SUM_H

#include "core/math/lanes.h"
#include "core/vpl/vpl.h"

#define LUM_SUM_BLOCK 256u /* 16 additions in each lane: floats lose no more than 16 roundings */

/* A point of a surface, as in struct lum_gather_points. */
struct lum_receiver {
    struct lum_vec3 p, n, ng;
};

/* A word of bits of the VPLs that the point faces and that face it, be they lit or not; others give it nothing, nor do
 * points in portals give anything to what is not in their box. */
uint64_t lum_vpl_faces(const struct lum_vpl_set *set, const struct lum_receiver *at, uint32_t word);

/* Of the VPLs that the point faces about n of bounced light are drawn into ret_bits, each with a chance in proportion
 * to what it would bring the point, were it as bright as its importance says, and visible; those that would bring the
 * returned step or more for sure; and of the points of the sky one in sky_every (a power of 2, at most 64). So n rays
 * tell as much of many VPLs as of few, and a sum over those drawn has the expectation of the sum over all. 0: the point
 * faces n or fewer, which are all drawn.
 *
 * Of each LUM_DRAW_BLOCK slots as many are drawn as their chances add up to, rounded down or up: systematic sampling.
 * Who it is hangs on the cell of space that the point is in, on the set's seed, and on the others of the block alone.
 * Drawn each by itself, the pictures of first frames had 10 % more SMAPE in cornell, 6 in conference, 2.5 in sponza and
 * office (three draws, 300 x 200); with blocks of 64 they are no better, and what moves exchanges more. */
#define LUM_DRAW_BLOCK 32u
float lum_vpl_draw(const struct lum_vpl_set *set, const struct lum_receiver *at, float lift, uint32_t n,
                   uint32_t sky_every, uint64_t *ret_bits);

struct lum_vpl_sum {
    struct lum_rgb irradiance;
    struct lum_rgb gradient[3]; /* by moving p along x, y, z, while the same VPLs are seen, undimmed by media; what
                                   panes leave stays */
};
/* Over the VPLs in `visible`, of those that lum_vpl_draw drew with this step, 0: of all, and sky_every. left: what
 * panes leave of each (lum_transmittance_pack), padded like the set; NULL: there are none. lift: m above, in radii of
 * each VPL; > 0. snapshot: whose lights the set is of. media: those of the snapshot dim the light. */
void lum_vpl_sum_visible(const struct lum_vpl_set *set, const struct lum_receiver *at, const uint64_t *visible,
                         const uint32_t *left, float lift, float step, uint32_t sky_every,
                         const struct lum_snapshot *snapshot, bool media, struct lum_vpl_sum *ret_sum);

#endif

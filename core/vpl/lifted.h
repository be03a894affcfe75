/* What a lifted VPL (core/cache/vpl_sum.h) leaves out, as rays from it tell, and gives back. Internal to renderers.
 *
 * Rays of density cos / pi go where a VPL's light goes. So the share of its light that surfaces get though it is lifted
 * by m is the mean over such rays of the lifted term over the true one, 1 where they meet nothing. It is 1 for a wall,
 * however near, that is wide beside m; a disc of radius a at a distance g gets a^2 / (a^2 + b^2) instead of
 * a^2 / (a^2 + g^2), b being its lifted height. What is lost is given back to what is near, with s = m^2 u / (d^2 +
 * m^2 u) for how near that is, 1 at the VPL and 0 far away. The rays are those that tell which paths are worth a VPL
 * (choose.c), so that it costs no ray.
 *   - Surfaces get it back by what their own rays say is near (core/cache/lost.h). Not from this VPL: few of them stand
 *     for what is nearer than they are to each other, and each would be a spot between the two slats that see it.
 *   - Points in fog, which look at few VPLs each, get the lifted term 1 + gain s times, with a gain with which the mean
 *     over these rays is 1. */
#ifndef LUM_CORE_VPL_LIFTED_H
#define LUM_CORE_VPL_LIFTED_H

#include "core/math/vec.h"

/* Lifts m for which it is known: LUM_VPL_LIFT_WIDEST of the scene's radius, and each half of the one before. What is
 * lifted further, as a few that are more important than all around them (share.h), has the gain of the widest. */
#define LUM_VPL_LIFTS 6u
#define LUM_VPL_LIFT_WIDEST 0.075f

/* A VPL is lifted by so many radii of the area that it stands for; less is noise, hot spots on slats and in corners,
 * more is blur. NOTES, tried and rejected, has the figures of both. */
#define LUM_VPL_LIFT 1.0f
#define LUM_VPL_GAIN_MAX 3.0f /* what few VPLs give back shows as spots */

/* Sums over n rays, by lift: of the share that is left, of it times s, and of s. */
struct lum_vpl_kept {
    float n;
    float light[LUM_VPL_LIFTS], near[LUM_VPL_LIFTS], beside[LUM_VPL_LIFTS];
};

/* A ray met nothing that takes light. */
void lum_vpl_kept_add_miss(struct lum_vpl_kept *inout);
/* A ray of unit direction d from a VPL of normal v met a surface of normal n (unit, either side) at distance t. */
void lum_vpl_kept_add(struct lum_vpl_kept *inout, float scene_radius, struct lum_vec3 v, struct lum_vec3 d, float t,
                      struct lum_vec3 n);
/* The same for a ray that counts as so many. */
void lum_vpl_kept_add_weighted(struct lum_vpl_kept *inout, float weight, float scene_radius, struct lum_vec3 v,
                               struct lum_vec3 d, float t, struct lum_vec3 n);
void lum_vpl_kept_add_all(struct lum_vpl_kept *inout, const struct lum_vpl_kept *more);

/* Of one lift m: means over the rays of what is lost, and of s. */
struct lum_vpl_lost {
    float lost, beside;
};
struct lum_vpl_lost lum_vpl_lost_of(const struct lum_vpl_kept *kept, float scene_radius, float m);

/* The gain of a VPL that is lifted by m. */
float lum_vpl_gain(const struct lum_vpl_kept *kept, float scene_radius, float m);

#endif

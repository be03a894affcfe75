/* Light that media scatter any number of times: where a path that crosses them is scattered, and to where.
 *
 * A path is scattered as scattering alone takes light from its ray: what is absorbed on the way is no matter of chance,
 * but taken from what the path carries. So fog that only absorbs makes no noise, and in fog that only scatters a path
 * carries the same for ever. Colours may be scattered at different rates: one is drawn, in proportion to what the path
 * carries of it, and the sample is weighed by the density that all of them have together (balance heuristic), which
 * leaves the sum of the three as it was. */
#ifndef LUM_CORE_MEDIUM_COLLIDE_H
#define LUM_CORE_MEDIUM_COLLIDE_H

#include "core/medium/stretches.h"

/* A ray and the media on it. */
struct lum_collider {
    const struct lum_snapshot *snapshot;
    struct lum_vec3 o, d; /* d unit */
    float tmax;
    float share[3];          /* of each colour in what the path carries; sum 1 */
    struct lum_stretches on; /* the ray */
    float pass;              /* chance of not being scattered before tmax */
};

/* Of the ray o + t d, 0 <= t <= tmax, which may be INFINITY. carried: by the path at o; not black, not negative. */
void lum_collider_init(struct lum_collider *c, const struct lum_snapshot *s, struct lum_vec3 o, struct lum_vec3 d,
                       float tmax, struct lum_rgb carried);

struct lum_collision {
    float t;
    uint32_t medium;
    float pdf;             /* of both: per unit of length */
    struct lum_rgb weight; /* what is left of the path there, before it goes on: sigma_s transmittance / pdf */
};
/* False: the path is not scattered, by chance; what it carries at tmax is then to be divided by pass. Depths below
 * 2^-25 are none. */
bool lum_collider_sample(const struct lum_collider *c, struct lum_vec2 u, struct lum_collision *ret_collision);
/* pdf with which it is scattered at t by this medium, in which it is there. */
float lum_collider_pdf(const struct lum_collider *c, float t, uint32_t medium);

/* A direction by the phase function, given the one that light travels in, or a path: it is the same both ways. Its pdf
 * is lum_phase_hg of the cosine between the two. */
struct lum_vec3 lum_phase_hg_sample(float g, struct lum_vec3 d, struct lum_vec2 u);

#endif

/* What a point gets of the sky's VPLs: sky.c has the argument. */
#ifndef LUM_CORE_VPL_SKY_H
#define LUM_CORE_VPL_SKY_H

#include "core/light/light.h"
#include "core/vpl/vpl.h"

/* Scene units: beyond everything, as coordinates are at most 2^7. Segments to what is further would be tested against
 * boxes less exactly (cache/since.c). */
#define LUM_VPL_FAR 0x1p11f

/* Where the segment from p to a slot ends, from p, given d from lum_vpl_seen_from to the slot's place: rays to points
 * in portals go on through them. */
static inline struct lum_vec3 lum_vpl_segment(const struct lum_vpl_set *set, uint32_t slot, struct lum_vec3 d)
{
    return slot < lum_vpl_first_portal(set) ? d : lum_v3_mul(d, LUM_VPL_FAR / sqrtf(lum_dot(d, d)));
}

/* True when p is where points in portals count. Nothing else asks for them. */
bool lum_vpl_sees_portals(const struct lum_vpl_set *set, struct lum_vec3 p);

/* What a point of the dome that p sees counts beside those in portals; the environment `sky` is the set's. */
float lum_vpl_dome_weight(const struct lum_vpl_set *set, const struct lum_light *sky, uint32_t slot, struct lum_vec3 p);

/* What a point in a portal brings p, of normal n, which sees it: irradiance is radiance times g;
 * the gradient is that of g by moving p. False: nothing. */
struct lum_portal_term {
    struct lum_rgb radiance;
    float g;
    struct lum_vec3 gradient;
};
bool lum_vpl_portal_term(const struct lum_vpl_set *set, const struct lum_light *sky, uint32_t slot, struct lum_vec3 p,
                         struct lum_vec3 n, struct lum_portal_term *ret_term);

#endif

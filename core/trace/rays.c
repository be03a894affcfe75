#include "core/trace/rays.h"

/* From here on only the direction counts: the offset of an origin turns it by less than float can tell. And a ray as
 * long as its light is far would leave the range of LUM_RAY_LIMIT. */
#define FAR_LIGHT 0x1p20f

bool lum_shadow_ray(struct lum_rays *rays, struct lum_vec3 p, struct lum_vec3 ng, struct lum_vec3 wi, float distance)
{
    struct lum_vec3 o = lum_ray_offset(p, lum_dot(wi, ng) >= 0.0f ? ng : lum_v3_neg(ng));
    if (!(distance < FAR_LIGHT)) {
        lum_rays_push(rays, o, wi, distance * (1.0f - 0x1p-12f));
        return true;
    }
    /* From the offset origin to the very point on the light, which must not be met itself: scene coordinates are below
     * 2^7, so each end is off by at most an ulp of 2^-17; and by the relative rounding of distance * wi and of t. */
    struct lum_vec3 d = lum_v3_sub(lum_v3_mad(p, wi, distance), o);
    float length = lum_length(d);
    float tfar = 1.0f - 0x1p-12f - 0x1p-16f / length;
    if (!(tfar > 0.0f))
        return false;
    lum_rays_push(rays, o, d, tfar);
    return true;
}

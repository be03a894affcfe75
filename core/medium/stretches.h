/* A ray cut where it enters or leaves a medium: on each stretch all is homogeneous. */
#ifndef LUM_CORE_MEDIUM_STRETCHES_H
#define LUM_CORE_MEDIUM_STRETCHES_H

#include "core/medium/medium.h"

struct lum_stretches {
    uint32_t n;
    float t[2 * LUM_MEDIA_MAX]; /* stretch i: from t[i] to t[i + 1], in order; before the first and after the last
                                   nothing is */
    struct lum_rgb sigma_s[2 * LUM_MEDIA_MAX], sigma_t[2 * LUM_MEDIA_MAX]; /* of stretch i: sums over its media */
};
/* Of the ray o + t d, 0 <= t <= tmax, d unit; tmax may be INFINITY. */
void lum_stretches_find(struct lum_stretches *ret, const struct lum_snapshot *s, struct lum_vec3 o, struct lum_vec3 d,
                        float tmax);

/* What arrives at o of a ray from where one unit of light is scattered into it, per sigma_s: the integral of sigma_s
 * times transmittance up to t, by colour. At most 1. */
struct lum_rgb lum_stretches_scatter(const struct lum_stretches *s, float t);

#endif

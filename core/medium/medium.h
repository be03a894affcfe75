/* Homogeneous participating media: boxes of fog.
 *
 * The model of every method here: light is dimmed along every segment (exp(-sigma_t d)), and scattered once on its way from
 * a light to the eye. So `media` is the light that comes from a light straight to a point in the medium, and from there
 * straight (or by mirrors and glass) to the eye. Light that was scattered and then lights a surface, or that a surface sent
 * into the medium, is left out, in the reference as well as in the fast methods. Where boxes overlap their coefficients
 * add up. */
#ifndef LUM_CORE_MEDIUM_MEDIUM_H
#define LUM_CORE_MEDIUM_MEDIUM_H

#include "core/base/base.h"
#include "core/math/vec.h"

struct lum_snapshot;

#define LUM_MEDIA_MAX 8u       /* in one scene */
#define LUM_MEDIUM_G_MAX 0.99f /* |g|: closer to 1 the phase function is a delta to float */

/* In scene space: coefficients per scene unit. */
struct lum_medium {
    struct lum_vec3 lo, hi; /* -INFINITY, INFINITY: everywhere */
    struct lum_rgb sigma_s, sigma_t;
    float g; /* Henyey-Greenstein */
    char id[LUM_ID_MAX + 1];
};

/* A ray's stay in a medium: t0 < t1, in units of |d|; false when it stays out. Conservative by nothing: a ray that only
 * touches the box stays out. */
bool lum_medium_clip(const struct lum_medium *m, struct lum_vec3 o, struct lum_vec3 d, float tmax, float *ret_t0, float *ret_t1);

/* What is left of light after the segment o + t d, 0 <= t <= tmax, d unit, through all media of the snapshot. */
struct lum_rgb lum_media_transmittance(const struct lum_snapshot *s, struct lum_vec3 o, struct lum_vec3 d, float tmax);

/* Phase function, 1/sr; cos between the direction light travels in and the one it is scattered to. */
float lum_phase_hg(float g, float cos_theta);

#endif

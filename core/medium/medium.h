/* Homogeneous participating media: boxes of fog.
 *
 * Light is dimmed along every segment (exp(-sigma_t d)). What is scattered once on its way from a light straight to a
 * point in the medium, and from there straight (or by perfect mirrors and clear glass) to the eye, is the effect
 * `media`; what is scattered again, lights a surface then, or came from one, is the effect `scattering` (collide.h).
 * Where boxes overlap their coefficients add up. They pass through objects: what is inside a solid that stands in fog
 * is fog.
 *
 * Through a medium without a box nothing comes from infinitely far: the background is black and so is the light of
 * environment and directional lights, on surfaces and in the fog. What other lights scatter towards the eye is finite.
 */
#ifndef LUM_CORE_MEDIUM_MEDIUM_H
#define LUM_CORE_MEDIUM_MEDIUM_H

#include "core/base/base.h"
#include "core/math/rgb.h"
#include "core/math/vec.h"

struct lum_light;
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

/* A ray's stay in a medium: 0 <= t0 < t1 <= tmax, in units of |d|; false when it stays out. Conservative by nothing: a
 * ray that only touches the box stays out. d is not 0; tmax may be INFINITY, and so may t1 then. */
bool lum_medium_clip(const struct lum_medium *m, struct lum_vec3 o, struct lum_vec3 d, float tmax, float *ret_t0,
                     float *ret_t1);

/* Infinitely far through what does not dim in this colour is no depth. */
static inline float lum_optical_depth(float sigma, float length)
{
    return sigma > 0.0f ? sigma * length : 0.0f;
}
/* What is left of light after the segment o + t d, 0 <= t <= tmax, d unit, through all media of the snapshot. Exactly 1
 * on a segment that meets none, 0 after an infinite one in a medium that dims. */
struct lum_rgb lum_media_transmittance(const struct lum_snapshot *s, struct lum_vec3 o, struct lum_vec3 d, float tmax);

/* Phase function, 1/sr; cos between the direction light travels in and the one it is scattered to. */
float lum_phase_hg(float g, float cos_theta);

/* ---- distances along a ray, to sample what a light scatters into it ---- */

/* All segments here are finite. Evenly over the angle under which a light at p sees the segment (Kulla & Fajardo 2012):
 * pdf ~ 1 / r^2 cancels what makes the halo of a light bright. */
struct lum_equiangular {
    float t0, t1;  /* of the segment */
    float nearest; /* t where the ray passes the light */
    float miss;    /* distance from the light there; at least LUM_POINT_LIGHT_NEAR and 2^-20 of the distance from t0 to
                    * the light, which is about what float knows of it */
    float angle;   /* of the segment as seen from the light */
};
struct lum_segment {
    struct lum_vec3 o, d; /* d unit */
    float t0, t1;
};
/* Narrows the segment to the part that a light can shine on: the cone of a spot, the front of a panel. False: none. */
bool lum_light_reaches(const struct lum_light *l, struct lum_segment *inout_segment);
struct lum_equiangular lum_equiangular_init(const struct lum_segment *segment, struct lum_vec3 light);
float lum_equiangular_sample(const struct lum_equiangular *e, float u);
float lum_equiangular_pdf(const struct lum_equiangular *e, float t);

/* As light is dimmed: pdf ~ exp(-sigma s) over 0 <= s <= length; evenly where it is not. */
float lum_exponential_sample(float sigma, float length, float u);
float lum_exponential_pdf(float sigma, float length, float s);

/* ---- one sample of single scattering ---- */

/* In the given medium and from the given light, on the way that a ray goes before it meets a surface at tmax. */
struct lum_scatter_query {
    const struct lum_snapshot *snapshot;
    uint32_t medium, light;
    struct lum_vec3 o, d; /* d unit */
    float tmax;
};
struct lum_scatter {
    struct lum_vec3 p, wi;   /* the point, and unit from there to the light */
    float distance;          /* to the light; INFINITY for directional and environment */
    struct lum_rgb radiance; /* arriving at o, if the light is not hidden from p; over the pdf of the sample */
    float t, pdf;            /* distance from o; pdf of it times that of wi, 0 of lights that nothing else meets */
};
/* The distance is drawn half the time by angle from the light, half the time as light is dimmed, and weighed by the
 * mixture (balance heuristic), so that halos and dense fog behave alike; lights without a place get the latter only.
 * False: no light from there. Its mean over u (in [0, 1)^4) is the integral. Fog beyond LUM_RAY_LIMIT, a million scenes
 * away, is not seen. */
bool lum_medium_scatter(const struct lum_scatter_query *q, struct lum_vec2 u_distance, struct lum_vec2 u_light,
                        struct lum_scatter *ret_scatter);

/* pdf of its distance, where it is t. */
float lum_medium_scatter_pdf(const struct lum_scatter_query *q, float t);

/* The same in two steps, for who draws distances otherwise. The part of the ray that scatters; false: none does. */
bool lum_medium_scatters(const struct lum_scatter_query *q, float *ret_t0, float *ret_t1);
/* At distance t, which was drawn with pdf. */
bool lum_medium_scatter_at(const struct lum_scatter_query *q, float t, float pdf, struct lum_vec2 u_light,
                           struct lum_scatter *ret_scatter);
/* The radiance of that for up to LUM_SCATTER_POINTS distances at once, from a point or a spot light; black where it is
 * false. */
#define LUM_SCATTER_POINTS 8u
void lum_medium_scatter_points(const struct lum_scatter_query *q, uint32_t n, const float *t, const float *pdf,
                               struct lum_rgb *ret_radiance);

#endif

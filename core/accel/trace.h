/* Tracing rays: batches of them, and what they hit.
 *
 * Every ray passes one gate first: origin and direction finite and inside Embree's limits, direction not zero,
 * 0 <= tnear <= tfar, no NaN. Debian's Embree abort()s on such rays, so a ray that fails is not traced, reads as a miss
 * (or as unoccluded) and is counted. A count above 0 is a bug in the caller. */
#ifndef LUM_CORE_ACCEL_TRACE_H
#define LUM_CORE_ACCEL_TRACE_H

#include <stdbool.h>
#include <stdint.h>

#include "core/math/rgb.h"
#include "core/math/vec.h"

struct lum_accel_alpha;
struct lum_accel_panes;
struct lum_accel_top;

/* Components of a ray's origin and direction are at most this. Scene coordinates are about 128 and directions about
 * unit, and instances shrink by at most 2^30 (the scene checked), so object-space rays stay below Embree's own limit
 * of 1.8e18. */
#define LUM_RAY_LIMIT 1e8f
static inline bool lum_ray_can_start(struct lum_vec3 p_scene)
{
    return fabsf(p_scene.x) <= LUM_RAY_LIMIT && fabsf(p_scene.y) <= LUM_RAY_LIMIT && fabsf(p_scene.z) <= LUM_RAY_LIMIT;
}

/* A batch of rays, structure of arrays, at most LUM_RAY_BATCH. Direction need not be unit: t is in units of |d|. */
#define LUM_RAY_BATCH 256
struct lum_rays {
    _Alignas(64) float ox[LUM_RAY_BATCH];
    float oy[LUM_RAY_BATCH], oz[LUM_RAY_BATCH], dx[LUM_RAY_BATCH], dy[LUM_RAY_BATCH], dz[LUM_RAY_BATCH];
    float tnear[LUM_RAY_BATCH], tfar[LUM_RAY_BATCH];
    uint32_t n;
};

/* object: as numbered in accel.h, or LUM_NO_OBJECT for a miss. u, v: barycentric for triangles; 0..1 over the whole
 * quad; disc: offset from the centre in radii along the axes of lum_frame_from_normal(n); sphere: unused. ng: geometric
 * normal by winding, in the object's local space for instances, scene space for shapes (sphere: outward); not unit.
 * Only t < tfar hits are reported; the fields of a miss other than object are undefined. */
struct lum_hits {
    _Alignas(64) float t[LUM_RAY_BATCH];
    float u[LUM_RAY_BATCH], v[LUM_RAY_BATCH];
    float ngx[LUM_RAY_BATCH], ngy[LUM_RAY_BATCH], ngz[LUM_RAY_BATCH];
    uint32_t object[LUM_RAY_BATCH], prim[LUM_RAY_BATCH];
    bool white; /* they are looked at as if all were matt, white, and dark by themselves: what leaves them then is
                   illuminance / pi. Whoever traces says so afterwards: tracing leaves it false */
};

struct lum_trace {
    const struct lum_accel_top *top;
    const struct lum_accel_alpha *alpha; /* NULL: no alpha-mapped material in the scene */
    const struct lum_accel_panes *panes; /* of lum_trace_light; NULL: there are none, or nothing gets through them */
    bool camera;                         /* a ray from the eye: passes hidden shapes */
    /* Closest hits of primary rays: neighbours together. Elsewhere the flag hurts, and any-hit queries
     * ignore it: Embree 3.13.5 as Debian builds it never returns from rtcOccluded16 with it on well-formed packets,
     * when there are instances and AVX-512. */
    bool coherent;
    uint64_t *bad_rays; /* incremented for each ray that the gate refused; the caller's own counter */
};

/* 16-wide inside; any n. Thread: any, concurrently. */
void lum_trace_closest(const struct lum_trace *trace, const struct lum_rays *rays, struct lum_hits *ret_hits);
/* occluded[i] = 1 when something lies in (tnear, tfar). */
void lum_trace_any(const struct lum_trace *trace, const struct lum_rays *rays, uint8_t ret_occluded[LUM_RAY_BATCH]);
/* The same of light: panes do not occlude, and ret_left[i] is what those in (tnear, tfar) leave of it; 1, exactly,
 * where there is none. Undefined where something else occludes, and wherever trace->panes is NULL: then this is
 * lum_trace_any.
 *
 * A pane is counted once however many of its triangles a ray meets: of one instance hits count as one that are no
 * further apart than LUM_RAY_OFFSET across the surface, as a path that goes on from the first would leave the others
 * behind. So a ray through an edge that triangles share (which both may report) is dimmed as one beside it. This looks
 * back on the last LUM_PANES_KEPT panes of a ray, in whatever order they are met. */
#define LUM_PANES_KEPT 8u
void lum_trace_light(const struct lum_trace *trace, const struct lum_rays *rays, uint8_t ret_occluded[LUM_RAY_BATCH],
                     struct lum_rgb ret_left[LUM_RAY_BATCH]);

/* Moves p off the surface along unit normal n (towards the side of the ray to be shot), so that tnear = 0 finds no
 * self-hit.
 *
 * What has to be outrun is the rounding of local -> scene -> local, which grows with the scene's coordinates and not
 * with those of p: a wall's corner may lie at 0. Scene coordinates are at most 2^7, where neighbouring floats are 2^-17
 * apart; the offset is 16 of these. Measured over 1.4 million hits on rotated and stretched instances: 2^-16 is the
 * least that leaves no self-hit (numeric.trace), where Waechter & Binder's 256 ulps of each component leave some near
 * the axes and reach eight times as far elsewhere. In a room of 10 m it is 0.02 mm. */
#define LUM_RAY_OFFSET 0x1p-13f
static inline struct lum_vec3 lum_ray_offset(struct lum_vec3 p_scene, struct lum_vec3 n)
{
    return lum_v3_mad(p_scene, n, LUM_RAY_OFFSET);
}

#endif

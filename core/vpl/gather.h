/* Summing virtual point lights at points. */
#ifndef LUM_CORE_VPL_GATHER_H
#define LUM_CORE_VPL_GATHER_H

#include <math.h>
#include <stdbool.h>
#include <stdint.h>

#include "core/accel/trace.h"
#include "core/math/rgb.h"
#include "core/math/vec.h"

struct lum_counters;
struct lum_snapshot;
struct lum_vpl_set;

/* How the geometry term g = cos cos / r^2 is kept from growing without limit near a VPL. */
enum lum_bound_kind {
    LUM_BOUND_NONE,
    LUM_BOUND_THESIS, /* equations 6.2.2 and 6.2.3: fades to 0 below 0.8 min_distance (NOTES R1) */
    LUM_BOUND_CLAMP,  /* min(g, 1 / min_distance^2) */
    LUM_BOUND_SMOOTH, /* 1 / (r^2 + min_distance^2) */
};
struct lum_bound {
    enum lum_bound_kind kind;
    float min_distance; /* scene units */
};

/* What methods use. The thesis bounds the geometry term by a constant (min(g, 1 / d^2), "as in [PH04]") that it does
 * not give. Here d is a multiple of the radius of the area that one VPL stands for: it falls as their number grows, and
 * the sum converges. Of 1/2, 1 and 2 the last had the least error on the built-in scenes with 256. */
static inline struct lum_bound lum_vpl_bound(float spacing)
{
    return (struct lum_bound){LUM_BOUND_CLAMP, 2.0f * spacing};
}

/* Points that gather: at most LUM_RAY_BATCH. n: the shading normal; ng: geometric, on the viewer's side. */
struct lum_gather_points {
    uint32_t n_points;
    struct lum_vec3 p[LUM_RAY_BATCH], n[LUM_RAY_BATCH], ng[LUM_RAY_BATCH];
};
struct lum_gather {
    const struct lum_snapshot *snapshot;
    const struct lum_vpl_set *set;
    const uint32_t *slots; /* the VPLs to gather from */
    uint32_t n_slots;
    struct lum_bound bound;
    bool media; /* light is dimmed by the snapshot's media between VPL and point */
    bool panes; /* and by its panes; else they hide the VPL */
    const struct lum_gather_points *points;
    struct lum_rgb *irradiance; /* by point: added to, and not scaled: the sum over `slots` */
    uint16_t *missed;           /* by point: added to, VPLs that are occluded (listing 5.2). NULL: not wanted */
    float *terms;   /* n_slots rows of n_points: bounded geometry terms, negative where the VPL is occluded, 0
                     * where it faces away; LUM_VPL_UNKNOWN where it is black, and no ray asked. NULL: not wanted */
    uint32_t *left; /* likewise, terms > 0: what panes leave (lum_transmittance_pack). NULL: not wanted */
    struct lum_counters *counters; /* rays as LUM_RAY_INDIRECT_DIFFUSE */
};
#define LUM_VPL_UNKNOWN (-INFINITY)
/* All points against each VPL in turn, so that a packet's rays end in one place. Thread: any. */
void lum_vpl_gather(const struct lum_gather *job);

/* Nearer than this there is no room for an occluder between the two ends, each of which is moved off its surface by
 * LUM_RAY_OFFSET: the ray would run backwards. */
#define LUM_VPL_TOUCHING (4.0f * LUM_RAY_OFFSET)

/* Ray of visibility from a point to a VPL, both moved off their surfaces: 0 <= t <= 1. */
static inline void lum_vpl_push_ray(struct lum_rays *rays, struct lum_vec3 from, struct lum_vec3 target)
{
    uint32_t r = rays->n++;
    rays->ox[r] = from.x, rays->oy[r] = from.y, rays->oz[r] = from.z;
    rays->dx[r] = target.x - from.x, rays->dy[r] = target.y - from.y, rays->dz[r] = target.z - from.z;
    rays->tnear[r] = 0.0f;
    rays->tfar[r] = 1.0f;
}

#endif

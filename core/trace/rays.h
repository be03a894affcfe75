/* Batches of rays through a scene, and who counts them. */
#ifndef LUM_CORE_TRACE_RAYS_H
#define LUM_CORE_TRACE_RAYS_H

#include "core/accel/trace.h"
#include "core/scene/snapshot.h"
#include "core/trace/effect.h"

/* Counters of one worker; summed after the pass, so that no worker touches another's cache line. */
struct lum_counters {
    _Alignas(LUM_CACHE_LINE) uint64_t rays[LUM_RAY_KIND_COUNT];
    uint64_t tiles[LUM_EFFECT_COUNT];
    int64_t ns[LUM_EFFECT_COUNT];
    uint64_t nonfinite, bad_rays;
    double culled_bound; /* the largest, and not the sum */
    uint32_t worker;     /* whose they are */
};

static inline struct lum_trace lum_trace_of(const struct lum_snapshot *s, struct lum_counters *counters)
{
    return (struct lum_trace){.top = s->top, .alpha = s->has_alpha ? &s->alpha : NULL, .bad_rays = &counters->bad_rays};
}
/* Of rays that ask what of a light arrives, for lum_trace_light. panes: some of it may go through glass. */
static inline struct lum_trace lum_trace_of_light(const struct lum_snapshot *s, struct lum_counters *counters,
                                                  bool panes)
{
    struct lum_trace trace = lum_trace_of(s, counters);
    trace.panes = panes && s->has_panes ? &s->panes : NULL;
    return trace;
}
/* Of rays that start at the eye, neighbours together. */
static inline struct lum_trace lum_trace_of_eye(const struct lum_snapshot *s, struct lum_counters *counters)
{
    struct lum_trace trace = lum_trace_of(s, counters);
    trace.camera = trace.coherent = true;
    return trace;
}

static inline void lum_rays_push(struct lum_rays *r, struct lum_vec3 o, struct lum_vec3 d, float tfar)
{
    uint32_t i = r->n++;
    r->ox[i] = o.x;
    r->oy[i] = o.y;
    r->oz[i] = o.z;
    r->dx[i] = d.x;
    r->dy[i] = d.y;
    r->dz[i] = d.z;
    r->tnear[i] = 0.0f;
    r->tfar[i] = tfar;
}

static inline struct lum_vec3 lum_rays_direction(const struct lum_rays *r, uint32_t i)
{
    return lum_v3(r->dx[i], r->dy[i], r->dz[i]);
}

/* A shadow ray from p on a surface (normal ng; 0 0 0: p is in the air) to a light at distance along wi; false when
 * there is no room for an occluder between the two. */
bool lum_shadow_ray(struct lum_rays *rays, struct lum_vec3 p, struct lum_vec3 ng, struct lum_vec3 wi, float distance);

#endif

#include "core/cache/proximity.h"

#include "core/render/frame.h"

#define RAYS LUM_PROXIMITY_RAYS

/* Ray i of a spiral that covers the hemisphere evenly by solid angle, turned by the golden ratio from each to the next.
 * It is the same everywhere, so that the distance changes no more than the point does. */
static struct lum_vec3 spiral(uint32_t i)
{
    const float golden = 0.618033989f;
    float z = ((float)i + 0.5f) / (float)RAYS, r = sqrtf(1.0f - z * z);
    float angle = 2.0f * LUM_PI * golden * (float)i;
    return lum_v3(r * cosf(angle), r * sinf(angle), z);
}

static void push_rays(struct lum_rays *rays, const struct lum_receiver *at, float limit)
{
    struct lum_frame frame = lum_frame_from_normal(at->ng);
    struct lum_vec3 o = lum_ray_offset(at->p, at->ng);
    for (uint32_t i = 0; i < RAYS; i++)
        lum_rays_push(rays, o, lum_frame_to_scene(&frame, spiral(i)), limit);
}

void lum_proximity(const struct lum_snapshot *s, const struct lum_receiver *points, uint32_t n, float limit,
                   struct lum_counters *counters, float *ret_distance)
{
    struct lum_rays rays;
    struct lum_hits hits;
    rays.n = 0;
    for (uint32_t i = 0; i < n; i++)
        push_rays(&rays, &points[i], limit);
    struct lum_trace trace = lum_trace_of(s, counters);
    lum_trace_closest(&trace, &rays, &hits);
    counters->rays[LUM_RAY_INDIRECT_DIFFUSE] += rays.n;
    for (uint32_t i = 0; i < n; i++) {
        float sum = 0.0f;
        for (uint32_t k = i * RAYS; k < (i + 1) * RAYS; k++)
            sum += 1.0f / lum_max(hits.object[k] == LUM_NO_OBJECT ? limit : hits.t[k], LUM_RAY_OFFSET);
        ret_distance[i] = lum_min((float)RAYS / sum, limit);
    }
}

#include "core/measure/clearance.h"

#include "core/math/sampler.h"
#include "core/math/warp.h"
#include "core/scene/surface.h"
#include "core/trace/rays.h"

/* Directions: more find narrower gaps, and are rays; a quarter of them may leave a body. Steps of a walk: more find
 * ways out round more bends, and each is as many rays again. */
enum { DIRECTIONS = 128, BACKS = DIRECTIONS * 3 / 4, STEPS = 6 };

/* Does it stop light, and give none? */
static bool is_opaque(const struct lum_snapshot *s, const struct lum_surface *at)
{
    if (at->instance == LUM_NO_OBJECT || at->light != LUM_NO_OBJECT)
        return false;
    const struct lum_material *m = &s->materials[at->material];
    return !(m->transmission > 0.0f) && m->alpha_mode == LUM_ALPHA_OPAQUE;
}

static void trace(const struct lum_snapshot *s, const struct lum_rays *rays, struct lum_hits *hits)
{
    struct lum_counters counters = {0};
    struct lum_trace how = lum_trace_of(s, &counters);
    lum_trace_closest(&how, rays, hits);
}

/* Evenly over the sphere: a spiral in steps of the golden angle. */
static struct lum_vec3 direction(uint32_t i)
{
    float z = 1.0f - (2.0f * (float)i + 1.0f) / DIRECTIONS, r = sqrtf(lum_max(1.0f - z * z, 0.0f));
    float phi = 2.39996323f * (float)i;
    return lum_v3(r * cosf(phi), z, r * sinf(phi));
}

static bool is_thin(const struct lum_snapshot *s, const struct lum_bounds *b)
{
    const struct lum_vec3 size = lum_v3_sub(b->hi, b->lo), all = lum_v3_sub(s->bounds_hi, s->bounds_lo);
    float limit = (float)(LUM_BODY_M * s->norm.scale);
    return size.x < lum_min(limit, 0.5f * all.x) || size.y < lum_min(limit, 0.5f * all.y) ||
           size.z < lum_min(limit, 0.5f * all.z);
}

static bool is_covered(const struct lum_snapshot *s, struct lum_vec3 p, struct lum_vec3 n)
{
    struct lum_rays ray = {.n = 0};
    struct lum_hits hit;
    struct lum_surface at;
    lum_rays_push(&ray, p, n, (float)(LUM_CLEARANCE_M * s->norm.scale));
    trace(s, &ray, &hit);
    if (hit.object[0] == LUM_NO_OBJECT)
        return false;
    lum_snapshot_surface(s, &hit, 0, n, &at);
    return is_opaque(s, &at);
}

/* The rays go on from what they met, evenly scattered. False: one left, or met what is not opaque. */
static bool walk_on(const struct lum_snapshot *s, uint32_t step, struct lum_rays *rays, struct lum_bounds *inout_box)
{
    struct lum_hits hits;
    uint32_t n = rays->n;
    trace(s, rays, &hits);
    for (uint32_t i = 0; i < n; i++) {
        struct lum_surface at;
        if (hits.object[i] == LUM_NO_OBJECT)
            return false;
        lum_snapshot_surface(s, &hits, i, lum_rays_direction(rays, i), &at);
        if (!is_opaque(s, &at))
            return false;
        lum_bounds_grow(inout_box, at.p);
        struct lum_sampler sampler = lum_sampler_at(i, 0, 0, 0);
        struct lum_frame frame = lum_frame_from_normal(at.ng);
        struct lum_vec3 on = lum_frame_to_scene(&frame, lum_warp_cosine(lum_sampler_2d(&sampler, step)));
        rays->n = i; /* ray i has been read */
        lum_rays_push(rays, lum_ray_offset(at.p, at.ng), on, INFINITY);
    }
    return true;
}

enum lum_clearance lum_clearance_of(const struct lum_snapshot *s, struct lum_vec3 p, struct lum_vec3 n)
{
    if (!lum_ray_can_start(p))
        return LUM_CLEARANCE_FAR;
    struct lum_rays rays = {.n = 0};
    struct lum_hits hits;
    struct lum_bounds backs = {p, p}, all = {p, p};
    uint32_t n_backs = 0;
    bool sealed = true;
    for (uint32_t i = 0; i < DIRECTIONS; i++)
        lum_rays_push(&rays, p, direction(i), INFINITY);
    trace(s, &rays, &hits);
    for (uint32_t i = 0; i < DIRECTIONS; i++) {
        struct lum_surface at;
        if (hits.object[i] != LUM_NO_OBJECT)
            lum_snapshot_surface(s, &hits, i, lum_rays_direction(&rays, i), &at);
        if (hits.object[i] == LUM_NO_OBJECT || !is_opaque(s, &at)) {
            sealed = false;
            continue;
        }
        lum_bounds_grow(&all, at.p);
        if (!at.backface)
            continue;
        n_backs++;
        lum_bounds_grow(&backs, at.p);
    }
    if (n_backs >= BACKS && is_thin(s, &backs))
        return LUM_CLEARANCE_INSIDE;
    for (uint32_t step = 0; sealed && step < STEPS && is_thin(s, &all); step++)
        sealed = walk_on(s, step, &rays, &all);
    if (sealed && is_thin(s, &all))
        return LUM_CLEARANCE_INSIDE;
    return is_covered(s, p, n) ? LUM_CLEARANCE_COVERED : LUM_CLEARANCE_FREE;
}

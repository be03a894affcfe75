/* Sampling what lights emit. */
#include "core/light/emit.h"

#include "core/accel/trace.h"
#include "core/light/environment.h"
#include "core/light/light.h"
#include "core/light/sample.h"
#include "core/math/warp.h"
#include "core/scene/snapshot.h"

#define ONE_MINUS 0x1.fffffep-1f /* the largest float below 1 */

static bool emit(struct lum_vec3 o, struct lum_vec3 d, struct lum_rgb flux, struct lum_light_ray *ret)
{
    if (lum_rgb_black(flux))
        return false;
    *ret = (struct lum_light_ray){o, d, flux};
    return true;
}

/* ---- surfaces ---- */

static bool emit_surface(struct lum_vec3 p, struct lum_vec3 n, struct lum_vec2 u, struct lum_rgb flux,
                         struct lum_light_ray *ret)
{
    struct lum_frame f = lum_frame_from_normal(n);
    return emit(lum_ray_offset(p, n), lum_frame_to_scene(&f, lum_warp_cosine(u)), flux, ret);
}

static bool emit_mesh(const struct lum_snapshot *s, const struct lum_light *l, struct lum_vec2 u_position,
                      struct lum_vec2 u_direction, struct lum_light_ray *ret)
{
    struct lum_emitter_point at;
    if (!lum_emitter_point(s, l, u_position, &at))
        return false;
    if (!l->both_sides)
        return emit_surface(at.p, at.n, u_direction, lum_rgb_scale(at.per_power, LUM_PI * l->area), ret);
    bool front = u_direction.x < 0.5f;
    u_direction.x = lum_min(front ? 2.0f * u_direction.x : 2.0f * u_direction.x - 1.0f, ONE_MINUS);
    return emit_surface(at.p, front ? at.n : lum_v3_neg(at.n), u_direction,
                        lum_rgb_scale(at.per_power, 2.0f * LUM_PI * l->area), ret);
}

/* ---- from afar ---- */

/* The box around all geometry, a little larger, so that its faces are off the surfaces that touch them. */
struct box {
    float centre[3], half[3], face[3]; /* face: area of the two faces across each axis */
};

static struct box box_around(struct lum_vec3 bounds_lo, struct lum_vec3 bounds_hi)
{
    float lo[3] = {bounds_lo.x, bounds_lo.y, bounds_lo.z}, hi[3] = {bounds_hi.x, bounds_hi.y, bounds_hi.z};
    struct box b;
    for (int k = 0; k < 3; k++) {
        b.centre[k] = lo[k] <= hi[k] ? 0.5f * (lo[k] + hi[k]) : 0.0f;
        b.half[k] = (lo[k] <= hi[k] ? 0.5f * (hi[k] - lo[k]) : 0.0f) + 2.0f * LUM_RAY_OFFSET;
    }
    for (int k = 0; k < 3; k++)
        b.face[k] = 4.0f * b.half[(k + 1) % 3] * b.half[(k + 2) % 3];
    return b;
}

/* An axis in proportion to weight; u becomes a fresh number. */
static int pick_axis(const float weight[3], float *inout_u)
{
    float x = *inout_u * (weight[0] + weight[1] + weight[2]), below = 0.0f;
    int k = 0;
    while (k < 2 && !(x < below + weight[k]))
        below += weight[k++];
    *inout_u = lum_clamp((x - below) / weight[k], 0.0f, ONE_MINUS);
    return k;
}

static struct lum_vec3 face_point(const struct box *b, int axis, float side, struct lum_vec2 u)
{
    float at[3];
    int second = (axis + 1) % 3, third = (axis + 2) % 3;
    at[axis] = b->centre[axis] + side * b->half[axis];
    at[second] = b->centre[second] + (2.0f * u.x - 1.0f) * b->half[second];
    at[third] = b->centre[third] + (2.0f * u.y - 1.0f) * b->half[third];
    return lum_v3(at[0], at[1], at[2]);
}

/* Faces of the box as light in direction d sees them. */
static void seen_faces(const struct box *b, const float d[3], float ret_area[3])
{
    for (int k = 0; k < 3; k++)
        ret_area[k] = fabsf(d[k]) * b->face[k];
}

/* Parallel light with this irradiance on a plane that faces it, evenly over the box as it sees it. */
static bool emit_parallel(const struct lum_snapshot *s, struct lum_vec3 d, struct lum_rgb irradiance, struct lum_vec2 u,
                          struct lum_light_ray *ret)
{
    struct box b = box_around(s->bounds_lo, s->bounds_hi);
    float to[3] = {d.x, d.y, d.z}, area[3];
    seen_faces(&b, to, area);
    int axis = pick_axis(area, &u.x);
    return emit(face_point(&b, axis, to[axis] > 0.0f ? -1.0f : 1.0f, u), d,
                lum_rgb_scale(irradiance, area[0] + area[1] + area[2]), ret);
}

static bool emit_environment(const struct lum_snapshot *s, const struct lum_light *l, struct lum_vec2 u_position,
                             struct lum_vec2 u_direction, struct lum_light_ray *ret)
{
    if (l->env) {
        struct lum_vec3 d;
        float pdf;
        if (!lum_env_map_sample(l->env, u_direction, &d, &pdf))
            return false;
        struct lum_rgb irradiance = lum_rgb_scale(lum_env_map_radiance(l->env, d), 1.0f / pdf);
        return emit_parallel(s, lum_v3_neg(lum_frame_to_scene(&l->env_frame, d)), irradiance, u_position, ret);
    }
    /* the lines through a convex body are even where they start evenly on its surface, by the cosine */
    struct box b = box_around(s->bounds_lo, s->bounds_hi);
    int axis = pick_axis(b.face, &u_position.x);
    float side = u_position.y < 0.5f ? -1.0f : 1.0f;
    u_position.y = lum_min(side < 0.0f ? 2.0f * u_position.y : 2.0f * u_position.y - 1.0f, ONE_MINUS);
    struct lum_vec3 inward = lum_v3(axis == 0 ? -side : 0.0f, axis == 1 ? -side : 0.0f, axis == 2 ? -side : 0.0f);
    struct lum_frame f = lum_frame_from_normal(inward);
    return emit(face_point(&b, axis, side, u_position), lum_frame_to_scene(&f, lum_warp_cosine(u_direction)),
                lum_grey(2.0f * LUM_PI * (b.face[0] + b.face[1] + b.face[2])), ret);
}

/* ---- any light ---- */

bool lum_light_emit(const struct lum_snapshot *s, uint32_t i, struct lum_vec2 u_position, struct lum_vec2 u_direction,
                    struct lum_light_ray *ret_shot)
{
    const struct lum_light *l = &s->lights.lights[i];
    struct lum_rgb surface = lum_grey(LUM_PI * l->area);
    struct lum_emitter_point place;
    struct lum_vec3 n;
    switch (l->kind) {
    case LUM_EMIT_POINT:
        return emit(l->p, l->falloff->draw(l, u_direction), lum_grey((float)l->falloff->flux(l)), ret_shot);
    case LUM_EMIT_DIRECTIONAL:
        return emit_parallel(s, l->n, lum_grey(1.0f), u_position, ret_shot);
    case LUM_EMIT_QUAD:
        return emit_surface(
            lum_v3_mad(lum_v3_mad(l->p, l->u, 2.0f * u_position.x - 1.0f), l->v, 2.0f * u_position.y - 1.0f), l->n,
            u_direction, surface, ret_shot);
    case LUM_EMIT_DISC:
        return lum_emitter_point(s, l, u_position, &place) &&
               emit_surface(place.p, place.n, u_direction, surface, ret_shot);
    case LUM_EMIT_SPHERE:
        n = lum_warp_cone(u_position, 2.0f);
        return emit_surface(lum_v3_mad(l->p, n, l->radius), n, u_direction, surface, ret_shot);
    case LUM_EMIT_MESH:
        return emit_mesh(s, l, u_position, u_direction, ret_shot);
    case LUM_EMIT_ENVIRONMENT:
        return emit_environment(s, l, u_position, u_direction, ret_shot);
    }
    return false;
}

double lum_mesh_light_flux(const struct lum_light *l, double area)
{
    return (l->both_sides ? 2.0 : 1.0) * LUM_PI_D * area * (double)l->mean_emission;
}

double lum_light_flux_unit(const struct lum_light *l, struct lum_vec3 bounds_lo, struct lum_vec3 bounds_hi)
{
    struct box b = box_around(bounds_lo, bounds_hi);
    float d[3] = {l->n.x, l->n.y, l->n.z}, area[3];
    switch (l->kind) {
    case LUM_EMIT_POINT:
        return l->falloff->flux(l);
    case LUM_EMIT_DIRECTIONAL:
        seen_faces(&b, d, area);
        return (double)(area[0] + area[1] + area[2]);
    case LUM_EMIT_QUAD:
    case LUM_EMIT_DISC:
    case LUM_EMIT_SPHERE:
        return LUM_PI_D * (double)l->area;
    case LUM_EMIT_MESH:
        return lum_mesh_light_flux(l, (double)l->area);
    case LUM_EMIT_ENVIRONMENT:
        return 2.0 * LUM_PI_D * (double)(b.face[0] + b.face[1] + b.face[2]) *
               (l->env ? lum_env_map_mean_luminance(l->env) : 1.0);
    }
    return 0.0;
}

/* Sampling what lights emit. */
#include "core/light/emitter.h"

#include "core/accel/trace.h"
#include "core/math/warp.h"
#include "core/scene/snapshot.h"

bool lum_emit_ray(struct lum_vec3 o, struct lum_vec3 d, struct lum_rgb flux, struct lum_light_ray *ret)
{
    if (lum_rgb_black(flux))
        return false;
    *ret = (struct lum_light_ray){o, d, flux};
    return true;
}

/* ---- surfaces ---- */

bool lum_emit_surface(struct lum_vec3 p, struct lum_vec3 n, struct lum_vec2 u, struct lum_rgb flux,
                      struct lum_light_ray *ret)
{
    struct lum_frame f = lum_frame_from_normal(n);
    return lum_emit_ray(lum_ray_offset(p, n), lum_frame_to_scene(&f, lum_warp_cosine(u)), flux, ret);
}

/* ---- from afar ---- */

struct lum_emit_box lum_emit_box_around(struct lum_vec3 bounds_lo, struct lum_vec3 bounds_hi)
{
    float lo[3] = {bounds_lo.x, bounds_lo.y, bounds_lo.z}, hi[3] = {bounds_hi.x, bounds_hi.y, bounds_hi.z};
    struct lum_emit_box b;
    for (int k = 0; k < 3; k++) {
        b.centre[k] = lo[k] <= hi[k] ? 0.5f * (lo[k] + hi[k]) : 0.0f;
        b.half[k] = (lo[k] <= hi[k] ? 0.5f * (hi[k] - lo[k]) : 0.0f) + 2.0f * LUM_RAY_OFFSET;
    }
    for (int k = 0; k < 3; k++)
        b.face[k] = 4.0f * b.half[(k + 1) % 3] * b.half[(k + 2) % 3];
    return b;
}

int lum_emit_pick_axis(const float weight[3], float *inout_u)
{
    float x = *inout_u * (weight[0] + weight[1] + weight[2]), below = 0.0f;
    int k = 0;
    while (k < 2 && !(x < below + weight[k]))
        below += weight[k++];
    *inout_u = lum_clamp((x - below) / weight[k], 0.0f, LUM_ONE_MINUS);
    return k;
}

struct lum_vec3 lum_emit_face_point(const struct lum_emit_box *b, int axis, float side, struct lum_vec2 u)
{
    float at[3];
    int second = (axis + 1) % 3, third = (axis + 2) % 3;
    at[axis] = b->centre[axis] + side * b->half[axis];
    at[second] = b->centre[second] + (2.0f * u.x - 1.0f) * b->half[second];
    at[third] = b->centre[third] + (2.0f * u.y - 1.0f) * b->half[third];
    return lum_v3(at[0], at[1], at[2]);
}

void lum_emit_seen_faces(const struct lum_emit_box *b, const float d[3], float ret_area[3])
{
    for (int k = 0; k < 3; k++)
        ret_area[k] = fabsf(d[k]) * b->face[k];
}

bool lum_emit_parallel(const struct lum_snapshot *s, struct lum_vec3 d, struct lum_rgb irradiance, struct lum_vec2 u,
                       struct lum_light_ray *ret)
{
    struct lum_emit_box b = lum_emit_box_around(s->bounds_lo, s->bounds_hi);
    float to[3] = {d.x, d.y, d.z}, area[3];
    lum_emit_seen_faces(&b, to, area);
    int axis = lum_emit_pick_axis(area, &u.x);
    return lum_emit_ray(lum_emit_face_point(&b, axis, to[axis] > 0.0f ? -1.0f : 1.0f, u), d,
                        lum_rgb_scale(irradiance, area[0] + area[1] + area[2]), ret);
}

/* ---- any light ---- */

bool lum_light_emit(const struct lum_snapshot *s, uint32_t i, struct lum_vec2 u_position, struct lum_vec2 u_direction,
                    struct lum_light_ray *ret_shot)
{
    const struct lum_light *l = &s->lights.lights[i];
    return lum_emitters[l->kind]->emit(s, l, u_position, u_direction, ret_shot);
}

double lum_light_flux_unit(const struct lum_light *l, struct lum_vec3 bounds_lo, struct lum_vec3 bounds_hi)
{
    struct lum_emit_box b = lum_emit_box_around(bounds_lo, bounds_hi);
    return lum_emitters[l->kind]->flux(l, &b);
}

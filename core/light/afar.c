/* Light from afar: directional, discs, and environments. */
#include "core/light/emitter.h"

#include "core/accel/trace.h"
#include "core/light/environment.h"
#include "core/math/warp.h"
#include "core/scene/snapshot.h"

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
    *inout_u = lum_clamp((x - below) / weight[k], 0.0f, LUM_ONE_MINUS);
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
    return lum_emit_ray(face_point(&b, axis, to[axis] > 0.0f ? -1.0f : 1.0f, u), d,
                        lum_rgb_scale(irradiance, area[0] + area[1] + area[2]), ret);
}

/* ---- directional ---- */

static bool sample_directional(const struct lum_snapshot *s, const struct lum_light *l, struct lum_vec3 p,
                               struct lum_vec2 u, struct lum_light_sample *ret)
{
    (void)s, (void)p, (void)u;
    *ret = (struct lum_light_sample){lum_v3_neg(l->n), INFINITY, l->power, 0.0f};
    return true;
}

static bool emit_directional(const struct lum_snapshot *s, const struct lum_light *l, struct lum_vec2 u_position,
                             struct lum_vec2 u_direction, struct lum_light_ray *ret)
{
    (void)u_direction;
    return emit_parallel(s, l->n, lum_grey(1.0f), u_position, ret);
}

static double flux_of_directional(const struct lum_light *l, struct lum_vec3 bounds_lo, struct lum_vec3 bounds_hi)
{
    struct box b = box_around(bounds_lo, bounds_hi);
    float d[3] = {l->n.x, l->n.y, l->n.z}, area[3];
    seen_faces(&b, d, area);
    return (double)(area[0] + area[1] + area[2]);
}

const struct lum_emitter_row lum_emitter_directional = {
    .sample = sample_directional, .emit = emit_directional, .flux = flux_of_directional, .from_afar = true};

/* ---- a disc ---- */

/* Square of the sine of the angle that its radius is seen under: a plane that faces radiance 1 from it gets pi times
 * that. */
static float sine_squared(const struct lum_light *l)
{
    float tangent = l->radius / LUM_FAR, t2 = tangent * tangent;
    return t2 / (1.0f + t2);
}

static struct lum_vec3 on_far_disc(const struct lum_light *l, struct lum_vec2 d)
{
    struct lum_frame f = lum_frame_from_normal(l->n);
    return lum_v3_mad(lum_v3_mad(l->p, f.t, l->radius * d.x), f.b, l->radius * d.y);
}

static bool place_on_far_disc(const struct lum_snapshot *s, const struct lum_light *l, struct lum_vec2 u,
                              struct lum_light_place *ret)
{
    (void)s;
    *ret = (struct lum_light_place){on_far_disc(l, lum_warp_disc(u)), l->n, lum_grey(1.0f)};
    return true;
}

static float pdf_of_far_disc(const struct lum_light *l, struct lum_vec3 p, struct lum_vec3 wi, float distance,
                             float cos_light)
{
    (void)p, (void)wi;
    return lum_emitter_area_pdf(distance, cos_light, l->area);
}

/* What of it is below the horizon where it touches it is not cut off: the sun does so for two minutes a day. */
static struct lum_irradiance far_disc_irradiance(const struct lum_light *l, struct lum_vec3 p, struct lum_vec3 n)
{
    (void)p;
    float cosine = lum_max(-lum_dot(l->n, n), 0.0f);
    return (struct lum_irradiance){LUM_PI * sine_squared(l) * cosine, cosine};
}

static bool emit_far_disc(const struct lum_snapshot *s, const struct lum_light *l, struct lum_vec2 u_position,
                          struct lum_vec2 u_direction, struct lum_light_ray *ret)
{
    struct lum_vec3 to = lum_normalize(lum_v3_neg(on_far_disc(l, lum_warp_disc(u_direction))));
    float cosine = lum_dot(to, l->n), distance = LUM_FAR / cosine;
    return emit_parallel(s, to, lum_grey(l->area * cosine / (distance * distance)), u_position, ret);
}

static double flux_of_far_disc(const struct lum_light *l, struct lum_vec3 bounds_lo, struct lum_vec3 bounds_hi)
{
    return LUM_PI_D * (double)sine_squared(l) * flux_of_directional(l, bounds_lo, bounds_hi);
}

static float across_far_disc(const struct lum_light *l)
{
    return l->radius;
}

static struct lum_vec3 hit_on_far_disc(const struct lum_light *l, struct lum_vec2 uv, struct lum_vec3 *inout_ng)
{
    *inout_ng = l->n;
    return on_far_disc(l, uv);
}

const struct lum_emitter_row lum_emitter_far_disc = {.pdf = pdf_of_far_disc,
                                                     .place = place_on_far_disc,
                                                     .emit = emit_far_disc,
                                                     .flux = flux_of_far_disc,
                                                     .irradiance = far_disc_irradiance,
                                                     .across = across_far_disc,
                                                     .shape = LUM_SHAPE_DISC,
                                                     .at = hit_on_far_disc,
                                                     .from_afar = true};

/* ---- environment ---- */

bool lum_environment_sample(const struct lum_light *l, struct lum_vec2 u, struct lum_light_sample *ret)
{
    if (!l->env) {
        *ret = (struct lum_light_sample){lum_warp_cone(u, 2.0f), INFINITY, l->power, 0.25f * LUM_INV_PI};
        return true;
    }
    struct lum_vec3 d;
    float pdf;
    if (!lum_env_map_sample(l->env, u, &d, &pdf))
        return false;
    *ret = (struct lum_light_sample){lum_frame_to_scene(&l->frame, d), INFINITY,
                                     lum_rgb_mul(l->power, lum_env_map_radiance(l->env, d)), pdf};
    return true;
}

/* Luminance of the brightest texel, in means. Where it is less, light comes from more than a sixteenth of the sphere, a
 * disc 58 degrees across: its shadows have no edges that would be lost between records. */
#define EVEN_PEAK 16.0

bool lum_light_is_even_sky(const struct lum_light *l)
{
    return l->kind == LUM_EMIT_ENVIRONMENT && (!l->env || lum_env_map_peak(l->env) <= EVEN_PEAK);
}

struct lum_rgb lum_sky_radiance(const struct lum_light *l, struct lum_vec3 d)
{
    if (!l->env)
        return l->power;
    return lum_rgb_mul(l->power, lum_env_map_radiance(l->env, lum_frame_to_local(&l->frame, d)));
}

static bool sample_environment(const struct lum_snapshot *s, const struct lum_light *l, struct lum_vec3 p,
                               struct lum_vec2 u, struct lum_light_sample *ret)
{
    (void)s, (void)p;
    return lum_environment_sample(l, u, ret);
}

static float pdf_of_environment(const struct lum_light *l, struct lum_vec3 p, struct lum_vec3 wi, float distance,
                                float cos_light)
{
    (void)p, (void)distance, (void)cos_light;
    return l->env ? lum_env_map_pdf(l->env, lum_frame_to_local(&l->frame, wi)) : 0.25f * LUM_INV_PI;
}

static void aim_at_environment(const struct lum_snapshot *s, const struct lum_light *l, struct lum_vec2 u,
                               struct lum_light_target *inout)
{
    (void)s;
    struct lum_light_sample ls;
    if (lum_environment_sample(l, u, &ls))
        *inout = (struct lum_light_target){
            .kind = LUM_TARGET_DIRECTION, .wi = ls.wi, .pdf_sa = ls.pdf_sa, .radiance = ls.radiance};
}

static struct lum_irradiance even_irradiance(const struct lum_light *l, struct lum_vec3 p, struct lum_vec3 n)
{
    (void)l, (void)p, (void)n;
    return (struct lum_irradiance){LUM_PI, 2.0f / 3.0f};
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
        return emit_parallel(s, lum_v3_neg(lum_frame_to_scene(&l->frame, d)), irradiance, u_position, ret);
    }
    /* the lines through a convex body are even where they start evenly on its surface, by the cosine */
    struct box b = box_around(s->bounds_lo, s->bounds_hi);
    int axis = pick_axis(b.face, &u_position.x);
    float side = u_position.y < 0.5f ? -1.0f : 1.0f;
    u_position.y = lum_min(side < 0.0f ? 2.0f * u_position.y : 2.0f * u_position.y - 1.0f, LUM_ONE_MINUS);
    struct lum_vec3 inward = lum_v3(axis == 0 ? -side : 0.0f, axis == 1 ? -side : 0.0f, axis == 2 ? -side : 0.0f);
    struct lum_frame f = lum_frame_from_normal(inward);
    return lum_emit_ray(face_point(&b, axis, side, u_position), lum_frame_to_scene(&f, lum_warp_cosine(u_direction)),
                        lum_grey(2.0f * LUM_PI * (b.face[0] + b.face[1] + b.face[2])), ret);
}

static double flux_of_environment(const struct lum_light *l, struct lum_vec3 bounds_lo, struct lum_vec3 bounds_hi)
{
    struct box b = box_around(bounds_lo, bounds_hi);
    return 2.0 * LUM_PI_D * (double)(b.face[0] + b.face[1] + b.face[2]) *
           (l->env ? lum_env_map_mean_luminance(l->env) : 1.0);
}

const struct lum_emitter_row lum_emitter_environment = {.sample = sample_environment,
                                                        .pdf = pdf_of_environment,
                                                        .aim = aim_at_environment,
                                                        .emit = emit_environment,
                                                        .flux = flux_of_environment,
                                                        .irradiance = even_irradiance,
                                                        .from_afar = true};

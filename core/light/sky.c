/* Environments: light from all around. */
#include "core/light/emitter.h"

#include "core/light/environment.h"
#include "core/math/warp.h"
#include "core/scene/snapshot.h"

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
    *ret = (struct lum_light_sample){lum_frame_to_scene(&l->env_frame, d), INFINITY,
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
    return lum_rgb_mul(l->power, lum_env_map_radiance(l->env, lum_frame_to_local(&l->env_frame, d)));
}

static bool sample_environment(const struct lum_snapshot *s, const struct lum_light *l, struct lum_vec3 p,
                               struct lum_vec2 u, struct lum_light_sample *ret)
{
    (void)s, (void)p;
    return lum_environment_sample(l, u, ret);
}

static float pdf_of_environment(const struct lum_light *l, struct lum_vec3 p, struct lum_vec3 wi,
                                struct lum_vec3 p_light, struct lum_vec3 ng_light)
{
    (void)p, (void)p_light, (void)ng_light;
    return l->env ? lum_env_map_pdf(l->env, lum_frame_to_local(&l->env_frame, wi)) : 0.25f * LUM_INV_PI;
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

static bool emit_environment(const struct lum_snapshot *s, const struct lum_light *l, struct lum_vec2 u_position,
                             struct lum_vec2 u_direction, struct lum_light_ray *ret)
{
    if (l->env) {
        struct lum_vec3 d;
        float pdf;
        if (!lum_env_map_sample(l->env, u_direction, &d, &pdf))
            return false;
        struct lum_rgb irradiance = lum_rgb_scale(lum_env_map_radiance(l->env, d), 1.0f / pdf);
        return lum_emit_parallel(s, lum_v3_neg(lum_frame_to_scene(&l->env_frame, d)), irradiance, u_position, ret);
    }
    /* the lines through a convex body are even where they start evenly on its surface, by the cosine */
    struct lum_emit_box b = lum_emit_box_around(s->bounds_lo, s->bounds_hi);
    int axis = lum_emit_pick_axis(b.face, &u_position.x);
    float side = u_position.y < 0.5f ? -1.0f : 1.0f;
    u_position.y = lum_min(side < 0.0f ? 2.0f * u_position.y : 2.0f * u_position.y - 1.0f, LUM_ONE_MINUS);
    struct lum_vec3 inward = lum_v3(axis == 0 ? -side : 0.0f, axis == 1 ? -side : 0.0f, axis == 2 ? -side : 0.0f);
    struct lum_frame f = lum_frame_from_normal(inward);
    return lum_emit_ray(lum_emit_face_point(&b, axis, side, u_position),
                        lum_frame_to_scene(&f, lum_warp_cosine(u_direction)),
                        lum_grey(2.0f * LUM_PI * (b.face[0] + b.face[1] + b.face[2])), ret);
}

static double flux_of_environment(const struct lum_light *l, const struct lum_emit_box *b)
{
    return 2.0 * LUM_PI_D * (double)(b->face[0] + b->face[1] + b->face[2]) *
           (l->env ? lum_env_map_mean_luminance(l->env) : 1.0);
}

const struct lum_emitter_row lum_emitter_environment = {.sample = sample_environment,
                                                        .pdf = pdf_of_environment,
                                                        .aim = aim_at_environment,
                                                        .emit = emit_environment,
                                                        .flux = flux_of_environment,
                                                        .irradiance = lum_even_sky_irradiance,
                                                        .from_afar = true};

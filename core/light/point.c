/* Lights at a point, whose intensity falls off around an axis. */
#include "core/light/emitter.h"

static bool sample_point(const struct lum_snapshot *s, const struct lum_light *l, struct lum_vec3 p, struct lum_vec2 u,
                         struct lum_light_sample *ret)
{
    (void)s, (void)u;
    struct lum_vec3 d = lum_v3_sub(l->p, p), wi = lum_normalize(d);
    float r = lum_length(d);
    if (!(r > 0.0f))
        return false;
    float share = l->falloff->share(l, wi);
    if (!(share > 0.0f))
        return false;
    float near = lum_max(r, LUM_POINT_LIGHT_NEAR);
    *ret = (struct lum_light_sample){wi, r, lum_rgb_scale(l->power, share / (near * near)), 0.0f};
    return true;
}

static bool emit_point(const struct lum_snapshot *s, const struct lum_light *l, struct lum_vec2 u_position,
                       struct lum_vec2 u_direction, struct lum_light_ray *ret)
{
    (void)s, (void)u_position;
    return lum_emit_ray(l->p, l->falloff->draw(l, u_direction), lum_grey((float)l->falloff->flux(l)), ret);
}

static double flux_of_point(const struct lum_light *l, struct lum_vec3 bounds_lo, struct lum_vec3 bounds_hi)
{
    (void)bounds_lo, (void)bounds_hi;
    return l->falloff->flux(l);
}

static struct lum_vec3 half_point(const struct lum_light *l)
{
    (void)l;
    return lum_v3(0.0f, 0.0f, 0.0f);
}

/* Within a spot's cone, as much anywhere. */
static struct lum_light_reach reach_of_point(const struct lum_light *l)
{
    float omc = l->falloff->cone ? l->omc_outer : 2.0f;
    return (struct lum_light_reach){.centre = l->p,
                                    .axis = l->n,
                                    .cos_faced = 1.0f - omc,
                                    .cos_end = l->falloff->cone ? 1.0f : 0.0f,
                                    .intensity = (float)l->falloff->flux(l) / (2.0f * LUM_PI * omc)};
}

const struct lum_emitter_row lum_emitter_point = {.reach = reach_of_point,
                                                  .sample = sample_point,
                                                  .emit = emit_point,
                                                  .flux = flux_of_point,
                                                  .half = half_point,
                                                  .unit = LUM_POWER_INTENSITY};

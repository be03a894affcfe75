/* Lights without an extent: no ray meets them. */
#include "core/light/emitter.h"

static bool sample_point(const struct lum_snapshot *s, const struct lum_light *l, struct lum_vec3 p, struct lum_vec2 u,
                         struct lum_light_sample *ret)
{
    (void)s, (void)u;
    struct lum_vec3 d = lum_v3_sub(l->p, p), wi = lum_normalize(d);
    float r = lum_length(d);
    if (!(r > 0.0f))
        return false;
    float share = lum_falloff_towards(l, wi);
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

static double flux_of_point(const struct lum_light *l, const struct lum_emit_box *around)
{
    (void)around;
    return l->falloff->flux(l);
}

static struct lum_vec3 half_point(const struct lum_light *l)
{
    (void)l;
    return lum_v3(0.0f, 0.0f, 0.0f);
}

const struct lum_emitter_row lum_emitter_point = {
    .sample = sample_point, .emit = emit_point, .flux = flux_of_point, .half = half_point};

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
    return lum_emit_parallel(s, l->n, lum_grey(1.0f), u_position, ret);
}

static double flux_of_directional(const struct lum_light *l, const struct lum_emit_box *around)
{
    float d[3] = {l->n.x, l->n.y, l->n.z}, area[3];
    lum_emit_seen_faces(around, d, area);
    return (double)(area[0] + area[1] + area[2]);
}

const struct lum_emitter_row lum_emitter_directional = {
    .sample = sample_directional, .emit = emit_directional, .flux = flux_of_directional, .from_afar = true};

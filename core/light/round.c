/* Discs and spheres. */
#include "core/light/emitter.h"

#include "core/math/warp.h"

/* ---- disc ---- */

struct lum_vec3 lum_disc_point(const struct lum_light *l, struct lum_vec2 d)
{
    struct lum_frame f = lum_frame_from_normal(l->n);
    return lum_v3_mad(lum_v3_mad(l->p, f.t, l->radius * d.x), f.b, l->radius * d.y);
}

static struct lum_vec3 draw_point(const struct lum_light *l, struct lum_vec2 u)
{
    return lum_disc_point(l, lum_warp_disc(u));
}

bool lum_disc_place(const struct lum_snapshot *s, const struct lum_light *l, struct lum_vec2 u,
                    struct lum_light_place *ret)
{
    (void)s;
    *ret = (struct lum_light_place){draw_point(l, u), l->n, lum_grey(1.0f)};
    return true;
}

static float pdf_of_disc(const struct lum_light *l, struct lum_vec3 p, struct lum_vec3 wi, float distance,
                         float cos_light)
{
    (void)wi;
    return lum_emitter_in_front(l, p) ? lum_emitter_area_pdf(distance, cos_light, l->area) : 0.0f;
}

static bool emit_disc(const struct lum_snapshot *s, const struct lum_light *l, struct lum_vec2 u_position,
                      struct lum_vec2 u_direction, struct lum_light_ray *ret)
{
    (void)s;
    return lum_emit_surface(draw_point(l, u_position), l->n, u_direction, lum_grey(LUM_PI * l->area), ret);
}

struct lum_vec3 lum_round_half(const struct lum_light *l)
{
    return lum_v3(l->radius, l->radius, l->radius);
}

float lum_round_across(const struct lum_light *l)
{
    return l->radius;
}

struct lum_vec3 lum_disc_at(const struct lum_light *l, struct lum_vec2 uv, struct lum_vec3 *inout_ng)
{
    *inout_ng = l->n;
    return lum_disc_point(l, uv);
}

static struct lum_light_reach reach_of_disc(const struct lum_light *l)
{
    return (struct lum_light_reach){
        .centre = l->p, .radius = l->radius, .axis = l->n, .cos_faced = 1.0f, .intensity = l->area};
}

static struct lum_light_reach reach_of_sphere(const struct lum_light *l)
{
    return (struct lum_light_reach){.centre = l->p,
                                    .radius = l->radius,
                                    .axis = {0.0f, 0.0f, 1.0f},
                                    .cos_faced = -1.0f,
                                    .intensity = LUM_PI * l->radius * l->radius};
}

const struct lum_emitter_row lum_emitter_disc = {.reach = reach_of_disc,
                                                 .pdf = pdf_of_disc,
                                                 .place = lum_disc_place,
                                                 .emit = emit_disc,
                                                 .irradiance = lum_disc_irradiance,
                                                 .across = lum_round_across,
                                                 .shape = &lum_shape_disc,
                                                 .at = lum_disc_at,
                                                 .half = lum_round_half,
                                                 .flat = true};

/* ---- sphere ---- */

/* 1 - cos of the half angle of a sphere's cone, without cancellation; 0 when p is inside. */
static float sphere_one_minus_cos(const struct lum_light *l, struct lum_vec3 p)
{
    float sin_max = l->radius / lum_length(lum_v3_sub(l->p, p)), sin2 = sin_max * sin_max;
    return sin2 < 1.0f ? sin2 / (1.0f + sqrtf(1.0f - sin2)) : 0.0f;
}

static float sphere_pdf(float one_minus_cos)
{
    float pdf = 1.0f / (2.0f * LUM_PI * one_minus_cos);
    return isfinite(pdf) ? pdf : 0.0f;
}

static bool sample_sphere(const struct lum_snapshot *s, const struct lum_light *l, struct lum_vec3 p, struct lum_vec2 u,
                          struct lum_light_sample *ret)
{
    (void)s;
    float omc = sphere_one_minus_cos(l, p), pdf = sphere_pdf(omc);
    if (!(pdf > 0.0f))
        return false;
    struct lum_vec3 d = lum_v3_sub(l->p, p), w = lum_warp_cone(u, omc);
    struct lum_frame f = lum_frame_from_normal(lum_normalize(d));
    float c = lum_length(d), beside = c * c * (w.x * w.x + w.y * w.y);
    float distance = c * w.z - sqrtf(lum_max(l->radius * l->radius - beside, 0.0f));
    *ret = (struct lum_light_sample){lum_frame_to_scene(&f, w), lum_max(distance, 0.0f), l->power, pdf};
    return true;
}

static float even_pdf_of_sphere(const struct lum_light *l, struct lum_vec3 p)
{
    return sphere_pdf(sphere_one_minus_cos(l, p));
}

static float pdf_of_sphere(const struct lum_light *l, struct lum_vec3 p, struct lum_vec3 wi, float distance,
                           float cos_light)
{
    (void)wi, (void)distance, (void)cos_light;
    return even_pdf_of_sphere(l, p);
}

static bool emit_sphere(const struct lum_snapshot *s, const struct lum_light *l, struct lum_vec2 u_position,
                        struct lum_vec2 u_direction, struct lum_light_ray *ret)
{
    (void)s;
    struct lum_vec3 n = lum_warp_cone(u_position, 2.0f);
    return lum_emit_surface(lum_v3_mad(l->p, n, l->radius), n, u_direction, lum_grey(LUM_PI * l->area), ret);
}

static struct lum_vec3 hit_on_sphere(const struct lum_light *l, struct lum_vec2 uv, struct lum_vec3 *inout_ng)
{
    (void)uv;
    *inout_ng = lum_normalize(*inout_ng);
    return lum_v3_mad(l->p, *inout_ng, l->radius);
}

const struct lum_emitter_row lum_emitter_sphere = {.reach = reach_of_sphere,
                                                   .sample = sample_sphere,
                                                   .pdf = pdf_of_sphere,
                                                   .even_pdf = even_pdf_of_sphere,
                                                   .emit = emit_sphere,
                                                   .irradiance = lum_sphere_irradiance,
                                                   .across = lum_round_across,
                                                   .shape = &lum_shape_sphere,
                                                   .at = hit_on_sphere,
                                                   .half = lum_round_half};

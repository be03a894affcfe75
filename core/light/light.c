#include "core/light/light.h"

#include <float.h>

#include "core/light/environment.h"
#include "core/light/irradiance.h"
#include "core/light/rect.h"
#include "core/light/sample.h"
#include "core/material/material.h"
#include "core/math/cdf.h"
#include "core/math/warp.h"
#include "core/scene/snapshot.h"

uint32_t lum_lights_pick(const struct lum_light_table *t, float *inout_u, float *ret_prob)
{
    if (t->n_active == 0)
        return LUM_NO_OBJECT;
    float below;
    uint32_t i = lum_cdf_find(t->active_cdf, t->n_active, *inout_u, &below);
    float width = t->active_cdf[i] - below;
    if (!(width > 0.0f))
        return LUM_NO_OBJECT;
    *inout_u = lum_clamp((*inout_u - below) / width, 0.0f, 0x1.fffffep-1f);
    *ret_prob = t->pick_pdf[t->active[i]];
    return t->active[i];
}

static bool sample_point(const struct lum_light *l, struct lum_vec3 p, struct lum_light_sample *ret)
{
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

/* ---- emitters with area ---- */

/* Solid-angle pdf of a point sampled uniformly over area. 0 when it is not lit from there, or not finite. */
static float area_pdf_sa(float distance, float cos_light, float area)
{
    if (!(cos_light > 0.0f && area > 0.0f))
        return 0.0f;
    float pdf = distance * distance / (cos_light * area);
    return isfinite(pdf) ? pdf : 0.0f;
}

/* Finishes a sample at point x of an emitter that is sampled by area; cos_light is taken on all sides that shine. */
static bool finish_area(const struct lum_light *l, struct lum_vec3 p, struct lum_vec3 x, struct lum_vec3 n,
                        struct lum_light_sample *ret)
{
    struct lum_vec3 d = lum_v3_sub(x, p);
    float distance = lum_length(d);
    struct lum_vec3 wi = lum_v3_mul(d, 1.0f / distance);
    float cos_light = -lum_dot(wi, n);
    if (l->both_sides)
        cos_light = fabsf(cos_light);
    float pdf = area_pdf_sa(distance, cos_light, l->area);
    if (!(pdf > 0.0f))
        return false;
    *ret = (struct lum_light_sample){wi, distance, l->power, pdf};
    return true;
}

/* True when the quad is sampled over solid angle from p: a rectangle (2^-16: the rounding of a rotated one), and not
 * too small. */
static bool quad_view(const struct lum_light *l, struct lum_vec3 p, struct lum_rect_view *ret_view)
{
    float skew = fabsf(lum_dot(l->u, l->v)), size = lum_length(l->u) * lum_length(l->v);
    if (!(size > 0.0f) || skew > 0x1p-16f * size)
        return false;
    struct lum_rect_view view;
    if (!lum_rect_view_init(&view, p, l->p, l->u, l->v) || !(view.solid_angle >= LUM_RECT_MIN_SR))
        return false;
    *ret_view = view;
    return true;
}

static struct lum_vec3 quad_point(const struct lum_light *l, struct lum_vec2 u)
{
    return lum_v3_mad(lum_v3_mad(l->p, l->u, 2.0f * u.x - 1.0f), l->v, 2.0f * u.y - 1.0f);
}

static bool sample_quad_area(const struct lum_light *l, struct lum_vec3 p, struct lum_vec2 u,
                             struct lum_light_sample *ret)
{
    return finish_area(l, p, quad_point(l, u), l->n, ret);
}

static bool sample_rect(const struct lum_light *l, const struct lum_rect_view *view, struct lum_vec2 u,
                        struct lum_light_sample *ret)
{
    struct lum_vec3 d = lum_rect_view_sample(view, u);
    *ret = (struct lum_light_sample){lum_normalize(d), lum_length(d), l->power, (float)(1.0 / view->solid_angle)};
    return ret->distance > 0.0f;
}

static bool in_front_of(const struct lum_light *l, struct lum_vec3 p)
{
    return lum_dot(lum_v3_sub(p, l->p), l->n) > 0.0f;
}

static bool sample_quad(const struct lum_light *l, struct lum_vec3 p, struct lum_vec2 u, struct lum_light_sample *ret)
{
    struct lum_rect_view view;
    if (!in_front_of(l, p))
        return false;
    return quad_view(l, p, &view) ? sample_rect(l, &view, u, ret) : sample_quad_area(l, p, u, ret);
}

static struct lum_vec3 disc_point(const struct lum_light *l, struct lum_vec2 u)
{
    struct lum_frame f = lum_frame_from_normal(l->n);
    struct lum_vec2 d = lum_warp_disc(u);
    return lum_v3_mad(lum_v3_mad(l->p, f.t, l->radius * d.x), f.b, l->radius * d.y);
}

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

static bool sample_sphere(const struct lum_light *l, struct lum_vec3 p, struct lum_vec2 u, struct lum_light_sample *ret)
{
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

static struct lum_vec2 mesh_uv(const struct lum_mesh *mesh, const uint32_t *tri, struct lum_vec2 b)
{
    if (!mesh->uvs)
        return (struct lum_vec2){0.0f, 0.0f};
    const float *a = mesh->uvs + 2 * (size_t)tri[0], *c = mesh->uvs + 2 * (size_t)tri[1];
    const float *d = mesh->uvs + 2 * (size_t)tri[2];
    float w = 1.0f - b.x - b.y;
    return (struct lum_vec2){w * a[0] + b.x * c[0] + b.y * d[0], w * a[1] + b.x * c[1] + b.y * d[1]};
}

/* Towards the front: the side of which the winding is counter-clockwise before a transform that may mirror. */
static struct lum_vec3 front_of(const struct lum_instance *instance, struct lum_vec3 winding)
{
    const float(*m)[4] = instance->local_to_scene.m;
    struct lum_vec3 x = lum_v3(m[0][0], m[1][0], m[2][0]), y = lum_v3(m[0][1], m[1][1], m[2][1]);
    return lum_dot(lum_cross(x, y), lum_v3(m[0][2], m[1][2], m[2][2])) < 0.0f ? lum_v3_neg(winding) : winding;
}

static bool mesh_place(const struct lum_snapshot *s, const struct lum_light *l, struct lum_vec2 u,
                       struct lum_emitter_point *ret)
{
    const struct lum_instance *instance = &s->instances[l->instance];
    const struct lum_mesh *mesh = instance->mesh;
    if (mesh->n_triangles == 0)
        return false;
    float x = u.x * l->tri_cdf[mesh->n_triangles - 1], below;
    uint32_t t = lum_cdf_find(l->tri_cdf, mesh->n_triangles, x, &below);
    float width = l->tri_cdf[t] - below;
    if (!(width > 0.0f))
        return false;
    struct lum_vec2 b = lum_warp_triangle((struct lum_vec2){lum_min((x - below) / width, 1.0f), u.y});
    if (s->has_alpha && !s->alpha.opaque(s->alpha.user, l->instance, t, b.x, b.y))
        return false; /* a hole: no ray would hit the emitter there */

    const uint32_t *tri = mesh->indices + 3 * (size_t)t;
    struct lum_vec3 v[3];
    for (int k = 0; k < 3; k++) {
        const float *q = mesh->positions + 3 * (size_t)tri[k];
        v[k] = lum_affine_point(&instance->local_to_scene, lum_v3(q[0], q[1], q[2]));
    }
    struct lum_vec3 e1 = lum_v3_sub(v[1], v[0]), e2 = lum_v3_sub(v[2], v[0]);
    const struct lum_material *m = &s->materials[instance->material];
    struct lum_rgb per_power = lum_grey(1.0f);
    if (m->emission_tex.image)
        per_power = lum_texture_sample(&m->emission_tex, mesh_uv(mesh, tri, b)).rgb;
    struct lum_vec3 n = lum_normalize(lum_cross(e1, e2));
    *ret = (struct lum_emitter_point){lum_v3_mad(lum_v3_mad(v[0], e1, b.x), e2, b.y),
                                      l->both_sides ? n : front_of(instance, n), per_power};
    return true;
}

bool lum_emitter_point(const struct lum_snapshot *s, const struct lum_light *l, struct lum_vec2 u,
                       struct lum_emitter_point *ret)
{
    if (l->kind == LUM_EMIT_MESH)
        return mesh_place(s, l, u, ret);
    if (l->kind != LUM_EMIT_DISC)
        return false;
    *ret = (struct lum_emitter_point){disc_point(l, u), l->n, lum_grey(1.0f)};
    return true;
}

bool lum_light_sample_place(const struct lum_light *l, struct lum_vec3 p, const struct lum_emitter_point *place,
                            struct lum_light_sample *ret)
{
    if (!finish_area(l, p, place->p, place->n, ret))
        return false;
    ret->radiance = lum_rgb_mul(l->power, place->per_power);
    return true;
}

static bool sample_by_place(const struct lum_snapshot *s, const struct lum_light *l, struct lum_vec3 p,
                            struct lum_vec2 u, struct lum_light_sample *ret)
{
    struct lum_emitter_point place;
    return lum_emitter_point(s, l, u, &place) && lum_light_sample_place(l, p, &place, ret);
}

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

static struct lum_rgb environment_radiance(const struct lum_light *l, struct lum_vec3 d)
{
    if (!l->env)
        return l->power;
    return lum_rgb_mul(l->power, lum_env_map_radiance(l->env, lum_frame_to_local(&l->env_frame, d)));
}

struct lum_rgb lum_lights_background(const struct lum_light_table *t, struct lum_vec3 d, bool camera_ray)
{
    if (t->environment == LUM_NO_OBJECT)
        return lum_grey(0.0f);
    const struct lum_light *l = &t->lights[t->environment];
    if (!l->on || (camera_ray && !l->camera_visible))
        return lum_grey(0.0f);
    return environment_radiance(l, d);
}

/* ---- any light ---- */

bool lum_light_sample_at(const struct lum_snapshot *s, uint32_t i, struct lum_vec3 p, struct lum_vec2 u,
                         struct lum_light_sample *ret_sample)
{
    const struct lum_light *l = &s->lights.lights[i];
    switch (l->kind) {
    case LUM_EMIT_POINT:
        return sample_point(l, p, ret_sample);
    case LUM_EMIT_DIRECTIONAL:
        *ret_sample = (struct lum_light_sample){lum_v3_neg(l->n), INFINITY, l->power, 0.0f};
        return true;
    case LUM_EMIT_QUAD:
        return sample_quad(l, p, u, ret_sample);
    case LUM_EMIT_DISC:
    case LUM_EMIT_MESH:
        return sample_by_place(s, l, p, u, ret_sample);
    case LUM_EMIT_SPHERE:
        return sample_sphere(l, p, u, ret_sample);
    case LUM_EMIT_ENVIRONMENT:
        return lum_environment_sample(l, u, ret_sample);
    }
    return false;
}

/* Squared distance over area from which on a quad is sampled by area. The weights of its samples differ by a third at
 * most. */
#define PLAIN_FROM 2.0f

static bool is_far_quad(const struct lum_light *l, struct lum_vec3 p)
{
    struct lum_vec3 d = lum_v3_sub(p, l->p);
    return l->kind == LUM_EMIT_QUAD && lum_dot(d, d) > PLAIN_FROM * l->area;
}

bool lum_light_sample_plainly(const struct lum_snapshot *s, uint32_t i, struct lum_vec3 p, struct lum_vec2 u,
                              struct lum_light_sample *ret_sample)
{
    const struct lum_light *l = &s->lights.lights[i];
    if (is_far_quad(l, p))
        return sample_quad_area(l, p, u, ret_sample);
    return lum_light_sample_at(s, i, p, u, ret_sample);
}

void lum_light_look(const struct lum_snapshot *s, uint32_t i, struct lum_vec3 p, struct lum_light_view *ret)
{
    const struct lum_light *l = &s->lights.lights[i];
    ret->snapshot = s;
    ret->index = i;
    ret->p = p;
    ret->kind = LUM_VIEW_OTHER;
    if (l->kind != LUM_EMIT_QUAD)
        return;
    if (is_far_quad(l, p))
        ret->kind = LUM_VIEW_AREA;
    else if (!in_front_of(l, p))
        ret->kind = LUM_VIEW_NONE;
    else
        ret->kind = quad_view(l, p, &ret->rect) ? LUM_VIEW_ANGLE : LUM_VIEW_AREA;
}

bool lum_light_view_sample(const struct lum_light_view *v, struct lum_vec2 u, struct lum_light_sample *ret_sample)
{
    const struct lum_light *l = &v->snapshot->lights.lights[v->index];
    switch (v->kind) {
    case LUM_VIEW_NONE:
        return false;
    case LUM_VIEW_AREA:
        return sample_quad_area(l, v->p, u, ret_sample);
    case LUM_VIEW_ANGLE:
        return sample_rect(l, &v->rect, u, ret_sample);
    case LUM_VIEW_OTHER:
        return lum_light_sample_at(v->snapshot, v->index, v->p, u, ret_sample);
    }
    return false;
}

static void quad_weights(const struct lum_light_view *v, struct lum_vec3 n, const struct lum_vec2 *u,
                         float *restrict ret)
{
    const struct lum_light l = v->snapshot->lights.lights[v->index];
    struct lum_vec3 p = v->p;
    for (uint32_t k = 0; k < LUM_LIGHT_WEIGHTS; k++) {
        struct lum_vec3 d = lum_v3_sub(quad_point(&l, u[k]), p);
        float r2 = lum_max(lum_dot(d, d), FLT_MIN), cos_light = lum_max(-lum_dot(d, l.n), 0.0f); /* cosines: times r */
        ret[k] = l.area * (cos_light / r2) * (lum_dot(d, n) / r2);
    }
}

void lum_light_view_weights(const struct lum_light_view *v, struct lum_vec3 n,
                            const struct lum_vec2 u[LUM_LIGHT_WEIGHTS], uint32_t asked,
                            float ret_weight[LUM_LIGHT_WEIGHTS])
{
    if (v->kind == LUM_VIEW_AREA) { /* all of them at once */
        quad_weights(v, n, u, ret_weight);
        return;
    }
    for (uint32_t left = asked; left; left &= left - 1) {
        uint32_t k = (uint32_t)__builtin_ctz(left);
        struct lum_light_sample ls;
        ret_weight[k] = lum_light_view_sample(v, u[k], &ls) ? lum_dot(ls.wi, n) / ls.pdf_sa : 0.0f;
    }
}

static struct lum_light_target aim_at(const struct lum_light *l, struct lum_vec3 p, struct lum_vec3 n)
{
    return (struct lum_light_target){.kind = LUM_TARGET_POINT, .p = p, .n = n, .area = l->area, .radiance = l->power};
}

static void aim_at_place(const struct lum_snapshot *s, const struct lum_light *l, struct lum_vec2 u,
                         struct lum_light_target *inout)
{
    struct lum_emitter_point at;
    if (!lum_emitter_point(s, l, u, &at))
        return;
    *inout = aim_at(l, at.p, at.n);
    inout->both_sides = l->both_sides;
    inout->radiance = lum_rgb_mul(l->power, at.per_power);
}

void lum_light_aim(const struct lum_snapshot *s, uint32_t i, struct lum_vec2 u, struct lum_light_target *ret)
{
    const struct lum_light *l = &s->lights.lights[i];
    struct lum_light_sample ls;
    *ret = (struct lum_light_target){.kind = LUM_TARGET_NONE};
    switch (l->kind) {
    case LUM_EMIT_QUAD:
        *ret = aim_at(l, l->p, l->n);
        ret->kind = LUM_TARGET_QUAD;
        ret->u = l->u, ret->v = l->v;
        ret->near2 = PLAIN_FROM * l->area;
        return;
    case LUM_EMIT_DISC:
    case LUM_EMIT_MESH:
        aim_at_place(s, l, u, ret);
        return;
    case LUM_EMIT_ENVIRONMENT:
        if (lum_environment_sample(l, u, &ls))
            *ret = (struct lum_light_target){
                .kind = LUM_TARGET_DIRECTION, .wi = ls.wi, .pdf_sa = ls.pdf_sa, .radiance = ls.radiance};
        return;
    case LUM_EMIT_POINT:
    case LUM_EMIT_DIRECTIONAL:
    case LUM_EMIT_SPHERE:
        ret->kind = LUM_TARGET_EACH;
        return;
    }
}

float lum_light_even_pdf(const struct lum_snapshot *s, uint32_t i, struct lum_vec3 p)
{
    const struct lum_light *l = &s->lights.lights[i];
    struct lum_rect_view view;
    float far_sr;
    if (l->kind == LUM_EMIT_SPHERE)
        return sphere_pdf(sphere_one_minus_cos(l, p));
    if (l->kind == LUM_EMIT_QUAD && lum_quad_far(l, p, &far_sr) && (double)far_sr >= LUM_RECT_MIN_SR)
        return 1.0f / far_sr;
    return l->kind == LUM_EMIT_QUAD && quad_view(l, p, &view) ? (float)(1.0 / view.solid_angle) : 0.0f;
}

float lum_light_pdf(const struct lum_snapshot *s, uint32_t i, struct lum_vec3 p, struct lum_vec3 wi,
                    struct lum_vec3 p_light, struct lum_vec3 ng_light)
{
    const struct lum_light *l = &s->lights.lights[i];
    float distance = lum_length(lum_v3_sub(p_light, p)), cos_light = fabsf(lum_dot(wi, ng_light));
    struct lum_rect_view view;
    switch (l->kind) {
    case LUM_EMIT_POINT:
    case LUM_EMIT_DIRECTIONAL:
        return 0.0f;
    case LUM_EMIT_QUAD:
        if (!in_front_of(l, p))
            return 0.0f;
        return quad_view(l, p, &view) ? (float)(1.0 / view.solid_angle) : area_pdf_sa(distance, cos_light, l->area);
    case LUM_EMIT_DISC:
        if (!in_front_of(l, p))
            return 0.0f;
        return area_pdf_sa(distance, cos_light, l->area);
    case LUM_EMIT_SPHERE:
        return sphere_pdf(sphere_one_minus_cos(l, p));
    case LUM_EMIT_MESH:
        return area_pdf_sa(distance, cos_light, l->area);
    case LUM_EMIT_ENVIRONMENT:
        return l->env ? lum_env_map_pdf(l->env, lum_frame_to_local(&l->env_frame, wi)) : 0.25f * LUM_INV_PI;
    }
    return 0.0f;
}

float lum_light_plain_pdf(const struct lum_snapshot *s, uint32_t i, struct lum_vec3 p, struct lum_vec3 wi,
                          struct lum_vec3 p_light, struct lum_vec3 ng_light)
{
    const struct lum_light *l = &s->lights.lights[i];
    if (!is_far_quad(l, p))
        return lum_light_pdf(s, i, p, wi, p_light, ng_light);
    if (!in_front_of(l, p))
        return 0.0f;
    return area_pdf_sa(lum_length(lum_v3_sub(p_light, p)), fabsf(lum_dot(wi, ng_light)), l->area);
}

struct lum_rgb lum_light_emitted(const struct lum_light *l, bool backface)
{
    return l->on && !(backface && !l->both_sides) ? l->power : lum_grey(0.0f);
}

static bool same_v3(struct lum_vec3 a, struct lum_vec3 b)
{
    return a.x == b.x && a.y == b.y && a.z == b.z;
}

bool lum_light_same_shape(const struct lum_light *a, const struct lum_light *b)
{
    if (a->env || b->env) /* the address of an image may be reused: it does not say that the image is the same */
        return false;
    return a->kind == b->kind && a->falloff == b->falloff && same_v3(a->p, b->p) && same_v3(a->n, b->n) &&
           same_v3(a->u, b->u) && same_v3(a->v, b->v) && a->radius == b->radius && a->area == b->area &&
           a->omc_inner == b->omc_inner && a->omc_outer == b->omc_outer && a->instance == b->instance &&
           a->shape == b->shape && a->camera_visible == b->camera_visible && a->both_sides == b->both_sides;
}

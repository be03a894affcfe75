/* Quads. Since most lamps are, there are quicker ways to sample them where it does not matter which. */
#include "core/light/emitter.h"

#include <float.h>

#include "core/scene/snapshot.h"

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

struct lum_vec3 lum_quad_point(const struct lum_light *l, struct lum_vec2 u)
{
    return lum_v3_mad(lum_v3_mad(l->p, l->u, 2.0f * u.x - 1.0f), l->v, 2.0f * u.y - 1.0f);
}

static bool sample_quad_area(const struct lum_light *l, struct lum_vec3 p, struct lum_vec2 u,
                             struct lum_light_sample *ret)
{
    return lum_emitter_area_sample(l, p, lum_quad_point(l, u), l->n, ret);
}

static bool sample_rect(const struct lum_light *l, const struct lum_rect_view *view, struct lum_vec2 u,
                        struct lum_light_sample *ret)
{
    struct lum_vec3 d = lum_rect_view_sample(view, u);
    *ret = (struct lum_light_sample){lum_normalize(d), lum_length(d), l->power, (float)(1.0 / view->solid_angle)};
    return ret->distance > 0.0f;
}

static bool sample_quad(const struct lum_snapshot *s, const struct lum_light *l, struct lum_vec3 p, struct lum_vec2 u,
                        struct lum_light_sample *ret)
{
    (void)s;
    struct lum_rect_view view;
    if (!lum_emitter_in_front(l, p))
        return false;
    return quad_view(l, p, &view) ? sample_rect(l, &view, u, ret) : sample_quad_area(l, p, u, ret);
}

static float pdf_of_quad(const struct lum_light *l, struct lum_vec3 p, struct lum_vec3 wi, float distance,
                         float cos_light)
{
    struct lum_rect_view view;
    (void)wi;
    if (!lum_emitter_in_front(l, p))
        return 0.0f;
    return quad_view(l, p, &view) ? (float)(1.0 / view.solid_angle)
                                  : lum_emitter_area_pdf(distance, cos_light, l->area);
}

static float even_pdf_of_quad(const struct lum_light *l, struct lum_vec3 p)
{
    struct lum_rect_view view;
    float far_sr;
    if (lum_quad_far(l, p, &far_sr) && (double)far_sr >= LUM_RECT_MIN_SR)
        return 1.0f / far_sr;
    return quad_view(l, p, &view) ? (float)(1.0 / view.solid_angle) : 0.0f;
}

/* ---- quicker ---- */

/* Squared distance over area from which on a quad is sampled by area. The weights of its samples differ by a third at
 * most. */
#define PLAIN_FROM 2.0f

static bool is_far_quad(const struct lum_light *l, struct lum_vec3 p)
{
    struct lum_vec3 d = lum_v3_sub(p, l->p);
    return l->kind == &lum_emitter_quad && lum_dot(d, d) > PLAIN_FROM * l->area;
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
    /* Where there is a closed form samples tell what is hidden, and may weigh as they do. */
    if (l->facets && !lum_light_has_irradiance(l) && lum_mesh_look(l, p, &ret->facets))
        ret->kind = LUM_VIEW_FACETS;
    if (l->kind != &lum_emitter_quad)
        return;
    if (is_far_quad(l, p))
        ret->kind = LUM_VIEW_AREA;
    else if (!lum_emitter_in_front(l, p))
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
    case LUM_VIEW_FACETS:
        return lum_mesh_sample(l, v->p, &v->facets, u, ret_sample);
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
        struct lum_vec3 d = lum_v3_sub(lum_quad_point(&l, u[k]), p);
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

float lum_light_plain_pdf(const struct lum_snapshot *s, uint32_t i, struct lum_vec3 p, struct lum_vec3 wi,
                          struct lum_vec3 p_light, struct lum_vec3 ng_light)
{
    const struct lum_light *l = &s->lights.lights[i];
    if (!is_far_quad(l, p))
        return lum_light_pdf(s, i, p, wi, p_light, ng_light);
    if (!lum_emitter_in_front(l, p))
        return 0.0f;
    return lum_emitter_area_pdf(lum_length(lum_v3_sub(p_light, p)), fabsf(lum_dot(wi, ng_light)), l->area);
}

/* ---- the row ---- */

static void aim_quad(const struct lum_snapshot *s, const struct lum_light *l, struct lum_vec2 u,
                     struct lum_light_target *inout)
{
    (void)s, (void)u;
    *inout = lum_emitter_target(l, l->p, l->n);
    inout->kind = LUM_TARGET_QUAD;
    inout->u = l->u, inout->v = l->v;
    inout->near2 = PLAIN_FROM * l->area;
}

static bool emit_quad(const struct lum_snapshot *s, const struct lum_light *l, struct lum_vec2 u_position,
                      struct lum_vec2 u_direction, struct lum_light_ray *ret)
{
    (void)s;
    return lum_emit_surface(lum_quad_point(l, u_position), l->n, u_direction, lum_grey(LUM_PI * l->area), ret);
}

struct lum_vec3 lum_quad_half(const struct lum_light *l)
{
    return lum_v3(fabsf(l->u.x) + fabsf(l->v.x), fabsf(l->u.y) + fabsf(l->v.y), fabsf(l->u.z) + fabsf(l->v.z));
}

float lum_quad_across(const struct lum_light *l)
{
    return l->area / (4.0f * fmaxf(lum_length(l->u), lum_length(l->v)));
}

struct lum_vec3 lum_quad_at(const struct lum_light *l, struct lum_vec2 uv, struct lum_vec3 *inout_ng)
{
    *inout_ng = l->n;
    return lum_quad_point(l, uv);
}

static struct lum_light_reach reach_of_quad(const struct lum_light *l)
{
    return (struct lum_light_reach){.centre = l->p,
                                    .radius =
                                        fmaxf(lum_length(lum_v3_add(l->u, l->v)), lum_length(lum_v3_sub(l->u, l->v))),
                                    .axis = l->n,
                                    .cos_faced = 1.0f,
                                    .intensity = l->area};
}

const struct lum_emitter_row lum_emitter_quad = {.sample = sample_quad,
                                                 .pdf = pdf_of_quad,
                                                 .even_pdf = even_pdf_of_quad,
                                                 .aim = aim_quad,
                                                 .emit = emit_quad,
                                                 .irradiances = lum_quad_irradiances,
                                                 .half = lum_quad_half,
                                                 .reach = reach_of_quad,
                                                 .across = lum_quad_across,
                                                 .shape = &lum_shape_quad,
                                                 .at = lum_quad_at,
                                                 .flat = true};

#include "core/light/light.h"

#include "core/light/emitter.h"
#include "core/light/facets.h"
#include "core/math/cdf.h"
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

bool lum_light_is_from_afar(const struct lum_light *l)
{
    return l->kind->from_afar;
}

/* ---- emitters with area ---- */

float lum_emitter_area_pdf(float distance, float cos_light, float area)
{
    if (!(cos_light > 0.0f && area > 0.0f))
        return 0.0f;
    float pdf = distance * distance / (cos_light * area);
    return isfinite(pdf) ? pdf : 0.0f;
}

float lum_emitter_pdf_by_area(const struct lum_light *l, struct lum_vec3 p, struct lum_vec3 wi, float distance,
                              float cos_light)
{
    (void)p, (void)wi;
    return lum_emitter_area_pdf(distance, cos_light, l->area);
}

bool lum_emitter_area_sample(const struct lum_light *l, struct lum_vec3 p, struct lum_vec3 x, struct lum_vec3 n,
                             struct lum_light_sample *ret)
{
    struct lum_vec3 d = lum_v3_sub(x, p);
    float distance = lum_length(d);
    struct lum_vec3 wi = lum_v3_mul(d, 1.0f / distance);
    float cos_light = -lum_dot(wi, n);
    bool hides =
        l->both_sides && cos_light < 0.0f && l->facets && lum_facets_hide_backs(l->facets, lum_v3_sub(p, l->facets_at));
    if (l->both_sides && !hides)
        cos_light = fabsf(cos_light);
    float pdf = lum_emitter_area_pdf(distance, cos_light, l->area);
    if (!(pdf > 0.0f))
        return false;
    *ret = (struct lum_light_sample){wi, distance, l->power, pdf};
    return true;
}

bool lum_light_place(const struct lum_snapshot *s, const struct lum_light *l, struct lum_vec2 u,
                     struct lum_light_place *ret)
{
    const struct lum_emitter_row *row = l->kind;
    return row->place && row->place(s, l, u, ret);
}

bool lum_light_sample_place(const struct lum_light *l, struct lum_vec3 p, const struct lum_light_place *place,
                            struct lum_light_sample *ret)
{
    if (!lum_emitter_area_sample(l, p, place->p, place->n, ret))
        return false;
    ret->radiance = lum_rgb_mul(l->power, place->per_power);
    if (!l->web)
        return true;
    ret->radiance = lum_rgb_scale(ret->radiance, lum_opening_radiance(l, ret->wi));
    return !lum_rgb_black(ret->radiance);
}

bool lum_light_sample_near(const struct lum_light *l, struct lum_vec3 p, struct lum_vec2 u,
                           struct lum_light_sample *ret)
{
    struct lum_facets_view view;
    return lum_mesh_look(l, p, &view) && lum_mesh_sample(l, p, &view, u, ret);
}

static bool sample_by_place(const struct lum_snapshot *s, const struct lum_light *l, struct lum_vec3 p,
                            struct lum_vec2 u, struct lum_light_sample *ret)
{
    struct lum_light_place place;
    if (lum_light_sample_near(l, p, u, ret))
        return true;
    return lum_light_place(s, l, u, &place) && lum_light_sample_place(l, p, &place, ret);
}

struct lum_rgb lum_lights_background(const struct lum_light_table *t, struct lum_vec3 d, bool camera_ray)
{
    if (t->environment == LUM_NO_OBJECT)
        return lum_grey(0.0f);
    const struct lum_light *l = &t->lights[t->environment];
    if (!l->on || (camera_ray && !l->camera_visible))
        return lum_grey(0.0f);
    return lum_sky_radiance(l, d);
}

/* ---- any light ---- */

bool lum_light_sample_at(const struct lum_snapshot *s, uint32_t i, struct lum_vec3 p, struct lum_vec2 u,
                         struct lum_light_sample *ret_sample)
{
    const struct lum_light *l = &s->lights.lights[i];
    const struct lum_emitter_row *row = l->kind;
    return row->sample ? row->sample(s, l, p, u, ret_sample) : sample_by_place(s, l, p, u, ret_sample);
}

struct lum_light_target lum_emitter_target(const struct lum_light *l, struct lum_vec3 p, struct lum_vec3 n)
{
    return (struct lum_light_target){.kind = LUM_TARGET_POINT, .p = p, .n = n, .area = l->area, .radiance = l->power};
}

static void aim_at_place(const struct lum_snapshot *s, const struct lum_light *l, struct lum_vec2 u,
                         struct lum_light_target *inout)
{
    struct lum_light_place at;
    if (!lum_light_place(s, l, u, &at))
        return;
    *inout = lum_emitter_target(l, at.p, at.n);
    inout->both_sides = l->both_sides;
    if (l->facets) {
        inout->near2 = l->facets->near2;
        inout->centre = lum_v3_add(l->facets_at, l->facets->centre);
    }
    inout->radiance = lum_rgb_mul(l->power, at.per_power);
}

void lum_light_aim(const struct lum_snapshot *s, uint32_t i, struct lum_vec2 u, struct lum_light_target *ret)
{
    const struct lum_light *l = &s->lights.lights[i];
    const struct lum_emitter_row *row = l->kind;
    *ret = (struct lum_light_target){.kind = row->aim || row->place ? LUM_TARGET_NONE : LUM_TARGET_EACH};
    if (row->aim)
        row->aim(s, l, u, ret);
    else if (row->place)
        aim_at_place(s, l, u, ret);
}

float lum_light_even_pdf(const struct lum_snapshot *s, uint32_t i, struct lum_vec3 p)
{
    const struct lum_light *l = &s->lights.lights[i];
    const struct lum_emitter_row *row = l->kind;
    return row->even_pdf ? row->even_pdf(l, p) : 0.0f;
}

float lum_light_pdf(const struct lum_snapshot *s, uint32_t i, struct lum_vec3 p, struct lum_vec3 wi,
                    struct lum_vec3 p_light, struct lum_vec3 ng_light)
{
    const struct lum_light *l = &s->lights.lights[i];
    const struct lum_emitter_row *row = l->kind;
    return row->pdf ? row->pdf(l, p, wi, lum_length(lum_v3_sub(p_light, p)), fabsf(lum_dot(wi, ng_light))) : 0.0f;
}

struct lum_rgb lum_light_emitted(const struct lum_light *l, struct lum_vec3 d, bool backface)
{
    if (!l->on || (backface && !l->both_sides))
        return lum_grey(0.0f);
    return l->web ? lum_rgb_scale(l->power, lum_opening_radiance(l, d)) : l->power;
}

static bool same_frame(const struct lum_frame *a, const struct lum_frame *b)
{
    return lum_v3_same(a->t, b->t) && lum_v3_same(a->b, b->b) && lum_v3_same(a->n, b->n);
}

bool lum_light_same_shape(const struct lum_light *a, const struct lum_light *b)
{
    bool image = (a->env && !a->env_hash) || (b->env && !b->env_hash);
    if (image) /* its address may be reused: it does not say that the image is the same */
        return false;
    return a->kind == b->kind && a->falloff == b->falloff && lum_v3_same(a->p, b->p) && lum_v3_same(a->n, b->n) &&
           lum_v3_same(a->u, b->u) && lum_v3_same(a->v, b->v) && a->radius == b->radius && a->area == b->area &&
           a->omc_inner == b->omc_inner && a->omc_outer == b->omc_outer && a->instance == b->instance &&
           a->shape == b->shape && a->web_hash == b->web_hash && a->env_hash == b->env_hash &&
           (!(a->web_hash || a->env_hash) || same_frame(&a->frame, &b->frame)) &&
           a->camera_visible == b->camera_visible && a->both_sides == b->both_sides &&
           !a->facets == !b->facets; /* their address may be gone */
}

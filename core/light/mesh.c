/* Meshes that shine. */
#include "core/light/emitter.h"
#include "core/light/facets.h"

#include "core/math/cdf.h"
#include "core/math/warp.h"
#include "core/scene/snapshot.h"

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
    return lum_affine_mirrors(&instance->local_to_scene) ? lum_v3_neg(winding) : winding;
}

static bool mesh_place(const struct lum_snapshot *s, const struct lum_light *l, struct lum_vec2 u,
                       struct lum_light_place *ret)
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
    *ret = (struct lum_light_place){lum_v3_mad(lum_v3_mad(v[0], e1, b.x), e2, b.y),
                                    l->both_sides ? n : front_of(instance, n), per_power};
    return true;
}

bool lum_mesh_look(const struct lum_light *l, struct lum_vec3 p, struct lum_facets_view *ret)
{
    return l->facets && lum_facets_look(l->facets, l->both_sides, lum_v3_sub(p, l->facets_at), ret);
}

bool lum_mesh_sample(const struct lum_light *l, struct lum_vec3 p, const struct lum_facets_view *view,
                     struct lum_vec2 u, struct lum_light_sample *ret)
{
    struct lum_vec3 d = lum_facets_sample(l->facets, view, lum_v3_sub(p, l->facets_at), u);
    *ret = (struct lum_light_sample){lum_normalize(d), lum_length(d), l->power, (float)(1.0 / view->solid_angle)};
    return true;
}

static float even_pdf_of_mesh(const struct lum_light *l, struct lum_vec3 p)
{
    struct lum_facets_view view;
    return lum_mesh_look(l, p, &view) ? (float)(1.0 / view.solid_angle) : 0.0f;
}

static float pdf_of_mesh(const struct lum_light *l, struct lum_vec3 p, struct lum_vec3 wi, float distance,
                         float cos_light)
{
    float even = even_pdf_of_mesh(l, p);
    (void)wi;
    return even > 0.0f ? even : lum_emitter_area_pdf(distance, cos_light, l->area);
}

static bool has_irradiance(const struct lum_light *l)
{
    return l->facets && l->facets->outlined;
}

static struct lum_irradiance irradiance_of_mesh(const struct lum_light *l, struct lum_vec3 p, struct lum_vec3 n)
{
    return lum_facets_irradiance(l->facets, l->both_sides, lum_v3_sub(p, l->facets_at), n);
}

static bool emit_mesh(const struct lum_snapshot *s, const struct lum_light *l, struct lum_vec2 u_position,
                      struct lum_vec2 u_direction, struct lum_light_ray *ret)
{
    struct lum_light_place at;
    if (!mesh_place(s, l, u_position, &at))
        return false;
    if (!l->both_sides)
        return lum_emit_surface(at.p, at.n, u_direction, lum_rgb_scale(at.per_power, LUM_PI * l->area), ret);
    bool front = u_direction.x < 0.5f;
    u_direction.x = lum_min(front ? 2.0f * u_direction.x : 2.0f * u_direction.x - 1.0f, LUM_ONE_MINUS);
    return lum_emit_surface(at.p, front ? at.n : lum_v3_neg(at.n), u_direction,
                            lum_rgb_scale(at.per_power, 2.0f * LUM_PI * l->area), ret);
}

double lum_mesh_light_flux(const struct lum_light *l, double area)
{
    return (l->both_sides ? 2.0 : 1.0) * LUM_PI_D * area * (double)l->mean_emission;
}

static double flux_of_mesh(const struct lum_light *l, struct lum_vec3 bounds_lo, struct lum_vec3 bounds_hi)
{
    (void)bounds_lo, (void)bounds_hi;
    return lum_mesh_light_flux(l, (double)l->area);
}

const struct lum_emitter_row lum_emitter_mesh = {.pdf = pdf_of_mesh,
                                                 .even_pdf = even_pdf_of_mesh,
                                                 .place = mesh_place,
                                                 .emit = emit_mesh,
                                                 .flux = flux_of_mesh,
                                                 .has_irradiance = has_irradiance,
                                                 .irradiance = irradiance_of_mesh};

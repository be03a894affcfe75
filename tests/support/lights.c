#include "tests/support/lights.h"

#include <math.h>
#include <string.h>

struct lum_vec3 direction(double cos_theta, double phi)
{
    double s = sqrt(fmax(0.0, 1.0 - cos_theta * cos_theta));
    return lum_v3((float)(s * cos(phi)), (float)(s * sin(phi)), (float)cos_theta);
}

struct lum_snapshot snapshot_of(const struct lum_light *l)
{
    return (struct lum_snapshot){.lights = {.lights = l, .n_lights = 1, .environment = LUM_NO_OBJECT}};
}

struct lum_light light(const struct lum_emitter_row *kind)
{
    return (struct lum_light){
        .kind = kind, .falloff = &lum_falloff_even, .power = {1.0f, 1.0f, 1.0f}, .on = true, .n = {0.0f, 0.0f, -1.0f}};
}

struct lum_light spot(void)
{
    struct lum_light l = light(&lum_emitter_point);
    l.falloff = &lum_falloff_spot;
    return l;
}

struct lum_light quad(struct lum_vec3 centre, struct lum_vec3 u, struct lum_vec3 v)
{
    struct lum_light l = light(&lum_emitter_quad);
    struct lum_vec3 n = lum_cross(u, v);
    l.p = centre, l.u = u, l.v = v, l.n = lum_normalize(n), l.area = 4.0f * lum_length(n);
    return l;
}

struct lum_light disc(struct lum_vec3 centre, struct lum_vec3 n, float radius)
{
    struct lum_light l = light(&lum_emitter_disc);
    l.p = centre, l.n = n, l.radius = radius, l.area = LUM_PI * radius * radius;
    return l;
}

struct lum_light sphere(struct lum_vec3 centre, float radius)
{
    struct lum_light l = light(&lum_emitter_sphere);
    l.p = centre, l.radius = radius, l.area = 4.0f * LUM_PI * radius * radius;
    return l;
}

struct lum_vec3 mesh_vertex(const struct mesh_light *m, uint32_t tri, uint32_t k)
{
    const float *q = m->positions + 3 * (size_t)m->indices[3 * tri + k];
    return lum_affine_point(&m->instance.local_to_scene, lum_v3(q[0], q[1], q[2]));
}

struct lum_vec3 mesh_normal(const struct mesh_light *m, uint32_t tri) /* length: twice the area */
{
    struct lum_vec3 a = mesh_vertex(m, tri, 0);
    return lum_cross(lum_v3_sub(mesh_vertex(m, tri, 1), a), lum_v3_sub(mesh_vertex(m, tri, 2), a));
}

void mesh_light_init(struct mesh_light *m)
{
    static const float positions[15] = {0, 0, 0, 1, 0, 0.2f, 0, 1, 0, 1.5f, 1, 0.5f, 2, 0, 0.4f};
    static const uint32_t indices[9] = {0, 1, 2, 0, 1, 4, 1, 3, 2}; /* 0, 1 and 4 are in line */
    memset(m, 0, sizeof *m);
    memcpy(m->positions, positions, sizeof positions);
    memcpy(m->indices, indices, sizeof indices);
    m->mesh.positions = m->positions, m->mesh.indices = m->indices, m->mesh.n_vertices = 5, m->mesh.n_triangles = 3;
    m->instance =
        (struct lum_instance){.mesh = &m->mesh, .local_to_scene = {{{2, 0, 0, 1}, {0, 1, 0, 0}, {0, 0, 1, 3}}}};
    m->light = light(&lum_emitter_mesh);
    m->light.both_sides = true, m->light.mean_emission = 1.0f;
    for (uint32_t t = 0; t < 3; t++)
        m->tri_cdf[t] = m->light.area += t == 1 ? 0.0f : 0.5f * lum_length(mesh_normal(m, t));
    m->light.tri_cdf = m->tri_cdf;
    struct lum_vec3 corner[3][3];
    m->light.facets_at = lum_v3(1, 0, 3);
    for (uint32_t t = 0; t < 3; t++)
        for (uint32_t k = 0; k < 3; k++)
            corner[t][k] = lum_v3_sub(mesh_vertex(m, t, k), m->light.facets_at);
    lum_facets_init(&m->facets, 3, (const struct lum_vec3(*)[3])corner, false);
    m->snapshot = snapshot_of(&m->light);
    m->snapshot.instances = &m->instance, m->snapshot.n_instances = 1;
    m->snapshot.materials = &m->material, m->snapshot.n_materials = 1;
}

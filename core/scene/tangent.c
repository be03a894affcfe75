/* Tangents of a mesh with uv: along growing u, of each vertex the mean of the triangles around it, weighted by the
 * angle that each has there, as the mean normal of a corner is. So brushed metal is as smooth as its mesh: from the uv
 * of a triangle alone, lines would break at its edges.
 *
 * They are made when a brushed material first asks for them, by whoever commits the scene. Snapshots that were
 * published before have none of the mesh that asks, and do not look at them. */
#include <math.h>
#include <string.h>

#include "core/scene/parts.h"
#include "core/scene/snapshot.h"

static struct lum_vec3 load(const float *array, uint32_t i)
{
    return lum_v3(array[3 * (size_t)i], array[3 * (size_t)i + 1], array[3 * (size_t)i + 2]);
}

/* Unit, or 0 where uv spans no area. */
static struct lum_vec3 along_u(const struct lum_mesh *m, const uint32_t *t)
{
    const float *a = m->uvs + 2 * (size_t)t[0], *b = m->uvs + 2 * (size_t)t[1], *c = m->uvs + 2 * (size_t)t[2];
    float u1 = b[0] - a[0], v1 = b[1] - a[1], u2 = c[0] - a[0], v2 = c[1] - a[1], area = u1 * v2 - u2 * v1;
    struct lum_vec3 p = load(m->positions, t[0]);
    struct lum_vec3 e1 = lum_v3_sub(load(m->positions, t[1]), p), e2 = lum_v3_sub(load(m->positions, t[2]), p);
    struct lum_vec3 d = lum_normalize(lum_v3_sub(lum_v3_mul(e1, v2), lum_v3_mul(e2, v1)));
    if (!(fabsf(area) > 0.0f) || !lum_v3_finite(d))
        return lum_v3(0.0f, 0.0f, 0.0f);
    return area < 0.0f ? lum_v3_neg(d) : d;
}

static void add_corner(struct lum_mesh *m, float *sum, const uint32_t *t, int k, struct lum_vec3 d)
{
    struct lum_vec3 p = load(m->positions, t[k]);
    struct lum_vec3 e = lum_normalize(lum_v3_sub(load(m->positions, t[(k + 1) % 3]), p));
    struct lum_vec3 f = lum_normalize(lum_v3_sub(load(m->positions, t[(k + 2) % 3]), p));
    float angle = acosf(lum_clamp(lum_dot(e, f), -1.0f, 1.0f));
    if (m->normals) {
        struct lum_vec3 n = load(m->normals, t[k]);
        d = lum_normalize(lum_v3_mad(d, n, -lum_dot(d, n)));
    }
    if (!lum_v3_finite(d) || !isfinite(angle))
        return;
    sum[0] += angle * d.x;
    sum[1] += angle * d.y;
    sum[2] += angle * d.z;
}

bool lum_mesh_make_tangents(struct lum_mesh *m)
{
    if (!m->uvs || m->tangents)
        return true;
    float *sum = lum_calloc(m->n_vertices, 3 * sizeof *sum);
    if (!sum)
        return false;
    for (uint32_t i = 0; i < m->n_triangles; i++) {
        const uint32_t *t = m->indices + 3 * (size_t)i;
        struct lum_vec3 d = along_u(m, t);
        for (int k = 0; k < 3 && lum_dot(d, d) > 0.0f; k++)
            add_corner(m, sum + 3 * (size_t)t[k], t, k, d);
    }
    for (uint32_t i = 0; i < m->n_vertices; i++) {
        struct lum_vec3 t = lum_normalize(load(sum, i));
        memcpy(sum + 3 * (size_t)i, &t, 3 * sizeof *sum);
    }
    m->tangents = sum;
    return true;
}

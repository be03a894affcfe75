/* Tangents of a mesh with uv: along growing u, of each vertex the mean of the triangles around it, weighted by the
 * angle that each has there, as the mean normal of a corner is. So brushed metal is as smooth as its mesh: from the uv
 * of a triangle alone, lines would break at its edges.
 *
 * They are made when a brushed material first asks for them, by whoever commits the scene. Snapshots that were
 * published before have none of the mesh that asks, and do not look at them. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/scene/parts.h"
#include "core/scene/snapshot.h"

/* Unit, or 0 where uv spans no area. */
static struct lum_vec3 along_u(const struct lum_mesh *m, const uint32_t *t)
{
    const float *a = m->uvs + 2 * (size_t)t[0], *b = m->uvs + 2 * (size_t)t[1], *c = m->uvs + 2 * (size_t)t[2];
    float u1 = b[0] - a[0], v1 = b[1] - a[1], u2 = c[0] - a[0], v2 = c[1] - a[1], area = u1 * v2 - u2 * v1;
    struct lum_vec3 p = lum_v3_load(m->positions, t[0]);
    struct lum_vec3 e1 = lum_v3_sub(lum_v3_load(m->positions, t[1]), p),
                    e2 = lum_v3_sub(lum_v3_load(m->positions, t[2]), p);
    struct lum_vec3 d = lum_normalize(lum_v3_sub(lum_v3_mul(e1, v2), lum_v3_mul(e2, v1)));
    if (!(fabsf(area) > 0.0f) || !lum_v3_finite(d))
        return lum_v3(0.0f, 0.0f, 0.0f);
    return area < 0.0f ? lum_v3_neg(d) : d;
}

static void add_corner(struct lum_mesh *m, float *sum, const uint32_t *t, int k, struct lum_vec3 d)
{
    struct lum_vec3 p = lum_v3_load(m->positions, t[k]);
    struct lum_vec3 e = lum_normalize(lum_v3_sub(lum_v3_load(m->positions, t[(k + 1) % 3]), p));
    struct lum_vec3 f = lum_normalize(lum_v3_sub(lum_v3_load(m->positions, t[(k + 2) % 3]), p));
    float angle = acosf(lum_clamp(lum_dot(e, f), -1.0f, 1.0f));
    if (m->normals) {
        struct lum_vec3 n = lum_v3_load(m->normals, t[k]);
        d = lum_normalize(lum_v3_mad(d, n, -lum_dot(d, n)));
    }
    if (!lum_v3_finite(d) || !isfinite(angle))
        return;
    sum[0] += angle * d.x;
    sum[1] += angle * d.y;
    sum[2] += angle * d.z;
}

/* ---- seams ---- */

/* Where uv begins anew, one place has a vertex for each side, and its tangent would be of the triangles on that side
 * alone: half an edge's turn apart, which shows on turned parts. Vertices at one place with one normal share theirs, if
 * they run alike; where u turns by more than SEAM_COS at a seam the lines do end there. More than SEAM_MOST at a place
 * (the tip of a cone) have no direction in common. */
#define SEAM_COS 0.5f
#define SEAM_MOST 32u
#define SEAM_GRID 65536.0f /* of the mesh's space, whose extent is 1 to 2 */
#define SEAM_NORMALS 1024.0f

struct place {
    int32_t at[6];
    uint32_t vertex;
};

static int by_place(const void *a, const void *b)
{
    const struct place *x = a, *y = b;
    for (int k = 0; k < 6; k++)
        if (x->at[k] != y->at[k])
            return x->at[k] < y->at[k] ? -1 : 1;
    return x->vertex < y->vertex ? -1 : x->vertex > y->vertex;
}

static void join(float *sum, const struct place *places, uint32_t n)
{
    struct lum_vec3 joined[SEAM_MOST];
    for (uint32_t i = 0; i < n; i++) {
        struct lum_vec3 own = lum_normalize(lum_v3_load(sum, places[i].vertex));
        joined[i] = lum_v3(0.0f, 0.0f, 0.0f);
        for (uint32_t k = 0; k < n; k++) {
            struct lum_vec3 other = lum_v3_load(sum, places[k].vertex);
            if (lum_dot(own, lum_normalize(other)) > SEAM_COS)
                joined[i] = lum_v3_add(joined[i], other);
        }
    }
    for (uint32_t i = 0; i < n; i++)
        memcpy(sum + 3 * (size_t)places[i].vertex, &joined[i], 3 * sizeof *sum);
}

static bool join_seams(const struct lum_mesh *m, float *sum)
{
    struct place *places = lum_calloc(m->n_vertices, sizeof *places);
    if (!places)
        return false;
    for (uint32_t i = 0; i < m->n_vertices; i++) {
        places[i].vertex = i;
        for (int k = 0; k < 3; k++) { /* coordinates are within 8, normals within 1 */
            places[i].at[k] = (int32_t)lrintf(m->positions[3 * (size_t)i + (size_t)k] * SEAM_GRID);
            places[i].at[3 + k] = (int32_t)lrintf(m->normals[3 * (size_t)i + (size_t)k] * SEAM_NORMALS);
        }
    }
    qsort(places, m->n_vertices, sizeof *places, by_place);
    for (uint32_t i = 0, end; i < m->n_vertices; i = end) {
        for (end = i + 1; end < m->n_vertices; end++)
            if (memcmp(places[i].at, places[end].at, sizeof places[i].at) != 0)
                break;
        if (end - i > 1 && end - i <= SEAM_MOST)
            join(sum, places + i, end - i);
    }
    lum_free(places);
    return true;
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
    if (m->normals && !join_seams(m, sum)) {
        lum_free(sum);
        return false;
    }
    for (uint32_t i = 0; i < m->n_vertices; i++) {
        struct lum_vec3 t = lum_normalize(lum_v3_load(sum, i));
        memcpy(sum + 3 * (size_t)i, &t, 3 * sizeof *sum);
    }
    m->tangents = sum;
    return true;
}

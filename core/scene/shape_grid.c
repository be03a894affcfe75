#include "core/scene/shape_grid.h"

#include <string.h>

#include "core/math/vec3d.h"

static uint32_t grid_vertices(const struct lum_grid *grid)
{
    return (grid->nu + 1) * (grid->nv + 1);
}

static uint32_t grid_triangles(const struct lum_grid *grid)
{
    uint32_t pole_rows = (uint32_t)grid->pole_lo + (uint32_t)grid->pole_hi;
    return grid->nu * (2 * grid->nv - pole_rows);
}

enum lum_status lum_shape_reserve(struct lum_shape_build *b, uint32_t n_vertices, uint32_t n_triangles,
                                  struct lum_error *err)
{
    b->mesh.positions = lum_calloc(n_vertices, 3 * sizeof(float));
    b->mesh.normals = lum_calloc(n_vertices, 3 * sizeof(float));
    b->mesh.uvs = lum_calloc(n_vertices, 2 * sizeof(float));
    b->mesh.indices = lum_calloc(n_triangles, 3 * sizeof(uint32_t));
    if (b->mesh.positions && b->mesh.normals && b->mesh.uvs && b->mesh.indices)
        return LUM_OK;
    lum_shape_finish(&b->mesh);
    return lum_fail(err, LUM_ERR_NOMEM, "", "out of memory for a shape of %u triangles", n_triangles);
}

void lum_shape_add_vertex(struct lum_shape_build *b, const struct lum_grid_point *point)
{
    struct lum_shape_mesh *m = &b->mesh;
    size_t at = m->n_vertices++;
    const float p[3] = {(float)point->p.x, (float)point->p.y, (float)point->p.z};
    struct lum_vec3 n = lum_normalize(lum_v3((float)point->n.x, (float)point->n.y, (float)point->n.z));
    memcpy(m->positions + 3 * at, p, sizeof p);
    memcpy(m->normals + 3 * at, &n, 3 * sizeof(float));
    m->uvs[2 * at] = (float)point->u;
    m->uvs[2 * at + 1] = 1.0f - (float)point->v; /* glTF: v runs down */
}

void lum_shape_add_triangle(struct lum_shape_build *b, uint32_t p, uint32_t q, uint32_t r)
{
    const uint32_t t[3] = {p, q, r};
    memcpy(b->mesh.indices + 3 * (size_t)b->mesh.n_triangles++, t, sizeof t);
}

static void add_grid(struct lum_shape_build *b, const struct lum_grid *grid)
{
    uint32_t first = b->mesh.n_vertices, columns = grid->nu + 1;
    for (uint32_t j = 0; j <= grid->nv; j++)
        for (uint32_t i = 0; i <= grid->nu; i++) {
            double u = (double)i / grid->nu, v = (double)j / grid->nv;
            struct lum_grid_point point = {
                .u = grid->closed_u && i == grid->nu ? 0.0 : u,
                .v = grid->closed_v && j == grid->nv ? 0.0 : v,
                .i = i,
                .j = j,
            };
            grid->at(grid->ctx, &point);
            point.u = u;
            point.v = v;
            lum_shape_add_vertex(b, &point);
        }
    for (uint32_t j = 0; j < grid->nv; j++)
        for (uint32_t i = 0; i < grid->nu; i++) {
            uint32_t a = first + j * columns + i, c = a + columns + 1;
            if (!(grid->pole_lo && j == 0))
                lum_shape_add_triangle(b, a, a + 1, c);
            if (!(grid->pole_hi && j + 1 == grid->nv))
                lum_shape_add_triangle(b, a, c, c - 1);
        }
}

enum lum_status lum_shape_of_grids(struct lum_shape_build *b, const struct lum_grid *grids, uint32_t n_grids,
                                   struct lum_error *err)
{
    uint32_t n_vertices = 0, n_triangles = 0;
    for (uint32_t i = 0; i < n_grids; i++) {
        n_vertices += grid_vertices(&grids[i]);
        n_triangles += grid_triangles(&grids[i]);
    }
    if (b->counts) {
        b->mesh.n_triangles = n_triangles;
        return LUM_OK;
    }
    enum lum_status status = lum_shape_reserve(b, n_vertices, n_triangles, err);
    for (uint32_t i = 0; i < n_grids && status == LUM_OK; i++)
        add_grid(b, &grids[i]);
    return status;
}

void lum_grid_normal(struct lum_grid_point *point, struct lum_vec3d (*position)(const void *ctx, double u, double v),
                     const void *ctx)
{
    const double h = 1e-5; /* balances truncation h^2 against rounding 1e-16 / h */
    struct lum_vec3d u0 = position(ctx, point->u - h, point->v), u1 = position(ctx, point->u + h, point->v);
    struct lum_vec3d v0 = position(ctx, point->u, point->v - h), v1 = position(ctx, point->u, point->v + h);
    struct lum_vec3d n = lum_v3d_cross(lum_v3d_sub(u1, u0), lum_v3d_sub(v1, v0));
    point->n = (struct lum_vec3d){n.x / (h * h), n.y / (h * h), n.z / (h * h)};
}

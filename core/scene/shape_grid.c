#include "core/scene/shape_grid.h"

#include <string.h>

uint32_t lum_grid_vertices(const struct lum_grid *grid)
{
    return (grid->nu + 1) * (grid->nv + 1);
}

uint32_t lum_grid_triangles(const struct lum_grid *grid)
{
    uint32_t pole_rows = (uint32_t)grid->pole_lo + (uint32_t)grid->pole_hi;
    return grid->nu * (2 * grid->nv - pole_rows);
}

enum lum_status lum_shape_reserve(struct lum_shape_build *b, const struct lum_grid *grids, uint32_t n_grids,
                                  struct lum_error *err)
{
    for (uint32_t i = 0; i < n_grids; i++) {
        b->max_vertices += lum_grid_vertices(&grids[i]);
        b->max_triangles += lum_grid_triangles(&grids[i]);
    }
    b->mesh.positions = lum_calloc(b->max_vertices, 3 * sizeof(float));
    b->mesh.normals = lum_calloc(b->max_vertices, 3 * sizeof(float));
    b->mesh.uvs = lum_calloc(b->max_vertices, 2 * sizeof(float));
    b->mesh.indices = lum_calloc(b->max_triangles, 3 * sizeof(uint32_t));
    if (b->mesh.positions && b->mesh.normals && b->mesh.uvs && b->mesh.indices)
        return LUM_OK;
    lum_shape_finish(&b->mesh);
    return lum_fail(err, LUM_ERR_NOMEM, "", "out of memory for a shape of %u triangles", b->max_triangles);
}

static void add_vertex(struct lum_shape_mesh *m, const struct lum_grid_point *point, float u, float v)
{
    size_t at = m->n_vertices++;
    const float p[3] = {(float)point->p.x, (float)point->p.y, (float)point->p.z};
    struct lum_vec3 n = lum_normalize(lum_v3((float)point->n.x, (float)point->n.y, (float)point->n.z));
    memcpy(m->positions + 3 * at, p, sizeof p);
    memcpy(m->normals + 3 * at, &n, 3 * sizeof(float));
    m->uvs[2 * at] = u;
    m->uvs[2 * at + 1] = 1.0f - v; /* glTF: v runs down */
}

static void add_triangle(struct lum_shape_mesh *m, uint32_t a, uint32_t b, uint32_t c)
{
    const uint32_t t[3] = {a, b, c};
    memcpy(m->indices + 3 * (size_t)m->n_triangles++, t, sizeof t);
}

void lum_shape_add(struct lum_shape_build *b, const struct lum_grid *grid)
{
    struct lum_shape_mesh *m = &b->mesh;
    uint32_t first = m->n_vertices, columns = grid->nu + 1;
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
            add_vertex(m, &point, (float)u, (float)v);
        }
    for (uint32_t j = 0; j < grid->nv; j++)
        for (uint32_t i = 0; i < grid->nu; i++) {
            uint32_t a = first + j * columns + i, c = a + columns + 1;
            if (!(grid->pole_lo && j == 0))
                add_triangle(m, a, a + 1, c);
            if (!(grid->pole_hi && j + 1 == grid->nv))
                add_triangle(m, a, c, c - 1);
        }
}

void lum_grid_normal(struct lum_grid_point *point, struct lum_vec3d (*position)(const void *ctx, double u, double v),
                     const void *ctx)
{
    const double h = 1e-5; /* balances truncation h^2 against rounding 1e-16 / h */
    struct lum_vec3d u0 = position(ctx, point->u - h, point->v), u1 = position(ctx, point->u + h, point->v);
    struct lum_vec3d v0 = position(ctx, point->u, point->v - h), v1 = position(ctx, point->u, point->v + h);
    struct lum_vec3d du = {u1.x - u0.x, u1.y - u0.y, u1.z - u0.z}, dv = {v1.x - v0.x, v1.y - v0.y, v1.z - v0.z};
    point->n = (struct lum_vec3d){(du.y * dv.z - du.z * dv.y) / (h * h), (du.z * dv.x - du.x * dv.z) / (h * h),
                                  (du.x * dv.y - du.y * dv.x) / (h * h)};
}

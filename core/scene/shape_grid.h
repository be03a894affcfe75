/* Private to core/scene: meshes in the making, and surfaces sampled on a grid, from which most built-in shapes are
 * made. */
#ifndef LUM_CORE_SCENE_SHAPE_GRID_H
#define LUM_CORE_SCENE_SHAPE_GRID_H

#include "core/math/vec.h"
#include "core/scene/shapes.h"

/* A mesh in the making, with the storage that lum_shape_reserve made. */
struct lum_shape_build {
    struct lum_shape_mesh mesh;
    bool counts;    /* its triangles only: nothing is made */
    double half[3]; /* of the box around the origin that is stretched to the size; 0: the box of the vertices is. */
};

struct lum_grid_point {
    double u, v;           /* in: 0..1, and u = 0 again on the closing column, so that seams have equal bits */
    uint32_t i, j;         /* in: column 0..nu and row 0..nv */
    struct lum_vec3d p, n; /* out; n need not be unit */
};

/* cross(dp/du, dp/dv) points outward. */
struct lum_grid {
    void (*at)(const void *ctx, struct lum_grid_point *point);
    const void *ctx;
    uint32_t nu, nv;
    bool closed_u, closed_v; /* the last column (row) repeats the first */
    bool pole_lo, pole_hi;   /* row 0 (row nv) is a single point */
};

enum lum_status lum_shape_reserve(struct lum_shape_build *b, uint32_t n_vertices, uint32_t n_triangles,
                                  struct lum_error *err);
void lum_shape_add_vertex(struct lum_shape_build *b, const struct lum_grid_point *point);
void lum_shape_add_triangle(struct lum_shape_build *b, uint32_t p, uint32_t q, uint32_t r);
/* All of a shape at once: reserves, and adds grid after grid. */
enum lum_status lum_shape_of_grids(struct lum_shape_build *b, const struct lum_grid *grids, uint32_t n_grids,
                                   struct lum_error *err);
/* Sets n by central differences of a position function over (u, v), which may reach outside 0..1 by 1e-5. */
void lum_grid_normal(struct lum_grid_point *point, struct lum_vec3d (*position)(const void *ctx, double u, double v),
                     const void *ctx);

struct lum_shape_input {
    uint32_t segments[2]; /* defaults filled in */
    double param[4];
};
enum lum_status lum_shape_bunny(struct lum_shape_build *b, const struct lum_shape_input *in, struct lum_error *err);
enum lum_status lum_shape_figure(struct lum_shape_build *b, const struct lum_shape_input *in, struct lum_error *err);

#endif

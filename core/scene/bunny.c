/* The bunny: a sitting rabbit, modelled as ellipsoids that melt into each other.
 *
 * The solid is where a function is negative: the smooth minimum of the parts' distances. Its surface is found by
 * surface nets (Gibson 1998) on a lattice: a vertex in each cell that the surface crosses, a quad around each lattice
 * edge that it crosses. So the triangles are of one size all over, as those of a scanned model are. Natural size: 1
 * high, y = 0 the floor, +z to the front. */
#include "core/scene/shape_grid.h"

#include "core/math/vec3d.h"

/* 160 cells: 0.3 million triangles, and 20 MB while they are made. */
#define CELLS_MAX 160u
/* At most, for the square of the cells along its height: its surface does not change. */
#define TRIANGLES_PER_CELL 5u

/* One half: x is mirrored. tilt turns about x (towards the back) and then about z (outwards). */
struct part {
    struct lum_vec3d centre, radii;
    double tilt_x, tilt_z; /* radians */
    double blend;          /* width over which it melts into the parts before it */
};
static const struct part parts[] = {
    {{0.000, 0.245, -0.110}, {0.225, 0.235, 0.255}, 0.0, 0.0, 0.00},    /* rump */
    {{0.000, 0.320, 0.105}, {0.165, 0.230, 0.165}, 0.25, 0.0, 0.10},    /* chest */
    {{0.165, 0.165, -0.105}, {0.090, 0.160, 0.185}, -0.2, 0.0, 0.04},   /* thigh */
    {{0.165, 0.038, 0.045}, {0.060, 0.042, 0.160}, 0.0, 0.0, 0.03},     /* hind foot */
    {{0.080, 0.170, 0.205}, {0.050, 0.170, 0.055}, 0.08, 0.0, 0.05},    /* foreleg */
    {{0.082, 0.034, 0.235}, {0.050, 0.036, 0.075}, 0.0, 0.0, 0.03},     /* forepaw */
    {{0.000, 0.590, 0.190}, {0.148, 0.142, 0.166}, 0.1, 0.0, 0.07},     /* head */
    {{0.058, 0.550, 0.290}, {0.072, 0.062, 0.070}, 0.0, 0.0, 0.05},     /* cheek */
    {{0.000, 0.585, 0.350}, {0.034, 0.026, 0.030}, 0.0, 0.0, 0.03},     /* nose */
    {{0.118, 0.638, 0.268}, {0.022, 0.026, 0.026}, 0.0, 0.0, 0.008},    /* eye */
    {{0.076, 0.850, 0.115}, {0.058, 0.195, 0.036}, -0.42, -0.16, 0.04}, /* ear */
    {{0.000, 0.225, -0.375}, {0.080, 0.080, 0.075}, 0.0, 0.0, 0.025},   /* tail */
};
static const double box_lo[3] = {-0.32, -0.04, -0.53}, box_hi[3] = {0.32, 1.10, 0.43};

/* ---- the solid ---- */

static struct lum_vec3d to_part(const struct part *part, struct lum_vec3d p)
{
    struct lum_vec3d q = lum_v3d_sub(p, part->centre);
    double c = cos(part->tilt_z), s = sin(part->tilt_z);
    q = (struct lum_vec3d){c * q.x + s * q.y, c * q.y - s * q.x, q.z};
    c = cos(part->tilt_x);
    s = sin(part->tilt_x);
    return (struct lum_vec3d){q.x, c * q.y + s * q.z, c * q.z - s * q.y};
}

/* Distance to an ellipsoid, to first order at its surface: f / |grad f| of f = |q / r|^2 - |q / r|. */
static double distance_to(const struct part *part, struct lum_vec3d p)
{
    struct lum_vec3d q = to_part(part, p), r = part->radii;
    double x = q.x / r.x, y = q.y / r.y, z = q.z / r.z;
    double k0 = sqrt(x * x + y * y + z * z);
    x /= r.x;
    y /= r.y;
    z /= r.z;
    double k1 = sqrt(x * x + y * y + z * z);
    return k1 > 0.0 ? k0 * (k0 - 1.0) / k1 : -r.x;
}

static double smooth_min(double a, double b, double width)
{
    double h = fmax(width - fabs(a - b), 0.0);
    return fmin(a, b) - (h > 0.0 ? 0.25 * h * h / width : 0.0);
}

/* Negative inside. */
static double solid(struct lum_vec3d p)
{
    p.x = fabs(p.x);
    double d = distance_to(&parts[0], p);
    for (size_t i = 1; i < LUM_ARRAY_LEN(parts); i++)
        d = smooth_min(d, distance_to(&parts[i], p), parts[i].blend);
    return d;
}

static struct lum_vec3d gradient(struct lum_vec3d p)
{
    const double h = 1e-5; /* balances truncation h^2 against rounding 1e-16 / h */
    double x0 = solid((struct lum_vec3d){p.x - h, p.y, p.z}), x1 = solid((struct lum_vec3d){p.x + h, p.y, p.z});
    double y0 = solid((struct lum_vec3d){p.x, p.y - h, p.z}), y1 = solid((struct lum_vec3d){p.x, p.y + h, p.z});
    double z0 = solid((struct lum_vec3d){p.x, p.y, p.z - h}), z1 = solid((struct lum_vec3d){p.x, p.y, p.z + h});
    return (struct lum_vec3d){(x1 - x0) / (2 * h), (y1 - y0) / (2 * h), (z1 - z0) / (2 * h)};
}

/* ---- the lattice ---- */

struct lattice {
    uint32_t n[3];    /* points along each axis */
    size_t stride[3]; /* between neighbouring points */
    double cell;
    float *value;     /* of the solid, at each point */
    uint32_t *vertex; /* of the cell whose lowest corner the point is */
};

static size_t n_points(const struct lattice *l)
{
    return (size_t)l->n[0] * l->n[1] * l->n[2];
}

static struct lum_vec3d point_at(const struct lattice *l, size_t at)
{
    size_t i = at % l->n[0], j = at / l->stride[1] % l->n[1], k = at / l->stride[2];
    return (struct lum_vec3d){box_lo[0] + (double)i * l->cell, box_lo[1] + (double)j * l->cell,
                              box_lo[2] + (double)k * l->cell};
}

/* cells: along the height. */
static enum lum_status lattice_init(struct lattice *l, uint32_t cells, struct lum_error *err)
{
    l->cell = (box_hi[1] - box_lo[1]) / cells;
    for (int k = 0; k < 3; k++)
        l->n[k] = (uint32_t)ceil((box_hi[k] - box_lo[k]) / l->cell) + 1;
    l->stride[0] = 1;
    l->stride[1] = l->n[0];
    l->stride[2] = (size_t)l->n[0] * l->n[1];
    l->value = lum_calloc(n_points(l), sizeof *l->value);
    l->vertex = lum_calloc(n_points(l), sizeof *l->vertex);
    if (!l->value || !l->vertex)
        return lum_fail(err, LUM_ERR_NOMEM, "", "out of memory for a bunny of %u cells", cells);
    for (size_t at = 0; at < n_points(l); at++)
        l->value[at] = (float)solid(point_at(l, at));
    return LUM_OK;
}

static void lattice_finish(struct lattice *l)
{
    lum_free(l->value);
    lum_free(l->vertex);
}

static bool inside(const struct lattice *l, size_t at)
{
    return l->value[at] < 0.0f;
}

/* The box leaves a cell of air around the solid, so a crossed edge has its four cells, and a cell its eight corners. */
static bool edge_crossed(const struct lattice *l, size_t at, int axis)
{
    size_t next = at + l->stride[axis];
    return next < n_points(l) && inside(l, at) != inside(l, next);
}

/* Edge e of 12 of the cell at a point: where it begins; its axis is e / 4. */
static size_t cell_edge(const struct lattice *l, size_t cell, int e)
{
    int axis = e / 4, u = (axis + 1) % 3, v = (axis + 2) % 3;
    return cell + (size_t)(e & 1) * l->stride[u] + (size_t)(e >> 1 & 1) * l->stride[v];
}

/* ---- the mesh ---- */

/* The mean of where the cell's edges are crossed; false: none is. */
static bool cell_crossing(const struct lattice *l, size_t cell, struct lum_vec3d *ret_p)
{
    struct lum_vec3d sum = {0, 0, 0};
    int n = 0;
    for (int e = 0; e < 12; e++) {
        size_t at = cell_edge(l, cell, e);
        if (!edge_crossed(l, at, e / 4))
            continue;
        double a = (double)l->value[at], b = (double)l->value[at + l->stride[e / 4]], t = a / (a - b) * l->cell;
        struct lum_vec3d p = point_at(l, at);
        sum.x += p.x + (e / 4 == 0 ? t : 0.0);
        sum.y += p.y + (e / 4 == 1 ? t : 0.0);
        sum.z += p.z + (e / 4 == 2 ? t : 0.0);
        n++;
    }
    if (n > 0)
        *ret_p = (struct lum_vec3d){sum.x / n, sum.y / n, sum.z / n};
    return n > 0;
}

static void add_cell(struct lum_shape_build *b, struct lattice *l, size_t cell)
{
    struct lum_grid_point g;
    if (!cell_crossing(l, cell, &g.p))
        return;
    l->vertex[cell] = b->mesh.n_vertices;
    g.n = gradient(g.p);
    g.u = 0.5 + atan2(g.p.x, g.p.z) / 6.28318530717958647692;
    g.v = (g.p.y - box_lo[1]) / (box_hi[1] - box_lo[1]);
    lum_shape_add_vertex(b, &g);
}

static double distance_squared(const struct lum_shape_mesh *m, uint32_t a, uint32_t b)
{
    const float *p = m->positions + 3 * (size_t)a, *q = m->positions + 3 * (size_t)b;
    double x = (double)(p[0] - q[0]), y = (double)(p[1] - q[1]), z = (double)(p[2] - q[2]);
    return x * x + y * y + z * z;
}

/* The four cells around an edge, seen counter-clockwise from outside; split along the shorter diagonal. */
static void add_quad(struct lum_shape_build *b, const struct lattice *l, size_t at, int axis)
{
    size_t u = l->stride[(axis + 1) % 3], v = l->stride[(axis + 2) % 3];
    uint32_t q[4] = {l->vertex[at - u - v], l->vertex[at - v], l->vertex[at], l->vertex[at - u]};
    if (!inside(l, at)) {
        uint32_t swap = q[1];
        q[1] = q[3];
        q[3] = swap;
    }
    int k = distance_squared(&b->mesh, q[0], q[2]) <= distance_squared(&b->mesh, q[1], q[3]) ? 0 : 1;
    lum_shape_add_triangle(b, q[k], q[k + 1], q[k + 2]);
    lum_shape_add_triangle(b, q[k], q[k + 2], q[(k + 3) % 4]);
}

static enum lum_status reserve(struct lum_shape_build *b, const struct lattice *l, struct lum_error *err)
{
    uint32_t vertices = 0, quads = 0;
    struct lum_vec3d p;
    for (size_t at = 0; at < n_points(l); at++) {
        vertices += cell_crossing(l, at, &p);
        for (int axis = 0; axis < 3; axis++)
            quads += edge_crossed(l, at, axis);
    }
    return lum_shape_reserve(b, vertices, 2 * quads, err);
}

enum lum_status lum_shape_bunny(struct lum_shape_build *b, const struct lum_shape_input *in, struct lum_error *err)
{
    if (in->segments[0] > CELLS_MAX)
        return lum_fail(err, LUM_ERR_LIMIT, "segments", "a bunny has at most %u segments, not %u", CELLS_MAX,
                        in->segments[0]);
    if (b->counts) {
        b->mesh.n_triangles = TRIANGLES_PER_CELL * in->segments[0] * in->segments[0];
        return LUM_OK;
    }
    struct lattice l = {.value = NULL};
    enum lum_status status = lattice_init(&l, in->segments[0], err);
    if (status == LUM_OK)
        status = reserve(b, &l, err);
    for (size_t at = 0; at < n_points(&l) && status == LUM_OK; at++)
        add_cell(b, &l, at);
    for (size_t at = 0; at < n_points(&l) && status == LUM_OK; at++)
        for (int axis = 0; axis < 3; axis++)
            if (edge_crossed(&l, at, axis))
                add_quad(b, &l, at, axis);
    lattice_finish(&l);
    return status;
}

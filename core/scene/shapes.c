/* The table of built-in shapes. Each is made in its natural size, then stretched to the bounding box that was asked
 * for. */
#include "core/scene/shapes.h"

#include <string.h>

#include "core/math/vec3d.h"
#include "core/scene/shape_grid.h"

static const double two_pi = 6.28318530717958647692;

void lum_shape_finish(struct lum_shape_mesh *mesh)
{
    lum_free(mesh->positions);
    lum_free(mesh->normals);
    lum_free(mesh->uvs);
    lum_free(mesh->indices);
    memset(mesh, 0, sizeof *mesh);
}

/* ---- flat ones ---- */

/* k of n steps from -1/2 to 1/2; exactly odd around the middle, so that faces meet with equal bits. */
static double step(uint32_t k, uint32_t n)
{
    return (2.0 * k - n) / (2.0 * n);
}

struct face {
    uint32_t n;
    struct lum_vec3d normal, u, v; /* centre = normal / 2 */
};

static void face_at(const void *ctx, struct lum_grid_point *g)
{
    const struct face *f = ctx;
    double a = step(g->i, f->n), b = step(g->j, f->n);
    g->n = f->normal;
    g->p = (struct lum_vec3d){0.5 * f->normal.x + a * f->u.x + b * f->v.x, 0.5 * f->normal.y + a * f->u.y + b * f->v.y,
                              0.5 * f->normal.z + a * f->u.z + b * f->v.z};
}

static enum lum_status make_box(struct lum_shape_build *b, const struct lum_shape_input *in, struct lum_error *err)
{
    static const struct face faces[6] = {
        {0, {1, 0, 0}, {0, 0, -1}, {0, 1, 0}}, {0, {-1, 0, 0}, {0, 0, 1}, {0, 1, 0}},
        {0, {0, 1, 0}, {1, 0, 0}, {0, 0, -1}}, {0, {0, -1, 0}, {1, 0, 0}, {0, 0, 1}},
        {0, {0, 0, 1}, {1, 0, 0}, {0, 1, 0}},  {0, {0, 0, -1}, {-1, 0, 0}, {0, 1, 0}},
    };
    struct face sized[6];
    struct lum_grid grids[6];
    for (int k = 0; k < 6; k++) {
        sized[k] = faces[k];
        sized[k].n = in->segments[0];
        grids[k] = (struct lum_grid){.at = face_at, .ctx = &sized[k], .nu = in->segments[0], .nv = in->segments[0]};
    }
    return lum_shape_of_grids(b, grids, 6, err);
}

static void quad_at(const void *ctx, struct lum_grid_point *g)
{
    (void)ctx;
    g->p = (struct lum_vec3d){g->u - 0.5, 0.0, 0.5 - g->v};
    g->n = (struct lum_vec3d){0, 1, 0};
}

static enum lum_status make_quad(struct lum_shape_build *b, const struct lum_shape_input *in, struct lum_error *err)
{
    struct lum_grid grid = {.at = quad_at, .nu = in->segments[0], .nv = in->segments[1]};
    return lum_shape_of_grids(b, &grid, 1, err);
}

/* ---- round ones, of radius 1 around the y axis ---- */

/* A disc; up: rim to centre, down: centre to rim, so that the winding is outward. */
struct cap {
    double x, y, radius; /* centre, z = 0 */
    bool up;
};

static void cap_at(const void *ctx, struct lum_grid_point *g)
{
    const struct cap *cap = ctx;
    double r = cap->radius * (cap->up ? 1.0 - g->v : g->v), phi = two_pi * g->u;
    g->p = (struct lum_vec3d){cap->x + r * cos(phi), cap->y, -r * sin(phi)};
    g->n = (struct lum_vec3d){0, cap->up ? 1 : -1, 0};
}

static struct lum_grid cap_grid(const struct cap *cap, uint32_t around)
{
    return (struct lum_grid){
        .at = cap_at, .ctx = cap, .nu = around, .nv = 1, .closed_u = true, .pole_lo = !cap->up, .pole_hi = cap->up};
}

static enum lum_status make_disc(struct lum_shape_build *b, const struct lum_shape_input *in, struct lum_error *err)
{
    const struct cap cap = {0.0, 0.0, 1.0, true};
    struct lum_grid grid = cap_grid(&cap, in->segments[0]);
    grid.nv = in->segments[1];
    return lum_shape_of_grids(b, &grid, 1, err);
}

static void cylinder_at(const void *ctx, struct lum_grid_point *g)
{
    (void)ctx;
    double phi = two_pi * g->u;
    g->p = (struct lum_vec3d){cos(phi), 2.0 * g->v - 1.0, -sin(phi)};
    g->n = (struct lum_vec3d){cos(phi), 0.0, -sin(phi)};
}

static enum lum_status make_cylinder(struct lum_shape_build *b, const struct lum_shape_input *in, struct lum_error *err)
{
    const struct cap top = {0.0, 1.0, 1.0, true}, bottom = {0.0, -1.0, 1.0, false};
    const struct lum_grid grids[3] = {
        {.at = cylinder_at, .nu = in->segments[0], .nv = in->segments[1], .closed_u = true},
        cap_grid(&top, in->segments[0]),
        cap_grid(&bottom, in->segments[0]),
    };
    return lum_shape_of_grids(b, grids, 3, err);
}

/* A cylinder whose axis is a sine wave: every slice is moved along x. phase in turns, so that 0 and 1 are one pose. */
struct wobble {
    double amplitude, waves, phase;
};

static double sway(const struct wobble *w, double v)
{
    return w->amplitude * sin(two_pi * (w->waves * v - w->phase));
}

static void wobble_at(const void *ctx, struct lum_grid_point *g)
{
    const struct wobble *w = ctx;
    double phi = two_pi * g->u, r = 1.0 - w->amplitude;
    double slope = 0.5 * w->amplitude * two_pi * w->waves * cos(two_pi * (w->waves * g->v - w->phase)); /* dx / dy */
    g->p = (struct lum_vec3d){sway(w, g->v) + r * cos(phi), 2.0 * g->v - 1.0, -r * sin(phi)};
    g->n = (struct lum_vec3d){cos(phi), -slope * cos(phi), -sin(phi)};
}

/* The box is that of all poses: setting the phase bends it, and nothing else. */
static enum lum_status make_wobble(struct lum_shape_build *b, const struct lum_shape_input *in, struct lum_error *err)
{
    const struct wobble w = {in->param[0], in->param[1], fmod(in->param[2], 1.0)};
    if (!(w.amplitude > 0.0 && w.amplitude <= 0.9))
        return lum_fail(err, LUM_ERR_INVALID, "param", "a wobble's amplitude is above 0 and at most 0.9");
    if (!(w.waves > 0.0 && w.waves <= 16.0) || !isfinite(w.phase))
        return lum_fail(err, LUM_ERR_INVALID, "param", "a wobble has up to 16 waves, and a phase");
    double r = 1.0 - w.amplitude;
    const struct cap top = {sway(&w, 1.0), 1.0, r, true}, bottom = {sway(&w, 0.0), -1.0, r, false};
    const struct lum_grid grids[3] = {
        {.at = wobble_at, .ctx = &w, .nu = in->segments[0], .nv = in->segments[1], .closed_u = true},
        cap_grid(&top, in->segments[0]),
        cap_grid(&bottom, in->segments[0]),
    };
    b->half[0] = 1.0;
    b->half[1] = 1.0;
    b->half[2] = r;
    return lum_shape_of_grids(b, grids, 3, err);
}

static void cone_at(const void *ctx, struct lum_grid_point *g)
{
    (void)ctx;
    double phi = two_pi * g->u, r = 1.0 - g->v;
    g->p = (struct lum_vec3d){r * cos(phi), 2.0 * g->v - 1.0, -r * sin(phi)};
    g->n = (struct lum_vec3d){2.0 * cos(phi), 1.0, -2.0 * sin(phi)}; /* radius 1 over height 2 */
}

static enum lum_status make_cone(struct lum_shape_build *b, const struct lum_shape_input *in, struct lum_error *err)
{
    const struct cap bottom = {0.0, -1.0, 1.0, false};
    const struct lum_grid grids[2] = {
        {.at = cone_at, .nu = in->segments[0], .nv = in->segments[1], .closed_u = true, .pole_hi = true},
        cap_grid(&bottom, in->segments[0]),
    };
    return lum_shape_of_grids(b, grids, 2, err);
}

static void sphere_at(const void *ctx, struct lum_grid_point *g)
{
    const struct lum_grid *grid = ctx;
    double phi = two_pi * g->u, theta = 0.5 * two_pi * g->v;
    bool pole = g->j == 0 || g->j == grid->nv;
    double r = pole ? 0.0 : sin(theta), y = g->j == 0 ? -1.0 : g->j == grid->nv ? 1.0 : -cos(theta);
    g->p = (struct lum_vec3d){r * cos(phi), y, -r * sin(phi)};
    g->n = g->p;
}

static enum lum_status make_sphere(struct lum_shape_build *b, const struct lum_shape_input *in, struct lum_error *err)
{
    struct lum_grid grid = {.at = sphere_at,
                            .nu = in->segments[0],
                            .nv = in->segments[1],
                            .closed_u = true,
                            .pole_lo = true,
                            .pole_hi = true};
    grid.ctx = &grid;
    return lum_shape_of_grids(b, &grid, 1, err);
}

/* ---- tubes ---- */

/* A torus knot that winds p times round the axis and q times round the ring; (1, 0) is a plain torus. */
struct tube {
    double p, q, radius;
};

/* Centre of the tube at s in 0..1. */
static struct lum_vec3d tube_centre(const struct tube *t, double s)
{
    double phi = two_pi * s, r = 1.0 + 0.4 * cos(t->q * phi);
    if (t->q == 0.0)
        r = 1.0;
    return (struct lum_vec3d){r * cos(t->p * phi), 0.4 * sin(t->q * phi), r * sin(t->p * phi)};
}

static struct lum_vec3d unit_d(struct lum_vec3d a)
{
    double s = 1.0 / sqrt(a.x * a.x + a.y * a.y + a.z * a.z);
    return lum_v3d_mul(a, s);
}

/* u runs along the tube, v around it. The ring is spanned by the radial direction of the knot's own torus and its
 * perpendicular, a frame that closes after one turn. */
static void tube_at(const void *ctx, struct lum_grid_point *g)
{
    const struct tube *t = ctx;
    const double h = 1e-6;
    struct lum_vec3d c = tube_centre(t, g->u), a = tube_centre(t, g->u - h), b = tube_centre(t, g->u + h);
    struct lum_vec3d along = unit_d(lum_v3d_sub(b, a));
    double phi = two_pi * g->u;
    struct lum_vec3d hub = {cos(t->p * phi), 0.0, sin(t->p * phi)};
    struct lum_vec3d out = t->q == 0.0 ? hub : (struct lum_vec3d){c.x - hub.x, c.y, c.z - hub.z};
    struct lum_vec3d side = unit_d(lum_v3d_cross(out, along));
    out = lum_v3d_cross(along, side);
    double x = cos(two_pi * g->v), y = sin(two_pi * g->v);
    g->n = (struct lum_vec3d){x * out.x + y * side.x, x * out.y + y * side.y, x * out.z + y * side.z};
    g->p = lum_v3d_mad(c, g->n, t->radius);
}

static enum lum_status make_tube(struct lum_shape_build *b, const struct lum_shape_input *in, const struct tube *tube,
                                 struct lum_error *err)
{
    struct lum_grid grid = {
        .at = tube_at, .ctx = tube, .nu = in->segments[0], .nv = in->segments[1], .closed_u = true, .closed_v = true};
    return lum_shape_of_grids(b, &grid, 1, err);
}

static enum lum_status make_torus(struct lum_shape_build *b, const struct lum_shape_input *in, struct lum_error *err)
{
    if (!(in->param[0] > 0.0 && in->param[0] < 1.0))
        return lum_fail(err, LUM_ERR_INVALID, "param", "a torus's tube is above 0 and below 1 times its ring");
    const struct tube tube = {1.0, 0.0, in->param[0]};
    return make_tube(b, in, &tube, err);
}

static enum lum_status make_knot(struct lum_shape_build *b, const struct lum_shape_input *in, struct lum_error *err)
{
    double p = in->param[0], q = in->param[1];
    if (!(p >= 1.0 && p <= 16.0 && q >= 1.0 && q <= 16.0) || p != floor(p) || q != floor(q))
        return lum_fail(err, LUM_ERR_INVALID, "param", "a knot's windings are whole numbers from 1 to 16");
    if (!(in->param[2] > 0.0 && in->param[2] <= 0.39))
        return lum_fail(err, LUM_ERR_INVALID, "param", "a knot's tube is above 0 and at most 0.39");
    const struct tube tube = {p, q, in->param[2]};
    return make_tube(b, in, &tube, err);
}

/* ---- the table ---- */

struct shape {
    const char *name;
    enum lum_status (*make)(struct lum_shape_build *b, const struct lum_shape_input *in, struct lum_error *err);
    uint32_t segments[2], least[2]; /* default and least, around and along */
    double param[4];                /* defaults */
    double proportions[3];          /* default size; axes without extent are 0 */
};

/* param: torus 0 = tube over ring radius; knot 0, 1 = windings round the axis and the ring, 2 = tube radius over ring
 * radius; figure 0 = depth of the folds (1 = as designed), 1 = turn of the folds; wobble 0 = amplitude over half the
 * width, 1 = waves over the height, 2 = phase in turns. segments of a box: along each edge, the first only; of a bunny:
 * cells of the lattice along its height, the first only. */
static const struct shape shapes[] = {
    {"box", make_box, {1, 1}, {1, 1}, {0}, {1, 1, 1}},
    {"sphere", make_sphere, {48, 24}, {3, 2}, {0}, {1, 1, 1}},
    {"quad", make_quad, {1, 1}, {1, 1}, {0}, {1, 0, 1}},
    {"disc", make_disc, {48, 1}, {3, 1}, {0}, {1, 0, 1}},
    {"cylinder", make_cylinder, {48, 1}, {3, 1}, {0}, {1, 1, 1}},
    {"cone", make_cone, {48, 1}, {3, 1}, {0}, {1, 1, 1}},
    {"torus", make_torus, {64, 24}, {3, 3}, {0.35}, {1, 0.26, 1}},
    {"knot", make_knot, {256, 24}, {3, 3}, {2, 3, 0.18}, {1, 0.37, 1}},
    {"figure", lum_shape_figure, {128, 90}, {16, 16}, {1, 1}, {0.43, 1, 0.43}},
    {"bunny", lum_shape_bunny, {67, 1}, {16, 1}, {0}, {0.495, 1, 0.805}},
    {"wobble", make_wobble, {96, 64}, {3, 1}, {0.35, 1, 0}, {1, 2, 0.65}},
};
#define SEGMENTS_MAX 2048u /* 8 million triangles */
#define SIZE_MAX_M 1e9     /* what is farther out is refused anyway */

const char *const *lum_shape_names(void)
{
    static const char *const names[LUM_ARRAY_LEN(shapes) + 1] = {
        "box", "sphere", "quad", "disc", "cylinder", "cone", "torus", "knot", "figure", "bunny", "wobble", NULL};
    return names;
}

static const struct shape *find_shape(const char *name)
{
    for (size_t i = 0; name && i < LUM_ARRAY_LEN(shapes); i++)
        if (strcmp(shapes[i].name, name) == 0)
            return &shapes[i];
    return NULL;
}

static enum lum_status fill_input(const struct shape *shape, const struct lum_shape_params *params,
                                  struct lum_shape_input *in, struct lum_error *err)
{
    for (int k = 0; k < 2; k++) {
        in->segments[k] = params->segments[k] ? params->segments[k] : shape->segments[k];
        if (in->segments[k] < shape->least[k] || in->segments[k] > SEGMENTS_MAX)
            return lum_fail(err, LUM_ERR_LIMIT, "segments", "a %s has %u to %u segments, not %u", shape->name,
                            shape->least[k], SEGMENTS_MAX, in->segments[k]);
    }
    for (int k = 0; k < 4; k++)
        in->param[k] = params->param[k] != 0.0 ? params->param[k] : shape->param[k];
    for (int k = 0; k < 3; k++)
        if (!(params->size[k] >= 0.0 && params->size[k] <= SIZE_MAX_M))
            return lum_fail(err, LUM_ERR_INVALID, "size", "a size is from 0 (the default) to %g m", SIZE_MAX_M);
    return LUM_OK;
}

static void vertex_box(const struct lum_shape_mesh *m, int axis, double *ret_centre, double *ret_extent)
{
    float lo = INFINITY, hi = -INFINITY;
    for (size_t i = (size_t)axis; i < 3 * (size_t)m->n_vertices; i += 3) {
        lo = fminf(lo, m->positions[i]);
        hi = fmaxf(hi, m->positions[i]);
    }
    *ret_extent = (double)hi - (double)lo;
    *ret_centre = 0.5 * ((double)lo + (double)hi);
}

/* Stretches the shape's box to the size, centred at the origin. */
static void stretch(struct lum_shape_build *b, const struct shape *shape, const double size[3])
{
    struct lum_shape_mesh *m = &b->mesh;
    for (int k = 0; k < 3; k++) {
        double centre = 0.0, extent = 2.0 * b->half[k];
        if (!(extent > 0.0))
            vertex_box(m, k, &centre, &extent);
        double wanted = size[k] > 0.0 ? size[k] : shape->proportions[k];
        double scale = extent > 0.0 ? wanted / extent : 1.0;
        for (size_t i = (size_t)k; i < 3 * (size_t)m->n_vertices; i += 3) {
            m->positions[i] = (float)(((double)m->positions[i] - centre) * scale);
            m->normals[i] = (float)((double)m->normals[i] / scale);
        }
    }
    for (size_t i = 0; i < m->n_vertices; i++) {
        struct lum_vec3 n = lum_normalize(lum_v3(m->normals[3 * i], m->normals[3 * i + 1], m->normals[3 * i + 2]));
        memcpy(m->normals + 3 * i, &n, 3 * sizeof(float));
    }
}

static enum lum_status build(const struct shape *shape, const char *name, const struct lum_shape_params *params,
                             struct lum_shape_build *b, struct lum_error *err)
{
    if (!shape)
        return lum_fail(err, LUM_ERR_NOT_FOUND, "shape", "there is no shape \"%.32s\"", name ? name : "");
    struct lum_shape_input in;
    enum lum_status status = fill_input(shape, params, &in, err);
    return status ? status : shape->make(b, &in, err);
}

enum lum_status lum_shape_make(const char *name, const struct lum_shape_params *params, struct lum_shape_mesh *ret_mesh,
                               struct lum_error *err)
{
    const struct shape *shape = find_shape(name);
    struct lum_shape_build b = {.counts = false};
    enum lum_status status = build(shape, name, params, &b, err);
    if (status != LUM_OK)
        return status;
    stretch(&b, shape, params->size);
    *ret_mesh = b.mesh;
    return LUM_OK;
}

enum lum_status lum_shape_count(const char *name, const struct lum_shape_params *params, uint32_t *ret_triangles,
                                struct lum_error *err)
{
    struct lum_shape_build b = {.counts = true};
    enum lum_status status = build(find_shape(name), name, params, &b, err);
    *ret_triangles = b.mesh.n_triangles;
    return status;
}

/* But for lum_quad_far all is in double: the integrals are small differences of angles when the
 * light is small. The error is about 2^-52 absolute, so that a light of 10^-8 sr is still right to 10^-7; smaller ones,
 * but for meshes, are taken as points, whose relative error is their solid angle. */
#include "core/light/emitter.h"

#include "core/math/angle.h"
#include "core/math/vec3d.h"

#define POINT_LIKE_SR 1e-8 /* smaller lights are points: the error is a hundred-millionth of their light */

/* From the irradiance vector: the integral of w over the part of the light above the horizon. */
static struct lum_irradiance from_vector(struct lum_vec3d e, struct lum_vec3d n)
{
    double a = fmin(fmax(lum_v3d_dot(e, n), 0.0), LUM_PI_D), all = lum_v3d_length(e);
    return (struct lum_irradiance){(float)a, all > 0.0 ? (float)fmin(a / all, 1.0) : 0.0f};
}

/* A flat light of this area, seen from d away, that is too small for the integral to be exact. */
static struct lum_irradiance from_point(struct lum_vec3d d, struct lum_vec3d n, struct lum_vec3d n_light, double area)
{
    double r2 = lum_v3d_dot(d, d), r = sqrt(r2), cos = fmax(lum_v3d_dot(d, n) / r, 0.0);
    return (struct lum_irradiance){(float)(cos * fmax(-lum_v3d_dot(d, n_light) / r, 0.0) * area / r2), (float)cos};
}

/* ---- polygon ---- */

/* Adds edge a -> b's part of the integral: half the angle that the edge subtends, along the normal of the plane through
 * it and the point. */
static void add_edge(struct lum_vec3d a, struct lum_vec3d b, struct lum_vec3d *inout_e)
{
    struct lum_vec3d c = lum_v3d_cross(a, b);
    double s = lum_v3d_length(c);
    if (s > 0.0) /* else the edge is seen end on, or is a point */
        *inout_e = lum_v3d_mad(*inout_e, c, 0.5 * lum_angle(s, lum_v3d_dot(a, b)) / s);
}

void lum_outline_add(struct lum_outline *o, struct lum_vec3d a, struct lum_vec3d b)
{
    double ha = lum_v3d_dot(a, o->n), hb = lum_v3d_dot(b, o->n);
    if (ha <= 0.0 && hb <= 0.0)
        return;
    if (ha < 0.0 || hb < 0.0) {
        struct lum_vec3d at_horizon = lum_v3d_mad(a, lum_v3d_sub(b, a), ha / (ha - hb));
        if (ha < 0.0)
            a = o->in = at_horizon;
        else
            b = o->out = at_horizon;
        o->crossings++;
    } else if (ha == 0.0) {
        o->in = a;
        o->crossings++;
    } else if (hb == 0.0) {
        o->out = b;
        o->crossings++;
    }
    add_edge(a, b, &o->e);
}

void lum_outline_close(struct lum_outline *o)
{
    if (o->crossings == 2)
        add_edge(o->out, o->in, &o->e);
    o->crossings = 0;
}

struct lum_irradiance lum_outline_irradiance(struct lum_outline *o)
{
    lum_outline_close(o);
    return from_vector(o->e, o->n);
}

/* Radon's seven points on the square (1948), exact to degree 5; an eighth without weight fills the lanes. */
#define LANES 8
static const float rule_x[LANES] = {0.0f,          0.0f,           0.0f,           0.7745966692f,
                                    0.7745966692f, -0.7745966692f, -0.7745966692f, 0.0f};
static const float rule_y[LANES] = {0.0f,           0.9660917831f, -0.9660917831f, 0.5773502692f,
                                    -0.5773502692f, 0.5773502692f, -0.5773502692f, 0.0f};
static const float rule_weight[LANES] = {2.0f / 7,  5.0f / 63, 5.0f / 63, 5.0f / 36,
                                         5.0f / 36, 5.0f / 36, 5.0f / 36, 0.0f};

/* Farther than this many times half its diagonal a quad is integrated by the rule: 1 / r^4 to degree 5, which is right
 * to 2e-4 of the integral at FAR (tests/numeric/irradiance_test.c), and the sixth power of that beyond. */
#define FAR 4.0f

bool lum_quad_far(const struct lum_light *l, struct lum_vec3 p, float *ret_solid_angle)
{
    struct lum_vec3 d = lum_v3_sub(l->p, p), u = l->u, v = l->v;
    float s[LANES], sum = 0.0f, size2 = lum_dot(u, u) + lum_dot(v, v);
    if (!(lum_dot(d, l->n) < 0.0f && lum_dot(d, d) > FAR * FAR * size2))
        return false;
    for (int i = 0; i < LANES; i++) {
        float x = d.x + rule_x[i] * u.x + rule_y[i] * v.x, y = d.y + rule_x[i] * u.y + rule_y[i] * v.y,
              z = d.z + rule_x[i] * u.z + rule_y[i] * v.z, r2 = x * x + y * y + z * z;
        s[i] = rule_weight[i] / r2 / r2 * sqrtf(r2);
    }
    for (int i = 0; i < LANES; i++)
        sum += s[i];
    *ret_solid_angle = sum * -lum_dot(d, l->n) * l->area;
    return true;
}

static struct lum_irradiance quad(const struct lum_light *l, struct lum_vec3d p, struct lum_vec3d n)
{
    struct lum_vec3d d = lum_v3d_mad(lum_v3d_wide(l->p), p, -1.0), u = lum_v3d_wide(l->u), v = lum_v3d_wide(l->v),
                     n_light = lum_v3d_wide(l->n);
    double r2 = lum_v3d_dot(d, d), area = (double)l->area;
    if (!(-lum_v3d_dot(d, n_light) > 0.0))
        return (struct lum_irradiance){0.0f, 0.0f};
    if (area < POINT_LIKE_SR * r2)
        return from_point(d, n, n_light, area);
    double turn = lum_v3d_dot(lum_v3d_cross(u, v), n_light) > 0.0 ? 1.0 : -1.0;
    struct lum_vec3d corner[4] = {
        lum_v3d_mad(lum_v3d_mad(d, u, -turn), v, -1.0),
        lum_v3d_mad(lum_v3d_mad(d, u, -turn), v, 1.0),
        lum_v3d_mad(lum_v3d_mad(d, u, turn), v, 1.0),
        lum_v3d_mad(lum_v3d_mad(d, u, turn), v, -1.0),
    };
    struct lum_outline outline = {.n = n};
    for (int k = 0; k < 4; k++)
        lum_outline_add(&outline, corner[k], corner[(k + 1) % 4]);
    return lum_outline_irradiance(&outline);
}

/* Points that are looked at together, one a lane. */
#define POINTS 8
struct points {
    double x[POINTS], y[POINTS], z[POINTS];
};

static void load_points(struct points *ret, uint32_t n, const struct lum_vec3 *v)
{
    for (uint32_t i = 0; i < POINTS; i++) {
        const struct lum_vec3 *at = &v[i < n ? i : 0];
        ret->x[i] = (double)at->x, ret->y[i] = (double)at->y, ret->z[i] = (double)at->z;
    }
}

/* From the points p to a corner; lowers *inout_height to how far it is above their horizons. */
static void look_at_corner(struct lum_vec3d corner, const struct points *p, const struct points *n, struct points *ret,
                           double *restrict inout_height)
{
    for (int i = 0; i < POINTS; i++) {
        double x = corner.x - p->x[i], y = corner.y - p->y[i], z = corner.z - p->z[i];
        double height = x * n->x[i] + y * n->y[i] + z * n->z[i];
        inout_height[i] = height < inout_height[i] ? height : inout_height[i];
        ret->x[i] = x, ret->y[i] = y, ret->z[i] = z;
    }
}

/* add_edge for all points. */
static void add_edges(const struct points *a, const struct points *b, struct points *restrict inout_e)
{
    for (int i = 0; i < POINTS; i++) {
        double x = a->y[i] * b->z[i] - a->z[i] * b->y[i], y = a->z[i] * b->x[i] - a->x[i] * b->z[i],
               z = a->x[i] * b->y[i] - a->y[i] * b->x[i];
        double s = sqrt(x * x + y * y + z * z);
        double half = 0.5 * lum_angle(s, a->x[i] * b->x[i] + a->y[i] * b->y[i] + a->z[i] * b->z[i]) / s;
        half = s > 0.0 ? half : 0.0;
        inout_e->x[i] += x * half, inout_e->y[i] += y * half, inout_e->z[i] += z * half;
    }
}

/* from_vector for all points. */
static void sum_up(const struct points *e, const struct points *n, double *restrict ret_a, double *restrict ret_cos)
{
    for (int i = 0; i < POINTS; i++) {
        double a = e->x[i] * n->x[i] + e->y[i] * n->y[i] + e->z[i] * n->z[i];
        double all = sqrt(e->x[i] * e->x[i] + e->y[i] * e->y[i] + e->z[i] * e->z[i]);
        a = a > 0.0 ? a : 0.0;
        a = a < LUM_PI_D ? a : LUM_PI_D;
        double cos = a < all ? a / all : 1.0;
        ret_a[i] = a, ret_cos[i] = all > 0.0 ? cos : 0.0;
    }
}

/* Whether the quad is in front of the points, and no point to them. */
static void look_at_side(const struct lum_light *l, const struct points *p, bool ret_open[POINTS])
{
    struct lum_vec3d at = lum_v3d_wide(l->p), n = lum_v3d_wide(l->n);
    for (int i = 0; i < POINTS; i++) {
        double x = at.x - p->x[i], y = at.y - p->y[i], z = at.z - p->z[i];
        ret_open[i] =
            (x * n.x + y * n.y + z * n.z < 0.0) & ((double)l->area >= POINT_LIKE_SR * (x * x + y * y + z * z));
    }
}

/* All of a quad above the horizon and in front takes the same path for every point; the others are looked at one by
 * one. */
static void quads(const struct lum_light *l, uint32_t n_points, const struct lum_vec3 *at,
                  const struct lum_vec3 *normal, struct lum_irradiance *ret)
{
    static const int8_t sides[4][2] = {{-1, -1}, {-1, 1}, {1, 1}, {1, -1}};
    struct lum_vec3d u = lum_v3d_wide(l->u), v = lum_v3d_wide(l->v);
    double turn = lum_v3d_dot(lum_v3d_cross(u, v), lum_v3d_wide(l->n)) > 0.0 ? 1.0 : -1.0, height[POINTS], a[POINTS],
           cos[POINTS];
    bool open[POINTS];
    struct points p, n, corner[4], e = {0};
    load_points(&p, n_points, at);
    load_points(&n, n_points, normal);
    for (int i = 0; i < POINTS; i++)
        height[i] = INFINITY;
    for (int k = 0; k < 4; k++)
        look_at_corner(lum_v3d_mad(lum_v3d_mad(lum_v3d_wide(l->p), u, turn * sides[k][0]), v, sides[k][1]), &p, &n,
                       &corner[k], height);
    for (int k = 0; k < 4; k++)
        add_edges(&corner[k], &corner[(k + 1) % 4], &e);
    sum_up(&e, &n, a, cos);
    look_at_side(l, &p, open);
    for (uint32_t i = 0; i < n_points; i++)
        ret[i] = open[i] && height[i] > 0.0 ? (struct lum_irradiance){(float)a[i], (float)cos[i]}
                                            : quad(l, lum_v3d_wide(at[i]), lum_v3d_wide(normal[i]));
}

/* ---- disc ---- */

/* The rim: r(t) = d + R (cos t a + sin t b), with a along the part of d in the disc's plane, so that r.r = square +
 * slope cos t. The integrand of the contour, r x r' / 2 r.r, is then (k0 + k1 cos t + k2 sin t) / (square + slope cos
 * t). */
struct rim {
    struct lum_vec3d d, a, b;
    double radius, square, slope;
};

static struct lum_vec3d rim_at(const struct rim *r, double t)
{
    return lum_v3d_mad(lum_v3d_mad(r->d, r->a, r->radius * cos(t)), r->b, r->radius * sin(t));
}

/* Integral of 1 / (square + slope cos t) from 0 to t, -pi <= t <= pi. */
static double integral_inverse(const struct rim *r, double t)
{
    double root = sqrt((r->square - r->slope) * (r->square + r->slope));
    double half = atan2(sqrt(r->square - r->slope) * sin(0.5 * t), sqrt(r->square + r->slope) * cos(0.5 * t));
    return 2.0 * half / root;
}

/* Contour integral along the rim from t0 to t1, both in -pi .. pi. */
static struct lum_vec3d arc_vector(const struct rim *r, double t0, double t1)
{
    struct lum_vec3d normal = lum_v3d_cross(r->a, r->b), da = lum_v3d_cross(r->d, r->a), db = lum_v3d_cross(r->d, r->b);
    double inverse = integral_inverse(r, t1) - integral_inverse(r, t0);
    double c, s; /* integrals of cos t and of sin t over the denominator */
    if (r->slope > 1e-6 * r->square) {
        c = (t1 - t0 - r->square * inverse) / r->slope;
        s = -(log1p(r->slope / r->square * cos(t1)) - log1p(r->slope / r->square * cos(t0))) / r->slope;
    } else { /* to first order in slope / square */
        double q = r->slope / r->square;
        c = (sin(t1) - sin(t0) - q * 0.5 * (t1 - t0 + 0.5 * (sin(2.0 * t1) - sin(2.0 * t0)))) / r->square;
        s = (cos(t0) - cos(t1) - q * 0.25 * (cos(2.0 * t0) - cos(2.0 * t1))) / r->square;
    }
    /* r x r' = R (cos t d x b - sin t d x a) + R^2 a x b */
    struct lum_vec3d zero = {0, 0, 0}, e = lum_v3d_mad(zero, normal, 0.5 * r->radius * r->radius * inverse);
    return lum_v3d_mad(lum_v3d_mad(e, db, 0.5 * r->radius * c), da, -0.5 * r->radius * s);
}

/* The same along the whole rim, where most of that cancels. */
static struct lum_vec3d circle_vector(const struct rim *r)
{
    double inverse = 2.0 * LUM_PI_D / sqrt((r->square - r->slope) * (r->square + r->slope)), q = r->slope / r->square;
    double c =
        r->slope > 1e-6 * r->square ? (2.0 * LUM_PI_D - r->square * inverse) / r->slope : -LUM_PI_D * q / r->square;
    struct lum_vec3d zero = {0, 0, 0},
                     e = lum_v3d_mad(zero, lum_v3d_cross(r->a, r->b), 0.5 * r->radius * r->radius * inverse);
    return lum_v3d_mad(e, lum_v3d_cross(r->d, r->b), 0.5 * r->radius * c);
}

/* The arc above the horizon, where height + R (cos t a.n + sin t b.n) > 0, and the chord that closes it. */
static struct lum_vec3d disc_vector(const struct rim *r, struct lum_vec3d n)
{
    double height = lum_v3d_dot(r->d, n), an = lum_v3d_dot(r->a, n), bn = lum_v3d_dot(r->b, n),
           reach = r->radius * sqrt(an * an + bn * bn);
    if (height >= reach)
        return circle_vector(r);
    if (height <= -reach)
        return (struct lum_vec3d){0, 0, 0};
    double middle = atan2(bn, an), half = acos(-height / reach), t0 = middle - half, t1 = middle + half;
    struct lum_vec3d e;
    if (t0 < -LUM_PI_D || t1 > LUM_PI_D) { /* over the seam */
        double from = t0 < -LUM_PI_D ? t0 + 2.0 * LUM_PI_D : t0, to = t1 > LUM_PI_D ? t1 - 2.0 * LUM_PI_D : t1;
        e = lum_v3d_mad(arc_vector(r, from, LUM_PI_D), arc_vector(r, -LUM_PI_D, to), 1.0);
    } else {
        e = arc_vector(r, t0, t1);
    }
    add_edge(rim_at(r, t1), rim_at(r, t0), &e);
    return e;
}

struct lum_irradiance lum_disc_irradiance(const struct lum_light *l, struct lum_vec3 at, struct lum_vec3 normal)
{
    struct lum_vec3d p = lum_v3d_wide(at), n = lum_v3d_wide(normal);
    struct lum_vec3d d = lum_v3d_mad(lum_v3d_wide(l->p), p, -1.0), n_light = lum_v3d_wide(l->n);
    double r2 = lum_v3d_dot(d, d), facing = -lum_v3d_dot(d, n_light), radius = (double)l->radius;
    if (!(facing > 0.0))
        return (struct lum_irradiance){0.0f, 0.0f};
    if (LUM_PI_D * radius * radius < POINT_LIKE_SR * r2)
        return from_point(d, n, n_light, LUM_PI_D * radius * radius);
    struct lum_vec3d beside = lum_v3d_mad(d, n_light, facing);
    double off = lum_v3d_length(beside);
    struct lum_frame f = lum_frame_from_normal(l->n);
    struct rim r = {.d = d, .radius = radius, .square = r2 + radius * radius, .slope = 2.0 * radius * off};
    r.a = off > 0x1p-20 * radius ? lum_v3d_mad((struct lum_vec3d){0, 0, 0}, beside, 1.0 / off) : lum_v3d_wide(f.t);
    r.b = lum_v3d_cross(r.a, n_light); /* so that a x b points away from where the light goes */
    if (!(off > 0x1p-20 * radius))
        r.slope = 0.0;
    return from_vector(disc_vector(&r, n), n);
}

/* ---- sphere ---- */

/* A cap of half angle sigma whose axis is at an angle theta to n, in three parts: above the horizon, below, across. */
struct lum_irradiance lum_sphere_irradiance(const struct lum_light *l, struct lum_vec3 at, struct lum_vec3 normal)
{
    struct lum_vec3d p = lum_v3d_wide(at), n = lum_v3d_wide(normal);
    struct lum_vec3d d = lum_v3d_mad(lum_v3d_wide(l->p), p, -1.0);
    double r2 = lum_v3d_dot(d, d), sin2 = (double)l->radius * (double)l->radius / r2,
           cos = lum_v3d_dot(d, n) / sqrt(r2);
    if (!(sin2 < 1.0))
        return (struct lum_irradiance){0.0f, 0.0f}; /* inside, where it does not shine */
    double a = 0.0;
    if (cos * cos >= sin2) {
        a = LUM_PI_D * sin2 * fmax(cos, 0.0);
    } else {
        double sin = sqrt(fmax(1.0 - cos * cos, 0.0)), cot = sqrt(1.0 / sin2 - 1.0);
        double y = fmin(fmax(-cot * cos / sin, -1.0), 1.0), s = sin * sqrt(1.0 - y * y);
        a = fmax((cos * acos(y) - cot * s) * sin2 + lum_angle(s, cot), 0.0);
    }
    return (struct lum_irradiance){(float)a, (float)fmin(a / (LUM_PI_D * sin2), 1.0)};
}

/* ---- any light ---- */

void lum_quad_irradiances(const struct lum_light *l, uint32_t n_points, const struct lum_vec3 *p,
                          const struct lum_vec3 *n, struct lum_irradiance *ret)
{
    for (uint32_t i = 0; i < n_points; i += POINTS)
        quads(l, n_points - i < POINTS ? n_points - i : POINTS, p + i, n + i, ret + i);
}

bool lum_light_has_irradiance(const struct lum_light *l)
{
    const struct lum_emitter_row *row = l->kind;
    return (row->irradiance || row->irradiances) && (!row->has_irradiance || row->has_irradiance(l));
}

void lum_light_irradiance(const struct lum_light *l, uint32_t n_points, const struct lum_vec3 *p,
                          const struct lum_vec3 *n, struct lum_irradiance *ret)
{
    const struct lum_emitter_row *row = l->kind;
    if (row->irradiances)
        row->irradiances(l, n_points, p, n, ret);
    for (uint32_t i = 0; i < n_points && row->irradiance; i++)
        ret[i] = row->irradiance(l, p[i], n[i]);
}

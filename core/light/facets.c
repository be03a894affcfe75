#include "core/light/facets.h"

#include "core/accel/trace.h"
#include "core/light/rect.h"
#include "core/math/angle.h"
#include "core/math/vec3d.h"

/* ---- what is known of them ---- */

/* Of the radius: less is the rounding of coordinates, and of a turned body. */
#define FLAT 1e-4

/* In radii of the ball around them. From there on no point of the ball is more than 5/3 as far as another: distances
 * make samples by area differ by less than 3 in weight. */
#define NEAR 4.0f

static double find_ball(struct lum_facets *f)
{
    struct lum_vec3 lo = f->point[0], hi = lo;
    for (uint32_t i = 0; i < f->n_points; i++) {
        struct lum_vec3 p = f->point[i];
        lo = lum_v3_min(lo, p);
        hi = lum_v3_max(hi, p);
    }
    float radius = 0.5f * lum_length(lum_v3_sub(hi, lo));
    f->centre = lum_v3_mul(lum_v3_add(lo, hi), 0.5f);
    f->near2 = NEAR * NEAR * radius * radius;
    return (double)radius;
}

/* The most and the least that points lie before the plane through `at`; normal: unit. */
static void span(const struct lum_facets *f, struct lum_vec3 at, struct lum_vec3d normal, double *ret_least,
                 double *ret_most)
{
    *ret_least = INFINITY, *ret_most = -INFINITY;
    for (uint32_t i = 0; i < f->n_points; i++) {
        double height = lum_v3d_dot(lum_v3d_sub(lum_v3d_wide(f->point[i]), lum_v3d_wide(at)), normal);
        *ret_least = fmin(*ret_least, height);
        *ret_most = fmax(*ret_most, height);
    }
}

/* Adds the edge, or finds its other facet. False: there are too many at it. */
static bool add_edge(struct lum_facets *f, uint8_t a, uint8_t b, uint32_t of)
{
    for (uint32_t i = 0; i < f->n_edges; i++) {
        struct lum_facet_edge *e = &f->edge[i];
        if (e->a == a && e->b == b)
            return false;
        if (e->a != b || e->b != a)
            continue;
        if (e->beyond != LUM_FACETS_MAX)
            return false;
        e->beyond = (uint8_t)of;
        return true;
    }
    f->edge[f->n_edges++] = (struct lum_facet_edge){a, b, (uint8_t)of, LUM_FACETS_MAX};
    return true;
}

static bool find_edges(struct lum_facets *f, bool mirrored)
{
    for (uint32_t i = 0; i < f->n; i++) {
        const uint8_t *corner = f->facet[i].corner;
        if (!(lum_v3d_length(f->facet[i].normal) > 0.0))
            return false;
        for (uint32_t k = 0; k < 3; k++) {
            uint32_t next = (k + 1) % 3;
            if (!add_edge(f, corner[mirrored ? next : k], corner[mirrored ? k : next], i))
                return false;
        }
    }
    return true;
}

/* Nothing lies before a facet, or beyond an edge that ends all. */
static bool is_convex(const struct lum_facets *f, double radius, bool *ret_closed)
{
    double most_off = FLAT * radius, least, most;
    bool flat = true;
    *ret_closed = true;
    for (uint32_t i = 0; i < f->n; i++) {
        span(f, f->point[f->facet[i].corner[0]], f->facet[i].normal, &least, &most);
        flat = flat && least >= -most_off && lum_v3d_dot(f->facet[i].normal, f->facet[0].normal) > 0.0;
        if (most > most_off)
            return false;
    }
    for (uint32_t i = 0; i < f->n_edges; i++) {
        const struct lum_facet_edge *e = &f->edge[i];
        if (e->beyond != LUM_FACETS_MAX)
            continue;
        *ret_closed = false;
        struct lum_vec3d along = lum_v3d_sub(lum_v3d_wide(f->point[e->b]), lum_v3d_wide(f->point[e->a]));
        struct lum_vec3d inwards =
            lum_v3d_cross(f->facet[e->of].normal, lum_v3d_mul(along, 1.0 / lum_v3d_length(along)));
        span(f, f->point[e->a], inwards, &least, &most);
        if (least < -most_off)
            return false;
    }
    return flat || *ret_closed;
}

/* Corners of neighbours are one point where they are the same to the bit. */
static uint8_t add_point(struct lum_facets *f, struct lum_vec3 p)
{
    for (uint32_t i = 0; i < f->n_points; i++)
        if (lum_v3_same(f->point[i], p))
            return (uint8_t)i;
    f->point[f->n_points] = p;
    return (uint8_t)f->n_points++;
}

void lum_facets_init(struct lum_facets *f, uint32_t n, const struct lum_vec3 (*corner)[3], bool mirrored)
{
    f->n = n;
    f->n_points = f->n_edges = 0;
    for (uint32_t i = 0; i < n; i++) {
        struct lum_facet *to = &f->facet[i];
        struct lum_vec3d p[3];
        for (uint32_t k = 0; k < 3; k++) {
            p[k] = lum_v3d_wide(corner[i][k]);
            to->corner[k] = add_point(f, corner[i][k]);
        }
        struct lum_vec3d along = lum_v3d_cross(lum_v3d_sub(p[1], p[0]), lum_v3d_sub(p[2], p[0]));
        double length = lum_v3d_length(along);
        to->normal = lum_v3d_mul(along, length > 0.0 ? (mirrored ? -1.0 : 1.0) / length : 0.0);
    }
    double radius = find_ball(f);
    bool closed = false;
    f->outlined = find_edges(f, mirrored) && is_convex(f, radius, &closed);
    f->closed = f->outlined && closed;
}
_Static_assert(3 * LUM_FACETS_MAX <= UINT8_MAX, "indices are bytes");

/* ---- sampling ---- */

/* Bits of the facets that p sees, but for what a convex body hides itself. */
struct sight {
    uint32_t seen;
    uint32_t on; /* p is on an outlined one: of these facets */
    bool behind; /* what is outlined shows its other side: a sheet, or a body around p */
};

static struct sight look_from(const struct lum_facets *f, bool both_sides, struct lum_vec3d p)
{
    uint32_t front = 0, level = 0, all = UINT32_MAX >> (32 - f->n);
    for (uint32_t i = 0; i < f->n; i++) {
        double height = lum_v3d_dot(lum_v3d_sub(p, lum_v3d_wide(f->point[f->facet[i].corner[0]])), f->facet[i].normal);
        front |= (uint32_t)(height > (double)LUM_RAY_OFFSET) << i;
        level |= (uint32_t)(fabs(height) <= (double)LUM_RAY_OFFSET) << i;
    }
    if (!f->outlined)
        return (struct sight){both_sides ? all & ~level : front, 0, false};
    if (front || level)
        return (struct sight){front, front ? 0 : level, false};
    return (struct sight){both_sides ? all : 0, 0, both_sides};
}
_Static_assert(LUM_FACETS_MAX <= 32, "facets are bits of a word");

bool lum_facets_hide_backs(const struct lum_facets *f, struct lum_vec3 p)
{
    return f->closed && look_from(f, false, lum_v3d_wide(p)).seen;
}

/* The spherical triangle of corners 0 to 2, as Peters 2021 ("BRDF importance sampling for polygonal lights", 4) has it:
 * the tangent of half its area is volume / (other + beside). */
struct parts {
    double volume, other, beside;
};

static struct parts parts_of(const struct lum_vec3d c[3])
{
    return (struct parts){fabs(lum_v3d_dot(c[0], lum_v3d_cross(c[1], c[2]))),
                          lum_v3d_dot(c[0], c[2]) + lum_v3d_dot(c[1], c[2]), 1.0 + lum_v3d_dot(c[0], c[1])};
}

/* Unit vectors to some points. False: p is one of them. */
static bool look_at(uint32_t n, const struct lum_vec3 *point, struct lum_vec3d p, struct lum_vec3d *ret_to)
{
    double least = INFINITY;
    for (uint32_t k = 0; k < n; k++) {
        struct lum_vec3d d = lum_v3d_sub(lum_v3d_wide(point[k]), p);
        double r = lum_v3d_length(d);
        ret_to[k] = lum_v3d_mul(d, 1.0 / r);
        least = r < least ? r : least;
    }
    return least > 0.0;
}

static double solid_angle(const struct lum_facet *f, const struct lum_vec3d *to)
{
    struct lum_vec3d c[3] = {to[f->corner[0]], to[f->corner[1]], to[f->corner[2]]};
    struct parts s = parts_of(c);
    return s.volume > 0.0 ? 2.0 * lum_angle(s.volume, s.other + s.beside) : 0.0;
}

bool lum_facets_look(const struct lum_facets *f, bool both_sides, struct lum_vec3 at, struct lum_facets_view *ret)
{
    struct lum_vec3 off = lum_v3_sub(at, f->centre);
    struct lum_vec3d p = lum_v3d_wide(at), to[3 * LUM_FACETS_MAX];
    if (!(lum_dot(off, off) < f->near2) || !look_at(f->n_points, f->point, p, to))
        return false;
    uint32_t seen = look_from(f, both_sides, p).seen;
    ret->solid_angle = 0.0;
    for (uint32_t i = 0; i < f->n; i++) {
        ret->below[i] = ret->solid_angle;
        if (seen >> i & 1)
            ret->solid_angle += solid_angle(&f->facet[i], to);
    }
    return ret->solid_angle >= LUM_RECT_MIN_SR;
}

/* Evenly in the spherical triangle: a part of it from corner 0 on, whose third corner lies between 0 and 2, and on the
 * arc from corner 1 to that. */
static struct lum_vec3d sample_triangle(const struct lum_vec3d c[3], double x, double y)
{
    struct parts s = parts_of(c);
    double half = x * lum_angle(s.volume, s.other + s.beside), cosine = cos(half), sine = sin(half);
    struct lum_vec3d r = lum_v3d_mad(lum_v3d_mul(c[0], s.volume * cosine - s.other * sine), c[2], s.beside * sine);
    struct lum_vec3d end = lum_v3d_mad(lum_v3d_mul(r, 2.0 * lum_v3d_dot(c[0], r) / lum_v3d_dot(r, r)), c[0], -1.0);
    double reach = lum_v3d_dot(c[1], end), along = 1.0 - y * (1.0 - reach), width = 1.0 - reach * reach;
    double t = width > 0.0 ? sqrt(fmax(1.0 - along * along, 0.0) / width) : 0.0;
    return lum_v3d_mad(lum_v3d_mul(c[1], along - t * reach), end, t);
}

/* The last facet that something is seen of and whose sum is not above x. */
static uint32_t find_facet(const struct lum_facets *f, const struct lum_facets_view *v, double x)
{
    uint32_t found = 0;
    for (uint32_t i = 0; i < f->n; i++) {
        double end = i + 1 < f->n ? v->below[i + 1] : v->solid_angle;
        if (end > v->below[i] && (v->below[i] <= x))
            found = i;
    }
    return found;
}

struct lum_vec3 lum_facets_sample(const struct lum_facets *f, const struct lum_facets_view *v, struct lum_vec3 at,
                                  struct lum_vec2 xi)
{
    double x = (double)xi.x * v->solid_angle;
    uint32_t i = find_facet(f, v, x);
    const struct lum_facet *facet = &f->facet[i];
    struct lum_vec3d p = lum_v3d_wide(at), c[3];
    struct lum_vec3 corner[3];
    double farthest = 0.0;
    for (uint32_t k = 0; k < 3; k++) {
        corner[k] = f->point[facet->corner[k]];
        farthest = fmax(farthest, lum_v3d_length(lum_v3d_sub(lum_v3d_wide(corner[k]), p)));
    }
    look_at(3, corner, p, c);
    double end = i + 1 < f->n ? v->below[i + 1] : v->solid_angle;
    struct lum_vec3d d = sample_triangle(c, (x - v->below[i]) / (end - v->below[i]), (double)xi.y);
    double t = lum_v3d_dot(lum_v3d_sub(lum_v3d_wide(corner[0]), p), facet->normal) / lum_v3d_dot(d, facet->normal);
    t = t > 0.0 && t < farthest ? t : farthest; /* seen along its plane */
    return lum_v3((float)(d.x * t), (float)(d.y * t), (float)(d.z * t));
}

/* ---- in closed form ---- */

/* Of all directions above a surface: as much of coats and fuzz as goes with the fifth power of 1 - cos is that of a
 * mean over them, 1/21. */
#define COS_ALL_AROUND 0.45605f

/* Facet by facet: at the horizon, where corners that rounding moved there and back, the outline of a body has more than
 * the two crossings that can be told apart. */
static struct lum_irradiance sum_facets(const struct lum_facets *f, const struct sight *sight, struct lum_vec3d p,
                                        struct lum_vec3d n)
{
    struct lum_outline all = {.n = n};
    for (uint32_t i = 0; i < f->n; i++) {
        struct lum_outline one = {.n = n};
        struct lum_vec3d to[3];
        if (!(sight->seen >> i & 1))
            continue;
        for (uint32_t k = 0; k < 3; k++)
            to[k] = lum_v3d_sub(lum_v3d_wide(f->point[f->facet[i].corner[k]]), p);
        bool turned = lum_v3d_dot(to[0], lum_v3d_cross(to[1], to[2])) < 0.0; /* counter-clockwise from p */
        for (uint32_t k = 0; k < 3; k++)
            lum_outline_add(&one, to[turned ? (k + 1) % 3 : k], to[turned ? k : (k + 1) % 3]);
        lum_outline_close(&one);
        all.e = lum_v3d_mad(all.e, one.e, 1.0);
    }
    return lum_outline_irradiance(&all);
}

struct lum_irradiance lum_facets_irradiance(const struct lum_facets *f, bool both_sides, struct lum_vec3 at,
                                            struct lum_vec3 normal)
{
    const struct lum_irradiance none = {0.0f, 0.0f}, all_around = {LUM_PI, COS_ALL_AROUND};
    struct lum_vec3d p = lum_v3d_wide(at), n = lum_v3d_wide(normal);
    struct sight sight = look_from(f, both_sides, p);
    if (sight.on && both_sides && f->closed) /* of a body, whose inner side sees nothing else */
        return lum_v3d_dot(n, f->facet[__builtin_ctz(sight.on)].normal) < 0.0 ? all_around : none;
    if (!sight.seen)
        return none;
    if (sight.behind && f->closed)
        return all_around;
    struct lum_outline outline = {.n = n};
    for (uint32_t i = 0; i < f->n_edges; i++) {
        const struct lum_facet_edge *e = &f->edge[i];
        bool of = sight.seen >> e->of & 1, beyond = e->beyond != LUM_FACETS_MAX && (sight.seen >> e->beyond & 1);
        if (of == beyond)
            continue;
        struct lum_vec3d a = lum_v3d_sub(lum_v3d_wide(f->point[e->a]), p),
                         b = lum_v3d_sub(lum_v3d_wide(f->point[e->b]), p);
        if (of == sight.behind)
            lum_outline_add(&outline, a, b);
        else
            lum_outline_add(&outline, b, a);
    }
    return outline.crossings > 2 ? sum_facets(f, &sight, p, n) : lum_outline_irradiance(&outline);
}

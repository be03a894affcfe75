#include "core/light/rect.h"

#include "core/math/angle.h"
#include "core/math/vec3d.h"

/* NaN becomes lo. */
static double clamp(double x, double lo, double hi)
{
    return x > lo ? (x < hi ? x : hi) : lo;
}

/* Angles as unit complex numbers: their sum is the product's argument, so that no inverse function is needed for each.
 */
struct turn {
    double c, s;
};

static struct turn turned(struct turn a, struct turn b)
{
    return (struct turn){a.c * b.c - a.s * b.s, a.s * b.c + a.c * b.s};
}

/* Half the angle at a corner of the spherical rectangle, which lies between the planes through two adjacent edges; a
 * and b are the z components of the planes' unit normals: cos of the angle is -a b. */
static struct turn half_corner(double a, double b)
{
    double c = clamp(-a * b, -1.0, 1.0);
    return (struct turn){sqrt(0.5 * (1.0 + c)), sqrt(0.5 * (1.0 - c))};
}

bool lum_rect_view_init(struct lum_rect_view *ret_view, struct lum_vec3 p, struct lum_vec3 centre, struct lum_vec3 u,
                        struct lum_vec3 v)
{
    struct lum_vec3d du = lum_v3d_wide(u), dv = lum_v3d_wide(v), d = lum_v3d_sub(lum_v3d_wide(centre), lum_v3d_wide(p));
    double hx = lum_v3d_length(du), hy = lum_v3d_length(dv);
    struct lum_rect_view w = {.x = lum_v3d_mul(du, 1.0 / hx), .y = lum_v3d_mul(dv, 1.0 / hy)};
    w.z = lum_v3d_cross(w.x, w.y);
    w.z0 = lum_v3d_dot(d, w.z);
    if (w.z0 > 0.0) {
        w.z = lum_v3d_mul(w.z, -1.0);
        w.z0 = -w.z0;
    }
    if (!(w.z0 < 0.0))
        return false;
    double x = lum_v3d_dot(d, w.x), y = lum_v3d_dot(d, w.y);
    w.x0 = x - hx, w.x1 = x + hx, w.y0 = y - hy, w.y1 = y + hy;

    /* z components of the unit normals of the planes through the point and the four edges. */
    double z2 = w.z0 * w.z0;
    double n0 = -w.y0 / sqrt(z2 + w.y0 * w.y0), n1 = w.x1 / sqrt(z2 + w.x1 * w.x1);
    double n2 = w.y1 / sqrt(z2 + w.y1 * w.y1), n3 = -w.x0 / sqrt(z2 + w.x0 * w.x0);
    /* The solid angle is the four corners' sum less 2 pi: its half is the argument of the half corners' product turned
     * by pi, and lies in [0, pi], where it cannot wrap. k = 2 pi - g2 - g3. */
    struct turn g01 = turned(half_corner(n0, n1), half_corner(n1, n2));
    struct turn g23 = turned(half_corner(n2, n3), half_corner(n3, n0));
    struct turn all = turned(g01, g23), k = turned(g23, g23);
    w.solid_angle = 2.0 * lum_angle(fabs(all.s), -all.c);
    w.b0 = n0, w.b1 = n2;
    w.cos_k = k.c, w.sin_k = -k.s;
    *ret_view = w;
    return true;
}

struct lum_vec3 lum_rect_view_sample(const struct lum_rect_view *w, struct lum_vec2 xi)
{
    double a = (double)xi.x * w->solid_angle;
    struct turn au = turned((struct turn){cos(a), sin(a)}, (struct turn){w->cos_k, w->sin_k});
    double fu = (au.c * w->b0 - w->b1) / au.s;
    double cu = clamp(copysign(1.0 / sqrt(fu * fu + w->b0 * w->b0), fu), -1.0, 1.0);
    double xu = -(cu * w->z0) / sqrt(cu * cu < 1.0 ? 1.0 - cu * cu : 0x1p-1000);
    xu = clamp(xu, w->x0, w->x1);

    double d = sqrt(xu * xu + w->z0 * w->z0);
    double h0 = w->y0 / sqrt(d * d + w->y0 * w->y0), h1 = w->y1 / sqrt(d * d + w->y1 * w->y1);
    double hv = h0 + (double)xi.y * (h1 - h0), hv2 = hv * hv;
    double yv = hv2 < 1.0 ? hv * d / sqrt(1.0 - hv2) : w->y1;
    yv = clamp(yv, w->y0, w->y1);
    return (struct lum_vec3){(float)(xu * w->x.x + yv * w->y.x + w->z0 * w->z.x),
                             (float)(xu * w->x.y + yv * w->y.y + w->z0 * w->z.y),
                             (float)(xu * w->x.z + yv * w->y.z + w->z0 * w->z.z)};
}

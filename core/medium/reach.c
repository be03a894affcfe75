/* Which part of a ray a light can shine on. */
#include "core/light/emitter.h"
#include "core/medium/medium.h"

/* Keeps the part of [t0, t1] where at + t slope > 0. */
static bool clip_half(double at, double slope, float *inout_t0, float *inout_t1)
{
    if (slope == 0.0)
        return at > 0.0;
    float t = (float)(-at / slope);
    if (slope > 0.0)
        *inout_t0 = lum_max(*inout_t0, t);
    else
        *inout_t1 = lum_min(*inout_t1, t);
    return *inout_t0 < *inout_t1;
}

/* A cone is widened by this much in the cosine: what rounding may cut off is dark, and found out by the sample. */
#define CONE_ROUNDING 0x1p-20

/* The points at t for which cos(angle from the axis) > c > 0: a t^2 + 2 b t + e > 0 on the side of the axis. The cone
 * is convex, so they are one interval. */
static bool clip_cone(const struct lum_light *l, const struct lum_segment *s, float *inout_t0, float *inout_t1)
{
    double c = 1.0 - (double)l->omc_outer - CONE_ROUNDING;
    if (!(c > 0.0))
        return true;
    double vx = (double)s->o.x - (double)l->p.x, vy = (double)s->o.y - (double)l->p.y,
           vz = (double)s->o.z - (double)l->p.z;
    double vn = vx * (double)l->n.x + vy * (double)l->n.y + vz * (double)l->n.z, dn = (double)lum_dot(s->d, l->n);
    double dv = vx * (double)s->d.x + vy * (double)s->d.y + vz * (double)s->d.z, vv = vx * vx + vy * vy + vz * vz;
    double a = dn * dn - c * c, b = dn * vn - c * c * dv, e = vn * vn - c * c * vv, root = b * b - a * e;
    if (a == 0.0)
        return true;
    if (!(root > 0.0)) /* beside both cones; or through the tip, where all is one point */
        return a > 0.0;
    root = sqrt(root);
    double t0 = (-b - root) / a, t1 = (-b + root) / a;
    if (a > 0.0)
        return dn > 0.0 ? clip_half(-t1, 1.0, inout_t0, inout_t1) : clip_half(t0, -1.0, inout_t0, inout_t1);
    if (!(vn + 0.5 * (t0 + t1) * dn > 0.0))
        return false;
    return clip_half(-t1, 1.0, inout_t0, inout_t1) && clip_half(t0, -1.0, inout_t0, inout_t1);
}

bool lum_light_reaches(const struct lum_light *l, struct lum_segment *inout)
{
    if (l->falloff && l->falloff->cone)
        return clip_cone(l, inout, &inout->t0, &inout->t1);
    if (!l->kind->flat)
        return true;
    return clip_half((double)lum_dot(lum_v3_sub(inout->o, l->p), l->n), (double)lum_dot(inout->d, l->n), &inout->t0,
                     &inout->t1);
}

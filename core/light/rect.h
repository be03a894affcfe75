/* Sampling a rectangle uniformly over the solid angle it subtends (Urena, Fajardo & King 2013). In double: the solid
 * angle is 2 pi less than a sum of four angles, and is as small as LUM_RECT_MIN_SR. */
#ifndef LUM_CORE_LIGHT_RECT_H
#define LUM_CORE_LIGHT_RECT_H

#include "core/math/vec.h"

/* Below, callers sample by area: the pdf varies little over so small a rectangle (pbrt's threshold). */
#define LUM_RECT_MIN_SR 1e-3

/* The rectangle as seen from one point; axes x, y, z of the rectangle, z pointing away from it, origin at the point. */
struct lum_rect_view {
    double solid_angle;
    struct lum_vec3d x, y, z;
    double x0, x1, y0, y1, z0;   /* extent; z0 < 0 */
    double b0, b1, cos_k, sin_k; /* Urena's b0, b1, and k as cosine and sine */
};

/* half edges u, v at right angles and not 0. False when p lies in the plane of the rectangle. */
bool lum_rect_view_init(struct lum_rect_view *ret_view, struct lum_vec3 p, struct lum_vec3 centre, struct lum_vec3 u,
                        struct lum_vec3 v);

/* Vector from the point to the sampled point of the rectangle. pdf_sa = 1 / solid_angle. */
struct lum_vec3 lum_rect_view_sample(const struct lum_rect_view *view, struct lum_vec2 xi);

#endif

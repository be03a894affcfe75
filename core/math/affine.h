/* Affine maps, row-major 3x4: p' = m[:, 0:3] p + m[:, 3]. Float for rendering, double where the scene is placed. */
#ifndef LUM_CORE_MATH_AFFINE_H
#define LUM_CORE_MATH_AFFINE_H

#include "core/math/vec.h"

struct lum_affine {
    float m[3][4];
};
struct lum_affined {
    double m[3][4];
};

static inline struct lum_vec3 lum_affine_point(const struct lum_affine *a, struct lum_vec3 p)
{
    return lum_v3(a->m[0][0] * p.x + a->m[0][1] * p.y + a->m[0][2] * p.z + a->m[0][3],
                  a->m[1][0] * p.x + a->m[1][1] * p.y + a->m[1][2] * p.z + a->m[1][3],
                  a->m[2][0] * p.x + a->m[2][1] * p.y + a->m[2][2] * p.z + a->m[2][3]);
}
static inline struct lum_vec3 lum_affine_vector(const struct lum_affine *a, struct lum_vec3 v)
{
    return lum_v3(a->m[0][0] * v.x + a->m[0][1] * v.y + a->m[0][2] * v.z,
                  a->m[1][0] * v.x + a->m[1][1] * v.y + a->m[1][2] * v.z,
                  a->m[2][0] * v.x + a->m[2][1] * v.y + a->m[2][2] * v.z);
}
/* It turns what is on the left to the right. */
static inline bool lum_affine_mirrors(const struct lum_affine *a)
{
    struct lum_vec3 x = lum_v3(a->m[0][0], a->m[1][0], a->m[2][0]), y = lum_v3(a->m[0][1], a->m[1][1], a->m[2][1]);
    return lum_dot(lum_cross(x, y), lum_v3(a->m[0][2], a->m[1][2], a->m[2][2])) < 0.0f;
}

struct lum_affined lum_affined_identity(void);
struct lum_affined lum_affined_mul(const struct lum_affined *a, const struct lum_affined *b); /* a after b */
struct lum_vec3d lum_affined_point(const struct lum_affined *a, struct lum_vec3d p);
/* False when the map is singular to working precision: not finite, or |M M^-1 - I| >= 1e-6 (NOTES H5). */
bool lum_affined_invert(const struct lum_affined *a, struct lum_affined *ret_inverse);
struct lum_affine lum_affine_from_double(const struct lum_affined *a);

#endif

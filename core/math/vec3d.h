/* Vectors in double: where the scene is placed, and where light is integrated in closed form. */
#ifndef LUM_CORE_MATH_VEC3D_H
#define LUM_CORE_MATH_VEC3D_H

#include "core/math/vec.h"

static inline struct lum_vec3d lum_v3d_wide(struct lum_vec3 a)
{
    return (struct lum_vec3d){(double)a.x, (double)a.y, (double)a.z};
}
static inline struct lum_vec3d lum_v3d_sub(struct lum_vec3d a, struct lum_vec3d b)
{
    return (struct lum_vec3d){a.x - b.x, a.y - b.y, a.z - b.z};
}
static inline struct lum_vec3d lum_v3d_mul(struct lum_vec3d a, double s)
{
    return (struct lum_vec3d){a.x * s, a.y * s, a.z * s};
}
/* a + b * s */
static inline struct lum_vec3d lum_v3d_mad(struct lum_vec3d a, struct lum_vec3d b, double s)
{
    return (struct lum_vec3d){a.x + b.x * s, a.y + b.y * s, a.z + b.z * s};
}
static inline bool lum_v3d_within(struct lum_vec3d a, double limit)
{
    return fabs(a.x) <= limit && fabs(a.y) <= limit && fabs(a.z) <= limit;
}
static inline double lum_v3d_dot(struct lum_vec3d a, struct lum_vec3d b)
{
    return a.x * b.x + a.y * b.y + a.z * b.z;
}
static inline struct lum_vec3d lum_v3d_cross(struct lum_vec3d a, struct lum_vec3d b)
{
    return (struct lum_vec3d){a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
static inline double lum_v3d_length(struct lum_vec3d a)
{
    return sqrt(lum_v3d_dot(a, a));
}

#endif

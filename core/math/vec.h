/* Vectors, and frames of them. Float for rendering, double where the scene is placed.
 * Spaces: p_local (a mesh's own), p_world (the user's metres), p_scene (normalised: what Embree sees). */
#ifndef LUM_CORE_MATH_VEC_H
#define LUM_CORE_MATH_VEC_H

#include <math.h>
#include <stdbool.h>
#include <stdint.h>

#define LUM_PI 3.14159265358979323846f
#define LUM_INV_PI 0.31830988618379067154f
#define LUM_PI_D 3.14159265358979323846264338327950288
#define LUM_RAD_PER_DEG (LUM_PI_D / 180.0)

struct lum_vec2 {
    float x, y;
};
struct lum_vec3 {
    float x, y, z;
};
struct lum_vec3d {
    double x, y, z;
};
/* One instruction each, where fminf and fmaxf are calls. b when either is NaN. */
static inline float lum_min(float a, float b)
{
    return a < b ? a : b;
}
static inline float lum_max(float a, float b)
{
    return a > b ? a : b;
}
/* NaN becomes lo. */
static inline float lum_clamp(float x, float lo, float hi)
{
    return lum_min(lum_max(x, lo), hi);
}
static inline float lum_clamp01(float x)
{
    return lum_clamp(x, 0.0f, 1.0f);
}
static inline float lum_mix(float a, float b, float t)
{
    return a + (b - a) * t;
}

static inline struct lum_vec3 lum_v3(float x, float y, float z)
{
    return (struct lum_vec3){x, y, z};
}
static inline struct lum_vec3 lum_v3_add(struct lum_vec3 a, struct lum_vec3 b)
{
    return lum_v3(a.x + b.x, a.y + b.y, a.z + b.z);
}
static inline struct lum_vec3 lum_v3_sub(struct lum_vec3 a, struct lum_vec3 b)
{
    return lum_v3(a.x - b.x, a.y - b.y, a.z - b.z);
}
static inline struct lum_vec3 lum_v3_mul(struct lum_vec3 a, float s)
{
    return lum_v3(a.x * s, a.y * s, a.z * s);
}
static inline struct lum_vec3 lum_v3_neg(struct lum_vec3 a)
{
    return lum_v3(-a.x, -a.y, -a.z);
}
static inline struct lum_vec3 lum_v3_min(struct lum_vec3 a, struct lum_vec3 b)
{
    return lum_v3(lum_min(a.x, b.x), lum_min(a.y, b.y), lum_min(a.z, b.z));
}
static inline struct lum_vec3 lum_v3_max(struct lum_vec3 a, struct lum_vec3 b)
{
    return lum_v3(lum_max(a.x, b.x), lum_max(a.y, b.y), lum_max(a.z, b.z));
}
static inline struct lum_vec3 lum_v3_abs(struct lum_vec3 a)
{
    return lum_v3(fabsf(a.x), fabsf(a.y), fabsf(a.z));
}
static inline float lum_v3_largest(struct lum_vec3 a)
{
    return lum_max(a.x, lum_max(a.y, a.z));
}
/* a + b * s */
static inline struct lum_vec3 lum_v3_mad(struct lum_vec3 a, struct lum_vec3 b, float s)
{
    return lum_v3(a.x + b.x * s, a.y + b.y * s, a.z + b.z * s);
}
static inline float lum_dot(struct lum_vec3 a, struct lum_vec3 b)
{
    return a.x * b.x + a.y * b.y + a.z * b.z;
}
static inline struct lum_vec3 lum_cross(struct lum_vec3 a, struct lum_vec3 b)
{
    return lum_v3(a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x);
}
static inline float lum_length(struct lum_vec3 a)
{
    return sqrtf(lum_dot(a, a));
}
/* The zero vector stays zero: never a NaN. Scales first, so that tiny and huge vectors do not under- or overflow. */
static inline struct lum_vec3 lum_normalize(struct lum_vec3 a)
{
    float l2 = lum_dot(a, a);
    if (l2 > 0x1p-80f && l2 < 0x1p80f) /* no square of a component was lost that matters */
        return lum_v3_mul(a, 1.0f / sqrtf(l2));
    float m = lum_v3_largest(lum_v3_abs(a));
    if (!(m > 0.0f) || !isfinite(m))
        return lum_v3(0.0f, 0.0f, 0.0f);
    a = lum_v3(a.x / m, a.y / m, a.z / m);
    return lum_v3_mul(a, 1.0f / lum_length(a));
}
static inline bool lum_v3_finite(struct lum_vec3 a)
{
    return isfinite(a.x) && isfinite(a.y) && isfinite(a.z);
}

static inline bool lum_v3_same(struct lum_vec3 a, struct lum_vec3 b)
{
    return a.x == b.x && a.y == b.y && a.z == b.z;
}
static inline float lum_v3_part(struct lum_vec3 a, uint32_t axis)
{
    return axis == 0 ? a.x : axis == 1 ? a.y : a.z;
}

/* Orthonormal frame around unit n (Duff et al. 2017): t, b, n right-handed. */
struct lum_frame {
    struct lum_vec3 t, b, n;
};
static inline struct lum_frame lum_frame_from_normal(struct lum_vec3 n)
{
    float s = n.z < 0.0f ? -1.0f : 1.0f; /* not the sign bit: of an upright wall it is that of a zero, by its winding */
    float a = -1.0f / (s + n.z);
    float c = n.x * n.y * a;
    return (struct lum_frame){{1.0f + s * n.x * n.x * a, s * c, -s * n.x}, {c, s + n.y * n.y * a, -n.y}, n};
}
static inline struct lum_vec3 lum_frame_to_scene(const struct lum_frame *f, struct lum_vec3 v)
{
    return lum_v3_mad(lum_v3_mad(lum_v3_mul(f->n, v.z), f->b, v.y), f->t, v.x);
}
static inline struct lum_vec3 lum_frame_to_local(const struct lum_frame *f, struct lum_vec3 v)
{
    return lum_v3(lum_dot(f->t, v), lum_dot(f->b, v), lum_dot(f->n, v));
}

#endif

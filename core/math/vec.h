/* Vectors and affine transforms. Float for rendering, double where the scene is placed.
 * Spaces: p_local (a mesh's own), p_world (the user's metres), p_scene (normalised: what Embree sees). */
#ifndef LUM_CORE_MATH_VEC_H
#define LUM_CORE_MATH_VEC_H

#include <math.h>
#include <stdbool.h>

#define LUM_PI 3.14159265358979323846f
#define LUM_INV_PI 0.31830988618379067154f
#define LUM_PI_D 3.14159265358979323846264338327950288

struct lum_vec2 {
    float x, y;
};
struct lum_vec3 {
    float x, y, z;
};
struct lum_vec3d {
    double x, y, z;
};
/* Linear Rec.709 colour. As radiance its luminance is in cd/m2, as irradiance in lx. */
struct lum_rgb {
    float r, g, b;
};

/* Affine map, row-major 3x4: p' = m[:, 0:3] p + m[:, 3]. */
struct lum_affine {
    float m[3][4];
};
struct lum_affined {
    double m[3][4];
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
    float m = lum_max(fabsf(a.x), lum_max(fabsf(a.y), fabsf(a.z)));
    if (!(m > 0.0f) || !isfinite(m))
        return lum_v3(0.0f, 0.0f, 0.0f);
    a = lum_v3(a.x / m, a.y / m, a.z / m);
    return lum_v3_mul(a, 1.0f / lum_length(a));
}
static inline bool lum_v3_finite(struct lum_vec3 a)
{
    return isfinite(a.x) && isfinite(a.y) && isfinite(a.z);
}

static inline struct lum_rgb lum_rgb(float r, float g, float b)
{
    return (struct lum_rgb){r, g, b};
}
static inline struct lum_rgb lum_grey(float v)
{
    return (struct lum_rgb){v, v, v};
}
static inline struct lum_rgb lum_rgb_add(struct lum_rgb a, struct lum_rgb b)
{
    return lum_rgb(a.r + b.r, a.g + b.g, a.b + b.b);
}
static inline struct lum_rgb lum_rgb_mul(struct lum_rgb a, struct lum_rgb b)
{
    return lum_rgb(a.r * b.r, a.g * b.g, a.b * b.b);
}
static inline struct lum_rgb lum_rgb_div(struct lum_rgb a, struct lum_rgb b)
{
    return lum_rgb(a.r / b.r, a.g / b.g, a.b / b.b);
}
static inline struct lum_rgb lum_rgb_scale(struct lum_rgb a, float s)
{
    return lum_rgb(a.r * s, a.g * s, a.b * s);
}
static inline struct lum_rgb lum_rgb_mad(struct lum_rgb a, struct lum_rgb b, float s)
{
    return lum_rgb(a.r + b.r * s, a.g + b.g * s, a.b + b.b * s);
}
static inline float lum_rgb_max(struct lum_rgb a)
{
    return lum_max(a.r, lum_max(a.g, a.b));
}
static inline bool lum_rgb_black(struct lum_rgb a)
{
    return !(a.r > 0.0f || a.g > 0.0f || a.b > 0.0f);
}
static inline bool lum_rgb_finite(struct lum_rgb a)
{
    return isfinite(a.r) && isfinite(a.g) && isfinite(a.b);
}
/* Luminance of linear Rec.709 (IEC 61966-2-1), so that Y of a radiance is cd/m2. */
static inline float lum_luminance(struct lum_rgb c)
{
    return 0.2126f * c.r + 0.7152f * c.g + 0.0722f * c.b;
}

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

static inline double lum_v3d_length(struct lum_vec3d v)
{
    return sqrt(v.x * v.x + v.y * v.y + v.z * v.z);
}
/* Of the cross product. */
static inline double lum_v3d_cross_length(struct lum_vec3d a, struct lum_vec3d b)
{
    return lum_v3d_length((struct lum_vec3d){a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x});
}

/* Double-precision placement maths (math/affine.c). */
struct lum_affined lum_affined_identity(void);
struct lum_affined lum_affined_mul(const struct lum_affined *a, const struct lum_affined *b); /* a after b */
struct lum_vec3d lum_affined_point(const struct lum_affined *a, struct lum_vec3d p);
/* False when the map is singular to working precision: not finite, or |M M^-1 - I| >= 1e-6 (NOTES H5). */
bool lum_affined_invert(const struct lum_affined *a, struct lum_affined *ret_inverse);
struct lum_affine lum_affine_from_double(const struct lum_affined *a);

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

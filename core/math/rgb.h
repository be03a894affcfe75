/* Linear Rec.709 colour. As radiance its luminance is in cd/m2, as irradiance in lx. */
#ifndef LUM_CORE_MATH_RGB_H
#define LUM_CORE_MATH_RGB_H

#include "core/math/vec.h"

struct lum_rgb {
    float r, g, b;
};

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
/* Of each colour; 0 where b is not above it. */
static inline struct lum_rgb lum_rgb_share(struct lum_rgb a, struct lum_rgb b)
{
    return lum_rgb(b.r > 0.0f ? a.r / b.r : 0.0f, b.g > 0.0f ? a.g / b.g : 0.0f, b.b > 0.0f ? a.b / b.b : 0.0f);
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

#endif

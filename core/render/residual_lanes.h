/* The values of a pixel that a residual's correction filters together. Internal to residual.c and outliers.c. */
#ifndef LUM_CORE_RENDER_RESIDUAL_LANES_H
#define LUM_CORE_RENDER_RESIDUAL_LANES_H

#include <stdbool.h>
#include <stdint.h>

#include "core/math/rgb.h"

#define LANES 12u

/* Of residuals: A times its weights, its weights, B likewise; red, green, blue. */
struct lanes {
    _Alignas(16) float v[LANES];
};
enum { A = 0, B = 6, WEIGHTS = 3 };

static inline struct lum_rgb rgb_of(const float v[3])
{
    return lum_rgb(v[0], v[1], v[2]);
}

static inline void set_rgb(float v[3], struct lum_rgb c)
{
    v[0] = c.r;
    v[1] = c.g;
    v[2] = c.b;
}

/* Weights: > 0, or all 0. */
static inline void put(struct lanes *l, uint32_t half, struct lum_rgb c, struct lum_rgb weights)
{
    set_rgb(l->v + half, lum_rgb_mul(c, weights));
    set_rgb(l->v + half + WEIGHTS, weights);
}

/* sum / weights; black where there is no weight. */
static inline struct lum_rgb over(struct lum_rgb sum, struct lum_rgb weights)
{
    return weights.r > 0.0f ? lum_rgb_div(sum, weights) : lum_grey(0.0f);
}

/* Black where no sample went in. */
static inline struct lum_rgb take(const struct lanes *l, uint32_t half)
{
    return over(rgb_of(l->v + half), rgb_of(l->v + half + WEIGHTS));
}

static inline struct lum_rgb mean_of(const struct lanes *l)
{
    return over(lum_rgb_add(rgb_of(l->v + A), rgb_of(l->v + B)),
                lum_rgb_add(rgb_of(l->v + A + WEIGHTS), rgb_of(l->v + B + WEIGHTS)));
}

static inline bool in_half(const struct lanes *l, uint32_t half)
{
    return l->v[half + WEIGHTS] > 0.0f;
}

static inline bool in_both(const struct lanes *l)
{
    return in_half(l, A) && in_half(l, B);
}

#endif

/* Boxes along the axes, scene space. */
#ifndef LUM_CORE_MATH_BOUNDS_H
#define LUM_CORE_MATH_BOUNDS_H

#include "core/math/vec.h"

struct lum_bounds {
    struct lum_vec3 lo, hi; /* lo > hi: empty */
};

/* Joined with another it is the other. */
#define LUM_BOUNDS_EMPTY ((struct lum_bounds){{INFINITY, INFINITY, INFINITY}, {-INFINITY, -INFINITY, -INFINITY}})

static inline bool lum_bounds_empty(const struct lum_bounds *b)
{
    return !(b->lo.x <= b->hi.x);
}
/* A p that is not a number does not count. */
static inline void lum_bounds_grow(struct lum_bounds *inout_box, struct lum_vec3 p)
{
    inout_box->lo = lum_v3_min(p, inout_box->lo);
    inout_box->hi = lum_v3_max(p, inout_box->hi);
}
static inline struct lum_bounds lum_bounds_join(const struct lum_bounds *a, const struct lum_bounds *b)
{
    return (struct lum_bounds){lum_v3_min(a->lo, b->lo), lum_v3_max(a->hi, b->hi)};
}
static inline bool lum_bounds_hold(const struct lum_bounds *b, struct lum_vec3 p)
{
    return p.x >= b->lo.x && p.y >= b->lo.y && p.z >= b->lo.z && p.x <= b->hi.x && p.y <= b->hi.y && p.z <= b->hi.z;
}

#endif

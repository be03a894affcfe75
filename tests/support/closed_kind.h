/* Kinds of cache whose records are closed forms of where they lie: what placement and interpolation do to them can be
 * told exactly. And methods that use them. */
#ifndef LUM_TESTS_SUPPORT_CLOSED_KIND_H
#define LUM_TESTS_SUPPORT_CLOSED_KIND_H

#include "core/cache/kind.h"
#include "core/method/method.h"

/* WAVY: irradiance and radius vary over the scene, no gradient. LINEAR: irradiance is linear in p, with its gradient.
 * STALE: WAVY, but records last, and are stale after every edit. BROKEN: irradiance is not a number. PIXELS: as LINEAR,
 * without the gradient; records reach CLOSED_PIXELS pixels of the picture that they are made for. POINTS: as LINEAR,
 * without the gradient; records reach no farther than rounding. STEEP: as WAVY, with a gradient that says that light
 * changes by many times itself within a record's reach. */
enum closed_kind {
    CLOSED_WAVY,
    CLOSED_LINEAR,
    CLOSED_STALE,
    CLOSED_BROKEN,
    CLOSED_PIXELS_KIND,
    CLOSED_POINTS,
    CLOSED_STEEP,
    CLOSED_KIND_COUNT
};
#define CLOSED_PIXELS 3.0f
extern const struct lum_cache_kind closed_kinds[CLOSED_KIND_COUNT];
extern const struct lum_method closed_methods[CLOSED_KIND_COUNT], closed_quarter, closed_free; /* the last two: WAVY */

/* What a record at p with normal n says. */
struct lum_rgb closed_irradiance(enum closed_kind kind, struct lum_vec3 p, struct lum_vec3 n);

/* STALE: the refreshes so far, of all caches. */
uint64_t closed_refreshes(void);

#endif

/* What a record counts at a point. Inline, so that it can stand in loops over many points at once. No branch, and no
 * value of any input makes it anything but 0 or finite and positive, as long as LUM_ACCURACY_MIN <= accuracy. */
#ifndef LUM_CORE_CACHE_WEIGHT_H
#define LUM_CORE_CACHE_WEIGHT_H

#include "core/cache/store.h"
#include "core/math/vec.h"

/* How near a record is to a point at distance d, and what it counts there. a: the accuracy, the error that is let pass.
 * WARD: 1 / e with e = a d / radius + sqrt(1 - n.n'), valid for e < a (Ward 1988); so radius = a R, with Ward's R. The
 * thesis' 6.2.5 is the same with R = 1 m everywhere. TENTS: tents over distance, angle and step, multiplied: reaches 0
 * at the edge, so that nothing pops. The tent over the angle is 10 degrees + a wide (as in Radiance). A record of TENTS
 * counts twice as far as it serves: further out it counts beside those that serve there, so that every point hears
 * several: what differs from record to record is mostly noise, which showed as rings and spots along edges, where
 * records are small. It costs no ray (NOTES has the figures). */
enum lum_metric { LUM_METRIC_WARD, LUM_METRIC_TENTS };

/* Of a metric with its constants. */
struct lum_weighting {
    float accuracy;
    float nearest;   /* WARD: least e, so that a record has the weight 1e4 / a where it lies */
    float per_chord; /* TENTS: 1 / width of the tent over |n - n'|, which is the angle for small ones */
};

#define LUM_ACCURACY_MIN 1e-3f    /* a tenth of LUM_CACHE_ACCURACY_MIN, the least that a view may ask for */
#define LUM_TENT_ANGLE 0.1745329f /* 10 degrees */
#define LUM_TENT_SERVES 0.5f      /* TENTS: of the radius; whoever is nearer needs no record of his own */
/* TENTS: of the radius; how far behind or in front of the surface a record may lie. On planes, cylinders and spheres
 * the distance along the sum of both normals is 0. */
#define LUM_TENT_STEP 0.05f

static inline struct lum_weighting lum_weighting_of(float accuracy)
{
    return (struct lum_weighting){accuracy, 1e-4f * accuracy, 1.0f / (LUM_TENT_ANGLE + accuracy)};
}

/* d: from the record to the point; n, m: normals of the record and the point. For unit normals 1 - n.m = |n - m|^2 / 2,
 * which unlike the left side is exactly 0 for equal ones, and never negative (NOTES H27). */
static inline float lum_weight_ward(const struct lum_weighting *w, float per_radius, struct lum_vec3 d,
                                    struct lum_vec3 n, struct lum_vec3 m)
{
    struct lum_vec3 turn = lum_v3_sub(n, m);
    float e = w->accuracy * per_radius * sqrtf(lum_dot(d, d)) + sqrtf(0.5f * lum_dot(turn, turn));
    return e < w->accuracy ? 1.0f / lum_max(e, w->nearest) : 0.0f;
}

/* edge: of the radius, where the tent over distance ends: 1; LUM_TENT_SERVES: above 0 where the record serves. */
static inline float lum_weight_tents(const struct lum_weighting *w, float per_radius, float edge, struct lum_vec3 d,
                                     struct lum_vec3 n, struct lum_vec3 m)
{
    struct lum_vec3 turn = lum_v3_sub(n, m);
    float near = edge - per_radius * sqrtf(lum_dot(d, d)), alike = 1.0f - w->per_chord * sqrtf(lum_dot(turn, turn));
    float level = 1.0f - per_radius * (0.5f / LUM_TENT_STEP) * fabsf(lum_dot(d, lum_v3_add(n, m)));
    return lum_max(near, 0.0f) * lum_max(alike, 0.0f) *
           lum_max(level, 0.0f); /* gcc 12 does not vectorise it joined by & */
}

/* Of one record at one point with normal n: above 0, finite; 0: it does not count there. Of WARD it serves wherever it
 * counts, of TENTS not. TENTS also rejects records that lie in front of or behind the point's surface (Ward 1988). */
static inline float lum_weight_of(const struct lum_weighting *w, enum lum_metric metric,
                                  const struct lum_cache_record *record, struct lum_vec3 p, struct lum_vec3 n)
{
    struct lum_vec3 d = lum_v3_sub(p, record->p);
    float per_radius = 1.0f / record->radius;
    return metric == LUM_METRIC_WARD ? lum_weight_ward(w, per_radius, d, record->n, n)
                                     : lum_weight_tents(w, per_radius, 1.0f, d, record->n, n);
}

#endif

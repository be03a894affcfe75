/* Illuminance at places, path traced until each is known well enough: what a light meter would show. */
#ifndef LUM_CORE_RENDER_ILLUMINANCE_H
#define LUM_CORE_RENDER_ILLUMINANCE_H

#include "core/base/pool.h"
#include "core/scene/snapshot.h"

struct lum_place {
    struct lum_vec3d point_world; /* metres */
    struct lum_vec3 normal;       /* of the plane, to the side that is lit; or the axis */
    bool cylindrical; /* of a small cylinder around the axis: the mean of all planes along it (EN 12464-1: Ez) */
};

struct lum_illuminance_goal {
    double error;   /* standard error over the illuminance, 0.01: 1 % */
    double dark_lx; /* darker places are to be known to that share of this */
    uint64_t max_samples;
    uint32_t seed;
};

struct lum_illuminance {
    double lx, stderr_lx;
    uint64_t n_samples, rays;
};

/* Thread: one at a time per pool. LUM_ERR_INVALID: the place is not finite, or far from the scene. */
LUM_MUST_USE enum lum_status lum_illuminance_at(struct lum_pool *pool, const struct lum_snapshot *snapshot,
                                                const struct lum_place *at, const struct lum_illuminance_goal *goal,
                                                struct lum_illuminance *ret, struct lum_error *err);

#endif

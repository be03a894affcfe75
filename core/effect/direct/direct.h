/* Direct light of one light at a batch of shading points, for deferred estimators. */
#ifndef LUM_CORE_EFFECT_DIRECT_DIRECT_H
#define LUM_CORE_EFFECT_DIRECT_DIRECT_H

#include "core/effect/direct/layers.h"
#include "core/material/bsdf.h"

/* Shading points: where, with which BSDF, seen from where. About 70 KiB: lives on a worker's stack. */
struct lum_vertices {
    uint32_t n;
    struct lum_bsdf bsdf[LUM_RAY_BATCH];
    struct lum_vec3 p[LUM_RAY_BATCH], wo[LUM_RAY_BATCH];
    struct lum_rgb weight[LUM_RAY_BATCH]; /* of the point in its pixel */
    uint32_t slot[LUM_RAY_BATCH];         /* its pixel in the tile */
    uint32_t pixel_seed[LUM_RAY_BATCH];   /* of its sampler */
};

/* Completes the point whose bsdf was written at index n, with weight 1. */
void lum_vertices_push(struct lum_vertices *v, uint32_t slot, struct lum_vec3 p, struct lum_vec3 wo,
                       uint32_t pixel_seed);

/* True when light can be summed at the point: it has more than delta lobes. */
bool lum_bsdf_spreads(const struct lum_bsdf *b);

struct lum_direct {
    const struct lum_snapshot *snapshot; /* with the light's power as it shall be */
    uint32_t light, salt;
    bool media;         /* dims light on its way */
    bool panes;         /* light goes through them */
    uint32_t n_samples; /* of an area light or the environment; delta lights take one */
    bool by_share;      /* vertices are matte: of light known in closed form the visible share is all that is sampled */
    bool hard;          /* quads, discs and spheres shine from near their middle, and take one as well */
    const struct lum_vertices *vertices;
    struct lum_visibility *visibility; /* by slot: visibility to use and to extend; NULL: trace everything. With it, at
                              most one vertex per slot */
    uint32_t *left;           /* by slot, with seen: what panes leave of the samples that are visible, on average
                                 (lum_transmittance_pack); NULL: there are none */
    struct lum_rgb *response; /* by slot: added to */
    struct lum_counters *counters;
};
void lum_direct_light(const struct lum_direct *job);
/* What a light without extent brings to vertex i, were it visible; false: nothing. */
bool lum_direct_unoccluded(const struct lum_direct *job, uint32_t i, struct lum_rgb *ret_value);

extern const struct lum_estimator lum_estimator_shadow; /* direct light with shadows, and all that shines by itself */

#endif

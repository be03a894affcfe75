/* A probe in one go: all of its samples, and their result. */
#ifndef LUM_TESTS_SUPPORT_PROBE_AT_H
#define LUM_TESTS_SUPPORT_PROBE_AT_H

#include "core/render/view.h"

static inline enum lum_status probe_at(struct lum_pool *pool, const struct lum_snapshot *snapshot,
                                       struct lum_vec3d point_world, struct lum_vec3 normal, uint32_t n_samples,
                                       uint32_t seed, struct lum_probe *ret_probe, uint64_t *ret_rays,
                                       struct lum_error *err)
{
    struct lum_probing *g = NULL;
    bool more;
    enum lum_status status = lum_probing_create(snapshot, point_world, normal, n_samples, seed, &g, err);
    if (!status)
        status = lum_probing_go_on(g, pool, n_samples, &more, err);
    if (!status)
        lum_probing_result(g, ret_probe, ret_rays);
    lum_probing_destroy(g);
    return status;
}

#endif

/* First-hit buffers for files and for the denoisers and metrics that read them. */
#ifndef LUM_CORE_RENDER_AOV_H
#define LUM_CORE_RENDER_AOV_H

#include "core/pass/pass.h"

/* The arrays behind struct lum_aovs; made on demand. */
struct lum_aov_buffers {
    struct lum_rgb *albedo;
    struct lum_vec3 *normal_world;
    float *depth_m;
    uint32_t *instance;
    uint64_t stamp; /* of the G-buffer that they show */
    struct lum_basis basis;
};
void lum_aov_finish(struct lum_aov_buffers *aov);
/* The G-buffer is complete. */
LUM_MUST_USE enum lum_status lum_aov_update(struct lum_aov_buffers *aov, const struct lum_pass *pass,
                                            struct lum_pool *pool, struct lum_error *err);

#endif

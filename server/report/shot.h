/* A picture of a scene at rest, for pages: in passes that a caller fits between other work. */
#ifndef LUM_SERVER_REPORT_SHOT_H
#define LUM_SERVER_REPORT_SHOT_H

#include "server/report/annotate.h"
#include "server/world/world.h"

struct lum_shot_desc {
    uint32_t w, h, spp;
    bool illuminance;                /* in false colour with its scale, in place of the picture */
    const struct lum_camera *camera; /* NULL: the scene's own */
};

struct lum_shot;
/* By `live`, of the scene as it is shown now, which it holds. The world's pool and caches are borrowed. */
LUM_MUST_USE enum lum_status lum_shot_create(const struct lum_world *world, const struct lum_shot_desc *desc,
                                             struct lum_shot **ret_shot, struct lum_error *err);
void lum_shot_destroy(struct lum_shot *shot); /* accepts NULL */

/* One pass, as of lum_view_pass: LUM_ERR_CANCELLED is no failure. *ret_done: it was the last. */
LUM_MUST_USE enum lum_status lum_shot_pass(struct lum_shot *shot, const _Atomic bool *cancel, bool *ret_done,
                                           struct lum_error *err);
uint32_t lum_shot_spp(const struct lum_shot *shot); /* samples a pixel so far */

/* ret_canvas->rgb is released with lum_free; NULL where there is no illuminance to show. */
LUM_MUST_USE enum lum_status lum_shot_paint(const struct lum_shot *shot, struct lum_canvas *ret_canvas,
                                            struct lum_error *err);

#endif

/* A picture of a scene from its own camera, at rest: for pages. */
#ifndef LUM_SERVER_CLI_SHOT_H
#define LUM_SERVER_CLI_SHOT_H

#include "server/cli/annotate.h"
#include "server/world/world.h"

struct lum_shot {
    uint32_t w, h, spp;
    bool illuminance;                       /* in false colour with its scale, in place of the picture */
    void (*tell)(void *user, uint32_t spp); /* after each sample; may be NULL */
    void *user;
};

/* By `live`, of the published scene. ret_canvas->rgb is released with lum_free; NULL where there is no illuminance to
 * show. */
LUM_MUST_USE enum lum_status lum_shot_take(const struct lum_world *world, const struct lum_shot *shot,
                                           struct lum_canvas *ret_canvas, struct lum_error *err);

#endif

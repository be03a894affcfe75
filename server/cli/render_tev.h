/* What `lumend render --tev` shows in tev, and when. */
#ifndef LUM_SERVER_CLI_RENDER_TEV_H
#define LUM_SERVER_CLI_RENDER_TEV_H

#include "server/cli/image_output.h"
#include "server/cli/render_options.h"

struct lum_render_tev {
    struct lum_tev *line; /* NULL: not asked for, or tev has gone */
    char name[256];       /* of the picture there */
    uint32_t frame;       /* that it is of */
    bool begun;           /* tev has it */
    int64_t shown_ns;     /* when */
};

/* Connects, where --tev is given. */
LUM_MUST_USE enum lum_status lum_render_tev_begin(struct lum_render_tev *tev, const struct lum_render_options *options,
                                                  struct lum_error *err);
/* After a pass: is it time to show what there is? Layers of light groups are shown when all are there. */
bool lum_render_tev_due(struct lum_render_tev *tev, uint32_t frame, const struct lum_render_options *options);
/* R, G and B of a picture that was begun; or all channels. A tev that has gone is told of once, and no failure. */
LUM_MUST_USE enum lum_status lum_render_tev_film(struct lum_render_tev *tev, const struct lum_film *film,
                                                 struct lum_error *err);
LUM_MUST_USE enum lum_status lum_render_tev_put(struct lum_render_tev *tev, const struct lum_exr_output *output,
                                                struct lum_error *err);

#endif

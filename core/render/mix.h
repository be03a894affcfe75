/* Pictures of lights on their way from one look to another. Light is linear, of each primary: where all lamps have gone
 * the same share of their way, the picture has, too, and is a sum of the pictures of both ends. It is no further off
 * than the worse of them. Internal to core/render. */
#ifndef LUM_CORE_RENDER_MIX_H
#define LUM_CORE_RENDER_MIX_H

#include "core/pass/pass.h"

struct lum_mix {
    const struct lum_snapshot *start, *end; /* held; NULL: their pictures are not there */
    const struct lum_snapshot *shown;       /* held: of the last picture that was mixed */
    struct lum_rgb *from, *to;              /* their pictures, w * h */
};

void lum_mix_finish(struct lum_mix *m); /* accepts a zeroed one */

/* Which share of the way from the one to the other the lights of `now` have gone; all three are the same scene in other
 * light. NAN: they are not on that way. */
double lum_mix_share(const struct lum_snapshot *start, const struct lum_snapshot *end, const struct lum_snapshot *now);

/* Takes the film as the picture of the start; the end is to follow. False: memory is short, and nothing is there. */
LUM_MUST_USE bool lum_mix_begin(struct lum_mix *m, const struct lum_film *film, const struct lum_snapshot *start);
/* Takes the film as the picture of the end. */
void lum_mix_take_end(struct lum_mix *m, const struct lum_film *film, const struct lum_snapshot *end);
/* The picture of the pass's snapshot, which has gone that share of the way. */
LUM_MUST_USE enum lum_status lum_mix_show(struct lum_mix *m, const struct lum_pass *pass, double share,
                                          const struct lum_stage_runner *runner);

#endif

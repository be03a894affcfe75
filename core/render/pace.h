/* How rough a picture is while something moves, so that it is there in time: what passes took, by the side of their
 * blocks of pixels (lum_view_settings.preview), and from that which side is next. Numbers alone. */
#ifndef LUM_CORE_RENDER_PACE_H
#define LUM_CORE_RENDER_PACE_H

#include "core/pass/method.h"

#define LUM_PREVIEW_MS                                                                                                 \
    60.0 /* a pass that takes no longer is seen within a tenth of a second, with all that is around it */
#define LUM_PACE_SIDES 8u

struct lum_pace {
    double ms[LUM_PACE_SIDES];    /* by side; 0: not known. Index 0: of a whole frame, or of a sample of every pixel */
    uint32_t age[LUM_PACE_SIDES]; /* of that, in passes: what is old is forgotten, and tried again */
    uint32_t side;                /* that was chosen last; 0: none */
};

/* A pass that made a picture anew took so long. Where it took another time than was known, so will those of other
 * sides: longer ones count at once, shorter ones by half. */
void lum_pace_note(struct lum_pace *p, uint32_t side, double ms);
/* Pictures have so many times the pixels from now on. */
void lum_pace_scale(struct lum_pace *p, double pixels);
/* The least side whose pass takes limit_ms at most, from what is known; 8 while nothing is, 16 where none does. Not a
 * finer one than the last, unless that takes clearly less: with each change of size buffers are made anew. */
uint32_t lum_pace_choose(struct lum_pace *p, const struct lum_method *method, double limit_ms);

#endif

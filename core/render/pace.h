/* How rough a picture is while something moves, so that it is there in time: what passes took, by the side of their
 * blocks of pixels (lum_view_settings.preview) and by their stages, and from that what is next. Numbers alone.
 *
 * Beside the side there is one setting of a method that is eased in rough passes, where that costs less accuracy than
 * the next coarser side, and gives time: of what was measured (lumend-bench settings) only those in the table. */
#ifndef LUM_CORE_RENDER_PACE_H
#define LUM_CORE_RENDER_PACE_H

#include "core/pass/method.h"
#include "core/pass/settings.h"
#include "core/pass/stats.h"

#define LUM_PREVIEW_MS                                                                                                 \
    60.0 /* a pass that takes no longer is seen within a tenth of a second, with all that is around it */
#define LUM_PACE_SIDES 9u

/* A setting that rough passes may do with less of, and what that leaves. */
struct lum_pace_ease {
    const char *method, *name;
    enum lum_stage stage; /* whose time falls */
    double left;          /* of that time */
};
/* NULL: the method has none, and the side alone is chosen. */
const struct lum_pace_ease *lum_pace_ease_of(const struct lum_method *method);
void lum_pace_apply_ease(struct lum_view_settings *inout_settings);

struct lum_pace_choice {
    uint32_t side;     /* of blocks; 0: none was chosen yet */
    const char *eased; /* name of the setting that is; NULL: none */
    double ms;         /* that the pass is expected to take; NAN: not known */
};

struct lum_pace {
    double ms[LUM_PACE_SIDES]; /* by side, not eased; 0: not known. Index 0: of a whole frame, or of a sample of every
                                  pixel */
    uint32_t age[LUM_PACE_SIDES]; /* of that, in passes: what is old is forgotten, and tried again */
    double share;                 /* of a pass's time, that the stage takes which can be eased; 0: not known */
    uint32_t share_age;
    double fixed_ms; /* of the last pass: what does not hang on the side */
    uint32_t noted;  /* its side; 0: there was none */
    struct lum_pace_choice last;
};

struct lum_pace_pass {
    uint32_t side;
    bool eased;
    double ms, stage_ms; /* the latter: of the stage that can be eased */
    double fixed_ms;     /* lum_pace_fixed_ms */
};

/* Of the time of a pass that which is the same whatever the side: virtual point lights, and the way to all pixels. */
double lum_pace_fixed_ms(const struct lum_pass_stats *pass);

/* A pass that made a picture anew took so long. Where it took another time than the one before it of the same side, so
 * will those of other sides: longer ones count at once, shorter ones by half. Where that was of another side, it may as
 * well be that what was known of this one was wrong: others change by the root of it. Else two sides would take turns
 * for ever, of which one is taken for dearer and one for cheaper than it is. */
void lum_pace_note(struct lum_pace *p, const struct lum_method *method, const struct lum_pace_pass *pass);
/* Pictures have so many times the pixels from now on. */
void lum_pace_scale(struct lum_pace *p, double pixels);
/* The first of: whole, then side by side as it is and eased, whose pass takes limit_ms at most, from what is known; 8
 * while nothing is, the roughest where none does. Not a finer one than the last, unless that takes clearly less: with
 * each change of size buffers are made anew. */
struct lum_pace_choice lum_pace_choose(struct lum_pace *p, const struct lum_method *method, double limit_ms);

#endif

/* When a picture's error is measured, and by how many paths, where its own samples do not tell it. Internal to
 * core/render. */
#ifndef LUM_CORE_RENDER_MEASURE_H
#define LUM_CORE_RENDER_MEASURE_H

#include "core/render/error_probes.h"

struct lum_measurement {
    struct lum_error_probes *probes; /* NULL: none were needed yet, or memory is short */
    bool given_up;                   /* it is */
    double ms, rays;                 /* that shares took so far, drawing pixels and looking at them included */
    struct lum_film_error error;     /* as of the last call; unknown after lum_measure_begin */
    double n_known;                  /* probes that say so, those of pictures before included by what they count */
};

void lum_measure_finish(struct lum_measurement *m); /* accepts a zeroed one */

/* As lum_error_probes_begin. */
void lum_measure_begin(struct lum_measurement *m, bool alike);

/* What a picture took. */
struct lum_measure_cost {
    uint64_t rays;
    double ms;
    bool first; /* it was made, and not bettered */
};

/* After a pass that made or bettered the picture, for settings->error_share of its cost: of its time; or, that nothing
 * hangs on time where a picture is to be deterministic, of its rays. None where it took no ray. It is not cancelled:
 * the picture is there. frame: the pass; on: effects that the picture should have. */
void lum_measure_share(struct lum_measurement *m, const struct lum_pass *frame, const bool on[LUM_EFFECT_COUNT],
                       struct lum_measure_cost cost, const struct lum_stage_runner *runner);

/* Of a picture that rests: some of what is left to do. */
enum lum_status lum_measure_more(struct lum_measurement *m, const struct lum_pass *frame,
                                 const bool on[LUM_EFFECT_COUNT], const struct lum_stage_runner *runner);
/* Nothing is left: it was compared with so many paths, however sure it is by then (who stops when it looks sure stops
 * where what is far off was not found yet); or memory is short. */
bool lum_measure_is_done(const struct lum_measurement *m, uint32_t w, uint32_t h);

#endif

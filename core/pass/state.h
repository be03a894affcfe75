/* What an estimator keeps of a view from pass to pass, for itself: nobody else knows what it is, or that it is there.
 *
 * A kind of state is a row of functions, known by its address; estimators name theirs, and may share one. A view has at
 * most one state of a kind: from the first pass whose plan has such an estimator to the first that has none, unless
 * that is because all lights are off. What is kept of them may serve again. */
#ifndef LUM_CORE_PASS_STATE_H
#define LUM_CORE_PASS_STATE_H

#include "core/base/base.h"

struct lum_pass;

/* What became of what the pass before left; each step includes the ones before. */
enum lum_fate {
    LUM_FATE_SAME,
    LUM_FATE_DIMMED, /* what is summed at the powers of lights is stale; what is kept at power 1 is not */
    LUM_FATE_MOVED,  /* of that, what pass->motion_mask says */
    LUM_FATE_STALE,  /* all of it */
};

struct lum_outcome {
    enum lum_fate light;
    enum lum_fate neighbours; /* who stands for whom among the pixels of a tile and those beside it; never DIMMED */
};

/* Called between passes, on one thread, in this order. */
struct lum_state_kind {
    size_t bytes; /* zeroed at first */
    /* Makes room for what the pass calls for. False: memory is short, and the pass fails. */
    bool (*reserve)(void *state, const struct lum_pass *pass);
    void (*invalidate)(void *state, const struct lum_pass *pass,
                       const struct lum_outcome *outcome); /* also while not in the plan */
    void (*finish)(void *state);
};

#define LUM_STATES_MAX 8u /* of a view: `live` has 6 */

struct lum_states {
    struct {
        const struct lum_state_kind *kind;
        void *state;
        bool planned; /* for the present pass */
    } row[LUM_STATES_MAX];
    uint32_t n;
    uint32_t w, h; /* of the picture */
};
void lum_states_finish(struct lum_states *states);

/* Kinds that the pass plans: some may be there more than once, or be NULL. On failure there are no states. */
LUM_MUST_USE enum lum_status lum_states_update(struct lum_states *states, const struct lum_pass *pass,
                                               const struct lum_state_kind *const *kinds, uint32_t n,
                                               const struct lum_outcome *outcome, struct lum_error *err);

/* NULL: nothing in the plan has such a state. Thread: any; what is in it belongs to whom the kind says. */
void *lum_state(const struct lum_states *states, const struct lum_state_kind *kind);
void *lum_pass_state(const struct lum_pass *pass, const struct lum_state_kind *kind);

#endif

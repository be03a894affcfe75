/* What is made already, tile by tile: the one way in which stages of a view remember that there is nothing left to do.
 *
 * An item (a tile, or a cell) goes through steps, from 0: nothing is made. All items go back to 0 at once, at no cost:
 * each remembers its step together with the version of the memo at which it was reached.
 *
 * What makes items stale is decided by whoever owns what was made, from the edits since (pass/basis.h, trace/stale.h)
 * and from where something moved (pass/motion_mask.h). Thread: one worker an item; all else between stages. */
#ifndef LUM_CORE_PASS_MEMO_H
#define LUM_CORE_PASS_MEMO_H

#include "core/base/base.h"
#include "core/pass/tiling.h"

#define LUM_MEMO_STEPS 8u /* more than any stage has */

/* Zeroed: it has no items. */
struct lum_memo {
    uint32_t *stamp; /* per item: version * LUM_MEMO_STEPS + step */
    uint32_t n, version;
};

/* Has n items, at step 0 if their number was another. False: memory is short. */
LUM_MUST_USE bool lum_memo_reserve(struct lum_memo *m, uint32_t n);
void lum_memo_finish(struct lum_memo *m);
void lum_memo_forget(struct lum_memo *m); /* all items are at step 0 */

static inline uint32_t lum_memo_step(const struct lum_memo *m, uint32_t item)
{
    uint32_t since = m->stamp[item] - m->version * LUM_MEMO_STEPS;
    return since < LUM_MEMO_STEPS ? since : 0;
}
static inline void lum_memo_set(struct lum_memo *m, uint32_t item, uint32_t step)
{
    m->stamp[item] = m->version * LUM_MEMO_STEPS + step;
}
/* True when the item is at step `from`, and from now on at the next. */
static inline bool lum_memo_advance(struct lum_memo *m, uint32_t item, uint32_t from)
{
    if (lum_memo_step(m, item) != from)
        return false;
    lum_memo_set(m, item, from + 1);
    return true;
}
/* All items are beyond step 0. */
bool lum_memo_is_whole(const struct lum_memo *m);

/* The latest of the stamps of a tile and those around it. Stamps are what their owner counts, such as passes. */
uint32_t lum_latest_around(const uint32_t *stamps, const struct lum_tiling *tiling, uint32_t tile);

#endif

/* The newest changes of a scene, as they were told: for those who come back. */
#ifndef LUM_SERVER_NET_CHANGES_H
#define LUM_SERVER_NET_CHANGES_H

#include "protocol/base/limits.h"
#include "server/net/text_queue.h"

struct lum_changes_kept {
    struct {
        uint64_t scene_rev;
        struct lum_text *text;
    } ring[LUM_LIMIT_CHANGES_KEPT];
    uint32_t first, n;
    size_t n_bytes;
    uint64_t before; /* the revision before the oldest */
};

/* text: NULL where memory was short. */
void lum_changes_kept_add(struct lum_changes_kept *c, uint64_t scene_rev, struct lum_text *text);
/* How many changes there were after this revision; -1: that is not known any more. */
int lum_changes_kept_missed(const struct lum_changes_kept *c, uint64_t scene_rev);
/* The last n, oldest first: 0 .. n - 1. */
struct lum_text *lum_changes_kept_last(const struct lum_changes_kept *c, uint32_t n, uint32_t i);
void lum_changes_kept_drop(struct lum_changes_kept *c);

#endif

/* Text that waits to be sent to one client, in the order in which it was queued. One text may wait in several queues.
 *
 * Thread: the net thread, for everything. */
#ifndef LUM_SERVER_NET_TEXT_QUEUE_H
#define LUM_SERVER_NET_TEXT_QUEUE_H

#include <stddef.h>
#include <stdint.h>

#include "core/base/base.h"

struct lum_text {
    uint32_t refs;
    size_t n_bytes;
    char *bytes; /* from malloc, as the rpc functions give it */
};

/* Takes bytes. NULL when memory is short, or was (bytes is NULL). */
struct lum_text *lum_text_create(char *bytes);
void lum_text_unref(struct lum_text *t); /* accepts NULL */

/* In caller memory, all zero: empty. */
struct lum_text_queue {
    struct lum_queued_text *first, *last;
    size_t n_bytes;
};

/* Queues a reference of its own. LUM_ERR_NOMEM, also without a text; LUM_ERR_LIMIT when more than max_bytes would wait,
 * of more than one text. */
LUM_MUST_USE enum lum_status lum_text_queue_push(struct lum_text_queue *q, struct lum_text *t, size_t max_bytes);
/* The caller owns a reference to what it gets. NULL: the queue is empty. */
struct lum_text *lum_text_queue_pop(struct lum_text_queue *q);
void lum_text_queue_clear(struct lum_text_queue *q);

#endif

#include "server/net/text_queue.h"

#include <stdlib.h>
#include <string.h>

struct lum_queued_text {
    struct lum_queued_text *next;
    struct lum_text *text;
};

struct lum_text *lum_text_create(char *bytes)
{
    struct lum_text *t = bytes ? malloc(sizeof *t) : NULL;
    if (!t) {
        free(bytes);
        return NULL;
    }
    *t = (struct lum_text){.refs = 1, .n_bytes = strlen(bytes), .bytes = bytes};
    return t;
}

void lum_text_unref(struct lum_text *t)
{
    if (!t || --t->refs)
        return;
    free(t->bytes);
    free(t);
}

enum lum_status lum_text_queue_push(struct lum_text_queue *q, struct lum_text *t, size_t max_bytes)
{
    struct lum_queued_text *item = t ? malloc(sizeof *item) : NULL;
    if (!item)
        return LUM_ERR_NOMEM;
    if (q->first && q->n_bytes + t->n_bytes > max_bytes) {
        free(item);
        return LUM_ERR_LIMIT;
    }
    t->refs++;
    *item = (struct lum_queued_text){.text = t};
    if (q->first)
        q->last->next = item;
    else
        q->first = item;
    q->last = item;
    q->n_bytes += t->n_bytes;
    return LUM_OK;
}

struct lum_text *lum_text_queue_pop(struct lum_text_queue *q)
{
    struct lum_queued_text *item = q->first;
    if (!item)
        return NULL;
    struct lum_text *t = item->text;
    q->first = item->next;
    q->n_bytes -= t->n_bytes;
    free(item);
    return t;
}

void lum_text_queue_clear(struct lum_text_queue *q)
{
    for (struct lum_text *t; (t = lum_text_queue_pop(q));)
        lum_text_unref(t);
}

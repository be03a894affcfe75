/* What the director sends, and its bell. Apart from director.c, so that tests can link requests without the thread. */
#define _GNU_SOURCE /* strdup */
#include "server/director/internal.h"

#include <stdlib.h>
#include <string.h>

#include <cjson/cJSON.h>

#include "protocol/message/rpc.h"
#include "server/base/log.h"

static void send_out(struct lum_director *d, struct lum_out *o)
{
    pthread_mutex_lock(&d->lock);
    o->wait_seq = d->submitted_seq;
    d->outbox_bytes += o->n_bytes;
    *d->outbox_tail = o;
    d->outbox_tail = &o->next;
    pthread_mutex_unlock(&d->lock);
    d->config.wake_net(d->config.wake_user);
}

static struct lum_out *out_create(enum lum_out_kind kind, struct lum_session_ref to)
{
    struct lum_out *o = lum_calloc(1, sizeof *o);
    if (o) {
        o->kind = kind;
        o->session = to;
    }
    return o;
}

void lum_director_send(struct lum_director *d, enum lum_out_kind kind, struct lum_session_ref to, char *text)
{
    struct lum_out *o = text ? out_create(kind, to) : NULL;
    if (!o) {
        lum_log(&d->config.log, LUM_LOG_ERROR, "director", "no memory for a message to a client, ignoring");
        free(text);
        return;
    }
    o->text = text;
    o->n_bytes = strlen(text);
    send_out(d, o);
}

void lum_director_send_changed(struct lum_director *d, uint64_t scene_rev, struct cJSON *params)
{
    char *text = lum_rpc_notification("scene.changed", params);
    struct lum_out *o = text ? out_create(LUM_OUT_BROADCAST, (struct lum_session_ref){0}) : NULL;
    if (!o) {
        lum_log(&d->config.log, LUM_LOG_ERROR, "director", "no memory to tell of a change, ignoring");
        free(text);
        return;
    }
    o->text = text;
    o->n_bytes = strlen(text);
    o->scene_rev = scene_rev;
    send_out(d, o);
}

void lum_director_send_news(struct lum_director *d, struct lum_session_ref to, char *text)
{
    pthread_mutex_lock(&d->lock);
    bool full = d->outbox_bytes > LUM_OUTBOX_MAX_BYTES;
    pthread_mutex_unlock(&d->lock);
    if (full)
        free(text);
    else
        lum_director_send(d, LUM_OUT_TEXT, to, text);
}

void lum_director_send_stream(struct lum_director *d, struct lum_session_ref to, struct lum_stream *stream)
{
    struct lum_out *o = out_create(LUM_OUT_VIEW_OPENED, to);
    if (!o) {
        lum_stream_unref(stream);
        return;
    }
    o->stream = stream;
    o->view_id = lum_stream_view_id(stream);
    send_out(d, o);
}

void lum_director_send_closed(struct lum_director *d, struct lum_session_ref to, uint32_t view_id)
{
    struct lum_out *o = out_create(LUM_OUT_VIEW_CLOSED, to);
    if (!o)
        return;
    o->view_id = view_id;
    send_out(d, o);
}

void lum_director_reply(struct lum_director *d, const struct lum_request *q, struct cJSON *result)
{
    if (q->rpc_id)
        lum_director_send(d, LUM_OUT_TEXT, q->session, lum_rpc_result(q->rpc_id, result));
    else
        cJSON_Delete(result);
}

void lum_director_refuse(struct lum_director *d, const struct lum_request *q, const struct lum_proto_error *err)
{
    if (q->rpc_id)
        lum_director_send(d, LUM_OUT_TEXT, q->session, lum_rpc_error(q->rpc_id, err));
}

/* Its bytes are not counted: the outbox is of text, and who asks for files has one at a time. */
void lum_director_reply_file(struct lum_director *d, const struct lum_request *q, uint8_t *bytes, size_t n_bytes,
                             uint64_t scene_rev)
{
    char *rpc_id = q->rpc_id ? strdup(q->rpc_id) : NULL;
    struct lum_out *o = rpc_id ? out_create(LUM_OUT_FILE, q->session) : NULL;
    if (!o) {
        free(rpc_id);
        free(bytes);
        return;
    }
    o->rpc_id = rpc_id;
    o->file = bytes;
    o->n_file = n_bytes;
    o->scene_rev = scene_rev;
    send_out(d, o);
}

void lum_director_reply_edit(struct lum_director *d, const struct lum_request *q, struct cJSON *result, uint64_t seq)
{
    char *text = q->rpc_id ? lum_rpc_result(q->rpc_id, result) : NULL, *rpc_id = text ? strdup(q->rpc_id) : NULL;
    struct lum_out *o = rpc_id ? out_create(LUM_OUT_TEXT, q->session) : NULL;
    if (!q->rpc_id) {
        cJSON_Delete(result);
        return;
    }
    if (!o) {
        lum_log(&d->config.log, LUM_LOG_ERROR, "director", "no memory for a message to a client, ignoring");
        free(text);
        free(rpc_id);
        return;
    }
    o->text = text;
    o->n_bytes = strlen(text);
    o->edit_seq = seq;
    o->rpc_id = rpc_id;
    send_out(d, o);
}

/* Its bytes are counted as they were. */
static void refuse_lost(struct lum_out *o, const struct lum_proto_error *err)
{
    free(o->text);
    o->text = lum_rpc_error(o->rpc_id, err); /* NULL (memory is short): the session ends, and is told nothing wrong */
}

void lum_director_refuse_lost(struct lum_director *d, uint64_t durable, const struct lum_proto_error *err)
{
    pthread_mutex_lock(&d->lock);
    for (struct lum_out *o = d->outbox; o; o = o->next) {
        if (o->edit_seq > durable)
            refuse_lost(o, err);
        if (o->wait_seq > durable)
            o->wait_seq = durable;
    }
    d->submitted_seq = durable;
    pthread_mutex_unlock(&d->lock);
    d->config.wake_net(d->config.wake_user);
}

bool lum_director_stopping(struct lum_director *d)
{
    pthread_mutex_lock(&d->lock);
    bool stop = d->stop;
    pthread_mutex_unlock(&d->lock);
    return stop;
}

void lum_director_ring(struct lum_director *d)
{
    pthread_mutex_lock(&d->lock);
    d->rung = true;
    pthread_cond_signal(&d->bell);
    pthread_mutex_unlock(&d->lock);
}

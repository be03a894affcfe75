#define _GNU_SOURCE /* pthread_setname_np */
#include "server/director/director.h"

#include <errno.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include <cjson/cJSON.h>

#include "protocol/message/rpc.h"
#include "server/base/log.h"
#include "server/director/internal.h"
#include "server/world/apply.h"
#include "server/world/scene_source.h"

#define ALIVE_WITHIN_NS 10000000000ll

/* ---- outgoing messages ---- */

static void send_out(struct lum_director *d, struct lum_out *o)
{
    pthread_mutex_lock(&d->lock);
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

/* ---- the inbox ---- */

void lum_director_ring(struct lum_director *d)
{
    pthread_mutex_lock(&d->lock);
    d->rung = true;
    pthread_cond_signal(&d->bell);
    pthread_mutex_unlock(&d->lock);
}

/* Does this make the running pass obsolete? Whatever the client of that view asks for that is not a drag does so at
 * once: it may be its way out of a method that is too slow. Edits and cameras leave a shielded pass alone. */
static bool outdates_locked(const struct lum_director *d, const struct lum_request *q)
{
    const struct lum_server_view *v = d->rendering;
    bool own = q->session.slot == v->session.slot && q->session.generation == v->session.generation;
    bool shielded = lum_clock_ns() < d->shielded_until_ns;
    switch (q->kind) {
    case LUM_REQUEST_SCENE_APPLY:
    case LUM_REQUEST_SCENE_UNDO:
    case LUM_REQUEST_SCENE_REDO:
    case LUM_REQUEST_VIEW_OPEN: /* a new client waits for its first picture */
        return !shielded;
    case LUM_REQUEST_VIEW_UPDATE:
        return own && q->view_id == v->id && (!shielded || q->view.given & (LUM_VIEW_BIT(METHOD) | LUM_VIEW_BIT(SIZE)));
    case LUM_REQUEST_VIEW_CLOSE:
        return own && q->view_id == v->id;
    case LUM_REQUEST_SESSION_CLOSED:
        return own;
    default:
        return false;
    }
}

bool lum_director_post(struct lum_director *d, struct lum_request *q)
{
    if (q->kind == LUM_REQUEST_WAKE) {
        lum_request_destroy(q);
        lum_director_ring(d);
        return true;
    }
    pthread_mutex_lock(&d->lock);
    /* a closed session must never be forgotten: there are no more of them than sessions */
    bool ok = (d->n_inbox < LUM_INBOX_MAX && d->inbox_bytes + q->n_bytes <= LUM_INBOX_MAX_BYTES) ||
              q->kind == LUM_REQUEST_SESSION_CLOSED;
    if (ok) {
        q->next = NULL;
        *d->inbox_tail = q;
        d->inbox_tail = &q->next;
        d->n_inbox++;
        d->inbox_bytes += q->n_bytes;
        if (d->rendering && outdates_locked(d, q))
            atomic_store_explicit(&d->cancel, true, memory_order_relaxed);
        pthread_cond_signal(&d->bell);
    }
    pthread_mutex_unlock(&d->lock);
    return ok;
}

struct lum_out *lum_director_take_outbox(struct lum_director *d)
{
    pthread_mutex_lock(&d->lock);
    struct lum_out *all = d->outbox;
    d->outbox = NULL;
    d->outbox_tail = &d->outbox;
    pthread_mutex_unlock(&d->lock);
    return all;
}

static struct lum_request *take_inbox(struct lum_director *d)
{
    pthread_mutex_lock(&d->lock);
    struct lum_request *all = d->inbox;
    d->inbox = NULL;
    d->inbox_tail = &d->inbox;
    d->n_inbox = 0;
    d->inbox_bytes = 0;
    d->rung = false;
    pthread_mutex_unlock(&d->lock);
    return all;
}

/* Is it answered from the scene after the edits before it? Camera moves are not: a drag of both costs one commit. A
 * session's end forgets history, and an edit that may still be taken back needs its own. */
static bool needs_commit(const struct lum_request *q)
{
    switch (q->kind) {
    case LUM_REQUEST_VIEW_UPDATE:
        return q->view.given & LUM_VIEW_BIT(CAMERA_ID);
    case LUM_REQUEST_VIEW_CLOSE:
        return false;
    default:
        return true;
    }
}

/* How each is answered. Edits outlive their turn and are not here, nor is a wake, which never gets into the inbox. */
static void (*const answers[])(struct lum_director *d, const struct lum_request *q) = {
    [LUM_REQUEST_SCENE_GET] = lum_director_scene_get,
    [LUM_REQUEST_VIEW_OPEN] = lum_director_view_open,
    [LUM_REQUEST_VIEW_UPDATE] = lum_director_view_update,
    [LUM_REQUEST_VIEW_CLOSE] = lum_director_view_close,
    [LUM_REQUEST_PICK] = lum_director_pick,
    [LUM_REQUEST_PROBE] = lum_director_probe,
    [LUM_REQUEST_BOUNDS] = lum_director_bounds,
    [LUM_REQUEST_STATS_GET] = lum_director_stats,
    [LUM_REQUEST_SESSION_CLOSED] = lum_director_session_closed,
};

static void handle(struct lum_director *d, struct lum_request *q)
{
    if (q->kind == LUM_REQUEST_SCENE_APPLY || q->kind == LUM_REQUEST_SCENE_UNDO || q->kind == LUM_REQUEST_SCENE_REDO) {
        lum_director_edit(d, q);
        return;
    }
    if (needs_commit(q))
        lum_director_commit(d);
    answers[q->kind](d, q);
    lum_request_destroy(q);
}

/* ---- the loop ---- */

static struct timespec deadline(int64_t ns)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    ns += t.tv_nsec;
    t.tv_sec += ns / 1000000000;
    t.tv_nsec = ns % 1000000000;
    return t;
}

/* Sleeps until something is posted, at most wait_ns. */
static void rest(struct lum_director *d, int64_t wait_ns)
{
    atomic_store(&d->asleep, true);
    pthread_mutex_lock(&d->lock);
    struct timespec until = deadline(wait_ns == INT64_MAX ? 0 : wait_ns);
    while (!d->inbox && !d->rung && !d->stop) {
        if (wait_ns == INT64_MAX)
            pthread_cond_wait(&d->bell, &d->lock);
        else if (pthread_cond_timedwait(&d->bell, &d->lock, &until) == ETIMEDOUT)
            break;
    }
    pthread_mutex_unlock(&d->lock);
    atomic_store(&d->tick_ns, lum_clock_ns());
    atomic_store(&d->asleep, false);
}

static bool stopping(struct lum_director *d)
{
    pthread_mutex_lock(&d->lock);
    bool stop = d->stop;
    pthread_mutex_unlock(&d->lock);
    return stop;
}

static void *director_main(void *arg)
{
    struct lum_director *d = arg;
    pthread_setname_np(pthread_self(), "lum-director");
    lum_thread_init_fp();
    while (!stopping(d)) {
        atomic_store(&d->tick_ns, lum_clock_ns());
        for (struct lum_request *q = take_inbox(d), *next; q; q = next) {
            next = q->next;
            handle(d, q);
        }
        lum_director_turn_imports(d);
        lum_director_commit(d);
        int64_t wait_ns = lum_director_publish_due(d);
        struct lum_server_view *v = lum_director_choose_view(d);
        if (v)
            lum_director_run_pass(d, v);
        else if (wait_ns > 0)
            rest(d, wait_ns);
    }
    return NULL;
}

/* ---- life ---- */

static char *copy_string(const char *s)
{
    size_t n = s ? strlen(s) + 1 : 0;
    char *copy = s ? lum_calloc(n, 1) : NULL;
    if (copy)
        memcpy(copy, s, n);
    return copy;
}

static void wake_nobody(void *user)
{
    (void)user;
}

static bool copy_config(struct lum_director *d, const struct lum_director_config *config)
{
    d->config = *config;
    d->config.scene = copy_string(config->scene);
    d->config.assets_dir = copy_string(config->assets_dir);
    d->config.importer = copy_string(config->importer);
    d->config.method = copy_string(config->method);
    if (!d->config.wake_net)
        d->config.wake_net = wake_nobody;
    return d->config.scene && (!config->assets_dir || d->config.assets_dir) &&
           (!config->importer || d->config.importer) && (!config->method || d->config.method);
}

static enum lum_status init_lock(struct lum_director *d, struct lum_error *err)
{
    pthread_condattr_t attr;
    if (pthread_condattr_init(&attr))
        goto fail;
    pthread_condattr_setclock(&attr, CLOCK_MONOTONIC);
    int failed = pthread_cond_init(&d->bell, &attr);
    pthread_condattr_destroy(&attr);
    if (failed)
        goto fail;
    if (pthread_mutex_init(&d->lock, NULL)) {
        pthread_cond_destroy(&d->bell);
        goto fail;
    }
    d->inbox_tail = &d->inbox;
    d->outbox_tail = &d->outbox;
    return LUM_OK;
fail:
    return lum_fail(err, LUM_ERR_NOMEM, "", "no memory for a lock");
}

/* The method of the command line is an edit like any other, so that scene.get shows it. */
static bool set_method(struct lum_director *d, struct lum_proto_error *err)
{
    struct lum_op op = {
        .kind = LUM_OP_SET, .id = "render", .path = "/method", .value = cJSON_CreateString(d->config.method)};
    if (!op.value)
        return lum_proto_fail_memory(err);
    struct lum_changes changes;
    bool ok = lum_world_apply(
        &d->world, &(struct lum_edit){"(options)", &(struct lum_ops){.ops = &op, .n = 1}, NULL, 0}, &changes, err);
    if (ok)
        lum_changes_finish(&changes);
    cJSON_Delete(op.value);
    struct lum_error e;
    return ok && (!lum_world_commit(&d->world, &e) || lum_apply_error(&e, "", err));
}

static enum lum_status load(struct lum_director *d, struct lum_error *err)
{
    struct lum_import_config import = {
        .importer = d->config.importer, .assets_dir = d->config.assets_dir, .log = d->config.log};
    struct lum_proto_error e;
    if (!lum_scene_load(&d->world, d->config.scene, &import, &e))
        return lum_fail(err, LUM_ERR_INVALID, e.path, "%.60s: %s", d->config.scene, e.text);
    if (d->config.method && !set_method(d, &e))
        return lum_fail(err, LUM_ERR_INVALID, "method", "%s", e.text);
    atomic_store(&d->scene_rev, lum_document_rev(d->world.doc));
    d->metrics.triangles = d->world.snapshot->n_triangles; /* no other thread yet */
    d->metrics.lights = d->world.snapshot->lights.n_lights;
    return LUM_OK;
}

enum lum_status lum_director_create(const struct lum_director_config *config, struct lum_director **ret_director,
                                    struct lum_error *err)
{
    struct lum_director *d = lum_calloc(1, sizeof *d);
    if (!d)
        return lum_fail(err, LUM_ERR_NOMEM, "", "no memory for the director");
    enum lum_status st = init_lock(d, err);
    if (st) {
        lum_free(d);
        return st;
    }
    d->start_ns = lum_clock_ns();
    atomic_store(&d->tick_ns, d->start_ns);
    if (!copy_config(d, config))
        st = lum_fail(err, LUM_ERR_NOMEM, "", "no memory for the configuration");
    if (!st)
        st = lum_world_init(&d->world, config->threads, config->isa, &config->log, err);
    if (!st) {
        d->world.deterministic = config->deterministic;
        st = lum_encoder_create(d->world.pool, &d->encoder, err);
    }
    if (!st)
        st = load(d, err);
    if (!st && pthread_create(&d->thread, NULL, director_main, d))
        st = lum_fail(err, LUM_ERR_NOMEM, "", "the director's thread cannot be started");
    if (st) {
        lum_director_destroy(d);
        return st;
    }
    d->has_thread = true;
    *ret_director = d;
    return LUM_OK;
}

/* Order: stop the loop, then the imports it started, then what both used. */
void lum_director_destroy(struct lum_director *d)
{
    if (!d)
        return;
    pthread_mutex_lock(&d->lock);
    d->stop = true;
    atomic_store(&d->cancel, true);
    pthread_cond_signal(&d->bell);
    pthread_mutex_unlock(&d->lock);
    if (d->has_thread)
        pthread_join(d->thread, NULL);
    lum_director_drop_imports(d);
    for (struct lum_server_view *v = d->views, *next; v; v = next) {
        next = v->next;
        lum_server_view_destroy(v);
    }
    for (struct lum_request *q = take_inbox(d), *next; q; q = next) {
        next = q->next;
        lum_request_destroy(q);
    }
    for (struct lum_out *o = lum_director_take_outbox(d), *next; o; o = next) {
        next = o->next;
        lum_out_destroy(o);
    }
    lum_encoder_destroy(d->encoder);
    lum_world_finish(&d->world);
    lum_free((char *)d->config.scene);
    lum_free((char *)d->config.assets_dir);
    lum_free((char *)d->config.importer);
    lum_free((char *)d->config.method);
    pthread_cond_destroy(&d->bell);
    pthread_mutex_destroy(&d->lock);
    lum_free(d);
}

uint64_t lum_director_scene_rev(const struct lum_director *d)
{
    return atomic_load(&d->scene_rev);
}

bool lum_director_alive(const struct lum_director *d)
{
    return atomic_load(&d->asleep) || lum_clock_ns() - atomic_load(&d->tick_ns) < ALIVE_WITHIN_NS;
}

void lum_director_metrics(const struct lum_director *d, struct lum_director_metrics *ret_metrics)
{
    struct lum_director *locked = (struct lum_director *)d; /* the lock is not part of what const promises */
    pthread_mutex_lock(&locked->lock);
    *ret_metrics = d->metrics;
    pthread_mutex_unlock(&locked->lock);
}

#define _GNU_SOURCE /* pthread_setname_np */
#include "server/director/director.h"

#include <errno.h>
#include <string.h>
#include <time.h>

#include <cjson/cJSON.h>

#include "server/director/internal.h"
#include "server/director/repeats.h"
#include "server/director/saving.h"
#include "server/world/apply.h"
#include "server/world/scene_source.h"

/* Since it last went round its loop. Larger: one that hangs is noticed later; smaller: a long edit counts as that. */
#define ALIVE_WITHIN_NS 10000000000ll

/* ---- the inbox ---- */

/* Does this make the running pass obsolete? Whatever the client of that view asks for that is not a drag does so at
 * once: it may be its way out of a method that is too slow. Edits and cameras leave a shielded pass alone. */
static bool outdates_locked(const struct lum_director *d, const struct lum_request *q)
{
    const struct lum_server_view *v = d->rendering;
    bool own = q->session.slot == v->session.slot && q->session.generation == v->session.generation;
    bool shielded = lum_clock_ns() < d->shielded_until_ns;
    if (q->type->edits || q->type == &lum_request_view_open) /* a new client waits for its first picture */
        return !shielded;
    if (q->type == &lum_request_view_update)
        return own && q->view_id == v->id && (!shielded || q->view.given & (LUM_VIEW_BIT(METHOD) | LUM_VIEW_BIT(SIZE)));
    if (q->type == &lum_request_view_close)
        return own && q->view_id == v->id;
    return (q->type == &lum_request_session_closed || q->type == &lum_request_session_lost) && own;
}

/* Somebody waits for a picture that follows a hand: that of a report has time. */
static bool interrupts(const struct lum_request *q)
{
    return q->type->edits || q->type == &lum_request_view_open || q->type == &lum_request_view_update;
}

bool lum_director_post(struct lum_director *d, struct lum_request *q)
{
    if (q->type == &lum_request_wake) {
        lum_request_destroy(q);
        lum_director_ring(d);
        return true;
    }
    size_t n_read = lum_request_bytes(q);
    q->n_bytes = n_read > q->n_bytes ? n_read : q->n_bytes;
    size_t most = LUM_REQUESTS_MAX_BYTES + (q->n_bytes <= LUM_REQUEST_SMALL_BYTES ? LUM_REQUESTS_RESERVE_BYTES : 0);
    pthread_mutex_lock(&d->lock);
    /* what the net thread has to say of sessions must never be lost: there is no more of it than sessions */
    bool ok = (d->n_inbox < LUM_INBOX_MAX && atomic_load(&d->requests_bytes) + q->n_bytes <= most &&
               d->outbox_bytes <= LUM_OUTBOX_MAX_BYTES) ||
              !q->type->name;
    if (ok) {
        q->next = NULL;
        *d->inbox_tail = q;
        d->inbox_tail = &q->next;
        d->n_inbox++;
        lum_request_charge(q, &d->requests_bytes);
        if (d->picturing ? interrupts(q) : d->rendering && outdates_locked(d, q))
            atomic_store_explicit(&d->cancel, true, memory_order_relaxed);
        pthread_cond_signal(&d->bell);
    }
    pthread_mutex_unlock(&d->lock);
    return ok;
}

struct lum_out *lum_director_take_outbox(struct lum_director *d)
{
    uint64_t durable = d->journal ? lum_journal_acknowledged(d->journal) : UINT64_MAX;
    pthread_mutex_lock(&d->lock);
    struct lum_out *all = NULL, **end = &all;
    while (d->outbox && d->outbox->wait_seq <= durable) {
        *end = d->outbox;
        end = &d->outbox->next;
        d->outbox_bytes -= d->outbox->n_bytes;
        d->outbox = d->outbox->next;
    }
    *end = NULL;
    if (!d->outbox)
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
    d->rung = false;
    pthread_mutex_unlock(&d->lock);
    return all;
}

/* Is it answered from the scene after the edits before it? Edits are not, nor camera moves: a drag of both costs one
 * commit. A session's end forgets history, and an edit that may still be taken back needs its own. */
static bool needs_commit(const struct lum_request *q)
{
    if (q->type->edits)
        return false;
    if (q->type == &lum_request_view_update)
        return q->view.given & (LUM_VIEW_BIT(CAMERA_ID) | LUM_VIEW_BIT(MOMENT));
    return q->type != &lum_request_view_close;
}

/* False: it is refused, or nobody would hear the answer. */
static bool enqueue(struct lum_director *d, struct lum_request *q)
{
    struct lum_proto_error err;
    if (!q->rpc_id)
        return false;
    if (q->type->enqueue(d, q, &err))
        return true;
    lum_director_refuse(d, q, &err);
    return false;
}

static void handle(struct lum_director *d, struct lum_request *q)
{
    if (needs_commit(q))
        lum_director_commit(d);
    if (q->type->take) {
        q->type->take(d, q);
        return;
    }
    if (q->type->enqueue && enqueue(d, q))
        return;
    if (q->type->answer)
        q->type->answer(d, q);
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

/* The loop turns. */
static void tick(struct lum_director *d)
{
    int64_t now_ns = lum_clock_ns();
    atomic_store(&d->tick_ns, now_ns);
    if (!d->config.alive || now_ns < d->alive_due_ns)
        return;
    d->config.alive(d->config.alive_user);
    d->alive_due_ns = now_ns + d->config.alive_ns;
}

/* Sleeps until something is posted, at most wait_ns. */
static void rest(struct lum_director *d, int64_t wait_ns)
{
    if (d->config.alive && wait_ns > d->config.alive_ns)
        wait_ns = d->config.alive_ns;
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
    tick(d);
    atomic_store(&d->asleep, false);
}

/* As lum_trees_ready.tell. */
static void ring(void *user)
{
    lum_director_ring(user);
}

/* As lum_world.go_on: between records of a large edit. */
static bool go_on(void *user)
{
    struct lum_director *d = user;
    tick(d);
    return !lum_director_stopping(d);
}

/* A burst is no reason to look dead, nor to go on when nobody waits for answers. */
static void work_off_inbox(struct lum_director *d)
{
    for (struct lum_request *q = take_inbox(d), *next; q; q = next) {
        next = q->next;
        tick(d);
        if (lum_director_stopping(d))
            lum_request_destroy(q);
        else
            handle(d, q);
    }
}

static void *director_main(void *arg)
{
    struct lum_director *d = arg;
    lum_thread_init_fp();
    while (!lum_director_stopping(d)) {
        tick(d);
        lum_director_turn_saving(d);
        work_off_inbox(d);
        lum_director_turn_imports(d);
        lum_director_turn_assets(d);
        lum_director_turn_exports(d);
        lum_director_commit(d);
        lum_director_turn_desk(d);
        int64_t fade_ns = lum_director_turn_fade(d), wait_ns = lum_director_publish_due(d);
        wait_ns = fade_ns < wait_ns ? fade_ns : wait_ns;
        struct lum_server_view *v = lum_director_choose_view(d);
        if (!d->staged && (!v || lum_server_view_is_whole(v))) /* pictures come first */
            lum_world_turn_trees(&d->world);
        if (v && fade_ns != INT64_MAX && lum_server_view_is_whole(v))
            v = NULL; /* it would only be refined, and has another light in a moment */
        enum lum_beside_state beside = lum_director_work_beside(d, v);
        if (v && beside != LUM_BESIDE_OWED)
            lum_director_run_pass(d, v);
        else if (!v && wait_ns > 0 && beside == LUM_BESIDE_DONE)
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
    d->config.uploads_dir = copy_string(config->uploads_dir);
    d->config.importer = copy_string(config->importer);
    d->config.method = copy_string(config->method);
    d->config.state_dir = copy_string(config->state_dir);
    if (!d->config.wake_net)
        d->config.wake_net = wake_nobody;
    return (!config->scene || d->config.scene) && (!config->assets_dir || d->config.assets_dir) &&
           (!config->uploads_dir || d->config.uploads_dir) && (!config->importer || d->config.importer) &&
           (!config->method || d->config.method) && (!config->state_dir || d->config.state_dir);
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
    d->unsaved_tail = &d->unsaved;
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
    struct lum_import_config import = {.importer = d->config.importer,
                                       .assets_dir = d->config.assets_dir,
                                       .uploads_dir = d->config.uploads_dir,
                                       .log = d->config.log};
    struct lum_proto_error e;
    bool loaded;
    enum lum_status st = lum_director_open_state(d, &loaded, err);
    if (st)
        return st;
    if (!loaded && !d->config.scene && !lum_scene_begin(&d->world, &e))
        return lum_fail(err, LUM_ERR_INVALID, e.path, "%s", e.text);
    if (!loaded && d->config.scene && !lum_scene_load(&d->world, d->config.scene, &import, &e))
        return lum_fail(err, LUM_ERR_INVALID, e.path, "%.60s: %s", d->config.scene, e.text);
    if (d->config.method && strcmp(lum_world_render(&d->world)->render.method, d->config.method) != 0 &&
        !set_method(d, &e))
        return lum_fail(err, LUM_ERR_INVALID, "method", "%s", e.text);
    atomic_store(&d->scene_rev, lum_document_rev(d->world.doc));
    lum_director_count_scene(d);
    lum_director_set_time(d, NULL);
    if (lum_document_n_moments(d->world.doc) == 0)
        lum_document_begin_past(d->world.doc);
    return lum_director_start_saving(d, err);
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
        d->world.go_on = (struct lum_go_on){go_on, d};
        if (!config->deterministic) /* pictures do not hang on the clock then */
            lum_world_hurry(&d->world, &(struct lum_trees_ready){ring, d});
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
    pthread_setname_np(d->thread, "lum-director"); /* from here: whoever knows that it runs finds it by its name */
    d->has_thread = true;
    if (d->config.desk && (st = lum_desk_start(d->config.desk, lum_director_desk_changed, d, err))) {
        lum_director_destroy(d);
        return st;
    }
    *ret_director = d;
    return LUM_OK;
}

/* Order: stop the loop, then the imports it started, then the journal, which writes what waits, then what all used. */
void lum_director_destroy(struct lum_director *d)
{
    if (!d)
        return;
    lum_desk_stop(d->config.desk);
    pthread_mutex_lock(&d->lock);
    d->stop = true;
    atomic_store(&d->cancel, true);
    pthread_cond_signal(&d->bell);
    pthread_mutex_unlock(&d->lock);
    if (d->has_thread)
        pthread_join(d->thread, NULL);
    lum_director_drop_imports(d);
    lum_director_drop_all_assets(d);
    lum_director_drop_all_exports(d);
    lum_journal_close(d->journal);
    d->journal = NULL;
    struct lum_staged_edit *const lists[] = {d->staged, d->unsaved};
    for (size_t i = 0; i < LUM_ARRAY_LEN(lists); i++)
        for (struct lum_staged_edit *p = lists[i], *next; p; p = next) {
            next = p->next;
            lum_director_free_edit(p);
        }
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
    lum_director_sensors_destroy(d->sensors);
    lum_director_drop_all_probes(d);
    lum_director_drop_all_scene_gets(d);
    lum_director_drop_all_timeline_gets(d);
    lum_director_drop_all_reports(d);
    lum_done_destroy(d->repeats);
    lum_world_finish(&d->world);
    lum_free((char *)d->config.scene);
    lum_free((char *)d->config.assets_dir);
    lum_free((char *)d->config.uploads_dir);
    lum_free((char *)d->config.importer);
    lum_free((char *)d->config.method);
    lum_free((char *)d->config.state_dir);
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

uint64_t lum_director_starts(const struct lum_director *d)
{
    return d->journal ? lum_journal_starts(d->journal) : 0;
}

void lum_director_metrics(const struct lum_director *d, struct lum_director_metrics *ret_metrics)
{
    struct lum_director *locked = (struct lum_director *)d; /* the lock is not part of what const promises */
    pthread_mutex_lock(&locked->lock);
    *ret_metrics = d->metrics;
    pthread_mutex_unlock(&locked->lock);
    if (d->journal)
        lum_journal_status(d->journal, &ret_metrics->journal);
}

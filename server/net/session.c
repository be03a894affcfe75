#include "server/net/session.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cjson/cJSON.h>

#include "protocol/json/json.h"
#include "protocol/message/rpc.h"
#include "server/base/log.h"
#include "server/director/read_request.h"
#include "server/net/metrics.h"
#include "server/net/session_internal.h"
#include "server/net/uploads.h"

#define HELLO_MAX_BYTES 4096u /* before hello nobody may make us hold more */

enum lum_status lum_sessions_create(const struct lum_sessions_config *config, struct lum_sessions **ret_sessions,
                                    struct lum_error *err)
{
    struct lum_sessions *t = lum_calloc(1, sizeof *t);
    if (!t)
        return lum_fail(err, LUM_ERR_NOMEM, "", "no memory for the session table");
    t->config = *config;
    for (uint32_t i = 0; i < LUM_LIMIT_CONNECTIONS; i++) {
        t->slots[i].table = t;
        t->slots[i].ref.slot = i;
    }
    *ret_sessions = t;
    return LUM_OK;
}

static void leave_project(struct lum_session *s)
{
    lum_project_leave(s->project, lum_clock_ns());
    s->project = NULL;
}

void lum_sessions_destroy(struct lum_sessions *sessions)
{
    for (uint32_t i = 0; sessions && i < LUM_LIMIT_CONNECTIONS; i++) {
        lum_session_close(&sessions->slots[i]);
        leave_project(&sessions->slots[i]);
    }
    if (sessions)
        lum_downloads_finish(&sessions->downloads);
    if (sessions)
        free(sessions->list_text);
    lum_free(sessions);
}

/* ---- outgoing text ---- */

/* A text that cannot be queued would be lost, so the session ends instead. */
void lum_session_queue_text(struct lum_session *s, struct lum_text *t)
{
    enum lum_status status = lum_text_queue_push(&s->text, t, LUM_LIMIT_CONTROL_QUEUE_BYTES);
    if (status != LUM_OK)
        lum_session_abort(s, status == LUM_ERR_NOMEM ? LUM_CLOSE_INTERNAL : LUM_CLOSE_SLOW);
}

void lum_session_say(struct lum_session *s, char *bytes)
{
    struct lum_text *t = lum_text_create(bytes);
    lum_session_queue_text(s, t);
    lum_text_unref(t);
}

void lum_session_refuse(struct lum_session *s, const char *id, const struct lum_proto_error *err)
{
    s->table->config.counters->messages_refused++;
    if (id)
        lum_session_say(s, lum_rpc_error(id, err));
}

/* ---- open and close ---- */

struct lum_session *lum_session_open(struct lum_sessions *sessions, const char *peer)
{
    struct lum_session *s = NULL;
    for (uint32_t i = 0; i < LUM_LIMIT_CONNECTIONS && !s; i++)
        if (!sessions->slots[i].open && !sessions->slots[i].leaving)
            s = &sessions->slots[i];
    if (!s) {
        sessions->config.counters->sessions_refused++;
        return NULL;
    }
    struct lum_session_ref ref = {.slot = s->ref.slot, .generation = s->ref.generation + 1};
    int64_t now_ns = lum_clock_ns();
    *s = (struct lum_session){
        .table = sessions,
        .ref = ref,
        .open = true,
        .bytes = lum_bucket_full(LUM_LIMIT_RX_BYTES_PER_S, LUM_LIMIT_RX_BURST_BYTES, now_ns),
        .messages = lum_bucket_full(LUM_LIMIT_MESSAGES_PER_S, 2.0 * LUM_LIMIT_MESSAGES_PER_S, now_ns),
    };
    snprintf(s->peer, sizeof s->peer, "%s", peer);
    sessions->config.counters->sessions++;
    sessions->config.counters->sessions_open++;
    if (sessions->draining)
        lum_session_abort(s, LUM_CLOSE_RESTART);
    return s;
}

static void forget_message(struct lum_session *s)
{
    lum_text_unref(s->sending_text);
    lum_encoded_tile_unref(s->sending_tile);
    s->sending_text = NULL;
    s->sending_tile = NULL;
}

/* A request without reply. False when the inbox is full or memory is short. */
bool lum_session_post(struct lum_session *s, const struct lum_request_type *type)
{
    struct lum_request *q = lum_request_create(type);
    if (!q)
        return false;
    q->session = s->ref;
    strcpy(q->user, s->user);
    if (lum_director_post(lum_project_director(s->project), q))
        return true;
    lum_request_destroy(q);
    return false;
}

static void say_farewell(struct lum_session *s)
{
    s->leaving = !lum_session_post(s, s->farewell);
    if (!s->leaving)
        leave_project(s);
}

void lum_session_close(struct lum_session *s)
{
    if (!s || !s->open)
        return;
    s->open = false;
    lum_session_stir(s);
    s->table->people_rev++;
    s->table->config.counters->sessions_open--;
    forget_message(s);
    lum_text_queue_clear(&s->text);
    for (uint32_t i = 0; i < s->n_streams; i++)
        lum_stream_unref(s->streams[i]);
    s->n_streams = 0;
    lum_session_stop_waiting(s);
    if (!s->greeted) {
        leave_project(s);
        return;
    }
    s->table->n_greeted--;
    if (s->project)
        lum_uploads_drop(lum_project_uploads(s->project), s->ref);
    lum_downloads_drop(&s->table->downloads, s->ref);
    lum_log(&s->table->config.log, s->table->config.audit ? LUM_LOG_AUDIT : LUM_LOG_INFO, "session", "%s left",
            s->user);
    if (s->table->draining || !s->project) {
        leave_project(s);
        return; /* who is cut off because the server stops may come back, and finds her undo again */
    }
    bool for_good = !s->superseded && (s->done || lum_close_is_for_good(s->close));
    s->farewell = for_good ? &lum_request_session_closed : &lum_request_session_lost;
    if (!for_good && !s->superseded)
        lum_session_park(s, lum_clock_ns());
    say_farewell(s);
}

void lum_session_leave(struct lum_session *s)
{
    s->done = true;
}

uint32_t lum_session_slot(const struct lum_session *s)
{
    return s->ref.slot;
}

bool lum_session_greeted(const struct lum_session *s)
{
    return s->greeted || s->waiting;
}

size_t lum_session_max_bytes(const struct lum_session *s)
{
    return s->greeted ? LUM_LIMIT_MESSAGE_BYTES : HELLO_MAX_BYTES;
}

bool lum_sessions_take_ended(struct lum_sessions *sessions)
{
    bool ended = sessions->ended;
    sessions->ended = false;
    return ended;
}

void lum_session_abort(struct lum_session *s, enum lum_close code)
{
    if (s->close && !s->close_after_text)
        return;
    s->close = code;
    s->close_after_text = false;
    s->table->people_rev++;
}

void lum_session_abort_after_text(struct lum_session *s, enum lum_close code)
{
    if (s->close)
        return;
    s->close = code;
    s->close_after_text = true;
    s->table->people_rev++;
}

/* ---- from the director ---- */

struct lum_session *lum_session_find(struct lum_sessions *sessions, struct lum_session_ref ref)
{
    struct lum_session *s = ref.slot < LUM_LIMIT_CONNECTIONS ? &sessions->slots[ref.slot] : NULL;
    return s && s->open && s->ref.generation == ref.generation ? s : NULL;
}

static void add_stream(struct lum_session *s, struct lum_out *out)
{
    if (s->n_streams == LUM_LIMIT_VIEWS_PER_SESSION) { /* the director refuses that many views */
        lum_session_abort(s, LUM_CLOSE_INTERNAL);
        return;
    }
    s->streams[s->n_streams++] = out->stream;
    out->stream = NULL;
}

static void remove_stream(struct lum_session *s, uint32_t view_id)
{
    for (uint32_t i = 0; i < s->n_streams; i++) {
        if (lum_stream_view_id(s->streams[i]) != view_id)
            continue;
        lum_stream_unref(s->streams[i]);
        s->streams[i] = s->streams[--s->n_streams];
        return;
    }
}

void lum_sessions_review(struct lum_sessions *sessions, int64_t now_s)
{
    for (uint32_t i = 0; i < LUM_LIMIT_CONNECTIONS; i++) {
        struct lum_session *s = &sessions->slots[i];
        if (!s->open || !s->greeted || s->close || lum_auth_still(sessions->config.auth, &s->person, now_s))
            continue;
        lum_log(&sessions->config.log, LUM_LOG_INFO, "session", "%s is sent away: its token is no more what it was",
                s->user);
        lum_session_abort(s, LUM_CLOSE_REVOKED);
    }
}

static void broadcast(struct lum_sessions *sessions, struct lum_project *p, struct lum_out *out)
{
    struct lum_text *t = lum_text_create(out->text);
    out->text = NULL;
    if (out->scene_rev)
        lum_project_note_change(p, out->scene_rev, t);
    for (uint32_t i = 0; i < LUM_LIMIT_CONNECTIONS; i++) {
        struct lum_session *s = &sessions->slots[i];
        if (s->open && s->greeted && s->project == p && !lum_session_outstayed(s))
            lum_session_queue_text(s, t);
    }
    lum_text_unref(t);
}

/* Where it can be fetched, or why not. */
static void offer_file(struct lum_session *s, struct lum_out *out)
{
    char get[sizeof LUM_DOWNLOAD_FOLDER + 1 + LUM_DOWNLOAD_TICKET_BYTES] = LUM_DOWNLOAD_FOLDER "/";
    struct lum_proto_error err;
    uint8_t *bytes = out->file;
    out->file = NULL;
    if (!lum_downloads_keep(&s->table->downloads, s->ref, bytes, out->n_file, get + sizeof LUM_DOWNLOAD_FOLDER, &err)) {
        lum_session_refuse(s, out->rpc_id, &err);
        return;
    }
    cJSON *result = cJSON_CreateObject();
    if (lum_json_add_string(result, "get", get) && lum_json_add_number(result, "bytes", (double)out->n_file) &&
        lum_json_add_number(result, "scene_rev", (double)out->scene_rev)) {
        lum_session_say(s, lum_rpc_result(out->rpc_id, result));
    } else {
        cJSON_Delete(result);
        lum_session_say(s, NULL);
    }
}

static void deliver(struct lum_sessions *sessions, struct lum_project *p, struct lum_out *out)
{
    if (out->kind == LUM_OUT_BROADCAST) {
        broadcast(sessions, p, out);
        return;
    }
    struct lum_session *s = lum_session_find(sessions, out->session);
    if (!s)
        return; /* it left: the answer is for nobody */
    if (out->kind == LUM_OUT_VIEW_OPENED) {
        add_stream(s, out);
    } else if (out->kind == LUM_OUT_VIEW_CLOSED) {
        remove_stream(s, out->view_id);
    } else if (out->kind == LUM_OUT_FILE) {
        offer_file(s, out);
    } else if (!lum_session_outstayed(s)) {
        lum_session_say(s, out->text);
        out->text = NULL;
    }
}

static void deliver_all(struct lum_sessions *sessions, struct lum_project *p)
{
    struct lum_out *out = lum_director_take_outbox(lum_project_director(p));
    while (out) {
        struct lum_out *next = out->next;
        deliver(sessions, p, out);
        lum_out_destroy(out);
        out = next;
    }
}

uint8_t *lum_sessions_take_file(struct lum_sessions *sessions, const char *ticket, size_t *ret_n)
{
    return lum_downloads_take(&sessions->downloads, ticket, ret_n);
}

void lum_sessions_deliver(struct lum_sessions *sessions)
{
    int64_t now_ns = lum_clock_ns();
    lum_projects_turn(sessions->config.projects, now_ns);
    for (uint32_t i = 0; i < LUM_LIMIT_CONNECTIONS; i++)
        if (sessions->slots[i].leaving)
            say_farewell(&sessions->slots[i]);
    lum_sessions_forget_parked(sessions, now_ns);
    lum_downloads_forget(&sessions->downloads, now_ns);
    for (unsigned i = 0; i < LUM_LIMIT_PROJECTS_OPEN; i++) {
        struct lum_project *p = lum_projects_at(sessions->config.projects, i);
        if (p)
            deliver_all(sessions, p);
    }
    for (uint32_t i = 0; i < LUM_LIMIT_CONNECTIONS; i++)
        if (sessions->slots[i].waiting && !sessions->slots[i].close)
            lum_session_go_on_waiting(&sessions->slots[i], now_ns);
    lum_sessions_answer_orders(sessions);
}

void lum_sessions_begin_drain(struct lum_sessions *sessions)
{
    sessions->draining = true;
    for (uint32_t i = 0; i < LUM_LIMIT_CONNECTIONS; i++) {
        struct lum_session *s = &sessions->slots[i];
        if (!s->open)
            continue;
        if (s->greeted)
            lum_session_say(s, lum_rpc_notification("session.closing", cJSON_CreateObject()));
        lum_session_abort_after_text(s, LUM_CLOSE_RESTART);
    }
}

/* ---- sending ---- */

bool lum_session_pending(const struct lum_session *s)
{
    if (s->text.first || s->close)
        return true;
    for (uint32_t i = 0; i < s->n_streams; i++)
        if (lum_stream_pending(s->streams[i]))
            return true;
    return false;
}

enum lum_close lum_session_close_now(const struct lum_session *s)
{
    return s->close_after_text && s->text.first ? LUM_CLOSE_NONE : s->close;
}

static bool next_tile(struct lum_session *s, struct lum_message *m)
{
    struct lum_stream_tile tile;
    for (uint32_t k = 0; k < s->n_streams; k++) {
        struct lum_stream *stream = s->streams[(s->next_stream + k) % s->n_streams];
        if (!lum_stream_next(stream, &tile))
            continue;
        s->next_stream = (s->next_stream + k + 1) % s->n_streams;
        tile.header.payload_len = tile.blob->n_bytes;
        lum_frame_header_pack(&tile.header, m->head);
        m->binary = true;
        m->n_head = LUM_FRAME_HEADER_BYTES;
        m->body = tile.blob->bytes;
        m->n_body = tile.blob->n_bytes;
        s->sending_tile = tile.blob;
        s->presence.tile_bytes += tile.blob->n_bytes;
        s->table->config.counters->tiles_sent++;
        if (tile.header.flags & LUM_FRAME_LAST_TILE)
            lum_session_wake_director(s, stream);
        return true;
    }
    return false;
}

bool lum_session_next(struct lum_session *s, struct lum_message *ret_message)
{
    memset(ret_message, 0, sizeof *ret_message);
    s->sending_text = lum_text_queue_pop(&s->text);
    if (s->sending_text) {
        ret_message->body = (const uint8_t *)s->sending_text->bytes;
        ret_message->n_body = s->sending_text->n_bytes;
        return true;
    }
    return !s->close && next_tile(s, ret_message);
}

void lum_session_sent(struct lum_session *s)
{
    forget_message(s);
}

/* What comes from clients: paid for, read, and passed on to whoever answers it. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include <cjson/cJSON.h>

#include "protocol/json/json.h"
#include "server/director/read_request.h"
#include "server/net/metrics.h"
#include "server/net/reader.h"
#include "server/net/session_internal.h"

static bool charge_message(struct lum_session *s, int64_t now_ns, struct lum_proto_error *err)
{
    return lum_bucket_take(&s->messages, now_ns) ||
           lum_proto_fail(err, LUM_PROTO_APPLICATION, "limit_exceeded", "", "more than %u messages a second",
                          LUM_LIMIT_MESSAGES_PER_S);
}

/* A full stream tells the director that it may render for it again. Losing this in a full inbox does no harm: the
 * director is awake then, and looks at all streams. */
void lum_session_wake_director(struct lum_session *s, struct lum_stream *stream)
{
    if (lum_stream_wants_frame(stream))
        (void)lum_session_post(s, &lum_request_wake);
}

static bool read_ack(const struct lum_rpc *rpc, uint32_t *ret_view_id, uint64_t *ret_frame_seq, int64_t *ret_held_ns,
                     struct lum_proto_error *err)
{
    struct lum_json_reader r;
    uint32_t view_id = 0;
    uint64_t frame_seq = 0;
    double held_ms = 0.0;
    lum_json_begin(&r, rpc->params, "", err);
    if (lum_json_require(&r, "view_id") && lum_json_require(&r, "frame_seq")) {
        lum_json_u32(&r, "view_id", 0, UINT32_MAX, &view_id);
        lum_json_u64(&r, "frame_seq", &frame_seq);
        const cJSON *held = lum_json_member(&r, "held_ms");
        if (held && cJSON_IsNumber(held)) /* one out of range loses no acknowledgement: none is repeated */
            held_ms = fmin(fmax(held->valuedouble, 0.0), LUM_LIMIT_HELD_MS);
        else if (held)
            lum_json_number(&r, "held_ms", 0.0, LUM_LIMIT_HELD_MS, &held_ms); /* refuses it */
    }
    if (!lum_json_end(&r))
        return false;
    *ret_view_id = view_id;
    *ret_frame_seq = frame_seq;
    *ret_held_ns = (int64_t)(held_ms * 1e6);
    return true;
}

/* False when it says nothing new: no such view, no such frame, or a repeated number. */
static bool take_ack(struct lum_session *s, uint32_t view_id, uint64_t frame_seq, int64_t held_ns)
{
    for (uint32_t i = 0; i < s->n_streams; i++) {
        if (lum_stream_view_id(s->streams[i]) != view_id || !lum_stream_ack(s->streams[i], frame_seq, held_ns))
            continue;
        s->table->config.counters->frames_acked++;
        lum_session_wake_director(s, s->streams[i]);
        return true;
    }
    return false;
}

/* The rate of honest acknowledgements is ours, not the client's: they need no token, and are never refused for want of
 * one, since one that is lost is not repeated. */
static void receive_ack(struct lum_session *s, const struct lum_rpc *rpc, int64_t now_ns)
{
    struct lum_proto_error err;
    uint32_t view_id;
    uint64_t frame_seq;
    int64_t held_ns;
    bool ok = read_ack(rpc, &view_id, &frame_seq, &held_ns, &err);
    if (!ok)
        (void)lum_bucket_take(&s->messages, now_ns);
    else if (!take_ack(s, view_id, frame_seq, held_ns))
        ok = charge_message(s, now_ns, &err);
    if (!ok)
        lum_session_refuse(s, rpc->id, &err);
    else if (rpc->id)
        lum_session_say(s, lum_rpc_result(rpc->id, cJSON_CreateObject()));
}

bool lum_session_has_scene(const struct lum_session *s, struct lum_proto_error *err)
{
    return s->project || lum_proto_fail(err, LUM_PROTO_APPLICATION, "unsupported", "method",
                                        "this session is in no project: session.hello says in which");
}

static void receive_request(struct lum_session *s, struct lum_reading *m)
{
    struct lum_request *q = m->asked ? m->request : lum_request_read(&m->rpc, s->person.role, &m->err);
    m->request = NULL;
    if (q && !lum_session_has_scene(s, &m->err)) {
        m->rpc.id = q->rpc_id;
        q->rpc_id = NULL;
        lum_request_destroy(q);
        q = NULL;
    }
    if (!q) {
        lum_session_refuse(s, m->rpc.id, &m->err);
        return;
    }
    q->session = s->ref;
    q->received_ns = m->received_ns;
    q->n_bytes = m->n_bytes;
    if (s->table->config.saved && q->type->edits) /* what was read of them does not need their text any more */
        q->ops_json =
            cJSON_DetachItemFromObjectCaseSensitive(cJSON_GetObjectItemCaseSensitive(m->rpc.root, "params"), "ops");
    strcpy(q->user, s->user);
    if (lum_director_post(lum_project_director(s->project), q))
        return;
    struct lum_proto_error err;
    lum_proto_fail(&err, LUM_PROTO_APPLICATION, "busy", "", "too many requests wait; try again");
    lum_session_refuse(s, q->rpc_id, &err);
    lum_request_destroy(q);
}

static bool admit(struct lum_session *s, const struct lum_rpc *rpc, int64_t now_ns, struct lum_proto_error *err)
{
    if (!charge_message(s, now_ns, err))
        return false;
    if (s->waiting)
        return lum_proto_fail(err, LUM_PROTO_APPLICATION, "busy", "method",
                              "the project is being opened: hello is not "
                              "answered yet");
    if (!s->greeted && strcmp(rpc->method, "session.hello") != 0)
        return lum_proto_fail(err, LUM_PROTO_APPLICATION, "not_authorised", "method", "session.hello comes first");
    return true;
}

/* What reading these bytes as JSON will cost, in bytes: each value is an allocation. */
static size_t reading_cost(const char *bytes, size_t n)
{
    size_t n_values = 0;
    for (size_t i = 0; i < n; i++)
        n_values += (bytes[i] == ',') + (bytes[i] == ':') + (bytes[i] == '[') + (bytes[i] == '{');
    return n + n_values * LUM_LIMIT_VALUE_COST_BYTES;
}

static int64_t charge_bytes(struct lum_session *s, double cost)
{
    int64_t wait_ns = lum_bucket_charge(&s->bytes, cost, lum_clock_ns());
    s->table->config.counters->rx_waits += wait_ns > 0;
    return wait_ns;
}

int64_t lum_session_charge(struct lum_session *s, const char *bytes, size_t n, bool whole_frame)
{
    return charge_bytes(s, (double)(reading_cost(bytes, n) + (whole_frame ? LUM_LIMIT_FRAME_COST_BYTES : 0)));
}

int64_t lum_session_charge_rest(struct lum_session *s, uint64_t n_bytes)
{
    s->table->config.counters->rx_rest += n_bytes;
    return charge_bytes(s, (double)n_bytes);
}

static void receive(struct lum_session *s, struct lum_reading *m)
{
    struct lum_proto_error err;
    struct lum_rpc *rpc = &m->rpc;
    int64_t now_ns = lum_clock_ns();
    struct lum_net_counters *counters = s->table->config.counters;
    if (s->close || lum_session_outstayed(s))
        return;
    counters->messages++;
    counters->rx_bytes += m->n_bytes;
    if (!m->parsed) {
        lum_session_refuse(s, rpc->id ? rpc->id : "null", &m->err);
        (void)lum_bucket_take(&s->messages, now_ns);
    } else if (s->greeted && strcmp(rpc->method, "frame.ack") == 0) {
        receive_ack(s, rpc, now_ns);
    } else if (!admit(s, rpc, now_ns, &err)) {
        lum_session_refuse(s, m->request ? m->request->rpc_id : rpc->id, &err);
    } else if (strcmp(rpc->method, "session.hello") == 0) {
        lum_session_receive_hello(s, rpc, now_ns);
    } else if (m->request || !lum_session_administer(s, rpc)) {
        receive_request(s, m);
    }
}

void lum_session_receive(struct lum_session *s, const char *text, size_t n_bytes)
{
    struct lum_reading m = {.n_bytes = n_bytes, .received_ns = lum_clock_ns()};
    m.parsed = lum_rpc_parse(text, n_bytes, &m.rpc, &m.err);
    receive(s, &m);
    lum_reading_finish(&m);
}

/* Its bytes are paid for, and its place among messages is, too. */
static void refuse_unread(struct lum_session *s, const char *text, size_t n_bytes)
{
    struct lum_proto_error err;
    char *id = lum_rpc_scan_id(text, n_bytes);
    s->table->config.counters->messages++;
    s->table->config.counters->rx_bytes += n_bytes;
    (void)lum_bucket_take(&s->messages, lum_clock_ns());
    lum_proto_fail(&err, LUM_PROTO_APPLICATION, "busy", "", "too many large messages wait; try again");
    lum_session_refuse(s, id, &err);
    free(id);
}

enum lum_read_beside lum_session_read_beside(struct lum_session *s, struct lum_reader *reader, char *text,
                                             size_t n_bytes)
{
    if (s->close) { /* while its last text goes out */
        free(text);
        return LUM_READ_REFUSED;
    }
    struct lum_reading *m = s->greeted ? lum_calloc(1, sizeof *m) : NULL;
    if (!m)
        return LUM_READ_NOT;
    *m = (struct lum_reading){
        .from = s->ref, .text = text, .n_bytes = n_bytes, .role = s->person.role, .received_ns = lum_clock_ns()};
    if (lum_reader_take(reader, m))
        return LUM_READ_LATER;
    refuse_unread(s, text, n_bytes);
    lum_reading_destroy(m);
    return LUM_READ_REFUSED;
}

void lum_session_forget_beside(const struct lum_session *s, struct lum_reader *reader)
{
    lum_reader_forget(reader, s->ref);
}

struct lum_session *lum_sessions_receive_read(struct lum_sessions *sessions, struct lum_reading *m)
{
    struct lum_session *s = lum_session_find(sessions, m->from);
    if (s)
        receive(s, m);
    return s;
}

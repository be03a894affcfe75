#define _GNU_SOURCE
#include "clients/replay/ws.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

#include <libwebsockets.h>

#define MESSAGE_MAX_BYTES (64u << 20) /* a server that sends more is not one of ours */

struct message {
    struct message *next;
    enum ws_event_kind kind;
    int64_t t_ns;
    size_t n_bytes, capacity;
    uint8_t bytes[]; /* outgoing: LWS_PRE bytes of room come first */
};

struct queue {
    struct message *first, **end;
};

struct ws {
    struct lws_context *context;
    struct lws *wsi; /* NULL once closed */
    struct queue in, out;
    struct message *partial; /* being received */
    struct message *current; /* handed out by the last ws_next */
    bool closed;             /* WS_CLOSED is in the queue, or was */
};

int64_t ws_clock_ns(void)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (int64_t)t.tv_sec * 1000000000 + t.tv_nsec;
}

static void push(struct queue *q, struct message *m)
{
    m->next = NULL;
    *q->end = m;
    q->end = &m->next;
}

static struct message *pop(struct queue *q)
{
    struct message *m = q->first;
    if (m && !(q->first = m->next))
        q->end = &q->first;
    return m;
}

static struct message *message_create(enum ws_event_kind kind, const void *bytes, size_t n_bytes)
{
    struct message *m = malloc(sizeof *m + n_bytes + 1);
    if (!m)
        return NULL;
    *m = (struct message){.kind = kind, .t_ns = ws_clock_ns(), .n_bytes = n_bytes, .capacity = n_bytes};
    if (n_bytes)
        memcpy(m->bytes, bytes, n_bytes);
    m->bytes[n_bytes] = 0;
    return m;
}

static void note_closed(struct ws *ws, const char *reason)
{
    struct message *m = ws->closed ? NULL : message_create(WS_CLOSED, reason, strlen(reason));
    ws->closed = true;
    ws->wsi = NULL;
    if (m)
        push(&ws->in, m);
}

/* False: too large, or memory is short. */
static bool receive(struct ws *ws, const void *bytes, size_t n)
{
    struct message *m = ws->partial;
    if (!m || m->capacity - m->n_bytes < n) {
        size_t have = m ? m->n_bytes : 0, capacity = 2 * (have + n);
        if (have + n > MESSAGE_MAX_BYTES || !(m = realloc(m, sizeof *m + capacity + 1)))
            return false;
        m->n_bytes = have;
        m->capacity = capacity;
        ws->partial = m;
    }
    memcpy(m->bytes + m->n_bytes, bytes, n);
    m->n_bytes += n;
    if (!lws_is_final_fragment(ws->wsi) || lws_remaining_packet_payload(ws->wsi) > 0)
        return true;
    m->kind = lws_frame_is_binary(ws->wsi) ? WS_BINARY : WS_TEXT;
    m->t_ns = ws_clock_ns();
    m->bytes[m->n_bytes] = 0;
    push(&ws->in, m);
    ws->partial = NULL;
    return true;
}

static int write_one(struct ws *ws)
{
    struct message *m = pop(&ws->out);
    if (!m)
        return 0;
    size_t n = m->n_bytes - LWS_PRE;
    bool ok = lws_write(ws->wsi, m->bytes + LWS_PRE, n, LWS_WRITE_TEXT) >= (int)n;
    free(m);
    if (ok && ws->out.first)
        lws_callback_on_writable(ws->wsi);
    return ok ? 0 : -1;
}

static int on_event(struct lws *wsi, enum lws_callback_reasons reason, void *user, void *in, size_t len)
{
    struct ws *ws = lws_context_user(lws_get_context(wsi));
    struct message *opened;
    (void)user;
    switch (reason) {
    case LWS_CALLBACK_CLIENT_ESTABLISHED:
        opened = message_create(WS_OPEN, "", 0);
        if (!opened)
            return -1;
        push(&ws->in, opened);
        lws_callback_on_writable(wsi);
        return 0;
    case LWS_CALLBACK_CLIENT_RECEIVE:
        return receive(ws, in, len) ? 0 : -1;
    case LWS_CALLBACK_CLIENT_WRITEABLE:
        return write_one(ws);
    case LWS_CALLBACK_CLIENT_CONNECTION_ERROR:
        note_closed(ws, in ? in : "cannot connect");
        return 0;
    case LWS_CALLBACK_CLIENT_CLOSED:
        note_closed(ws, "closed by the server");
        return 0;
    case LWS_CALLBACK_WS_PEER_INITIATED_CLOSE: { /* 2 bytes code, then a reason */
        char text[160];
        unsigned code = len >= 2 ? (unsigned)((uint8_t *)in)[0] << 8 | ((uint8_t *)in)[1] : 1005u;
        snprintf(text, sizeof text, "closed by the server: %u %.*s", code, len > 2 ? (int)len - 2 : 0,
                 len > 2 ? (const char *)in + 2 : "");
        note_closed(ws, text);
        return 0;
    }
    default:
        return 0;
    }
}

struct address {
    char host[256], path[256];
    int port;
    bool tls;
};

static bool parse_url(const char *url, struct address *ret)
{
    bool tls = strncmp(url, "wss://", 6) == 0;
    struct address a = {.port = tls ? 443 : 80, .path = "/", .tls = tls};
    if (!tls && strncmp(url, "ws://", 5) != 0)
        return false;
    url += tls ? 6 : 5;
    size_t n = strcspn(url, "/:");
    if (n == 0 || n >= sizeof a.host)
        return false;
    memcpy(a.host, url, n);
    url += n;
    if (*url == ':') {
        char *end;
        long port = strtol(url + 1, &end, 10);
        if (end == url + 1 || port < 1 || port > 65535 || (*end && *end != '/'))
            return false;
        a.port = (int)port;
        url = end;
    }
    if (*url && snprintf(a.path, sizeof a.path, "%s", url) >= (int)sizeof a.path)
        return false;
    *ret = a;
    return true;
}

/* What libwebsockets takes for a name that it looks up, or a file that it cannot read, is told by its callbacks. */
static struct lws_context *make_context(struct ws *ws, const struct lws_protocols *protocols, bool tls, const char *ca)
{
    struct lws_context_creation_info info = {
        .port = CONTEXT_PORT_NO_LISTEN, .protocols = protocols, .user = ws, .gid = (gid_t)-1, .uid = (uid_t)-1};
    if (tls)
        info.options = LWS_SERVER_OPTION_DO_SSL_GLOBAL_INIT;
#if defined(LWS_WITH_TLS)
    info.client_ssl_ca_filepath = ca;
#else
    (void)ca;
#endif
    return lws_create_context(&info);
}

struct ws *ws_connect(const char *url, const char *ca, const char *subprotocol, const char **ret_reason)
{
    static const struct lws_protocols protocols[] = {
        {.name = "replay", .callback = on_event, .rx_buffer_size = 1 << 16}, {.name = NULL}};
    struct address a;
    if (!parse_url(url, &a)) {
        *ret_reason = "the URL must look like ws://host:port, or wss://host:port";
        return NULL;
    }
    if (ca && (!a.tls || access(ca, R_OK) != 0)) {
        *ret_reason = a.tls ? "the file of --ca cannot be read" : "--ca is for wss://";
        return NULL;
    }
#if !defined(LWS_WITH_TLS)
    if (a.tls) {
        *ret_reason = "this lumend-replay was built with a libwebsockets without TLS";
        return NULL;
    }
#endif
    struct ws *ws = calloc(1, sizeof *ws);
    *ret_reason = "out of memory";
    if (!ws)
        return NULL;
    ws->in.end = &ws->in.first;
    ws->out.end = &ws->out.first;
    lws_set_log_level(0, NULL);
    ws->context = make_context(ws, protocols, a.tls, ca);
    if (!ws->context)
        goto fail;
    char host[280];
    snprintf(host, sizeof host, "%s:%d", a.host, a.port);
    const struct lws_client_connect_info to = {.context = ws->context,
                                               .address = a.host,
                                               .port = a.port,
                                               .path = a.path,
                                               .host = host,
                                               .ssl_connection = a.tls ? LCCSCF_USE_SSL : 0,
                                               .protocol = subprotocol,
                                               .local_protocol_name = "replay",
                                               .pwsi = &ws->wsi};
    if (!lws_client_connect_via_info(&to)) {
        *ret_reason = "cannot connect";
        goto fail;
    }
    return ws;
fail:
    ws_destroy(ws);
    return NULL;
}

static void queue_free(struct queue *q)
{
    for (struct message *m; (m = pop(q));)
        free(m);
}

void ws_destroy(struct ws *ws)
{
    if (!ws)
        return;
    if (ws->context)
        lws_context_destroy(ws->context);
    queue_free(&ws->in);
    queue_free(&ws->out);
    free(ws->partial);
    free(ws->current);
    free(ws);
}

bool ws_send(struct ws *ws, char *text)
{
    size_t n = text ? strlen(text) : 0;
    struct message *m = text ? malloc(sizeof *m + LWS_PRE + n) : NULL;
    if (m) {
        *m = (struct message){.n_bytes = LWS_PRE + n};
        memcpy(m->bytes + LWS_PRE, text, n);
        push(&ws->out, m);
        if (ws->wsi)
            lws_callback_on_writable(ws->wsi);
    }
    free(text);
    return m != NULL;
}

static void wake(lws_sorted_usec_list_t *sul)
{
    (void)sul; /* its only work is to end the poll */
}

struct ws_event ws_next(struct ws *ws, int64_t deadline_ns)
{
    lws_sorted_usec_list_t timer;
    memset(&timer, 0, sizeof timer);
    free(ws->current);
    ws->current = NULL;
    while (!ws->in.first && !ws->closed) {
        int64_t left_ns = deadline_ns - ws_clock_ns();
        if (left_ns <= 0)
            break;
        lws_sul_schedule(ws->context, 0, &timer, wake, left_ns / 1000 + 1);
        int failed = lws_service(ws->context, 0);
        lws_sul_schedule(ws->context, 0, &timer, wake, LWS_SET_TIMER_USEC_CANCEL);
        if (failed < 0)
            note_closed(ws, "the network loop failed");
    }
    struct message *m = ws->current = pop(&ws->in);
    if (m)
        return (struct ws_event){m->kind, m->t_ns, m->bytes, m->n_bytes};
    if (ws->closed)
        return (struct ws_event){WS_CLOSED, ws_clock_ns(), (const uint8_t *)"closed", 6};
    return (struct ws_event){WS_TIMEOUT, ws_clock_ns(), NULL, 0};
}

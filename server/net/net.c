/* libwebsockets 4.1 in use. Rules that this file keeps, because breaking them is a bug in that library's terms or a
 * hole:
 *
 * - Other threads call lws_cancel_service and nothing else. A producer publishes, sets `woken`, then cancels; this
 *   thread clears `woken` first and looks after that, so no wake-up is lost.
 * - At most one lws_write per WRITEABLE callback. WRITEABLE also comes unasked: what to send is decided from our own
 *   state.
 * - A long message goes out in fragments of at most one tx_packet_size, so that the library never copies more than that
 *   to its heap, and nothing is begun while it still holds a partial write.
 * - HTTP_CONFIRM_UPGRADE refuses every upgrade but websocket, and touches only headers that are there: on a kept-alive
 *   connection the header block may be gone and `in` dangling (read after free in 4.1.6 before any authentication), and
 *   "h2c" would be accepted on a clear-text port.
 * - Host and Origin are checked for pages and upgrades alike.
 * - By TLS each read takes a whole record. Where a rest of one stays with OpenSSL while a WebSocket is not read from
 *   (lws_rx_flow_control), 4.1.6 turns for ever, and adds what it holds back to its heap each time.
 * - There is no limit on message size, connections per address, handshakes, bytes or messages per second in the
 * library: they are here, in peers.c, in handshakes.c, in session_receive.c and in uploads.c. */
#define _GNU_SOURCE
#include "server/net/net.h"

#include <errno.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include <sys/socket.h>
#include <time.h>

#include "server/base/service.h"
#include "server/net/net_internal.h"
#include "server/net/presence.h"
#include "server/net/projects.h"
#include "server/net/tls.h"

#define PROTOCOL "lumend.v1"
#define RX_BYTES (16u << 10)              /* read at once: most messages whole; each connection has such a buffer */
#define TLS_RECORD_BYTES (16u << 10)      /* at most: RFC 8446, 5.1 */
#define UNSENT_BYTES (128 << 10)          /* TCP_NOTSENT_LOWAT: frames wait here, and not in the kernel */
#define TURN_NS 1000000000ll              /* of projects: what waits for one waits seconds anyway */
#define HEADER_POOL LUM_LIMIT_CONNECTIONS /* all may be in their HTTP phase at once: none waits for another */
#define CLOSE_GRACE_S 5                   /* a peer that does not take the close frame is cut off */
#define DRAIN_GRACE_S 1                   /* and one that does not answer it, where the server waits for that to end */

_Static_assert(RX_BYTES >= TLS_RECORD_BYTES, "a record may stay unread in part");

static const lws_retry_bo_t idle_policy = {
    .secs_since_valid_ping = LUM_LIMIT_PING_S,
    .secs_since_valid_hangup = LUM_LIMIT_HANGUP_S,
};

/* ---- connections by network ---- */

/* At once, so that its place is free. Twice, because the library at first only shuts a socket down, and waits. */
static void turn_out(struct lum_net *net, const struct lum_peer *peer)
{
    for (int i = 0; i < 2 && peer->connection; i++)
        lws_set_timeout(peer->connection, PENDING_TIMEOUT_USER_REASON_BASE, LWS_TO_KILL_SYNC);
    net->counters.connections_turned_out++;
}

/* False: this network has begun too many handshakes, and would only have one refused: that is cheaper now. */
static bool may_begin_soon(struct lum_net *net, const struct in6_addr *network)
{
    bool may = !net->config.tls ||
               lum_handshakes_may(&net->handshakes, network, lum_peers_know(&net->peers, network), lum_clock_ns());
    net->counters.handshakes_refused += !may;
    return may;
}

static bool may_begin(void *user, int fd)
{
    struct lum_net *net = user;
    struct in6_addr network;
    bool may = lum_peer_network_of(fd, &network) &&
               lum_handshakes_take(&net->handshakes, &network, lum_peers_know(&net->peers, &network), lum_clock_ns());
    net->counters.handshakes += may;
    net->counters.handshakes_refused += !may;
    return may;
}

/* Before a byte is read. Nonzero: hang up. */
static int filter_connection(struct lum_net *net, int fd)
{
    struct in6_addr network;
    if (lum_peer_network_of(fd, &network) && may_begin_soon(net, &network)) {
        const struct lum_peer *guest = lum_peers_in_the_way(&net->peers, &network);
        if (guest)
            turn_out(net, guest);
        if (lum_peers_admit(&net->peers, &network))
            return 0;
    }
    net->counters.connections_refused++;
    return 1;
}

/* The connection remembers its peer in the library's opaque pointer until it is destroyed. */
static void count_connection(struct lum_net *net, struct lws *wsi)
{
    struct in6_addr network;
    if (lum_peer_network_of(lws_get_socket_fd(wsi), &network))
        lws_set_opaque_user_data(wsi, lum_peers_add(&net->peers, &network, wsi));
    net->counters.connections++;
}

static void uncount_connection(struct lws *wsi)
{
    lum_peers_remove(lws_get_opaque_user_data(wsi));
    lws_set_opaque_user_data(wsi, NULL);
}

/* ---- WebSocket ---- */

static int close_with(struct conn *c, enum lum_close code)
{
    const char *reason = lum_close_reason(code);
    lws_close_reason(c->wsi, (enum lws_close_status)code, (unsigned char *)reason, strlen(reason));
    return -1;
}

/* By its own time-outs the library would go on to wait, for the answers to a close frame and to the end of TLS. */
static void cut_off(lws_sorted_usec_list_t *sul)
{
    struct conn *c = lws_container_of(sul, struct conn, cut_later);
    struct lum_net *net = lws_context_user(lws_get_context(c->wsi));
    uint32_t slot = lum_session_slot(c->session);
    for (int i = 0; i < 2 && net->conns[slot]; i++) /* twice: see turn_out */
        lws_set_timeout(net->conns[slot]->wsi, PENDING_TIMEOUT_USER_REASON_BASE, LWS_TO_KILL_SYNC);
}

static void cut_off_in(struct conn *c, int64_t s)
{
    lws_sul_schedule(lws_get_context(c->wsi), 0, &c->cut_later, cut_off, s * LWS_US_PER_SEC);
}

/* Ends the connection from outside its own callbacks: at its next WRITEABLE, or by force when that does not come. */
static void close_soon(struct conn *c)
{
    if (!c->closing) /* once: the grace must not begin anew with every wake-up */
        cut_off_in(c, CLOSE_GRACE_S);
    c->closing = true;
    lws_callback_on_writable(c->wsi);
}

/* Who has not said hello goes when its time is over, and makes room before. */
static void expect_hello(struct conn *c)
{
    struct lum_peer *peer = lws_get_opaque_user_data(c->wsi);
    if (peer)
        peer->greeted = false;
    c->kept = false;
    lws_set_timer_usecs(c->wsi, (lws_usec_t)LUM_LIMIT_HELLO_S * LWS_US_PER_SEC);
}

static void keep_for_good(struct conn *c)
{
    struct lum_peer *peer = lws_get_opaque_user_data(c->wsi);
    if (peer)
        peer->greeted = true;
    c->kept = true;
    lws_set_timer_usecs(c->wsi, LWS_SET_TIMER_USEC_CANCEL);
}

/* Sees to it that what waits for this client goes out. One that takes nothing in never becomes writable: a close is not
 * left to that. */
static void serve(const struct lum_net *net, struct conn *c)
{
    if (c->kept && !lum_session_greeted(c->session)) /* it waited for a project, and was refused */
        expect_hello(c);
    if (!lum_session_pending(c->session))
        return;
    if (net->site.draining || lum_session_close_now(c->session))
        close_soon(c);
    else
        lws_callback_on_writable(c->wsi);
}

/* Where people are, to who has not heard it. */
static void tell_presence(lws_sorted_usec_list_t *sul)
{
    struct lum_net *net = lws_container_of(sul, struct lum_net, presence_later);
    int64_t wait_ns = net->sessions ? lum_sessions_tell_presence(net->sessions, lum_clock_ns()) : INT64_MAX;
    for (uint32_t i = 0; i < LUM_LIMIT_CONNECTIONS; i++)
        if (net->conns[i])
            serve(net, net->conns[i]);
    if (wait_ns != INT64_MAX)
        lws_sul_schedule(net->context, 0, &net->presence_later, tell_presence, wait_ns / 1000 + 1);
}

static void tell_presence_soon(struct lum_net *net)
{
    if (net->sessions && lum_sessions_presence_waits(net->sessions))
        lws_sul_schedule(net->context, 0, &net->presence_later, tell_presence, 1);
}

static int ws_established(struct lum_net *net, struct lws *wsi, struct conn *c)
{
    const int on = 1, unsent = UNSENT_BYTES, fd = lws_get_socket_fd(wsi);
    /* Both only shorten waiting; a socket that refuses them still works. */
    (void)setsockopt(fd, IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
    (void)setsockopt(fd, IPPROTO_TCP, TCP_NOTSENT_LOWAT, &unsent, sizeof unsent);
    lum_net_http_finish(net, c);
    memset(c, 0, sizeof *c);
    c->wsi = wsi;
    char peer[INET6_ADDRSTRLEN] = "";
    lws_get_peer_simple(wsi, peer, sizeof peer);
    c->session = lum_session_open(net->sessions, peer);
    if (!c->session)
        return close_with(c, LUM_CLOSE_BUSY);
    net->conns[lum_session_slot(c->session)] = c;
    expect_hello(c);
    lum_net_begin_flow(c);
    serve(net, c);
    return 0;
}

static void ws_closed(struct lum_net *net, struct conn *c)
{
    if (!c->session)
        return;
    net->conns[lum_session_slot(c->session)] = NULL;
    lum_net_end_flow(c);
    lws_sul_cancel(&c->cut_later);
    lum_session_forget_beside(c->session, net->reader);
    lum_session_close(c->session);
    lum_fragments_finish(&c->rx);
    c->session = NULL;
    tell_presence_soon(net);
    if (net->site.draining) /* one that a timer closed: the library would sleep until its next timer, half a minute */
        lws_cancel_service(net->context);
}

static int ws_receive(struct lum_net *net, struct conn *c, const char *bytes, size_t n)
{
    struct lws *wsi = c->wsi;
    size_t max = lum_session_max_bytes(c->session);
    lws_validity_confirmed(wsi); /* a pong may be stuck behind tiles on a slow line; who talks is alive all the same */
    if (lws_frame_is_binary(wsi))
        return close_with(c, LUM_CLOSE_UNSUPPORTED);
    lum_net_charge(c, bytes, n);
    /* What this fragment declares still to come counts too: no need to receive it all first. */
    if (c->rx.n + n + lws_remaining_packet_payload(wsi) > max)
        return close_with(c, LUM_CLOSE_TOO_BIG);
    if (!lum_fragments_add(&c->rx, bytes, n, max))
        return close_with(c, LUM_CLOSE_INTERNAL);
    if (!lws_is_final_fragment(wsi) || lws_remaining_packet_payload(wsi))
        return 0;
    if (lum_net_read_beside(net, c))
        return 0;
    if (c->n_reading) /* it would overtake */
        return close_with(c, LUM_CLOSE_INTERNAL);
    lum_session_receive(c->session, c->rx.bytes ? c->rx.bytes : "", c->rx.n);
    lum_fragments_clear(&c->rx);
    if (lum_session_greeted(c->session))
        keep_for_good(c);
    if (lum_sessions_take_ended(net->sessions))
        lum_net_wake(net);
    tell_presence_soon(net);
    serve(net, c);
    return 0;
}

static int ws_writeable(struct lum_net *net, struct conn *c)
{
    if (lws_partial_buffered(c->wsi)) {
        lws_callback_on_writable(c->wsi);
        return 0;
    }
    if (!c->sending) {
        enum lum_close code = lum_session_close_now(c->session);
        if (code && net->site.draining)
            cut_off_in(c, DRAIN_GRACE_S);
        if (code)
            return close_with(c, code);
        if (!lum_session_next(c->session, &c->message))
            return 0;
        c->sending = true;
        c->message_sent = 0;
    }
    size_t n = lum_message_copy(&c->message, c->message_sent, net->tx + LWS_PRE, LUM_NET_CHUNK_BYTES);
    bool first = c->message_sent == 0, last = c->message_sent + n == c->message.n_head + c->message.n_body;
    int flags = lws_write_ws_flags(c->message.binary ? LWS_WRITE_BINARY : LWS_WRITE_TEXT, first, last);
    if (lws_write(c->wsi, net->tx + LWS_PRE, n, (enum lws_write_protocol)flags) < (int)n)
        return -1;
    c->message_sent += n;
    net->counters.tx_bytes += n;
    if (last) {
        lum_session_sent(c->session);
        c->sending = false;
    }
    if (c->sending || lum_session_pending(c->session))
        lws_callback_on_writable(c->wsi);
    return 0;
}

/* The hello deadline. */
static int ws_timer(struct conn *c)
{
    if (!c->session || lum_session_greeted(c->session))
        return 0;
    lum_session_abort(c->session, LUM_CLOSE_AUTH);
    close_soon(c);
    return 0;
}

/* ---- the loop ---- */

static void look_around(struct lum_net *net)
{
    atomic_store(&net->woken, false); /* before looking: pairs with lum_net_wake */
    if (net->config.tls) {
        lum_tls_take_offered(net->config.tls);
        net->counters.certificate_ends_s = lum_tls_ends_s(net->config.tls);
    }
    if (!net->sessions)
        return;
    if (atomic_load(&net->stop) && !net->site.draining) {
        net->site.draining = true;
        lum_sessions_begin_drain(net->sessions);
    }
    if (lum_auth_take_offered(net->config.auth))
        lum_sessions_review(net->sessions, time(NULL));
    lum_net_take_read(net);
    lum_sessions_deliver(net->sessions);
    lum_net_http_look(net);
    tell_presence_soon(net); /* one who waited for a project is in */
    for (uint32_t i = 0; i < LUM_LIMIT_CONNECTIONS; i++)
        if (net->conns[i])
            serve(net, net->conns[i]);
}

/* Of a close frame: the client is done (1000), or its page is (1001). Others are broken connections. */
static bool is_leaving(const void *payload, size_t n_bytes)
{
    const uint8_t *code = payload;
    return n_bytes >= 2 && code[0] == 1000 >> 8 && (code[1] == (1000 & 255) || code[1] == (1001 & 255));
}

static int on_event(struct lws *wsi, enum lws_callback_reasons reason, void *user, void *in, size_t len)
{
    struct lum_net *net = lws_context_user(lws_get_context(wsi));
    struct conn *c = user;
    switch ((int)reason) {                                    /* int: only these reasons concern us */
    case LWS_CALLBACK_OPENSSL_LOAD_EXTRA_SERVER_VERIFY_CERTS: /* once, of the listening socket: no connection yet */
        return lum_tls_setup(net->config.tls, user, may_begin, net) ? 0 : -1;
    case LWS_CALLBACK_FILTER_NETWORK_CONNECTION:
        return filter_connection(net, (int)(intptr_t)in);
    case LWS_CALLBACK_SERVER_NEW_CLIENT_INSTANTIATED:
        count_connection(net, wsi);
        return 0;
    case LWS_CALLBACK_WSI_DESTROY:
        uncount_connection(wsi);
        return 0;
    case LWS_CALLBACK_HTTP_CONFIRM_UPGRADE:
        return lum_net_confirm_upgrade(net, wsi);
    case LWS_CALLBACK_RAW_ADOPT: /* CONNECT would turn the connection into a raw one, without any time limit */
    case LWS_CALLBACK_RAW_RX:
        return -1;
    case LWS_CALLBACK_HTTP:
        return lum_net_http_request(net, wsi, c, in, len);
    case LWS_CALLBACK_HTTP_WRITEABLE:
        return lum_net_http_writeable(net, c);
    case LWS_CALLBACK_CLOSED_HTTP:
    case LWS_CALLBACK_HTTP_DROP_PROTOCOL:
        if (c)
            lum_net_http_finish(net, c);
        return 0;
    case LWS_CALLBACK_ESTABLISHED:
        return ws_established(net, wsi, c);
    case LWS_CALLBACK_RECEIVE:
        return c->session ? ws_receive(net, c, in, len) : -1;
    case LWS_CALLBACK_SERVER_WRITEABLE:
        return c->session ? ws_writeable(net, c) : -1;
    case LWS_CALLBACK_TIMER:
        return c ? ws_timer(c) : 0;
    case LWS_CALLBACK_WS_PEER_INITIATED_CLOSE:
        if (c->session && is_leaving(in, len))
            lum_session_leave(c->session);
        return 0;
    case LWS_CALLBACK_CLOSED:
        ws_closed(net, c);
        return 0;
    case LWS_CALLBACK_EVENT_WAIT_CANCELLED:
        look_around(net);
        return 0;
    case LWS_CALLBACK_HTTP_BODY:
        return lum_net_http_body(c, in, len);
    case LWS_CALLBACK_HTTP_BODY_COMPLETION:
        return lum_net_http_body_end(c);
    default:
        return 0;
    }
}

static void fill_info(struct lum_net *net, struct lws_context_creation_info *info)
{
    const struct lum_net_config *config = &net->config;
    net->protocols[0] = (struct lws_protocols){.name = PROTOCOL,
                                               .callback = on_event,
                                               .per_session_data_size = sizeof(struct conn),
                                               .rx_buffer_size = RX_BYTES,
                                               .tx_packet_size = LUM_NET_TX_BYTES};
    memset(info, 0, sizeof *info);
    info->iface = config->address.any ? NULL : config->address.host;
    info->port = config->address.port;
    info->protocols = net->protocols;
    info->user = net;
    info->gid = info->uid = -1;
    info->alpn = "http/1.1"; /* never h2 */
    info->server_string = "lumend";
    info->max_http_header_data = LUM_LIMIT_HTTP_HEADER_BYTES;
    info->max_http_header_pool = HEADER_POOL;
    info->pt_serv_buf_size = config->tls ? 2 * TLS_RECORD_BYTES : 0; /* 0: 4 KiB */
    info->fd_limit_per_thread = LUM_LIMIT_CONNECTIONS + 16; /* the listening socket, the event descriptor, spare */
    info->timeout_secs = 10;
    info->timeout_secs_ah_idle = 10;
    info->keepalive_timeout = 5;
    info->retry_and_idle_policy = &idle_policy;
    info->options = LWS_SERVER_OPTION_VALIDATE_UTF8 | LWS_SERVER_OPTION_FAIL_UPON_UNABLE_TO_BIND |
                    (config->address.ipv6 ? 0 : LWS_SERVER_OPTION_DISABLE_IPV6) | LWS_SERVER_OPTION_EXPLICIT_VHOSTS |
                    (config->tls ? LWS_SERVER_OPTION_DO_SSL_GLOBAL_INIT | LWS_SERVER_OPTION_CREATE_VHOST_SSL_CTX : 0);
}

enum lum_status lum_net_create(const struct lum_net_config *config, struct lum_net **ret_net, struct lum_error *err)
{
    enum lum_status status;
    struct lws_context_creation_info info;
    struct lum_net *net = lum_calloc(1, sizeof *net);
    if (!net)
        return lum_fail(err, LUM_ERR_NOMEM, "", "no memory for the network");
    net->config = *config;
    net->site =
        (struct lum_http_site){.counters = &net->counters, .auth = net->config.auth, .started_ns = lum_clock_ns()};
    lum_handshakes_init(&net->handshakes, lum_clock_ns());
    lws_set_log_level(0, NULL); /* what matters is reported from here, through our own log */
    fill_info(net, &info);
    net->context = lws_create_context(&info);
    if (!net->context) {
        status = lum_fail(err, LUM_ERR_INTERNAL, "listen", "libwebsockets gives no context");
        goto fail;
    }
    status = lum_reader_create(lum_net_wake, net, &net->reader, err);
    if (status)
        goto fail;
    errno = 0;
    net->vhost = lws_create_vhost(net->context, &info);
    if (!net->vhost) {
        status = lum_fail(err, LUM_ERR_IO, "listen", "cannot listen on %s port %u: %s", config->address.host,
                          config->address.port,
                          errno == EADDRINUSE ? "another program does (port 0 picks a free one)"
                          : errno             ? strerror(errno)
                                              : "the address is taken or not ours");
        goto fail;
    }
    *ret_net = net;
    return LUM_OK;
fail:
    lum_net_destroy(net);
    return status;
}

void lum_net_destroy(struct lum_net *net)
{
    if (!net)
        return;
    lum_reader_destroy(net->reader); /* it wakes the context */
    if (net->context)
        lws_context_destroy(net->context);
    lum_free(net);
}

uint16_t lum_net_port(const struct lum_net *net)
{
    return (uint16_t)lws_get_vhost_listen_port(net->vhost);
}

const struct lum_tls *lum_net_tls(const struct lum_net *net)
{
    return net->config.tls;
}

struct lum_net_counters *lum_net_counters(struct lum_net *net)
{
    return &net->counters;
}

bool lum_net_wait(struct lum_net *net, const _Atomic bool *until, bool *ret_failed)
{
    *ret_failed = false;
    while (!atomic_load(until) && !atomic_load(&net->stop) && !*ret_failed)
        *ret_failed = lws_service(net->context, 0) < 0;
    return atomic_load(until);
}

/* Where there are projects: some wait for time, or for one another. */
static void turn(lws_sorted_usec_list_t *sul)
{
    struct lum_net *net = lws_container_of(sul, struct lum_net, turn_later);
    int64_t alive_ns = net->config.service->alive_ns, period_ns = TURN_NS;
    look_around(net);
    if (alive_ns && lum_projects_take_alive(net->site.projects))
        lum_service_tell_alive(net->config.service);
    if (alive_ns && alive_ns < period_ns)
        period_ns = alive_ns;
    lws_sul_schedule(net->context, 0, &net->turn_later, turn, period_ns / 1000);
}

void lum_net_run(struct lum_net *net, struct lum_sessions *sessions, struct lum_projects *projects)
{
    net->sessions = sessions;
    net->site.projects = projects;
    look_around(net);
    if (lum_projects_are_many(projects))
        turn(&net->turn_later);
    while (!net->site.draining || net->counters.sessions_open)
        if (lws_service(net->context, 0) < 0)
            break;
    lws_sul_cancel(&net->turn_later);
    lws_sul_cancel(&net->presence_later);
    lum_net_http_drop(net);
    net->sessions = NULL;
}

void lum_net_wake(void *user)
{
    struct lum_net *net = user;
    if (!atomic_exchange(&net->woken, true))
        lws_cancel_service(net->context);
}

void lum_net_stop(struct lum_net *net)
{
    atomic_store(&net->stop, true);
    lws_cancel_service(net->context);
}

#define LUM_STRING_(x) #x
#define LUM_STRING(x) LUM_STRING_(x)

const char *lum_net_library(void)
{
    /* not LWS_LIBRARY_VERSION, which Debian's build leaves as "4.1.6-" */
    return "libwebsockets " LUM_STRING(LWS_LIBRARY_VERSION_MAJOR) "." LUM_STRING(
        LWS_LIBRARY_VERSION_MINOR) "." LUM_STRING(LWS_LIBRARY_VERSION_PATCH);
}

/* Who is read from, and when: a client whose bytes are paid for, and whose last message has been read. */
#include "server/net/net_internal.h"

#include "server/net/received.h"

#define FRAME_HEADERS_BYTES 64 /* of a frame and a record of TLS: 14 and 5, its checksum 16; and some */
#define READ_LATER_US 20000    /* at least so long, so that a flood does not mean a timer for every read */

static void read_on_if_free(struct conn *c)
{
    if (!c->owes && !c->n_reading)
        lws_rx_flow_control(c->wsi, 1);
}

static void read_on(lws_sorted_usec_list_t *sul)
{
    struct conn *c = lws_container_of(sul, struct conn, read_later);
    c->owes = false;
    read_on_if_free(c);
}

/* Who owes is not read from until it is paid. What comes waits in the kernel, and with the sender. */
static void let_wait(struct conn *c, int64_t wait_ns)
{
    if (!wait_ns)
        return;
    c->owes = true;
    lws_rx_flow_control(c->wsi, 0);
    lws_sul_schedule(lws_get_context(c->wsi), 0, &c->read_later, read_on, wait_ns / 1000 + READ_LATER_US);
}

void lum_net_charge(struct conn *c, const char *bytes, size_t n)
{
    c->n_charged += n + FRAME_HEADERS_BYTES;
    let_wait(c, lum_session_charge(c->session, bytes, n, lws_remaining_packet_payload(c->wsi) == 0));
}

/* What was of no message is paid for afterwards: of pings, and of what is TLS's own, the library tells nothing. */
static void count_rest(lws_sorted_usec_list_t *sul)
{
    struct conn *c = lws_container_of(sul, struct conn, count_later);
    uint64_t n_read = c->n_read;
    bool known = lum_received_bytes(lws_get_socket_fd(c->wsi), &n_read);
    uint64_t n_free = c->n_charged + LUM_LIMIT_RX_REST_PER_S, n = n_read - c->n_read;
    if (known && n > n_free)
        let_wait(c, lum_session_charge_rest(c->session, n - n_free));
    c->n_read = n_read;
    c->n_charged = 0;
    if (c->n_reading) /* its pong waits unread behind what it sent: the silence is ours */
        lws_validity_confirmed(c->wsi);
    lws_sul_schedule(lws_get_context(c->wsi), 0, &c->count_later, count_rest, LWS_US_PER_SEC);
}

void lum_net_begin_flow(struct conn *c)
{
    (void)lum_received_bytes(lws_get_socket_fd(c->wsi), &c->n_read);
    lws_sul_schedule(lws_get_context(c->wsi), 0, &c->count_later, count_rest, LWS_US_PER_SEC);
}

void lum_net_end_flow(struct conn *c)
{
    lws_sul_cancel(&c->read_later);
    lws_sul_cancel(&c->count_later);
}

/* ---- large messages ---- */

/* Behind one that is being read, small ones wait, too: a client is answered in the order in which it asks. */
bool lum_net_read_beside(struct lum_net *net, struct conn *c)
{
    if (c->rx.n < LUM_READER_SMALL_BYTES && !c->n_reading)
        return false;
    enum lum_read_beside how = lum_session_read_beside(c->session, net->reader, c->rx.bytes, c->rx.n);
    if (how == LUM_READ_NOT)
        return false;
    c->rx = (struct lum_fragments){0};
    if (how == LUM_READ_REFUSED) {
        lws_callback_on_writable(c->wsi);
        return true;
    }
    c->n_reading++;
    lws_rx_flow_control(c->wsi, 0);
    return true;
}

void lum_net_take_read(struct lum_net *net)
{
    for (struct lum_reading *m; (m = lum_reader_next(net->reader));) {
        struct lum_session *s = lum_sessions_receive_read(net->sessions, m);
        struct conn *c = s ? net->conns[lum_session_slot(s)] : NULL;
        if (c && --c->n_reading == 0)
            read_on_if_free(c);
        lum_reading_destroy(m);
    }
}

/* What net.c (connections, WebSocket, the loop) and net_http.c (pages, files that are sent) share. The rules at the top
 * of net.c are for both. */
#ifndef LUM_SERVER_NET_NET_INTERNAL_H
#define LUM_SERVER_NET_NET_INTERNAL_H

#include <libwebsockets.h>

#include "server/net/handshakes.h"
#include "server/net/metrics.h"
#include "server/net/net.h"
#include "server/net/peers.h"
#include "server/net/fragments.h"
#include "server/net/reader.h"

#define LUM_NET_TX_BYTES (128u << 10)                /* one write: a raw tile of 128 x 128 and its header fit */
#define LUM_NET_CHUNK_BYTES (LUM_NET_TX_BYTES - 16u) /* less the WebSocket frame header, at most 10 bytes */

/* Per connection, in the library's memory: zeroed when the connection first needs it, and gone with it. */
struct conn {
    struct lws *wsi;
    /* HTTP */
    struct lum_http_response response;
    size_t response_sent;
    bool head_only;
    size_t n_file;             /* bytes of the response that count among file_bytes of the server */
    bool tls_for_good;         /* the response says that this name is reached by TLS alone */
    struct lum_upload *upload; /* NULL: none comes by this connection */
    /* WebSocket */
    struct lum_session *session; /* NULL: not a WebSocket */
    struct lum_fragments rx;
    lws_sorted_usec_list_t read_later, count_later, cut_later;
    uint64_t n_read;    /* bytes, when it was counted last */
    uint64_t n_charged; /* bytes of messages since then, and what belongs to each */
    bool owes;          /* what came is not paid for yet */
    uint32_t n_reading; /* messages that the reader has, or that wait behind one */
    bool kept;          /* it said hello: no deadline runs */
    bool closing;       /* close_soon was called */
    bool sending;       /* message is on its way */
    struct lum_message message;
    size_t message_sent; /* of head and body together */
};

struct lum_net {
    struct lum_net_config config;
    struct lws_context *context;
    struct lws_vhost *vhost;
    struct lws_protocols protocols[2];
    _Atomic bool woken, stop;
    struct lum_reader *reader;
    /* net thread */
    struct lum_sessions *sessions;
    struct lum_http_site site;
    lws_sorted_usec_list_t turn_later, presence_later;
    struct lum_net_counters counters;
    uint64_t file_bytes;                       /* of files that are on their way */
    struct conn *conns[LUM_LIMIT_CONNECTIONS]; /* by session slot */
    struct lum_peers peers;
    struct lum_handshakes handshakes; /* of TLS */
    unsigned char tx[LWS_PRE + LUM_NET_TX_BYTES];
};

/* ---- net_flow.c: who is read from, and when ---- */
void lum_net_begin_flow(struct conn *c);
void lum_net_end_flow(struct conn *c);
/* What a client sends is paid for before anybody looks at it. */
void lum_net_charge(struct conn *c, const char *bytes, size_t n);
/* The whole message in c->rx, if it is large, or others of this client are being read. False: it is for the net thread.
 */
bool lum_net_read_beside(struct lum_net *net, struct conn *c);
void lum_net_take_read(struct lum_net *net); /* what has been read */

/* ---- net_http.c: callbacks, whose result is the library's: nonzero hangs up ---- */
int lum_net_confirm_upgrade(const struct lum_net *net, struct lws *wsi);
int lum_net_http_request(struct lum_net *net, struct lws *wsi, struct conn *c, const char *path, size_t n_path);
int lum_net_http_body(struct conn *c, const void *bytes, size_t n);
int lum_net_http_body_end(struct conn *c);
int lum_net_http_writeable(struct lum_net *net, struct conn *c);
/* The connection is of no request any more. */
void lum_net_http_finish(struct lum_net *net, struct conn *c);
/* After a wake: goes on with what waited for the disk. */
void lum_net_http_look(struct lum_net *net);
/* No file is waited for any more. */
void lum_net_http_drop(struct lum_net *net);

#endif

/* What the files of sessions share: session.c (life, and what comes in and goes out), session_hello.c (who it is) and
 * session_admin.c (who is here). Everything belongs to the net thread. */
#ifndef LUM_SERVER_NET_SESSION_INTERNAL_H
#define LUM_SERVER_NET_SESSION_INTERNAL_H

#include <netinet/in.h>

#include "server/net/bucket.h"
#include "server/net/session.h"
#include "server/net/text_queue.h"

struct lum_rpc;

struct lum_session {
    struct lum_sessions *table; /* immutable */
    struct lum_session_ref ref; /* generation changes with each use of the slot */
    bool open, greeted, close_after_text;
    bool leaving; /* closed, but the director's inbox was full: it has not been told yet, and the slot is not free */
    enum lum_close close;
    char user[LUM_LIMIT_ID_BYTES + 1];
    struct lum_person person; /* who it is, once greeted */
    char peer[INET6_ADDRSTRLEN];
    struct lum_bucket bytes;    /* paid before anybody looks at what came */
    struct lum_bucket messages; /* paid for what the director is asked */
    struct lum_text_queue text;
    struct lum_stream *streams[LUM_LIMIT_VIEWS_PER_SESSION];
    uint32_t n_streams, next_stream; /* round robin, so that no view of a client starves another */
    /* The message being sent: one of the two. */
    struct lum_text *sending_text;
    struct lum_encoded_tile *sending_tile;
};

struct lum_sessions {
    struct lum_sessions_config config;
    bool draining;
    bool ended; /* lum_sessions_take_ended */
    uint32_t n_greeted;
    int64_t refusal_told_ns; /* when the log last heard of a wrong token; 0: never */
    uint32_t n_untold;       /* wrong tokens since then */
    struct lum_session slots[LUM_LIMIT_CONNECTIONS];
};

/* ---- session.c ---- */
/* Queues a text, which passes over; NULL (memory is short) ends the session. */
void lum_session_say(struct lum_session *s, char *text);
/* The error reply; without an id (a notification) the client cannot be told. */
void lum_session_refuse(struct lum_session *s, const char *id, const struct lum_proto_error *err);

/* ---- session_hello.c ---- */
void lum_session_receive_hello(struct lum_session *s, const struct lum_rpc *rpc, int64_t now_ns);

/* ---- session_admin.c ---- */
/* Answers what only administrators may ask. False: the message is something else. */
bool lum_session_administer(struct lum_session *s, const struct lum_rpc *rpc);

#endif

/* What a connection is told: messages as they go out, and why it ends. */
#ifndef LUM_SERVER_NET_MESSAGE_H
#define LUM_SERVER_NET_MESSAGE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "protocol/message/frame.h"

/* WebSocket close codes; PROTOCOL.md lists them for clients. */
enum lum_close {
    LUM_CLOSE_NONE = 0,
    LUM_CLOSE_UNSUPPORTED = 1003, /* a binary message */
    LUM_CLOSE_TOO_BIG = 1009,
    LUM_CLOSE_INTERNAL = 1011, /* memory is short */
    LUM_CLOSE_RESTART = 1012,  /* the server stops */
    LUM_CLOSE_BUSY = 1013,     /* too many sessions */
    LUM_CLOSE_AUTH = 4001,     /* wrong token, or no hello in time */
    LUM_CLOSE_REVOKED = 4003,  /* the token, or its role, was taken away meanwhile */
    LUM_CLOSE_ENDED = 4004,    /* by an administrator */
    LUM_CLOSE_RESUMED = 4009,  /* another connection went on with this session */
    LUM_CLOSE_SLOW = 4008,     /* LUM_LIMIT_CONTROL_QUEUE_BYTES of text wait: the client does not read */
};

bool lum_close_is_for_good(enum lum_close code);   /* the session cannot be resumed */
const char *lum_close_reason(enum lum_close code); /* for people; "": none */

struct lum_message {
    bool binary;
    uint8_t head[LUM_FRAME_HEADER_BYTES]; /* of a binary message */
    size_t n_head;
    const uint8_t *body; /* lent until lum_session_sent */
    size_t n_body;
};
/* Copies what lies from byte `at` of head and body together on, at most n bytes. Returns how many. */
size_t lum_message_copy(const struct lum_message *m, size_t at, uint8_t *out, size_t n);

#endif

/* What the director is asked, and what it sends out. Both are plain data in lists, handed from one thread to the other.
 *
 * Sessions are named by slot and generation, never by pointer: the session may be gone when the answer is ready. */
#ifndef LUM_SERVER_DIRECTOR_REQUEST_H
#define LUM_SERVER_DIRECTOR_REQUEST_H

#include "protocol/op/op.h"
#include "server/director/view_params.h"
#include "server/stream/stream.h"

struct lum_session_ref {
    uint32_t slot, generation;
};

enum lum_request_kind {
    LUM_REQUEST_SCENE_GET,
    LUM_REQUEST_SCENE_APPLY,
    LUM_REQUEST_SCENE_UNDO,
    LUM_REQUEST_SCENE_REDO,
    LUM_REQUEST_VIEW_OPEN,
    LUM_REQUEST_VIEW_UPDATE,
    LUM_REQUEST_VIEW_CLOSE,
    LUM_REQUEST_PICK,
    LUM_REQUEST_PROBE,
    LUM_REQUEST_BOUNDS,
    LUM_REQUEST_STATS_GET,
    LUM_REQUEST_SESSION_CLOSED, /* closes the session's views and forgets the user's history; no reply */
    LUM_REQUEST_WAKE,           /* a stream wants a frame; no reply */
};

struct lum_request {
    struct lum_request *next;
    enum lum_request_kind kind;
    struct lum_session_ref session;
    char user[LUM_LIMIT_ID_BYTES + 1];
    char *rpc_id;        /* the request's id as JSON text; NULL: a notification, no reply. Owned */
    int64_t received_ns; /* lum_clock_ns at receipt: server_us counts from here */
    size_t n_bytes;      /* of the message: what waits is bounded in bytes too */
    struct lum_ops ops;  /* apply; owned */
    char op_id[LUM_LIMIT_ID_BYTES + 1];
    bool has_base_rev;
    uint64_t base_rev;
    bool expand;                 /* scene.get */
    struct lum_view_params view; /* open, update */
    uint32_t view_id;            /* update, close, pick, probe */
    double x, y;                 /* pick, probe: pixel of the view */
    bool has_point;              /* probe: point and normal instead of a pixel */
    double point[3], normal[3];
    uint32_t samples; /* probe */
    lum_id id;        /* bounds */
};
struct lum_request *lum_request_create(enum lum_request_kind kind); /* zeroed; NULL when memory is short */
void lum_request_destroy(struct lum_request *q);

/* What the director sends to the net thread. */
enum lum_out_kind {
    LUM_OUT_TEXT,        /* to one session */
    LUM_OUT_BROADCAST,   /* to every session that said hello */
    LUM_OUT_VIEW_OPENED, /* stream (a reference passes) to one session; comes before the reply that names it */
    LUM_OUT_VIEW_CLOSED, /* view_id */
};
struct lum_out {
    struct lum_out *next;
    enum lum_out_kind kind;
    struct lum_session_ref session;
    char *text; /* owned JSON */
    size_t n_bytes;
    struct lum_stream *stream;
    uint32_t view_id;
};
void lum_out_destroy(struct lum_out *o);

#endif

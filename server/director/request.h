/* What the director is asked, and what it sends out. Both are plain data in lists, handed from one thread to the other.
 *
 * Sessions are named by slot and generation, never by pointer: the session may be gone when the answer is ready. */
#ifndef LUM_SERVER_DIRECTOR_REQUEST_H
#define LUM_SERVER_DIRECTOR_REQUEST_H

#include <stdatomic.h>

#include "protocol/op/op.h"
#include "server/director/view_params.h"
#include "server/stream/stream.h"

struct lum_session_ref {
    uint32_t slot, generation;
};
static inline bool lum_session_same(struct lum_session_ref a, struct lum_session_ref b)
{
    return a.slot == b.slot && a.generation == b.generation;
}

struct lum_director;
struct lum_document_state;
struct lum_json_reader;
struct lum_request;

/* What can be asked. Each is defined beside its answer. */
struct lum_request_type {
    const char *name; /* the method of JSON-RPC; NULL: a note of the net thread, which no client can send */
    /* Params into q. False: r->err says what is wrong. Thread: any. */
    bool (*read)(struct lum_json_reader *r, struct lum_request *q);
    /* Ends in lum_director_reply or lum_director_refuse (internal.h). Thread: director. */
    void (*answer)(struct lum_director *d, const struct lum_request *q);
    /* Instead of answer, where that comes later: takes over a request that has a reply. False: *err is the reply. */
    bool (*enqueue)(struct lum_director *d, struct lum_request *q, struct lum_proto_error *err);
    /* Instead of both: takes the request over, and ends in a reply later, if there is to be one. */
    void (*take)(struct lum_director *d, struct lum_request *q);
    bool edits; /* lum_director_commit answers it */
};
/* All that clients can ask for, and the least role that may: X(scene_get, VIEW) stands for the row
 * lum_request_scene_get and LUM_ROLE_VIEW. Roles are held to this table alone, where a message becomes a request
 * (read_request.c). */
#define LUM_REQUESTS(X)                                                                                                \
    X(scene_get, VIEW)                                                                                                 \
    X(scene_apply, EDIT)                                                                                               \
    X(scene_revert, EDIT)                                                                                              \
    X(timeline_get, VIEW)                                                                                              \
    X(timeline_name, EDIT)                                                                                             \
    X(scene_undo, EDIT)                                                                                                \
    X(scene_export, EDIT)                                                                                              \
    X(scene_redo, EDIT)                                                                                                \
    X(preset_store, EDIT)                                                                                              \
    X(preset_recall, EDIT)                                                                                             \
    X(preset_stop, EDIT)                                                                                               \
    X(view_open, VIEW)                                                                                                 \
    X(view_update, VIEW)                                                                                               \
    X(view_close, VIEW)                                                                                                \
    X(view_read, VIEW)                                                                                                 \
    X(pick, VIEW)                                                                                                      \
    X(surroundings, VIEW)                                                                                              \
    X(bounds, VIEW)                                                                                                    \
    X(photometry, VIEW)                                                                                                \
    X(asset_list, EDIT)                                                                                                \
    X(asset_photometry, EDIT)                                                                                          \
    X(daylight, VIEW)                                                                                                  \
    X(probe, MEASURE)                                                                                                  \
    X(sensor_watch, MEASURE)                                                                                           \
    X(sensor_read, MEASURE)                                                                                            \
    X(sensor_place, MEASURE)                                                                                           \
    X(report_get, MEASURE)                                                                                             \
    X(stats_get, VIEW)
#define LUM_REQUEST_DECLARE(name, role) extern const struct lum_request_type lum_request_##name;
LUM_REQUESTS(LUM_REQUEST_DECLARE)
/* Notes of the net thread, without a reply. */
extern const struct lum_request_type lum_request_session_closed, /* closes its views and forgets the user's history */
    lum_request_session_lost,                                    /* closes its views; the user may come back */
    lum_request_user_gone,                                       /* forgets the history of one who did not */
    lum_request_copy_state,                                      /* gives the scene as it is to `give` */
    lum_request_wake;                                            /* a stream wants a frame; never in the inbox */

struct lum_request {
    struct lum_request *next;
    const struct lum_request_type *type;
    struct lum_session_ref session;
    char user[LUM_LIMIT_ID_BYTES + 1];
    char *rpc_id;            /* the request's id as JSON text; NULL: a notification, no reply. Owned */
    int64_t received_ns;     /* lum_clock_ns at receipt: server_us counts from here */
    size_t n_bytes;          /* of the message, or of what was read of it where that is more */
    _Atomic size_t *charged; /* n_bytes are counted there until the request is destroyed; NULL: nowhere */
    struct lum_ops ops;      /* apply; owned */
    struct cJSON *ops_json;  /* their text as it came, for the journal; NULL: it is made anew. Owned */
    char op_id[LUM_LIMIT_ID_BYTES + 1];
    bool repeat; /* edits: nobody knows whether the one with this op_id was done: only once, please */
    bool has_base_rev;
    uint64_t base_rev;
    bool expand;                 /* scene.get */
    struct lum_view_params view; /* open, update */
    uint64_t rev;                /* scene.revert, timeline.* */
    uint32_t view_id;            /* update, close, pick, probe, report */
    double x, y;                 /* pick, probe: pixel of the view */
    bool has_point;              /* probe: point and normal instead of a pixel, which becomes such */
    double point[3], normal[3];
    char name[128];            /* preset.store; "": as it is. timeline.name; "": none */
    struct lum_opt fade_s;     /* preset.store, preset.recall */
    uint32_t samples;          /* probe */
    lum_id id;                 /* bounds, photometry, sensor.read, preset.*; sensor.place: what it lies on */
    bool on, points;           /* sensor.watch */
    double height_m, border_m; /* sensor.place */
    uint32_t n_directions;     /* likewise */
    char asset[LUM_LIMIT_ASSET_BYTES + 1]; /* asset.photometry */
    char match[LUM_LIMIT_ID_BYTES + 1];    /* asset.list */
    /* copy_state: called on the director's thread, unless it ends before. The state passes over; false: no memory. */
    void (*give)(void *user, struct lum_document_state *state, bool ok);
    void *give_user;
};
struct lum_request *lum_request_create(const struct lum_request_type *type); /* zeroed; NULL when memory is short */
void lum_request_destroy(struct lum_request *q);
size_t lum_request_bytes(const struct lum_request *q);                   /* about what it takes in memory */
void lum_request_charge(struct lum_request *q, _Atomic size_t *account); /* which outlives it */

/* What the director sends to the net thread. */
enum lum_out_kind {
    LUM_OUT_TEXT,        /* to one session */
    LUM_OUT_BROADCAST,   /* to every session that said hello */
    LUM_OUT_VIEW_OPENED, /* stream (a reference passes) to one session; comes before the reply that names it */
    LUM_OUT_VIEW_CLOSED, /* view_id */
    LUM_OUT_FILE,        /* to one session: the reply to rpc_id tells where it can be fetched */
};
struct lum_out {
    struct lum_out *next;
    enum lum_out_kind kind;
    struct lum_session_ref session;
    char *text; /* owned JSON */
    size_t n_bytes;
    struct lum_stream *stream;
    uint32_t view_id;
    uint64_t wait_seq;  /* leaves when this entry of the journal is durable: it may know of it */
    uint64_t scene_rev; /* of a scene.changed, or of a file; 0: it is none */
    uint64_t edit_seq;  /* the reply to the edit of that entry; 0: none */
    char *rpc_id;       /* of that reply: it becomes a refusal if the entry is lost. Of a file's. Owned */
    uint8_t *file;      /* n_file bytes, from malloc. Owned */
    size_t n_file;
};
void lum_out_destroy(struct lum_out *o);

#endif

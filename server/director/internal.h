/* What the director's files share. Everything here belongs to the director thread unless it says otherwise.
 *
 * One turn of the loop:
 *   take the inbox -> edit the world (document and renderer) -> commit once -> answer -> refresh the views
 *   -> send the frames that are due -> a slice of other work -> one pass of the view that needs it most -> its frame
 * and when no view needs a pass and no frame waits for its time, sleep until something is posted.
 *
 * Import threads (at most LUM_LIMIT_IMPORTS_AT_ONCE) turn an edit's assets into records; the edit joins the loop when
 * its thread is done, and other edits go on meanwhile. They touch only their own job, the outbox, and the bell. */
#ifndef LUM_SERVER_DIRECTOR_INTERNAL_H
#define LUM_SERVER_DIRECTOR_INTERNAL_H

#include <pthread.h>

#include "server/director/assets.h"
#include "server/director/exports.h"
#include "server/director/beside.h"
#include "server/director/director.h"
#include "server/director/edits.h"
#include "server/director/probes.h"
#include "server/director/reports.h"
#include "server/director/scene_get.h"
#include "server/director/sensors.h"
#include "server/director/timeline_get.h"
#include "server/director/view.h"
#include "server/journal/done.h"
#include "server/world/world.h"

#define LUM_INBOX_MAX 4096u /* a few messages from each session, or all of one burst */
/* Of all requests that are not done, waiting imports too: their text, or what it was read to where that is more. The
 * costliest message takes most of it. */
#define LUM_REQUESTS_MAX_BYTES (256u << 20)
/* Those of cameras, small edits and questions have a reserve: whoever fills the rest with what takes long keeps nobody
 * else from working. */
#define LUM_REQUEST_SMALL_BYTES 16384u
#define LUM_REQUESTS_RESERVE_BYTES (64u << 20) /* 4096 of the largest small ones: 64 of each session */

/* Of text that waits to be sent, as while the disk hangs: beyond, nothing is taken in, and news are dropped. */
#define LUM_OUTBOX_MAX_BYTES (128u << 20)

struct lum_director {
    /* immutable */
    struct lum_director_config config; /* strings owned */
    int64_t start_ns;

    /* director thread */
    struct lum_world world;
    struct lum_encoder *encoder;
    struct lum_director_sensors *sensors; /* NULL: nobody ever watched them */
    struct lum_director_probes probes;
    struct lum_director_scene_gets scene_gets;
    struct lum_director_timeline_gets timeline_gets;
    struct lum_director_reports reports;
    struct lum_director_assets assets;
    struct lum_director_exports exports;
    struct {
        uint64_t changes, generation; /* of the desk and of the patches, when its values were taken */
        uint64_t looks;               /* that were made of them */
        int64_t heard_ns;             /* of the newest packet in them */
    } desk;
    struct {
        lum_id preset; /* recalled last */
        bool told;     /* that it fades, and not yet that it has arrived */
    } fade;
    struct lum_beside beside;
    struct lum_done_user *repeats;
    struct lum_server_view *views;
    uint32_t n_views, next_view_id;
    int64_t alive_due_ns;                            /* config.alive is called then */
    uint64_t order;                                  /* counts changes */
    struct lum_staged_edit *staged;                  /* newest first */
    struct lum_import_job *jobs;                     /* oldest first */
    struct lum_journal *journal;                     /* NULL: nothing is kept */
    struct lum_staged_edit *unsaved, **unsaved_tail; /* published and not durable yet, oldest first */
    pthread_t thread;
    bool has_thread;

    pthread_mutex_t lock;
    pthread_cond_t bell; /* inbox, a finished import, a hungry stream, stop; monotonic clock */
    /* guarded by lock */
    struct lum_request *inbox, **inbox_tail;
    uint32_t n_inbox;
    struct lum_out *outbox, **outbox_tail;
    size_t outbox_bytes;
    uint64_t submitted_seq; /* what is said from now on waits for this entry; 0: for none */
    bool rung, stop;
    const struct lum_server_view *rendering; /* in a pass; its id and session do not change */
    bool picturing;                          /* a pass of a report runs: edits and views end it */
    int64_t shielded_until_ns;               /* that pass is the first after a change: edits let it be until then */
    struct lum_director_metrics metrics;

    /* any thread */
    _Atomic size_t requests_bytes; /* of all that were posted and are not destroyed; grows under lock */
    _Atomic bool cancel;           /* the pass that runs; set under lock, read by workers (relaxed: a hint) */
    _Atomic bool stop_imports;     /* set once at the end, read by import threads */
    _Atomic bool asleep;
    _Atomic int64_t tick_ns;
    _Atomic uint64_t scene_rev;
};

/* ---- send.c ---- */
void lum_director_ring(struct lum_director *d);     /* any thread */
bool lum_director_stopping(struct lum_director *d); /* any thread */
/* Any thread. text and stream pass over; text NULL (memory) drops it. */
void lum_director_send(struct lum_director *d, enum lum_out_kind kind, struct lum_session_ref to, char *text);
/* The same of news that nobody needs where too much waits: what a frame cost, how far an import is. */
void lum_director_send_news(struct lum_director *d, struct lum_session_ref to, char *text);
/* A scene.changed, which leads to this revision, to everybody. */
void lum_director_send_changed(struct lum_director *d, uint64_t scene_rev, struct cJSON *params);
void lum_director_send_stream(struct lum_director *d, struct lum_session_ref to, struct lum_stream *stream);
void lum_director_send_closed(struct lum_director *d, struct lum_session_ref to, uint32_t view_id);
/* Answers a request that has an rpc_id; result is consumed. */
void lum_director_reply(struct lum_director *d, const struct lum_request *q, struct cJSON *result);
void lum_director_refuse(struct lum_director *d, const struct lum_request *q, const struct lum_proto_error *err);
/* The reply to an edit that the journal has as entry seq (0: none): it turns into a refusal if that entry is lost. */
void lum_director_reply_edit(struct lum_director *d, const struct lum_request *q, struct cJSON *result, uint64_t seq);
/* The reply tells where to fetch it; the bytes pass over. */
void lum_director_reply_file(struct lum_director *d, const struct lum_request *q, uint8_t *bytes, size_t n_bytes,
                             uint64_t scene_rev);
/* Edits' replies above the durable entry are refused, and nothing waits for those entries any more. */
void lum_director_refuse_lost(struct lum_director *d, uint64_t durable, const struct lum_proto_error *err);

/* ---- views.c ---- */
void lum_director_refresh_views(struct lum_director *d, int64_t received_ns);
/* The view that the request names. NULL: the session has none of that number, as err says unless it is NULL. */
struct lum_server_view *lum_director_view_of(struct lum_director *d, const struct lum_request *q,
                                             struct lum_proto_error *err);
/* Sends frames that are due, closes videos that nobody uses. How long until the next of it; INT64_MAX: no time set. */
int64_t lum_director_publish_due(struct lum_director *d);
struct lum_server_view *lum_director_choose_view(struct lum_director *d);
void lum_director_run_pass(struct lum_director *d, struct lum_server_view *v);

/* ---- desk.c ---- */
void lum_director_desk_changed(void *director); /* any thread */
/* The newest values of the desk, if there are others. True: the scene shines otherwise, and views need a refresh. */
bool lum_director_follow_desk(struct lum_director *d);
void lum_director_turn_desk(struct lum_director *d);
struct cJSON *lum_director_desk_json(struct lum_director *d); /* null: this server listens to none */

/* ---- presets.c ---- */
/* Lamps that fade shine as they do now. Returns how long until they shall again; INT64_MAX: none fades. */
int64_t lum_director_turn_fade(struct lum_director *d);

/* ---- query.c ---- */
/* What lies under the request's pixel. False: it has no such view, or pixel. */
bool lum_director_pick(struct lum_director *d, const struct lum_request *q, struct lum_pick *ret_pick,
                       struct lum_proto_error *err);

#endif

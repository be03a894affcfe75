/* The director: the one thread that owns the scene.
 *
 * It drains an inbox of commands from the net thread (ops first, newest camera wins), applies them to the document and
 * the renderer's scene, publishes a snapshot, and renders: the view whose state is stalest goes first, in passes that a
 * new edit can cancel; when all views are complete it sleeps until the next command. Frames leave through each view's
 * struct lum_stream, everything else through the outbox.
 *
 * Sessions are named by slot and generation, never by pointer: the session may be gone when the answer is ready. */
#ifndef LUM_SERVER_DIRECTOR_DIRECTOR_H
#define LUM_SERVER_DIRECTOR_DIRECTOR_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "core/base/base.h"
#include "protocol/base/error.h"
#include "protocol/op/op.h"
#include "server/director/view_params.h"
#include "server/stream/stream.h"

struct lum_session_ref {
    uint32_t slot, generation;
};

enum lum_command_kind {
    LUM_CMD_SCENE_GET,
    LUM_CMD_SCENE_APPLY,
    LUM_CMD_SCENE_UNDO,
    LUM_CMD_SCENE_REDO,
    LUM_CMD_VIEW_OPEN,
    LUM_CMD_VIEW_UPDATE,
    LUM_CMD_VIEW_CLOSE,
    LUM_CMD_PICK,
    LUM_CMD_PROBE,
    LUM_CMD_BOUNDS,
    LUM_CMD_STATS_GET,
    LUM_CMD_SESSION_CLOSED, /* closes the session's views and forgets the user's history; no reply */
    LUM_CMD_WAKE,           /* a stream wants a frame; no reply */
};

struct lum_command {
    struct lum_command *next;
    enum lum_command_kind kind;
    struct lum_session_ref session;
    char user[LUM_LIMIT_ID_BYTES + 1];
    char *rpc_id;       /* the request's id as JSON text; NULL: a notification, no reply. Owned */
    int64_t received_ns; /* lum_clock_ns at receipt: server_us counts from here */
    size_t n_bytes;      /* of the message: what waits is bounded in bytes too */
    struct lum_ops ops; /* apply; owned */
    char op_id[LUM_LIMIT_ID_BYTES + 1];
    bool has_base_rev;
    uint64_t base_rev;
    bool expand;        /* scene.get */
    struct lum_view_params view; /* open, update */
    uint32_t view_id;   /* update, close, pick, probe */
    double x, y;        /* pick, probe: pixel of the view */
    bool has_point;     /* probe: point and normal instead of a pixel */
    double point[3], normal[3];
    uint32_t samples;   /* probe */
    lum_id id;          /* bounds */
};
struct lum_command *lum_command_create(enum lum_command_kind kind); /* zeroed; NULL when memory is short */
void lum_command_destroy(struct lum_command *c);

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

struct lum_director_config {
    const char *scene;       /* built-in name or file */
    const char *assets_dir;  /* root of import assets; NULL: imports refused */
    const char *importer;    /* path of lumend-import */
    const char *method;      /* default method; NULL: the scene's */
    const char *isa;         /* of the ray tracing kernels; NULL: see world.h. Needed only while creating */
    uint32_t threads;
    bool deterministic;
    struct lum_log log;
    /* Called from the director's threads when the outbox or a stream has something new; must only wake the net thread. */
    void (*wake_net)(void *user);
    void *wake_user;
};

struct lum_director;

/* Loads the scene (blocking), then starts the thread. */
LUM_MUST_USE enum lum_status lum_director_create(const struct lum_director_config *config, struct lum_director **ret_director,
                                                 struct lum_error *err);
/* Stops rendering, joins, frees. Accepts NULL. Nobody may post any more. */
void lum_director_destroy(struct lum_director *director);

/* ---- net thread ---- */
/* Takes the command. False when the inbox is full (the reply "busy" is the caller's). */
bool lum_director_post(struct lum_director *director, struct lum_command *command);
/* Everything sent since the last call, oldest first; NULL: nothing. */
struct lum_out *lum_director_take_outbox(struct lum_director *director);
uint64_t lum_director_scene_rev(const struct lum_director *director); /* any thread */
/* True while the director's loop turns: it ticked within the last 10 s, or is asleep with nothing to do. Any thread. */
bool lum_director_alive(const struct lum_director *director);

/* Counters for /metrics; any thread. */
struct lum_director_metrics {
    uint64_t passes, frames_published, tiles_encoded, tile_bytes, rays, edits, edits_refused, imports, imports_failed, nonfinite;
    uint64_t views, triangles, lights;
    double last_pass_ms;
};
void lum_director_metrics(const struct lum_director *director, struct lum_director_metrics *ret_metrics);

#endif

/* The director: the one thread that owns the scene.
 *
 * It drains an inbox of requests from the net thread (ops first, newest camera wins), applies them to the document and
 * the renderer's scene, publishes a snapshot, and renders: the view whose state is stalest goes first, in passes that a
 * new edit can cancel; when all views are complete it sleeps until the next request. Frames leave through each view's
 * struct lum_stream, everything else through the outbox. */
#ifndef LUM_SERVER_DIRECTOR_DIRECTOR_H
#define LUM_SERVER_DIRECTOR_DIRECTOR_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "core/base/base.h"
#include "server/desk/desk.h"
#include "server/director/request.h"
#include "server/journal/journal.h"

struct lum_director_config {
    const char *scene;       /* built-in name or file; NULL: nothing but a camera */
    const char *assets_dir;  /* root of import assets; NULL: those are refused */
    const char *uploads_dir; /* root of what people sent (asset.h); NULL: nobody may */
    const char *importer;    /* path of lumend-import */
    const char *state_dir;   /* of the journal; NULL: nothing is kept. What is there comes before the scene */
    enum lum_durability durability;
    uint64_t snapshot_bytes;           /* of edits, after which a snapshot is due; 0: LUM_JOURNAL_COMPACT_BYTES */
    const struct lum_disk *state_disk; /* NULL: the real one; tests have others */
    bool scene_asked;                  /* by somebody: the log says where it is left aside */
    const char *method;                /* default method; NULL: the scene's */
    const char *isa;                   /* of the ray tracing kernels; NULL: see world.h. Needed only while creating */
    uint32_t threads;
    bool deterministic;
    bool audit;            /* a line of the log for each edit, at LUM_LOG_AUDIT */
    struct lum_desk *desk; /* started and stopped with the director, the caller's to destroy after; NULL: none */
    struct lum_log log;
    /* Called from the director's threads when the outbox or a stream has something new; must only wake the net thread.
     */
    void (*wake_net)(void *user);
    void *wake_user;
    /* Called from the loop at least so often while it turns, asleep or not: who hears nothing knows that it is stuck.
     * NULL: nobody wants to know. Must not wait. */
    void (*alive)(void *user);
    void *alive_user;
    int64_t alive_ns;
};

struct lum_director;

/* Loads the scene (blocking), then starts the thread. */
LUM_MUST_USE enum lum_status lum_director_create(const struct lum_director_config *config,
                                                 struct lum_director **ret_director, struct lum_error *err);
/* Stops rendering, joins, frees. Accepts NULL. Nobody may post any more. */
void lum_director_destroy(struct lum_director *director);

/* ---- net thread ---- */
/* Takes the request. False when the inbox is full (the reply "busy" is the caller's). */
bool lum_director_post(struct lum_director *director, struct lum_request *request);
/* Everything sent since the last call, oldest first, that knows of no edit that is not durable yet; NULL: nothing. */
struct lum_out *lum_director_take_outbox(struct lum_director *director);
uint64_t lum_director_scene_rev(const struct lum_director *director); /* any thread */
/* True while the director's loop turns: it ticked within the last 10 s, or is asleep with nothing to do. Any thread. */
bool lum_director_alive(const struct lum_director *director);
/* How often a daemon has begun with the state, this time included; 0: nothing is kept. Any thread. */
uint64_t lum_director_starts(const struct lum_director *director);

/* Counters for /metrics; any thread. */
struct lum_director_metrics {
    uint64_t passes, frames_published, tiles_encoded, tile_bytes, rays, edits, edits_refused, imports, imports_failed,
        nonfinite;
    uint64_t views, triangles, lights;
    double last_pass_ms;
    struct lum_journal_status journal; /* zeroed where nothing is kept */
};
void lum_director_metrics(const struct lum_director *director, struct lum_director_metrics *ret_metrics);

#endif

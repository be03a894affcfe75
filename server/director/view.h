/* A client's view: the renderer's view, what the client asked for, and when to send the next frame.
 *
 * Life of a picture: a change makes it stale; its first pass is never cancelled, so that a drag keeps showing pictures;
 * progressive methods then refine it until it is complete. Frames go out after each pass while there are few samples,
 * then at growing intervals. The last one waits until the client has the one before and the view has rested, and is
 * lossless.
 *
 * A view may be larger at rest (rest_size). Then a second view of the renderer makes that picture while the first one's
 * stays on the screen, until it has as many samples. The first keeps all that it knows: with the next change it goes on
 * as if there had been no other.
 *
 * Thread: the director. */
#ifndef LUM_SERVER_DIRECTOR_VIEW_H
#define LUM_SERVER_DIRECTOR_VIEW_H

#include "core/render/pace.h"
#include "server/director/director.h"
#include "server/director/exposure.h"
#include "server/director/stats_json.h"
#include "server/stream/encode.h"
#include "server/stream/video.h"
#include "server/world/world.h"

#define LUM_VIEW_REST_NS 500000000ll     /* before it is made larger: a drag that halts is shorter */
#define LUM_VIEW_SETTLE_NS 200000000ll   /* rest before the lossless frame: it costs ten lossy ones, wasted in a drag */
#define LUM_VIEW_UNHEARD_NS 2000000000ll /* then it is sent to who has not said that the lossy one is there */
#define LUM_VIEW_UNHEARD_MOST_S 30.0     /* on the thinnest line, too: what is thought of its rate may be wrong */

struct lum_rest {
    struct lum_view *core; /* NULL: no larger size was ever asked for */
    struct lum_view_settings settings;
    bool on;     /* passes are its own */
    bool shown;  /* frames, too */
    bool failed; /* it could not be made: not tried again before another size is asked for */
};

struct lum_view_video {
    struct lum_video of;
    bool anew;              /* the client lacks what the next chunk would be based on */
    uint64_t skipped;       /* of the stream, by then */
    double interval_s;      /* of its pictures, the newest with the most weight; 0: not known */
    int64_t failed_ns;      /* when there was no room or memory; 0: there was */
    uint64_t failed_pixels; /* for a picture of so many */
};

struct lum_server_view {
    struct lum_server_view *next;
    uint32_t id;
    struct lum_session_ref session;
    struct lum_view *core;
    struct lum_rest rest;
    struct lum_stream *stream;
    struct lum_view_params want; /* everything the client ever gave */
    /* from want and the scene */
    struct lum_view_settings settings;
    struct lum_opt exposure_ev;
    enum lum_tone_map tone;
    struct lum_opt white_balance_k;
    uint8_t codec;                      /* enum lum_codec */
    struct lum_coding_state coding;     /* of pictures that need not be exact */
    const struct lum_snapshot *moment;  /* the scene as it was; NULL: as it is */
    uint64_t moment_bytes;              /* that it has apart from the scene */
    const struct lum_snapshot *solo;    /* what it shows, with some lamps alone, or of a moment; NULL: all as it is */
    struct lum_auto_exposure automatic; /* exposure */
    uint32_t n_things;                  /* objects and lights that it was settled for */
    struct lum_versions versions;       /* of the snapshot last resolved against */
    bool only_background;
    uint64_t scene_rev; /* that the picture stands for */
    /* progress */
    bool prepared;                 /* lum_view_prepare has run since the last change */
    bool stale;                    /* changed, and no pass has run since */
    bool complete;                 /* nothing left to do */
    bool failed;                   /* a pass failed: waits for the next change */
    uint64_t change_order;         /* greater: changed later */
    int64_t newest_ns;             /* receipt of the newest edit or camera that the settings contain */
    int64_t last_pass_ns;          /* when the last pass ended */
    struct lum_budget_watch watch; /* what the picture took since the last change, and where it will end */
    struct lum_pace pace;          /* what passes took that made a picture anew, in this size and by this method */
    struct lum_pace_choice chose;  /* how the picture began; side 0: nothing was to be chosen */
    struct lum_pass_stats last_pass;
    /* sending */
    struct lum_tile_state *tiles;
    struct lum_view_video video;
    struct lum_overlay overlay; /* of the last frame */
    uint32_t n_tiles;
    bool unsent; /* the film or its display changed since the last frame */
    bool final_sent;
    uint32_t sent_spp; /* 0: nothing since the last change */
    int64_t sent_ns;
    uint64_t frame_seq;
    struct lum_frame_stats frame; /* of the passes since the last frame */
};

/* The view is resolved against the world's snapshot. On failure err->path names the field. */
bool lum_server_view_create(struct lum_world *world, const struct lum_view_params *params, uint32_t id,
                            struct lum_server_view **ret_view, struct lum_proto_error *err);
void lum_server_view_destroy(struct lum_server_view *v); /* accepts NULL */

/* Takes over what the params give. On failure the view is as before. */
bool lum_server_view_update(struct lum_server_view *v, struct lum_world *world, const struct lum_view_params *params,
                            struct lum_proto_error *err);

/* After any change of the scene or the request: finds out what is stale. A camera or method that is gone is replaced by
 * one that exists. */
void lum_server_view_refresh(struct lum_server_view *v, const struct lum_world *world, int64_t received_ns,
                             uint64_t order);

/* Of a picture that is complete: why it is (budget.h). */
const char *lum_server_view_stopped_by(const struct lum_server_view *v);

/* It has a picture of what is now, not a rough one. */
static inline bool lum_server_view_is_whole(const struct lum_server_view *v)
{
    return !v->stale && v->last_pass.spp > 0;
}

bool lum_server_view_needs_pass(const struct lum_server_view *v);
/* LUM_ERR_CANCELLED is no failure. */
enum lum_status lum_server_view_pass(struct lum_server_view *v, const struct lum_snapshot *snapshot,
                                     const _Atomic bool *cancel, struct lum_error *err);

/* The size of the picture on the screen. */
void lum_server_view_shown_size(const struct lum_server_view *v, uint32_t ret_size[2]);

#endif

/* One view's encoded picture on its way to one session: state, not a queue.
 *
 * The director publishes whole frames: for each tile a reference-counted blob, unchanged tiles keep their old one. The
 * net thread sends from a cursor: it takes the newest frame, sends each tile whose version the client does not have yet,
 * marks the last one, and only then looks for a newer frame. So a client never sees a torn frame, a slow client skips frames
 * by itself, and memory is at most two frames per view (the newest, and the one being sent), whatever the client's speed.
 *
 * The stream also carries demand backwards: wants_frame is true while the cursor has nothing left to send and fewer than
 * LUM_LIMIT_UNACKED_FRAMES are unacknowledged. The director encodes only then, so a slow client costs no encoding.
 *
 * Thread: each function names its side; one mutex inside, never held across encoding or a socket write. */
#ifndef LUM_SERVER_STREAM_H
#define LUM_SERVER_STREAM_H

#include <stdatomic.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "protocol/frame.h"

struct lum_blob_tile {
    _Atomic uint32_t refs;
    struct lum_frame_header header; /* flags: all but LAST_TILE */
    uint32_t n_bytes;
    uint8_t bytes[];
};
struct lum_blob_tile *lum_blob_tile_create(uint32_t n_bytes); /* NULL when memory is short; one reference */
struct lum_blob_tile *lum_blob_tile_ref(struct lum_blob_tile *b);
void lum_blob_tile_unref(struct lum_blob_tile *b);

struct lum_stream; /* refcounted: shared by the director's view and the session */
struct lum_stream *lum_stream_create(uint32_t view_id, uint32_t n_tiles);
struct lum_stream *lum_stream_ref(struct lum_stream *s);
void lum_stream_unref(struct lum_stream *s);
uint32_t lum_stream_view_id(const struct lum_stream *s);

/* ---- director ---- */
bool lum_stream_wants_frame(struct lum_stream *s);
/* tiles: n_tiles references that pass to the stream; NULL keeps the tile of the frame before. All headers carry the same
 * frame_seq. False when memory is short (references are released). */
bool lum_stream_publish(struct lum_stream *s, uint64_t frame_seq, struct lum_blob_tile **tiles);
/* The view's size changed: forget everything sent. */
bool lum_stream_resize(struct lum_stream *s, uint32_t n_tiles);

/* ---- net ---- */
/* The next tile to send; the caller owns the reference. NULL: nothing to send now. *ret_last: it completes its frame. */
struct lum_blob_tile *lum_stream_next(struct lum_stream *s, bool *ret_last);
/* True when lum_stream_next would give a tile. */
bool lum_stream_pending(struct lum_stream *s);
/* The client drew this frame: gives back credit. Unknown and repeated numbers are ignored. */
void lum_stream_ack(struct lum_stream *s, uint64_t frame_seq);
/* Frames skipped by this client so far. */
uint64_t lum_stream_skipped(struct lum_stream *s);

#endif

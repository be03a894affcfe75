/* One view's encoded picture on its way to one session: state, not a queue.
 *
 * The director publishes whole frames: for each tile a reference-counted blob, unchanged tiles keep their old one. The
 * net thread sends from a cursor: it takes the newest frame, sends each tile whose version the client does not have
 * yet, marks the last one, and only then looks for a newer frame. So a client never sees a torn frame, a slow client
 * skips frames by itself, and memory is at most two frames per view (the newest, and the one being sent), whatever the
 * client's speed.
 *
 * The stream also carries demand backwards: wants_frame is true while the cursor has nothing left to send and fewer
 * than LUM_LIMIT_UNACKED_FRAMES are unacknowledged. The director encodes only then, so a slow client costs no encoding.
 *
 * The version of a tile is the frame_seq in its blob's header, so a stream's frame_seq must grow from 1.
 *
 * Thread: each function names its side; one mutex inside, never held across encoding or a socket write. */
#ifndef LUM_SERVER_STREAM_STREAM_H
#define LUM_SERVER_STREAM_STREAM_H

#include <stdatomic.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "protocol/message/frame.h"

struct lum_encoded_tile {
    _Atomic uint32_t refs;
    struct lum_frame_header header; /* flags: all but LAST_TILE */
    uint32_t n_bytes;
    uint8_t bytes[];
};
struct lum_encoded_tile *lum_encoded_tile_create(uint32_t n_bytes); /* NULL when memory is short; one reference */
struct lum_encoded_tile *lum_encoded_tile_ref(struct lum_encoded_tile *b);
void lum_encoded_tile_unref(struct lum_encoded_tile *b); /* accepts NULL */

struct lum_stream; /* refcounted: shared by the director's view and the session */
struct lum_stream *lum_stream_create(uint32_t view_id, uint32_t n_tiles); /* NULL when memory is short; one reference */
struct lum_stream *lum_stream_ref(struct lum_stream *s);
void lum_stream_unref(struct lum_stream *s); /* accepts NULL */
uint32_t lum_stream_view_id(const struct lum_stream *s);

/* ---- director ---- */
bool lum_stream_wants_frame(struct lum_stream *s);
/* tiles: n_tiles references that pass to the stream; NULL keeps the tile of the frame before. All headers carry the
 * same frame_seq. At least one tile is not NULL: when no pixel changed, a tile sent again is how the client learns the
 * new scene_rev. False when the frame is refused (no tile, or frame_seq does not grow): references are released. */
bool lum_stream_publish(struct lum_stream *s, uint64_t frame_seq, struct lum_encoded_tile **tiles);
/* The view's size changed: forget everything sent. False when memory is short: nothing changed. */
bool lum_stream_resize(struct lum_stream *s, uint32_t n_tiles);
/* True when the client has said that it has all that was published; *ret_since_ns: when it said so, 0 before the first
 * frame. */
bool lum_stream_is_idle(struct lum_stream *s, int64_t *ret_since_ns);
/* How long the line takes for what was sent and is not acknowledged, as far as that is known; 0: not at all. */
double lum_stream_owed_s(struct lum_stream *s);
/* Bytes a second that reach the client, as far as its acknowledgements tell (line.h); 0: not known. */
double lum_stream_line(struct lum_stream *s);

/* ---- net ---- */
struct lum_stream_tile {
    struct lum_encoded_tile *blob; /* the caller owns the reference */
    /* As the wire gets it: the blob's own place and coding, with the sequence, revision, camera and cost of the frame
     * that is being sent (a tile may be older than its frame), and LAST_TILE where it completes the frame. */
    struct lum_frame_header header;
};
/* The next tile to send. False: nothing to send now. */
bool lum_stream_next(struct lum_stream *s, struct lum_stream_tile *ret_tile);
/* True when lum_stream_next would give a tile. */
bool lum_stream_pending(struct lum_stream *s);
/* Gives back the credit of this frame and of all before it. It may be any published frame: frame.stats can tell its
 * number before its tiles are sent, and an acknowledgement lost for coming early would never be repeated. Still only
 * one frame is on its way at a time: the next begins after the last tile. False, and ignored: a number that is not
 * published yet, or not above those acknowledged before. held_ns: since when the client has the frame, as it says. */
bool lum_stream_ack(struct lum_stream *s, uint64_t frame_seq, int64_t held_ns);
/* Frames skipped by this client so far. */
uint64_t lum_stream_skipped(struct lum_stream *s);

#endif

/* A view's pictures as a video: each a chunk of the whole picture, one message, which tells what is not as in the chunk
 * before. A key chunk stands alone: the first, any that is asked for, and the first of another size.
 *
 * Encoders take memory. All views share a room for them; who needs one while it is full takes that which was not used
 * for longest, and for a while, whose view goes on with a key chunk. One that nobody uses is closed in the end, whoever
 * needs room. */
#ifndef LUM_SERVER_STREAM_VIDEO_H
#define LUM_SERVER_STREAM_VIDEO_H

#include "server/stream/encode.h"

#define LUM_VIDEO_UNUSED_NS 5000000000ll /* a hand that rests for longer may have moved on */
#define LUM_VIDEO_KEPT_NS                                                                                              \
    (12 * LUM_VIDEO_UNUSED_NS) /* a hand that rests for a minute: the next key chunk costs less than the memory */

struct lum_video {
    struct lum_vp9 *vp9; /* NULL: none now */
    uint32_t w, h;
    int64_t used_ns; /* when last */
    struct lum_video_room *room;
    struct lum_video *next; /* of those in the room */
};

struct lum_video_room {
    struct lum_video *first;
    uint64_t n_pixels;
    uint32_t n;
};

/* Would an encoder of that size ever get into the room? */
bool lum_video_fits(uint32_t w, uint32_t h);

struct lum_video_want {
    uint32_t n_bytes; /* about */
    bool key;
};
/* picture->header.downscale is not looked at. *ret_tile: a new blob whose header covers the whole picture.
 * LUM_ERR_NOMEM: there is none, or no room, and video is closed. Thread: as lum_encoder_run. */
LUM_MUST_USE enum lum_status lum_video_run(struct lum_video *video, struct lum_encoder *encoder,
                                           const struct lum_picture *picture, const struct lum_video_want *want,
                                           struct lum_encoded_tile **ret_tile, struct lum_error *err);
/* Closes those that were not used for LUM_VIDEO_KEPT_NS; after how long to look again, INT64_MAX: there is none. */
int64_t lum_video_close_unused(struct lum_video_room *room, int64_t now_ns);
void lum_video_close(struct lum_video *video); /* accepts a zeroed one; it may be used again */

#endif

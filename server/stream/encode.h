/* From a view's film to encoded tiles, in parallel over the worker pool.
 *
 * A picture is cut into tiles of LUM_LIMIT_TILE_SIDE. Each is tone mapped, hashed, and encoded only when its pixels
 * differ from what the tile showed last, or when it was lossy and is now wanted lossless.
 *
 * Payloads: RGBA8 raw rows; one JPEG, PNG or WebP file, WebP with LUM_FRAME_LOSSLESS without loss; half-float deflate:
 * a zlib stream of RGBA half floats, little-endian, rows from the top, absolute linear Rec.709 (cd/m2), values over
 * 65504 saturated. With downscale d the payload holds ceil(w / 2^d) x ceil(h / 2^d) pixels; x, y, w, h stay in full
 * pixels. */
#ifndef LUM_SERVER_STREAM_ENCODE_H
#define LUM_SERVER_STREAM_ENCODE_H

#include "core/base/pool.h"
#include "core/film/film.h"
#include "protocol/base/limits.h"
#include "protocol/message/frame.h"
#include "server/stream/coding.h"
#include "server/stream/overlay.h"
#include "server/stream/stream.h"
#include "server/stream/vp9.h"

struct lum_video_room; /* video.h */
struct lum_encoder;    /* JPEG handles and scratch memory, one set a worker */

LUM_MUST_USE enum lum_status lum_encoder_create(struct lum_pool *pool, struct lum_encoder **ret_encoder,
                                                struct lum_error *err);
void lum_encoder_destroy(struct lum_encoder *encoder); /* accepts NULL */

/* What a tile showed when it was last encoded; zero: nothing yet. */
struct lum_tile_state {
    uint64_t hash;
    uint8_t quality, downscale; /* quality 255: exact */
    bool shown;
};

struct lum_picture {
    const struct lum_film *film;
    struct lum_display display;
    const struct lum_overlay *overlay; /* HDR tiles do not show it; NULL: none */
    /* frame_seq, scene_rev, view_id, camera_seq, flags, codec, quality, downscale, spp and error are taken from here */
    struct lum_frame_header header;
};

uint32_t lum_tile_count(uint32_t w, uint32_t h);

/* ret_tiles[i]: a new blob, or NULL where tile i shows already what it should. At least one is not NULL, so that every
 * frame reaches the client. states and ret_tiles have lum_tile_count elements; on failure ret_tiles holds NULLs and
 * states is as before. Thread: one at a time per pool. */
LUM_MUST_USE enum lum_status lum_encoder_run(struct lum_encoder *encoder, const struct lum_picture *picture,
                                             struct lum_tile_state *states, struct lum_encoded_tile **ret_tiles,
                                             struct lum_error *err);

/* The whole picture as it is shown, in full size, into an encoder of its size. Thread: as lum_encoder_run. */
void lum_encoder_draw(struct lum_encoder *encoder, const struct lum_picture *picture, struct lum_vp9 *into);

uint32_t lum_encoder_threads(const struct lum_encoder *encoder);
struct lum_video_room *lum_encoder_videos(struct lum_encoder *encoder);
/* Of the last run: coding alone, of the tiles that were new. Nothing of one that was sent only so that there is a
 * frame. */
struct lum_coding_cost lum_encoder_cost(const struct lum_encoder *encoder);

/* Round to nearest even; over 65504 saturates, NaN gives 0. */
uint16_t lum_half_from_float(float f);

#endif

/* The 64-byte little-endian header in front of every binary message (PROTOCOL.md has the table). */
#ifndef LUM_PROTOCOL_MESSAGE_FRAME_H
#define LUM_PROTOCOL_MESSAGE_FRAME_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#define LUM_FRAME_HEADER_BYTES 64u /* the fields of frame.c without a gap */

enum lum_frame_kind { LUM_FRAME_TILE = 1, LUM_FRAME_HDR_TILE = 2, LUM_FRAME_FILE_CHUNK = 3 };
enum lum_frame_flag { LUM_FRAME_LAST_TILE = 1, LUM_FRAME_LOSSLESS = 2, LUM_FRAME_CONVERGED = 4, LUM_FRAME_KEY = 8 };
enum lum_codec {
    LUM_CODEC_RGBA8 = 0,
    LUM_CODEC_JPEG = 1,
    LUM_CODEC_PNG = 2,
    LUM_CODEC_WEBP = 3,
    LUM_CODEC_HALF_DEFLATE = 4,
    LUM_CODEC_VP9 = 5
};

/* As view.open names them: "jpeg". False: there is no such codec. */
bool lum_codec_find(const char *name, uint8_t *ret_codec);
const char *lum_codec_name(enum lum_codec codec);

struct lum_frame_header {
    uint8_t kind;
    uint32_t flags, payload_len;
    uint64_t frame_seq, scene_rev;
    uint32_t view_id, camera_seq;
    uint16_t x, y, w, h, full_w, full_h;
    uint8_t codec, quality, downscale;
    uint32_t server_us;
    uint16_t error; /* relative x 10000; 65535 unknown */
    uint16_t spp;   /* saturating */
};

void lum_frame_header_pack(const struct lum_frame_header *h, uint8_t ret_bytes[LUM_FRAME_HEADER_BYTES]);
/* False for a wrong magic or version, a header_len below 64 or beyond n_bytes, or a payload_len that is not the rest.
 */
bool lum_frame_header_unpack(const uint8_t *bytes, size_t n_bytes, struct lum_frame_header *ret_header,
                             size_t *ret_payload_offset);

#endif

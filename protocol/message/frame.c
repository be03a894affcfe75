#include "protocol/message/frame.h"

#include <string.h>

/* Offsets of the fields; the struct on the wire is these numbers, never a C struct. */
enum {
    AT_MAGIC = 0,
    AT_VERSION = 4,
    AT_KIND = 5,
    AT_HEADER_LEN = 6,
    AT_FLAGS = 8,
    AT_PAYLOAD_LEN = 12,
    AT_FRAME_SEQ = 16,
    AT_SCENE_REV = 24,
    AT_VIEW_ID = 32,
    AT_CAMERA_SEQ = 36,
    AT_RECT = 40,
    AT_FULL = 48,
    AT_CODEC = 52,
    AT_QUALITY = 53,
    AT_DOWNSCALE = 54,
    AT_ZERO = 55,
    AT_SERVER_US = 56,
    AT_ERROR = 60,
    AT_SPP = 62,
    AT_END = 64,
};
_Static_assert(AT_END == LUM_FRAME_HEADER_BYTES, "the header is 64 bytes");
_Static_assert(AT_FRAME_SEQ % 8 == 0 && AT_SCENE_REV % 8 == 0, "64-bit fields are aligned for clients that map them");
_Static_assert(AT_RECT + 4 * 2 == AT_FULL && AT_FULL + 2 * 2 == AT_CODEC, "rectangles are 16-bit");
_Static_assert(AT_ZERO + 1 == AT_SERVER_US && AT_SERVER_US + 4 == AT_ERROR && AT_SPP + 2 == AT_END, "no gaps");

static const uint8_t magic[4] = {'L', 'U', 'M', 'F'};
#define FRAME_VERSION 1u /* of this layout */

static void put(uint8_t *p, uint64_t v, unsigned n_bytes)
{
    for (unsigned i = 0; i < n_bytes; i++)
        p[i] = (uint8_t)(v >> (8 * i));
}

static uint64_t get(const uint8_t *p, unsigned n_bytes)
{
    uint64_t v = 0;
    for (unsigned i = 0; i < n_bytes; i++)
        v |= (uint64_t)p[i] << (8 * i);
    return v;
}

void lum_frame_header_pack(const struct lum_frame_header *h, uint8_t ret_bytes[LUM_FRAME_HEADER_BYTES])
{
    uint8_t *b = ret_bytes;
    const uint16_t rect[6] = {h->x, h->y, h->w, h->h, h->full_w, h->full_h};
    memcpy(b + AT_MAGIC, magic, sizeof magic);
    b[AT_VERSION] = FRAME_VERSION;
    b[AT_KIND] = h->kind;
    put(b + AT_HEADER_LEN, LUM_FRAME_HEADER_BYTES, 2);
    put(b + AT_FLAGS, h->flags, 4);
    put(b + AT_PAYLOAD_LEN, h->payload_len, 4);
    put(b + AT_FRAME_SEQ, h->frame_seq, 8);
    put(b + AT_SCENE_REV, h->scene_rev, 8);
    put(b + AT_VIEW_ID, h->view_id, 4);
    put(b + AT_CAMERA_SEQ, h->camera_seq, 4);
    for (unsigned i = 0; i < 6; i++)
        put(b + AT_RECT + 2 * i, rect[i], 2);
    b[AT_CODEC] = h->codec;
    b[AT_QUALITY] = h->quality;
    b[AT_DOWNSCALE] = h->downscale;
    b[AT_ZERO] = 0;
    put(b + AT_SERVER_US, h->server_us, 4);
    put(b + AT_ERROR, h->error, 2);
    put(b + AT_SPP, h->spp, 2);
}

bool lum_frame_header_unpack(const uint8_t *bytes, size_t n_bytes, struct lum_frame_header *ret_header,
                             size_t *ret_payload_offset)
{
    const uint8_t *b = bytes;
    if (n_bytes < LUM_FRAME_HEADER_BYTES || memcmp(b + AT_MAGIC, magic, sizeof magic) != 0 ||
        b[AT_VERSION] != FRAME_VERSION)
        return false;
    size_t header_len = get(b + AT_HEADER_LEN, 2);
    uint32_t payload_len = (uint32_t)get(b + AT_PAYLOAD_LEN, 4);
    if (header_len < LUM_FRAME_HEADER_BYTES || header_len > n_bytes || n_bytes - header_len != payload_len)
        return false;
    *ret_header = (struct lum_frame_header){
        .kind = b[AT_KIND],
        .flags = (uint32_t)get(b + AT_FLAGS, 4),
        .payload_len = payload_len,
        .frame_seq = get(b + AT_FRAME_SEQ, 8),
        .scene_rev = get(b + AT_SCENE_REV, 8),
        .view_id = (uint32_t)get(b + AT_VIEW_ID, 4),
        .camera_seq = (uint32_t)get(b + AT_CAMERA_SEQ, 4),
        .x = (uint16_t)get(b + AT_RECT, 2),
        .y = (uint16_t)get(b + AT_RECT + 2, 2),
        .w = (uint16_t)get(b + AT_RECT + 4, 2),
        .h = (uint16_t)get(b + AT_RECT + 6, 2),
        .full_w = (uint16_t)get(b + AT_FULL, 2),
        .full_h = (uint16_t)get(b + AT_FULL + 2, 2),
        .codec = b[AT_CODEC],
        .quality = b[AT_QUALITY],
        .downscale = b[AT_DOWNSCALE],
        .server_us = (uint32_t)get(b + AT_SERVER_US, 4),
        .error = (uint16_t)get(b + AT_ERROR, 2),
        .spp = (uint16_t)get(b + AT_SPP, 2),
    };
    *ret_payload_offset = header_len;
    return true;
}

static const char *const codec_names[] = {[LUM_CODEC_RGBA8] = "rgba8",
                                          [LUM_CODEC_JPEG] = "jpeg",
                                          [LUM_CODEC_PNG] = "png",
                                          [LUM_CODEC_WEBP] = "webp",
                                          [LUM_CODEC_HALF_DEFLATE] = "half_deflate",
                                          [LUM_CODEC_VP9] = "vp9"};

const char *lum_codec_name(enum lum_codec codec)
{
    return codec_names[codec];
}

bool lum_codec_find(const char *name, uint8_t *ret_codec)
{
    for (uint8_t i = 0; i < sizeof codec_names / sizeof codec_names[0]; i++)
        if (strcmp(codec_names[i], name) == 0) {
            *ret_codec = i;
            return true;
        }
    return false;
}

/* PNG files, by libspng: 8 bits a channel, written with an sRGB chunk. */
#ifndef LUM_SERVER_STREAM_PNG_H
#define LUM_SERVER_STREAM_PNG_H

#include <stddef.h>
#include <stdint.h>

#include "core/base/base.h"

struct lum_png {
    const uint8_t *rgb; /* 3 * w * h, first row on top */
    uint32_t w, h;
    int level; /* zlib, 1 fast .. 9 small */
};
/* *ret_bytes is released with free(). Thread: any. */
LUM_MUST_USE enum lum_status lum_png_encode(const struct lum_png *png, uint8_t **ret_bytes, size_t *ret_n,
                                            struct lum_error *err);
/* The same where rgb is 4 * w * h: with opacity. */
LUM_MUST_USE enum lum_status lum_png_encode_rgba(const struct lum_png *png, uint8_t **ret_bytes, size_t *ret_n,
                                                 struct lum_error *err);
/* Writes beside the target and renames, so that a reader never sees half a file. */
LUM_MUST_USE enum lum_status lum_png_write(const char *path, const struct lum_png *png, struct lum_error *err);

struct lum_png_image {
    uint8_t *rgb; /* 3 * w * h, first row on top; lum_free */
    uint32_t w, h;
};
/* Whatever the file holds becomes 8-bit RGB, without alpha; it is taken for sRGB. Sides over max_side are refused. */
LUM_MUST_USE enum lum_status lum_png_read(const char *path, uint32_t max_side, struct lum_png_image *ret_image,
                                          struct lum_error *err);

#endif

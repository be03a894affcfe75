/* One WebP file of a tile (libwebp, `LUMEND_WEBP`). A build without it has webp_none.c, and encodes nothing. */
#ifndef LUM_SERVER_STREAM_WEBP_H
#define LUM_SERVER_STREAM_WEBP_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

struct lum_webp {
    const uint8_t *rgbx; /* 4 * w * h, first row on top; the fourth byte is not looked at */
    uint32_t w, h;
    int quality; /* 1 .. 100, as WebP counts (coding.h) */
    bool lossless;
};

/* False: this build has no WebP. */
bool lum_webp_available(void);

/* Into out, which holds size bytes. The length of the file; 0: no memory, or no room. Thread: any. */
size_t lum_webp_encode(const struct lum_webp *image, uint8_t *out, size_t size);

#endif

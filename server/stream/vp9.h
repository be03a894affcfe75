/* Pictures that follow each other as VP9 (libvpx, `LUMEND_VP9`): each is told as what differs from those before, but
 * for key frames, which stand alone. A build without it has vp9_none.c, and encodes nothing.
 *
 * Every picture becomes one frame, at once: none is held back, left out, or shown later. Values are those of the
 * screen, BT.709 in all 8 bits, colours in half the resolution. */
#ifndef LUM_SERVER_STREAM_VP9_H
#define LUM_SERVER_STREAM_VP9_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

struct lum_vp9; /* one encoder, and the picture that it is to encode next */

/* False: this build has no VP9. */
bool lum_vp9_available(void);

/* NULL when memory is short. A picture of w x h, black at first; n_threads work on it. */
struct lum_vp9 *lum_vp9_create(uint32_t w, uint32_t h, uint32_t n_threads);
void lum_vp9_destroy(struct lum_vp9 *v); /* accepts NULL */

struct lum_vp9_part {
    const uint8_t *rgbx; /* 4 * w * h, first row on top; the fourth byte is not looked at */
    uint32_t x, y, w, h; /* x and y even; w and h, too, where it does not end with the picture */
};
/* Into the picture. Thread: any, for parts that do not overlap. */
void lum_vp9_put(struct lum_vp9 *v, const struct lum_vp9_part *part);

struct lum_vp9_frame {
    const uint8_t *bytes; /* the encoder's own, until its next frame */
    size_t n;             /* 0: none, as when memory is short; nor will there ever be one again */
    bool key;
    uint8_t quality; /* 0 .. 100: how fine its steps are */
};
/* wanted_bytes: what it should take, about, and not 0; a key frame takes more. Thread: one at a time. */
struct lum_vp9_frame lum_vp9_encode(struct lum_vp9 *v, uint32_t wanted_bytes, bool key);

#endif

/* The picture put together from tiles. A frame is complete with the tile that carries LUM_FRAME_LAST_TILE; tiles that a
 * frame does not bring are unchanged since the one before. */
#ifndef LUM_CLIENTS_REPLAY_CANVAS_H
#define LUM_CLIENTS_REPLAY_CANVAS_H

#include "protocol/message/frame.h"

struct canvas {
    uint32_t w, h;
    uint8_t *rgb; /* 3 * w * h; NULL: headers are checked, pixels are not decoded */
    void *jpeg;   /* TurboJPEG handle, made at need */
};
/* decode false: only the bookkeeping. False: memory is short. */
bool canvas_init(struct canvas *c, uint32_t w, uint32_t h, bool decode);
void canvas_finish(struct canvas *c);

/* Draws one tile. False, with *ret_reason (static): it does not fit the picture, or cannot be decoded. */
bool canvas_draw(struct canvas *c, const struct lum_frame_header *h, const uint8_t *payload, const char **ret_reason);
bool canvas_write_png(const struct canvas *c, const char *path);

#endif

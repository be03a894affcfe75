/* Guidance maps over the picture: where a method refined its samples. */
#ifndef LUM_SERVER_STREAM_OVERLAY_H
#define LUM_SERVER_STREAM_OVERLAY_H

#include "core/method/method.h"
#include "protocol/message/frame.h"

/* Of "guidance_EFFECT", as the wire names the map. False: it names none. */
bool lum_overlay_effect(const char *overlay, enum lum_effect *ret_effect);

struct lum_overlay_picture {
    const uint8_t *iterations; /* lum_view_guidance; NULL: none is asked for, or the method makes none */
    uint32_t w;                /* pixels of a row of iterations */
};

/* Turns the pixels of a tile (w * h of RGBA8, display-referred) into grey and mixes the map's colours in. Nothing
 * without a map. */
void lum_overlay_paint(const struct lum_overlay_picture *overlay, const struct lum_frame_header *tile,
                       uint8_t *inout_rgba);

#endif

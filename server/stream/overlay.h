/* Guidance maps over the picture: where a method refined its samples. */
#ifndef LUM_SERVER_STREAM_OVERLAY_H
#define LUM_SERVER_STREAM_OVERLAY_H

#include "core/method/method.h"
#include "protocol/message/frame.h"

enum lum_overlay {
    LUM_OVERLAY_NONE,
    LUM_OVERLAY_SOFT_SHADOW,
    LUM_OVERLAY_INDIRECT_DIFFUSE,
    LUM_OVERLAY_MEDIA,
};
/* As on the wire, in the order of the enumeration. */
#define LUM_OVERLAY_NAMES "none|guidance_soft_shadow|guidance_indirect_diffuse|guidance_media"
/* overlay: not LUM_OVERLAY_NONE. */
enum lum_effect lum_overlay_effect(enum lum_overlay overlay);

struct lum_overlay_picture {
    const uint8_t *iterations; /* lum_view_guidance; NULL: none is asked for, or the method makes none */
    uint32_t w;                /* pixels of a row of iterations */
};

/* Turns the pixels of a tile (w * h of RGBA8, display-referred) into grey and mixes the map's colours in. Nothing
 * without a map. */
void lum_overlay_paint(const struct lum_overlay_picture *overlay, const struct lum_frame_header *tile,
                       uint8_t *inout_rgba);

#endif

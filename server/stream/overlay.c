#include "server/stream/overlay.h"

#include <string.h>

#include "core/interleave/interleave.h"
#include "core/render/view.h"

bool lum_overlay_effect(const char *overlay, enum lum_effect *ret_effect)
{
    static const char map[] = "guidance_";
    size_t n = sizeof map - 1;
    return strncmp(overlay, map, n) == 0 && lum_effect_find(overlay + n, strlen(overlay + n), ret_effect);
}

/* Half of what is shown is map, half is the grey picture, which keeps shapes readable under it. */
static uint8_t mix(uint8_t grey, uint8_t code)
{
    return (uint8_t)((grey + code + 1) / 2);
}

void lum_overlay_paint(const struct lum_overlay_picture *overlay, const struct lum_frame_header *tile,
                       uint8_t *inout_rgba)
{
    if (!overlay->iterations)
        return;
    uint8_t codes[LUM_GUIDANCE_MAX][3];
    for (uint32_t i = 0; i < LUM_GUIDANCE_MAX; i++)
        lum_tone_pixel(lum_guidance_color(i, LUM_GUIDANCE_MAX), 1.0, LUM_TONE_NONE, codes[i]);
    for (uint32_t y = 0; y < tile->h; y++)
        for (uint32_t x = 0; x < tile->w; x++) {
            uint8_t *p = inout_rgba + ((size_t)y * tile->w + x) * 4;
            /* Rec.709 luma, in 256ths */
            uint8_t grey = (uint8_t)((54u * p[0] + 183u * p[1] + 19u * p[2] + 128u) / 256u);
            uint32_t n = overlay->iterations[(size_t)(tile->y + y) * overlay->w + tile->x + x];
            n = n < LUM_GUIDANCE_MAX ? n : LUM_GUIDANCE_MAX - 1;
            for (int c = 0; c < 3; c++)
                p[c] = mix(grey, codes[n][c]);
        }
}

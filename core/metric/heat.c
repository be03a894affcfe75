#include "core/metric/heat.h"

#include <math.h>
#include <string.h>

#include "core/film/film.h"
#include "core/metric/lab.h"

/* A spiral up the axis of greys: hue from violet (300 degrees) through red to yellow (95), as colourful as the gamut of
 * Rec.709 allows of a curve this simple, which is least in dark reds: there it ends at 57. */
void lum_heat_init(struct lum_heat *heat)
{
    for (uint32_t i = 0; i < LUM_HEAT_COLORS; i++) {
        double t = i / (LUM_HEAT_COLORS - 1.0), hue = (300.0 + 155.0 * t) * LUM_PI_D / 180.0;
        double chroma = 65.0 * pow(sin(LUM_PI_D * t), 0.75);
        float rgb[3];
        lum_lab_to_rgb((struct lum_lab){(float)(98.0 * t), (float)(chroma * cos(hue)), (float)(chroma * sin(hue))},
                       rgb);
        lum_tone_pixel(lum_rgb(rgb[0], rgb[1], rgb[2]), 1.0, LUM_TONE_NONE, heat->srgb[i]);
    }
}

void lum_heat_color(const struct lum_heat *heat, double value, uint8_t ret_srgb[3])
{
    if (!isfinite(value)) {
        memcpy(ret_srgb, (const uint8_t[]){0, 255, 255}, 3);
        return;
    }
    double at = fmin(fmax(value, 0.0), 1.0) * (LUM_HEAT_COLORS - 1);
    memcpy(ret_srgb, heat->srgb[(uint32_t)(at + 0.5)], 3);
}

/* Writing what a view shows to a file. */
#ifndef LUM_SERVER_CLI_IMAGE_OUTPUT_H
#define LUM_SERVER_CLI_IMAGE_OUTPUT_H

#include "core/image/exr.h"
#include "server/cli/annotate.h"

struct lum_png_output {
    const struct lum_film *film;
    struct lum_display display;
    const struct lum_overlay *overlay; /* over it */
    bool legend;                       /* and its scale at the right: the file is wider than the picture */
};
/* Tone mapped, 8 bit. ret_canvas->rgb is released with lum_free. */
LUM_MUST_USE enum lum_status lum_paint_png(const struct lum_png_output *output, struct lum_canvas *ret_canvas,
                                           struct lum_error *err);
LUM_MUST_USE enum lum_status lum_write_png(const char *path, const struct lum_png_output *output,
                                           struct lum_error *err);

struct lum_layer {
    char name[LUM_ID_MAX + 1];
    struct lum_rgb *pixels; /* w * h */
};
struct lum_exr_output {
    uint32_t w, h;
    const struct lum_rgb *beauty;
    struct lum_aovs aovs;
    const struct lum_error_map *errors; /* settled; NULL: none */
    const struct lum_film *illuminance; /* a picture of it; NULL: none */
    const struct lum_error_map *illuminance_errors;
    const uint8_t *guidance[LUM_EFFECT_COUNT]; /* lum_view_guidance; NULL: none */
    const struct lum_layer *layers;            /* light groups */
    uint32_t n_layers;
    const struct lum_exr_attribute *attributes;
    uint32_t n_attributes;
};
/* Float channels R G B, layers NAME.R .G .B, albedo.R .G .B, N.X .Y .Z, Z (metres, +inf: background), id (1 + index of
 * the object in id order, 0: background), error.Y (root mean square error of luminance around the pixel, cd/m2; NaN:
 * unknown), illuminance.Y (lx; 0 where there is no surface) and illuminance.error (likewise, lx), and guidance.EFFECT
 * (how often the pixel's samples were refined). */
LUM_MUST_USE enum lum_status lum_write_exr(const char *path, const struct lum_exr_output *output,
                                           struct lum_error *err);

/* The film's mean as an array; released with lum_free. NULL when memory is short. */
struct lum_rgb *lum_film_pixels(const struct lum_film *film);

#endif

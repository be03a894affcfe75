/* Writing what a view shows to a file. */
#ifndef LUM_SERVER_CLI_IMAGE_OUTPUT_H
#define LUM_SERVER_CLI_IMAGE_OUTPUT_H

#include "core/image/exr.h"
#include "server/cli/tev.h"
#include "server/report/paint.h"

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

/* The same channels, to tev: a new picture there where begin is set, else more of it. */
LUM_MUST_USE enum lum_status lum_show_exr(struct lum_tev *tev, const char *name, bool begin,
                                          const struct lum_exr_output *output, struct lum_error *err);

/* The film's mean as an array; released with lum_free. NULL when memory is short. */
struct lum_rgb *lum_film_pixels(const struct lum_film *film);

#endif

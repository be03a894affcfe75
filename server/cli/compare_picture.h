/* A picture that is compared: an EXR file of light, or a PNG file of what a display shows. */
#ifndef LUM_SERVER_CLI_COMPARE_PICTURE_H
#define LUM_SERVER_CLI_COMPARE_PICTURE_H

#include "core/image/exr.h"

struct lum_compared {
    const char *path; /* borrowed; NULL: there is none */
    bool is_png;      /* its light is relative: white is 1 */
    uint32_t w, h;
    float *rgb[3];            /* planes, linear Rec.709 */
    uint8_t *shown;           /* 3 * w * h, sRGB: what a display shows. Of an EXR NULL before lum_compared_show */
    struct lum_exr_image exr; /* rgb points into it, or into linear */
    float *linear;
};

/* By what the file begins with. On failure there is nothing to finish. */
LUM_MUST_USE enum lum_status lum_compared_read(const char *path, struct lum_compared *ret_picture,
                                               struct lum_error *err);
void lum_compared_finish(struct lum_compared *picture);

/* An EXR as the browser shows it: exposed by ev100, AgX. Values that are not finite are black. Nothing to do for a PNG.
 */
LUM_MUST_USE enum lum_status lum_compared_show(struct lum_compared *picture, double ev100, struct lum_error *err);
/* The exposure that fits the picture. */
LUM_MUST_USE enum lum_status lum_compared_exposure(const struct lum_compared *picture, double *ret_ev100,
                                                   struct lum_error *err);

#endif

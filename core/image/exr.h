/* OpenEXR files: single-part scanline, float or half channels. Reading refuses deep and multi-part files and anything
 * over the given size (OpenEXR 3.1 has known faults in deep reading). */
#ifndef LUM_CORE_IMAGE_EXR_H
#define LUM_CORE_IMAGE_EXR_H

#include "core/base/base.h"

struct lum_exr_channel {
    char name[64];       /* "R", "key.R", "Z", "N.X" */
    const float *pixels; /* first pixel; w * h values */
    size_t stride;       /* floats from one pixel to the next */
    bool half;           /* store as half; values over 65504 saturate instead of becoming infinite */
};
struct lum_exr_attribute {
    const char *name, *text;
};

LUM_MUST_USE enum lum_status lum_exr_write(const char *path, uint32_t w, uint32_t h,
                                           const struct lum_exr_channel *channels, uint32_t n_channels,
                                           const struct lum_exr_attribute *attributes, uint32_t n_attributes,
                                           struct lum_error *err);

/* Owned planar float image; n_channels names. lum_exr_finish frees. */
struct lum_exr_image {
    uint32_t w, h, n_channels;
    char (*names)[64];
    float *pixels; /* channel-major: pixels[c * w * h + y * w + x] */
};
LUM_MUST_USE enum lum_status lum_exr_read(const char *path, uint32_t max_w, uint32_t max_h,
                                          struct lum_exr_image *ret_image, struct lum_error *err);
/* The same from memory; max_size: width and height. */
LUM_MUST_USE enum lum_status lum_exr_read_memory(const void *bytes, size_t n_bytes, const uint32_t max_size[2],
                                                 struct lum_exr_image *ret_image, struct lum_error *err);
void lum_exr_finish(struct lum_exr_image *image);

const char *lum_exr_library(void); /* "OpenEXR 3.1.5" */

#endif

/* Image files to texels. All readers are total over arbitrary bytes, and check sizes from the header before allocating.
 */
#ifndef LUM_SERVER_IMPORTER_IMAGE_H
#define LUM_SERVER_IMPORTER_IMAGE_H

#include "server/importer/importer.h"

struct lum_texels {
    uint32_t width, height;
    bool hdr;     /* 3 linear floats a texel; else 4 bytes RGBA */
    void *pixels; /* lum_free; first row is the top */
    size_t n_bytes;
};

/* PNG, JPEG, Radiance .hdr or OpenEXR, by content. */
LUM_MUST_USE enum lum_status lum_image_decode(const struct lum_bytes *file, struct lum_texels *ret_texels,
                                              struct lum_error *err);
/* Sends the op of an image record. linear: bytes are not sRGB encoded (normals, roughness). */
LUM_MUST_USE enum lum_status lum_image_emit(struct lum_importer *im, const char *id, const struct lum_texels *texels,
                                            bool linear, struct lum_error *err);

/* One reader each. */
enum lum_status lum_png_decode(const struct lum_bytes *file, struct lum_texels *ret_texels, struct lum_error *err);
enum lum_status lum_jpeg_decode(const struct lum_bytes *file, struct lum_texels *ret_texels, struct lum_error *err);
enum lum_status lum_hdr_decode(const struct lum_bytes *file, struct lum_texels *ret_texels, struct lum_error *err);
enum lum_status lum_exr_decode(const struct lum_bytes *file, struct lum_texels *ret_texels, struct lum_error *err);

/* Checks width and height against the limits and allocates ret_texels->pixels. */
LUM_MUST_USE enum lum_status lum_texels_alloc(uint64_t width, uint64_t height, bool hdr, struct lum_texels *ret_texels,
                                              struct lum_error *err);

#endif

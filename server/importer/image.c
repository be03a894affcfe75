#include "server/importer/image.h"

#include <string.h>

#include "protocol/base/limits.h"

enum lum_status lum_texels_alloc(uint64_t width, uint64_t height, bool hdr, struct lum_texels *ret_texels,
                                 struct lum_error *err)
{
    if (width == 0 || height == 0)
        return lum_fail(err, LUM_ERR_INVALID, "size", "the image has no pixels");
    if (width > LUM_LIMIT_IMAGE_SIDE || height > LUM_LIMIT_IMAGE_SIDE || width * height > LUM_LIMIT_IMAGE_TEXELS)
        return lum_fail(err, LUM_ERR_LIMIT, "size", "%llu x %llu pixels are over the limit of %u a side and %u in all",
                        (unsigned long long)width, (unsigned long long)height, LUM_LIMIT_IMAGE_SIDE,
                        LUM_LIMIT_IMAGE_TEXELS);
    size_t texel_bytes = hdr ? 3 * sizeof(float) : 4;
    struct lum_texels t = {.width = (uint32_t)width, .height = (uint32_t)height, .hdr = hdr};
    t.n_bytes = (size_t)(width * height) * texel_bytes;
    t.pixels = lum_calloc(1, t.n_bytes);
    if (!t.pixels)
        return lum_fail(err, LUM_ERR_NOMEM, "", "out of memory for an image of %llu x %llu", (unsigned long long)width,
                        (unsigned long long)height);
    *ret_texels = t;
    return LUM_OK;
}

static bool starts_with(const struct lum_bytes *file, const char *magic, size_t n)
{
    return file->n >= n && memcmp(file->data, magic, n) == 0;
}

enum lum_status lum_image_decode(const struct lum_bytes *file, struct lum_texels *ret_texels, struct lum_error *err)
{
    if (starts_with(file, "\x89PNG\r\n\x1a\n", 8))
        return lum_png_decode(file, ret_texels, err);
    if (starts_with(file, "\xff\xd8\xff", 3))
        return lum_jpeg_decode(file, ret_texels, err);
    if (starts_with(file, "#?", 2))
        return lum_hdr_decode(file, ret_texels, err);
    if (starts_with(file, "\x76\x2f\x31\x01", 4))
        return lum_exr_decode(file, ret_texels, err);
    if (starts_with(file, "RIFF", 4))
        return lum_fail(err, LUM_ERR_UNSUPPORTED, "", "WebP images are not supported");
    if (starts_with(file, "\xabKTX 20", 7))
        return lum_fail(err, LUM_ERR_UNSUPPORTED, "", "KTX2 images are not supported");
    return lum_fail(err, LUM_ERR_UNSUPPORTED, "", "is no PNG, JPEG, Radiance HDR or OpenEXR image");
}

enum lum_status lum_image_emit(struct lum_importer *im, const char *id, const struct lum_texels *texels, bool linear,
                               struct lum_error *err)
{
    struct lum_op_text op;
    lum_op_begin(&op, "image", id);
    lum_op_number(&op, "width", texels->width);
    lum_op_number(&op, "height", texels->height);
    lum_op_string(&op, "texel", texels->hdr ? "rgb32f" : linear ? "linear8" : "srgb8");
    lum_emit_blob(&im->emit, &op, "pixels", texels->pixels, texels->n_bytes);
    return lum_emit_op(&im->emit, &op, err);
}

#include "server/stream/png.h"

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <spng.h>

#include "server/base/write_file.h"

#define CHUNK_BYTES (4u << 20) /* ancillary chunks: colour profiles are under 1 MiB */

static enum lum_status encode(const struct lum_png *png, size_t n_channels, uint8_t **ret_bytes, size_t *ret_n,
                              struct lum_error *err)
{
    spng_ctx *ctx = spng_ctx_new(SPNG_CTX_ENCODER);
    if (!ctx)
        return lum_fail(err, LUM_ERR_NOMEM, "", "no memory for a PNG of %u x %u", png->w, png->h);
    struct spng_ihdr ihdr = {.width = png->w,
                             .height = png->h,
                             .bit_depth = 8,
                             .color_type =
                                 n_channels == 4 ? SPNG_COLOR_TYPE_TRUECOLOR_ALPHA : SPNG_COLOR_TYPE_TRUECOLOR};
    int failed = spng_set_option(ctx, SPNG_ENCODE_TO_BUFFER, 1);
    if (!failed)
        failed = spng_set_option(ctx, SPNG_IMG_COMPRESSION_LEVEL, png->level);
    /* Sub alone: a tenth of the time of trying all filters, and within some percent of their size on rendered pictures.
     */
    if (!failed)
        failed = spng_set_option(ctx, SPNG_FILTER_CHOICE, SPNG_FILTER_CHOICE_SUB);
    if (!failed)
        failed = spng_set_ihdr(ctx, &ihdr);
    if (!failed)
        failed = spng_set_srgb(ctx, 0); /* rendering intent: perceptual */
    if (!failed)
        failed = spng_encode_image(ctx, png->rgb, n_channels * png->w * png->h, SPNG_FMT_PNG, SPNG_ENCODE_FINALIZE);
    size_t n = 0;
    uint8_t *bytes = failed ? NULL : spng_get_png_buffer(ctx, &n, &failed);
    spng_ctx_free(ctx);
    if (!bytes)
        return lum_fail(err, failed == SPNG_EMEM ? LUM_ERR_NOMEM : LUM_ERR_INTERNAL, "", "PNG encoding failed: %s",
                        spng_strerror(failed));
    *ret_bytes = bytes;
    *ret_n = n;
    return LUM_OK;
}

enum lum_status lum_png_encode(const struct lum_png *png, uint8_t **ret_bytes, size_t *ret_n, struct lum_error *err)
{
    return encode(png, 3, ret_bytes, ret_n, err);
}

enum lum_status lum_png_encode_rgba(const struct lum_png *png, uint8_t **ret_bytes, size_t *ret_n,
                                    struct lum_error *err)
{
    return encode(png, 4, ret_bytes, ret_n, err);
}

enum lum_status lum_png_write(const char *path, const struct lum_png *png, struct lum_error *err)
{
    uint8_t *bytes = NULL;
    size_t n = 0;
    enum lum_status st = lum_png_encode(png, &bytes, &n, err);
    if (st)
        return st;
    st = lum_write_file(path, bytes, n, err);
    free(bytes);
    return st;
}

/* ret_image: filled but for what a failure leaves out. */
static int decode(spng_ctx *ctx, FILE *f, uint32_t max_side, struct lum_png_image *ret_image)
{
    struct spng_ihdr head;
    size_t n = 0;
    int failed;
    spng_set_image_limits(ctx, max_side, max_side);
    spng_set_chunk_limits(ctx, CHUNK_BYTES, 2 * CHUNK_BYTES);
    spng_set_crc_action(ctx, SPNG_CRC_ERROR, SPNG_CRC_DISCARD);
    if ((failed = spng_set_png_file(ctx, f)) || (failed = spng_get_ihdr(ctx, &head)) ||
        (failed = spng_decoded_image_size(ctx, SPNG_FMT_RGB8, &n)))
        return failed;
    ret_image->w = head.width;
    ret_image->h = head.height;
    ret_image->rgb = lum_calloc(n, 1);
    return ret_image->rgb ? spng_decode_image(ctx, ret_image->rgb, n, SPNG_FMT_RGB8, 0) : SPNG_EMEM;
}

enum lum_status lum_png_read(const char *path, uint32_t max_side, struct lum_png_image *ret_image,
                             struct lum_error *err)
{
    struct lum_png_image image = {0};
    FILE *f = fopen(path, "rb");
    if (!f)
        return lum_fail(err, LUM_ERR_IO, "", "cannot read %s: %s", path, strerror(errno));
    spng_ctx *ctx = spng_ctx_new(0);
    int failed = ctx ? decode(ctx, f, max_side, &image) : SPNG_EMEM;
    spng_ctx_free(ctx);
    fclose(f);
    if (!failed) {
        *ret_image = image;
        return LUM_OK;
    }
    lum_free(image.rgb);
    return lum_fail(err, failed == SPNG_EMEM ? LUM_ERR_NOMEM : LUM_ERR_INVALID, "", "%s: %s", path,
                    spng_strerror(failed));
}

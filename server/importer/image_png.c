#include <spng.h>

#include "protocol/base/limits.h"
#include "server/importer/image.h"

#define CHUNK_BYTES (4u << 20) /* ancillary chunks: colour profiles are under 1 MiB */

enum lum_status lum_png_decode(const struct lum_bytes *file, struct lum_texels *ret_texels, struct lum_error *err)
{
    struct lum_texels texels = {0};
    enum lum_status status = LUM_OK;
    spng_ctx *png = spng_ctx_new(0);
    if (!png)
        return lum_fail(err, LUM_ERR_NOMEM, "", "out of memory for a PNG image");
    spng_set_image_limits(png, LUM_LIMIT_IMAGE_SIDE, LUM_LIMIT_IMAGE_SIDE);
    spng_set_chunk_limits(png, CHUNK_BYTES, 2 * CHUNK_BYTES);
    spng_set_crc_action(png, SPNG_CRC_ERROR, SPNG_CRC_DISCARD);
    struct spng_ihdr head;
    size_t n_bytes = 0;
    int code = spng_set_png_buffer(png, file->data, file->n);
    if (!code)
        code = spng_get_ihdr(png, &head);
    if (!code)
        code = spng_decoded_image_size(png, SPNG_FMT_RGBA8, &n_bytes);
    if (code) {
        status = lum_fail(err, LUM_ERR_INVALID, "", "PNG: %s", spng_strerror(code));
        goto done;
    }
    status = lum_texels_alloc(head.width, head.height, false, &texels, err);
    if (status)
        goto done;
    code = n_bytes == texels.n_bytes
               ? spng_decode_image(png, texels.pixels, texels.n_bytes, SPNG_FMT_RGBA8, SPNG_DECODE_TRNS)
               : SPNG_EBUFSIZ;
    if (code) {
        lum_free(texels.pixels);
        status = lum_fail(err, LUM_ERR_INVALID, "", "PNG: %s", spng_strerror(code));
        goto done;
    }
    *ret_texels = texels;
done:
    spng_ctx_free(png);
    return status;
}

#include <turbojpeg.h>

#include "server/importer/image.h"

enum lum_status lum_jpeg_decode(const struct lum_bytes *file, struct lum_texels *ret_texels, struct lum_error *err)
{
    struct lum_texels texels = {0};
    enum lum_status status = LUM_OK;
    tjhandle jpeg = tjInitDecompress();
    if (!jpeg)
        return lum_fail(err, LUM_ERR_NOMEM, "", "out of memory for a JPEG image");
    int w = 0, h = 0, subsampling = 0, colorspace = 0;
    if (tjDecompressHeader3(jpeg, file->data, (unsigned long)file->n, &w, &h, &subsampling, &colorspace) || w < 1 ||
        h < 1) {
        status = lum_fail(err, LUM_ERR_INVALID, "", "JPEG: %.150s", tjGetErrorStr2(jpeg));
        goto done;
    }
    if (colorspace == TJCS_CMYK || colorspace == TJCS_YCCK) {
        status = lum_fail(err, LUM_ERR_UNSUPPORTED, "", "JPEG: CMYK images are not supported");
        goto done;
    }
    status = lum_texels_alloc((uint64_t)w, (uint64_t)h, false, &texels, err);
    if (status)
        goto done;
    /* LIMITSCANS: a progressive file with thousands of empty scans would decode for hours. A warning (a truncated file,
     * say) still gives a picture. */
    if (tjDecompress2(jpeg, file->data, (unsigned long)file->n, texels.pixels, w, 4 * w, h, TJPF_RGBA,
                      TJFLAG_ACCURATEDCT | TJFLAG_LIMITSCANS) &&
        tjGetErrorCode(jpeg) == TJERR_FATAL) {
        lum_free(texels.pixels);
        status = lum_fail(err, LUM_ERR_INVALID, "", "JPEG: %.150s", tjGetErrorStr2(jpeg));
        goto done;
    }
    *ret_texels = texels;
done:
    tjDestroy(jpeg);
    return status;
}

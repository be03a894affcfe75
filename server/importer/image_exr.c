#include <math.h>
#include <string.h>

#include "core/image/exr.h"
#include "protocol/base/limits.h"
#include "server/importer/image.h"

/* The plane of a channel, or NULL. */
static const float *find_plane(const struct lum_exr_image *image, const char *name)
{
    for (uint32_t i = 0; i < image->n_channels; i++)
        if (strcmp(image->names[i], name) == 0)
            return image->pixels + (size_t)i * image->w * image->h;
    return NULL;
}

/* Not a number and negative light become 0, infinity the largest float that a sum survives: one broken pixel must not
 * poison all light in a scene. */
static float clean(float v)
{
    return v > 0.0f ? fminf(v, 1.0e30f) : 0.0f;
}

enum lum_status lum_exr_decode(const struct lum_bytes *file, struct lum_texels *ret_texels, struct lum_error *err)
{
    static const uint32_t max_size[2] = {LUM_LIMIT_IMAGE_SIDE, LUM_LIMIT_IMAGE_SIDE};
    struct lum_exr_image image;
    enum lum_status status = lum_exr_read_memory(file->data, file->n, max_size, &image, err);
    if (status == LUM_ERR_NOMEM) /* OpenEXR says so of damaged PIZ data as well */
        return lum_fail(err, LUM_ERR_INVALID, "", "EXR: damaged, or too large to be decoded");
    if (status)
        return status;
    const float *grey = find_plane(&image, "Y");
    const float *planes[3] = {find_plane(&image, "R"), find_plane(&image, "G"), find_plane(&image, "B")};
    struct lum_texels texels = {0};
    for (int c = 0; c < 3; c++)
        if (!planes[c])
            planes[c] = grey;
    if (!planes[0] || !planes[1] || !planes[2])
        status = lum_fail(err, LUM_ERR_UNSUPPORTED, "", "EXR: has neither the channels R, G, B nor Y");
    else
        status = lum_texels_alloc(image.w, image.h, true, &texels, err);
    if (!status) {
        float *to = texels.pixels;
        for (size_t i = 0; i < (size_t)image.w * image.h; i++)
            for (int c = 0; c < 3; c++)
                to[3 * i + (size_t)c] = clean(planes[c][i]);
        *ret_texels = texels;
    }
    lum_exr_finish(&image);
    return status;
}

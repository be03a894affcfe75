/* Textures of an Assimp scene: files beside the asset, or embedded in it ("*3"). */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "server/importer/assimp.h"
#include "server/importer/image.h"

/* Embedded pictures are whole files, or raw BGRA texels. */
static enum lum_status decode_embedded(struct lum_assimp *a, const char *path, struct lum_texels *ret_texels,
                                       struct lum_error *err)
{
    unsigned long i = strtoul(path + 1, NULL, 10);
    const struct aiTexture *t = i < a->scene->mNumTextures ? a->scene->mTextures[i] : NULL;
    if (!t || !t->pcData)
        return lum_fail(err, LUM_ERR_NOT_FOUND, "", "%.20s: no such embedded texture", path);
    if (t->mHeight == 0) {
        struct lum_bytes file = {(uint8_t *)t->pcData, t->mWidth};
        return lum_image_decode(&file, ret_texels, err);
    }
    enum lum_status status = lum_texels_alloc(t->mWidth, t->mHeight, false, ret_texels, err);
    if (status)
        return status;
    uint8_t *to = ret_texels->pixels;
    for (size_t p = 0; p < (size_t)t->mWidth * t->mHeight; p++) {
        const struct aiTexel *from = &t->pcData[p];
        const uint8_t rgba[4] = {from->r, from->g, from->b, from->a};
        memcpy(to + 4 * p, rgba, sizeof rgba);
    }
    return LUM_OK;
}

static enum lum_status decode(struct lum_assimp *a, const char *path, struct lum_texels *ret_texels,
                              struct lum_error *err)
{
    if (path[0] == '*')
        return decode_embedded(a, path, ret_texels, err);
    struct lum_bytes bytes;
    enum lum_status status = lum_assimp_read(a, path, &bytes, err);
    if (status)
        return status;
    status = lum_image_decode(&bytes, ret_texels, err);
    lum_free(bytes.data);
    return status;
}

/* Opacity maps are grey pictures of their own; a record's alpha lies in the base colour. Nearest texel. */
static void merge_opacity(struct lum_texels *color, const struct lum_texels *opacity)
{
    uint8_t *to = color->pixels;
    const uint8_t *from = opacity->pixels;
    for (uint32_t y = 0; y < color->height; y++)
        for (uint32_t x = 0; x < color->width; x++) {
            size_t sx = (size_t)x * opacity->width / color->width, sy = (size_t)y * opacity->height / color->height;
            to[4 * ((size_t)y * color->width + x) + 3] = from[4 * (sy * opacity->width + sx)];
        }
}

static enum lum_status decode_both(struct lum_assimp *a, const char *color_path, const char *opacity_path,
                                   struct lum_texels *ret_texels, struct lum_error *err)
{
    struct lum_texels opacity;
    enum lum_status status = decode(a, color_path, ret_texels, err);
    if (status || !opacity_path[0] || ret_texels->hdr || strcmp(color_path, opacity_path) == 0)
        return status;
    struct lum_error why;
    if (decode(a, opacity_path, &opacity, &why)) {
        lum_emit_warning(&a->im->emit, "opacity map left out: %s", why.text);
        return LUM_OK;
    }
    if (!opacity.hdr)
        merge_opacity(ret_texels, &opacity);
    lum_free(opacity.pixels);
    return LUM_OK;
}

static enum lum_status send(struct lum_assimp *a, struct lum_assimp_image *image, const char *color_path,
                            const char *opacity_path, bool linear, struct lum_error *err)
{
    struct lum_texels texels = {0};
    struct lum_error why;
    if (decode_both(a, color_path, opacity_path, &texels, &why)) {
        lum_emit_warning(&a->im->emit, "texture left out: %s", why.text);
        return LUM_OK;
    }
    const char *slash = strrchr(color_path, '/'), *back = strrchr(color_path, '\\');
    const char *name = back && (!slash || back > slash) ? back + 1 : slash ? slash + 1 : color_path;
    struct lum_id_request request = {"image/", name, "image", a->n_images};
    enum lum_status status = lum_ids_make(&a->im->ids, &request, image->id, err);
    if (!status)
        status = lum_image_emit(a->im, image->id, &texels, linear, err);
    lum_free(texels.pixels);
    return status;
}

static struct lum_assimp_image *add_image(struct lum_assimp *a, const char *key)
{
    if (a->n_images == a->images_cap) {
        uint32_t cap = a->images_cap ? 2 * a->images_cap : 16;
        struct lum_assimp_image *grown = lum_calloc(cap, sizeof *grown);
        if (!grown)
            return NULL;
        if (a->n_images)
            memcpy(grown, a->images, a->n_images * sizeof *grown);
        lum_free(a->images);
        a->images = grown;
        a->images_cap = cap;
    }
    struct lum_assimp_image *image = &a->images[a->n_images++];
    snprintf(image->path, sizeof image->path, "%s", key);
    return image;
}

enum lum_status lum_assimp_image(struct lum_assimp *a, const char *color_path, const char *opacity_path, bool linear,
                                 lum_id ret_id, struct lum_error *err)
{
    char key[sizeof a->images->path];
    ret_id[0] = 0;
    if (!color_path[0])
        return LUM_OK;
    if (snprintf(key, sizeof key, "%s|%s|%d", color_path, opacity_path, linear) >= (int)sizeof key) {
        lum_emit_warning(&a->im->emit, "texture left out: its name is too long");
        return LUM_OK;
    }
    for (uint32_t i = 0; i < a->n_images; i++)
        if (strcmp(a->images[i].path, key) == 0) {
            memcpy(ret_id, a->images[i].id, sizeof(lum_id));
            return LUM_OK;
        }
    struct lum_assimp_image *image = add_image(a, key);
    if (!image)
        return lum_fail(err, LUM_ERR_NOMEM, "", "out of memory for a texture");
    enum lum_status status = send(a, image, color_path, opacity_path, linear, err);
    memcpy(ret_id, image->id, sizeof(lum_id));
    return status;
}

#include "core/scene/tables.h"

#include <string.h>

#include "core/light/environment.h"
#include "core/scene/parts.h"

struct lender {
    void (*release)(void *owner);
    void *owner;
};

struct lum_image *lum_image_ref(struct lum_image *image)
{
    lum_refs_get(&image->refs);
    return image;
}

void lum_image_unref(struct lum_image *image)
{
    if (!image || !lum_refs_put(&image->refs))
        return;
    if (image->release)
        image->release(image->owner);
    else
        lum_free((void *)image->pixels);
    lum_free(image);
}

struct lum_env_part *lum_env_part_ref(struct lum_env_part *env)
{
    lum_refs_get(&env->refs);
    return env;
}

void lum_env_part_unref(struct lum_env_part *env)
{
    if (!env || !lum_refs_put(&env->refs))
        return;
    lum_env_map_destroy(env->map);
    lum_image_unref(env->image);
    lum_free(env);
}

static enum lum_status check_desc(const struct lum_image_desc *d, struct lum_error *err)
{
    if (d->width < 1 || d->height < 1 || d->width > LUM_IMAGE_SIDE_MAX || d->height > LUM_IMAGE_SIDE_MAX)
        return lum_fail(err, LUM_ERR_LIMIT, "width", "an image is 1 to %u pixels wide and high, not %u x %u",
                        LUM_IMAGE_SIDE_MAX, d->width, d->height);
    if ((unsigned)d->texel > LUM_TEXEL_RGB32F)
        return lum_fail(err, LUM_ERR_INVALID, "texel", "is not a kind of texel");
    if (!d->pixels)
        return lum_fail(err, LUM_ERR_INVALID, "pixels", "an image needs pixels");
    return LUM_OK;
}

/* Returns how many were not finite, which comes from a broken file; a little below 0 is common where a picture was
 * resampled. The upper bound keeps products with a light's intensity far inside the range of float. */
static uint64_t copy_float_texels(float *to, const float *from, size_t n)
{
    uint64_t dropped = 0;
    for (size_t i = 0; i < n; i++) {
        dropped += !isfinite(from[i]);
        to[i] = isfinite(from[i]) ? lum_clamp(from[i], 0.0f, 1e12f) : 0.0f;
    }
    return dropped;
}

/* NULL: memory is short. */
static void *copy_pixels(const struct lum_image_desc *d, uint64_t *inout_dropped)
{
    size_t texels = (size_t)d->width * d->height;
    bool floats = d->texel == LUM_TEXEL_RGB32F;
    void *pixels = lum_calloc(texels, floats ? 3 * sizeof(float) : 4);
    if (pixels && floats)
        *inout_dropped += copy_float_texels(pixels, d->pixels, 3 * texels);
    else if (pixels)
        memcpy(pixels, d->pixels, 4 * texels);
    return pixels;
}

/* lender: NULL: of a copy. */
static enum lum_status image_create(const struct lum_image_desc *d, const struct lender *lender,
                                    struct lum_image **ret_image, uint64_t *inout_dropped, struct lum_error *err)
{
    struct lum_image *image = lum_calloc(1, sizeof *image);
    const void *pixels = image && !lender ? copy_pixels(d, inout_dropped) : d->pixels;
    if (!image || !pixels) {
        lum_free(image);
        return lum_fail(err, LUM_ERR_NOMEM, "", "out of memory for an image of %u x %u", d->width, d->height);
    }
    lum_refs_init(&image->refs);
    image->texel = d->texel;
    image->width = d->width;
    image->height = d->height;
    image->pixels = pixels;
    image->mean = lum_image_mean(image);
    if (lender) {
        image->release = lender->release;
        image->owner = lender->owner;
    }
    *ret_image = image;
    return LUM_OK;
}

static enum lum_status put_image(struct lum_scene *scene, const char *id, const struct lum_image_desc *desc,
                                 const struct lender *lender, struct lum_error *err)
{
    enum lum_status status = check_desc(desc, err);
    if (status != LUM_OK)
        return status;
    struct lum_table *table = &scene->tables[LUM_ENTITY_IMAGE];
    struct lum_entry *base = NULL;
    status = lum_table_open(table, id, sizeof(struct lum_image_entry), &base, err);
    if (status != LUM_OK)
        return status;
    struct lum_image *image = NULL;
    status = image_create(desc, lender, &image, &scene->dropped_texels, err);
    if (status != LUM_OK) {
        lum_table_drop(table, base);
        return status;
    }
    struct lum_image_entry *entry = (struct lum_image_entry *)base;
    lum_image_unref(entry->image);
    lum_env_part_unref(entry->env);
    entry->image = image;
    entry->env = NULL;
    lum_table_keep(table, base);
    return LUM_OK;
}

enum lum_status lum_scene_put_image(struct lum_scene *scene, const char *id, const struct lum_image_desc *desc,
                                    struct lum_error *err)
{
    return put_image(scene, id, desc, NULL, err);
}

enum lum_status lum_scene_share_image(struct lum_scene *scene, const char *id, const struct lum_image_desc *desc,
                                      void (*release)(void *owner), void *owner, struct lum_error *err)
{
    if (desc->texel == LUM_TEXEL_RGB32F)
        return lum_fail(err, LUM_ERR_INVALID, "texel", "cannot be shared");
    return put_image(scene, id, desc, &(struct lender){release, owner}, err);
}

enum lum_status lum_image_entry_env(struct lum_image_entry *entry, struct lum_env_part **ret_env, struct lum_error *err)
{
    if (!entry->env) {
        struct lum_env_part *env = lum_calloc(1, sizeof *env);
        if (!env)
            return lum_fail(err, LUM_ERR_NOMEM, "", "out of memory for an environment");
        lum_refs_init(&env->refs);
        env->image = lum_image_ref(entry->image);
        env->map = lum_env_map_create(entry->image);
        if (!env->map) {
            lum_env_part_unref(env);
            return lum_fail(err, LUM_ERR_NOMEM, "", "out of memory for the environment \"%s\"", entry->base.id);
        }
        entry->env = env;
    }
    *ret_env = lum_env_part_ref(entry->env);
    return LUM_OK;
}

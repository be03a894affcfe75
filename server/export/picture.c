/* Images as PNG, and textures. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include <cjson/cJSON.h>

#include "protocol/json/json.h"
#include "server/export/internal.h"
#include "server/stream/png.h"

#define PNG_LEVEL 6 /* zlib's own default: somebody keeps the file */

/* ---- images ---- */

/* Floats have no PNG: other programs get what a screen could show of it, clipped. */
static uint8_t shown(float v)
{
    double c = fmin(fmax((double)v, 0.0), 1.0);
    return (uint8_t)lround(255.0 * (c <= 0.0031308 ? 12.92 * c : 1.055 * pow(c, 1.0 / 2.4) - 0.055));
}

/* 3 or 4 bytes a texel. */
static uint8_t *texels_of(const struct lum_record_image *im, bool *ret_alpha)
{
    size_t n = (size_t)im->width * im->height;
    const float *hdr = strcmp(im->texel, "rgb32f") == 0 ? (const float *)(const void *)im->pixels : NULL;
    bool alpha = false;
    for (size_t i = 0; i < n && !hdr && !alpha; i++)
        alpha = im->pixels[4 * i + 3] != 255;
    size_t channels = alpha ? 4 : 3;
    uint8_t *to = lum_calloc(n, channels);
    for (size_t i = 0; i < n && to; i++)
        for (size_t c = 0; c < channels; c++)
            to[channels * i + c] = hdr ? shown(hdr[3 * i + c]) : im->pixels[4 * i + c];
    *ret_alpha = alpha;
    return to;
}

static uint32_t add_png(struct lum_exporting *x, const struct lum_record_image *im)
{
    struct lum_png png = {.w = im->width, .h = im->height, .level = PNG_LEVEL};
    struct lum_error err;
    bool alpha = false;
    uint8_t *bytes = NULL, *texels = texels_of(im, &alpha);
    size_t n = 0;
    uint32_t view = 0;
    png.rgb = texels;
    if (!texels)
        lum_glb_fail_memory(x->glb);
    else if (alpha ? lum_png_encode_rgba(&png, &bytes, &n, &err) : lum_png_encode(&png, &bytes, &n, &err))
        lum_glb_fail(x->glb, &err);
    else
        view = lum_glb_bytes(x->glb, bytes, n, free);
    lum_free(texels);
    return view;
}

/* Its pixels as they are: extras of the scene have the record, and the image of glTF names it. */
static void add_floats(struct lum_exporting *x, const struct lum_record *r)
{
    cJSON *o = cJSON_CreateObject();
    bool ok = lum_json_add_string(o, "type", "image") && lum_json_add_string(o, "id", r->id) &&
              lum_json_add_number(o, "width", r->image.width) && lum_json_add_number(o, "height", r->image.height) &&
              lum_json_add_string(o, "texel", r->image.texel);
    if (ok)
        lum_export_bytes(x, o, "pixels", r->image.pixels, r->image.n_bytes, 32);
    if (!lum_json_add(x->records, NULL, o) || !ok)
        lum_glb_fail_memory(x->glb);
}

uint32_t lum_export_image(struct lum_exporting *x, struct lum_export_entry *e)
{
    const struct lum_record_image *im = &e->record->image;
    if (e->index != LUM_EXPORT_NONE || !lum_glb_ok(x->glb) || !im->pixels)
        return e->index;
    bool hdr = strcmp(im->texel, "rgb32f") == 0;
    cJSON *o = cJSON_CreateObject(), *extras = cJSON_CreateObject(), *ours = cJSON_CreateObject();
    bool ok = lum_json_add_string(ours, "id", e->record->id) && lum_json_add_string(ours, "texel", im->texel) &&
              lum_json_add_string(o, "name", e->record->id) && lum_json_add_string(o, "mimeType", "image/png");
    ok = lum_json_add(extras, "lumend", ours) && ok;
    ok = lum_json_add(o, "extras", extras) && ok;
    if (hdr)
        add_floats(x, e->record);
    ok = ok && lum_json_add_number(o, "bufferView", add_png(x, im));
    if (!ok)
        lum_glb_fail_memory(x->glb);
    return e->index = lum_glb_add(x->glb, LUM_GLB_IMAGES, o);
}

/* ---- textures ---- */

static int wrap_of(const char *name)
{
    return strcmp(name, "clamp") == 0 ? 1 : strcmp(name, "mirror") == 0 ? 2 : 0;
}

static uint32_t sampler(struct lum_exporting *x, const struct lum_record_texture *t)
{
    static const double modes[] = {10497, 33071, 33648}; /* REPEAT, CLAMP_TO_EDGE, MIRRORED_REPEAT */
    int u = wrap_of(t->wrap_u), v = wrap_of(t->wrap_v);
    if (x->samplers[u][v] != LUM_EXPORT_NONE)
        return x->samplers[u][v];
    cJSON *o = cJSON_CreateObject();
    bool ok = lum_json_add_number(o, "magFilter", 9729) && lum_json_add_number(o, "minFilter", 9987) && /* linear */
              lum_json_add_number(o, "wrapS", modes[u]) && lum_json_add_number(o, "wrapT", modes[v]);
    if (!ok)
        lum_glb_fail_memory(x->glb);
    return x->samplers[u][v] = lum_glb_add(x->glb, LUM_GLB_SAMPLERS, o);
}

static void add_transform(struct lum_exporting *x, cJSON *info, const struct lum_record_texture *t)
{
    if (t->offset[0] == 0.0 && t->offset[1] == 0.0 && t->scale[0] == 1.0 && t->scale[1] == 1.0 &&
        t->rotation_rad == 0.0)
        return;
    cJSON *o = lum_glb_extension(x->glb, info, "KHR_texture_transform");
    if (!o || !lum_json_add(o, "offset", cJSON_CreateDoubleArray(t->offset, 2)) ||
        !lum_json_add(o, "scale", cJSON_CreateDoubleArray(t->scale, 2)) ||
        !lum_json_add_number(o, "rotation", t->rotation_rad))
        lum_glb_fail_memory(x->glb);
}

void lum_export_texture(struct lum_exporting *x, struct cJSON *o, const char *key, const struct lum_record_texture *t)
{
    struct lum_export_entry *image = t->image[0] ? lum_export_find(x, LUM_RECORD_IMAGE, t->image) : NULL;
    uint32_t source = image ? lum_export_image(x, image) : LUM_EXPORT_NONE;
    if (source == LUM_EXPORT_NONE || !o)
        return;
    cJSON *texture = cJSON_CreateObject(), *info = cJSON_CreateObject();
    bool ok = lum_json_add_number(texture, "source", source) && lum_json_add_number(texture, "sampler", sampler(x, t));
    if (!lum_json_add_number(info, "index", lum_glb_add(x->glb, LUM_GLB_TEXTURES, texture)) || !ok)
        lum_glb_fail_memory(x->glb);
    add_transform(x, info, t);
    if (!lum_json_add(o, key, info))
        lum_glb_fail_memory(x->glb);
}

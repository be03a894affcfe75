#include "clients/replay/canvas.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <spng.h>
#include <turbojpeg.h>

bool canvas_init(struct canvas *c, uint32_t w, uint32_t h, bool decode)
{
    *c = (struct canvas){.w = w, .h = h};
    if (decode)
        c->rgb = calloc((size_t)w * h, 3);
    return !decode || c->rgb;
}

void canvas_finish(struct canvas *c)
{
    if (c->jpeg)
        tjDestroy(c->jpeg);
    free(c->rgb);
    *c = (struct canvas){0};
}

/* A decoded tile; fewer pixels than the tile covers when the server downscaled it. */
struct pixels {
    uint8_t *rgb; /* owned */
    uint32_t w, h;
};

static bool decode_jpeg(struct canvas *c, const uint8_t *bytes, size_t n, struct pixels *ret)
{
    int w, h, subsampling, colorspace;
    if (!c->jpeg)
        c->jpeg = tjInitDecompress();
    if (!c->jpeg || tjDecompressHeader3(c->jpeg, bytes, (unsigned long)n, &w, &h, &subsampling, &colorspace) != 0 ||
        w < 1 || h < 1 || w > 65535 || h > 65535)
        return false;
    uint8_t *rgb = malloc((size_t)w * (size_t)h * 3);
    if (!rgb || tjDecompress2(c->jpeg, bytes, (unsigned long)n, rgb, w, 0, h, TJPF_RGB, 0) != 0) {
        free(rgb);
        return false;
    }
    *ret = (struct pixels){rgb, (uint32_t)w, (uint32_t)h};
    return true;
}

static bool decode_png(const uint8_t *bytes, size_t n, struct pixels *ret)
{
    struct spng_ihdr header;
    size_t size = 0;
    uint8_t *rgb = NULL;
    spng_ctx *ctx = spng_ctx_new(0);
    bool ok = ctx && !spng_set_image_limits(ctx, 65535, 65535) && !spng_set_png_buffer(ctx, bytes, n) &&
              !spng_get_ihdr(ctx, &header) && !spng_decoded_image_size(ctx, SPNG_FMT_RGB8, &size) &&
              (rgb = malloc(size)) && !spng_decode_image(ctx, rgb, size, SPNG_FMT_RGB8, 0);
    spng_ctx_free(ctx);
    if (!ok) {
        free(rgb);
        return false;
    }
    *ret = (struct pixels){rgb, header.width, header.height};
    return true;
}

static bool decode_raw(const struct lum_frame_header *h, const uint8_t *bytes, struct pixels *ret)
{
    uint32_t d = h->downscale, w = (h->w + (1u << d) - 1) >> d, high = (h->h + (1u << d) - 1) >> d;
    if (h->payload_len != 4 * w * high)
        return false;
    uint8_t *rgb = malloc((size_t)w * high * 3);
    for (size_t i = 0; rgb && i < (size_t)w * high; i++)
        memcpy(rgb + 3 * i, bytes + 4 * i, 3);
    *ret = (struct pixels){rgb, w, high};
    return rgb != NULL;
}

static void paste(struct canvas *c, const struct lum_frame_header *h, const struct pixels *p)
{
    for (uint32_t y = 0; y < h->h; y++)
        for (uint32_t x = 0; x < h->w; x++) {
            size_t from = (size_t)(y * p->h / h->h) * p->w + x * p->w / h->w;
            memcpy(c->rgb + 3 * ((size_t)(h->y + y) * c->w + h->x + x), p->rgb + 3 * from, 3);
        }
}

bool canvas_draw(struct canvas *c, const struct lum_frame_header *h, const uint8_t *payload, const char **ret_reason)
{
    struct pixels p = {0};
    *ret_reason = "a tile lies outside its picture";
    if (h->full_w != c->w || h->full_h != c->h || h->w == 0 || h->h == 0 || (uint32_t)h->x + h->w > c->w ||
        (uint32_t)h->y + h->h > c->h || h->downscale > 8)
        return false;
    if (!c->rgb)
        return true;
    *ret_reason = "a tile cannot be decoded";
    bool ok = h->codec == LUM_CODEC_JPEG    ? decode_jpeg(c, payload, h->payload_len, &p)
              : h->codec == LUM_CODEC_PNG   ? decode_png(payload, h->payload_len, &p)
              : h->codec == LUM_CODEC_RGBA8 ? decode_raw(h, payload, &p)
                                            : false;
    if (ok)
        paste(c, h, &p);
    free(p.rgb);
    return ok;
}

bool canvas_write_png(const struct canvas *c, const char *path)
{
    struct spng_ihdr header = {.width = c->w, .height = c->h, .bit_depth = 8, .color_type = SPNG_COLOR_TYPE_TRUECOLOR};
    FILE *f = fopen(path, "wb");
    spng_ctx *ctx = f ? spng_ctx_new(SPNG_CTX_ENCODER) : NULL;
    bool ok = ctx && !spng_set_png_file(ctx, f) && !spng_set_ihdr(ctx, &header) && !spng_set_srgb(ctx, 0) &&
              !spng_encode_image(ctx, c->rgb, (size_t)3 * c->w * c->h, SPNG_FMT_PNG, SPNG_ENCODE_FINALIZE);
    spng_ctx_free(ctx);
    if (f && fclose(f) != 0)
        ok = false;
    return ok;
}

#include "server/stream/vp9.h"

#include <math.h>
#include <string.h>

#include <vpx/vp8cx.h>
#include <vpx/vpx_encoder.h>

#include "core/base/base.h"

/* Settings by what they gave on drags through rooms (tests/bench/RESULTS.md). The encoder's own control of bytes needs
 * some twenty pictures until it knows what they take, and most drags are shorter: a quantizer is given to each. */
enum {
    SPEED = 8,          /* 7 takes a fifth more time for the same pictures */
    COLUMN_LEAST = 256, /* pixels that a column of blocks must have, by the format */
};
#define FINEST 4.0      /* quantizers, of 0 .. 63: finer ones take bytes for what no screen shows */
#define COARSEST 60.0   /* coarser, shapes fall apart */
#define HALVES 6.0      /* so much coarser takes half the bytes */
#define KEY_AT 40.0     /* with this quantizer a key frame of a room takes */
#define KEY_BYTES 0.045 /* of a pixel; a rich one the double */
#define KEY_SHARE                                                                                                      \
    2.5 /* of a frame's bytes: with less the first pictures of a drag are blurred, with more they are late */
/* A picture that moves on after it stood still takes no more than three times what it may: so much finer than those
 * that moved are those that hardly do. */
#define STILL_FINER 10.0
#define FORGET 0.5 /* of that, with each of those */

struct lum_vp9 {
    vpx_codec_ctx_t codec;
    vpx_codec_enc_cfg_t config;
    vpx_image_t image;
    vpx_codec_pts_t n_frames;
    double quantizer, moving; /* of the next frame; of those that took more than half of what they may */
    double wanted_bytes;      /* of the frame before */
    bool open, has_image, broken;
};

bool lum_vp9_available(void)
{
    return true;
}

static bool configure(vpx_codec_enc_cfg_t *c, uint32_t w, uint32_t h, uint32_t n_threads)
{
    if (vpx_codec_enc_config_default(vpx_codec_vp9_cx(), c, 0))
        return false;
    c->g_w = w;
    c->g_h = h;
    c->g_threads = n_threads;
    c->g_timebase = (struct vpx_rational){1, 20}; /* any: nothing depends on it */
    c->g_error_resilient = VPX_ERROR_RESILIENT_DEFAULT;
    c->g_lag_in_frames = 0;
    c->kf_mode = VPX_KF_DISABLED; /* those that are asked for, and no others */
    c->rc_end_usage = VPX_CBR;
    c->rc_dropframe_thresh = 0;
    c->rc_resize_allowed = 0;
    c->rc_target_bitrate = 1000;
    return true;
}

/* As the logarithm: each is a thread's. */
static int columns_log2(const vpx_codec_enc_cfg_t *c)
{
    int log2 = 0;
    while (2u << log2 <= c->g_threads && c->g_w >> (log2 + 1) >= COLUMN_LEAST)
        log2++;
    return log2;
}

static bool tune(struct lum_vp9 *v)
{
    vpx_codec_ctx_t *c = &v->codec;
    return !vpx_codec_control(c, VP8E_SET_CPUUSED, SPEED) && !vpx_codec_control(c, VP9E_SET_ROW_MT, 1) &&
           !vpx_codec_control(c, VP9E_SET_TILE_COLUMNS, columns_log2(&v->config)) &&
           !vpx_codec_control(c, VP9E_SET_AQ_MODE, 0) &&
           !vpx_codec_control(c, VP9E_SET_TUNE_CONTENT, VP9E_CONTENT_DEFAULT) &&
           !vpx_codec_control(c, VP9E_SET_COLOR_SPACE, VPX_CS_BT_709) &&
           !vpx_codec_control(c, VP9E_SET_COLOR_RANGE, VPX_CR_FULL_RANGE);
}

static void paint_black(vpx_image_t *image)
{
    size_t rows = image->d_h, chroma_rows = (image->d_h + 1) / 2;
    memset(image->planes[VPX_PLANE_Y], 0, rows * (size_t)image->stride[VPX_PLANE_Y]);
    memset(image->planes[VPX_PLANE_U], 128, chroma_rows * (size_t)image->stride[VPX_PLANE_U]);
    memset(image->planes[VPX_PLANE_V], 128, chroma_rows * (size_t)image->stride[VPX_PLANE_V]);
}

struct lum_vp9 *lum_vp9_create(uint32_t w, uint32_t h, uint32_t n_threads)
{
    struct lum_vp9 *v = lum_calloc(1, sizeof *v);
    if (!v)
        return NULL;
    v->has_image = vpx_img_alloc(&v->image, VPX_IMG_FMT_I420, w, h, 32) != NULL;
    v->open = v->has_image && configure(&v->config, w, h, n_threads) &&
              !vpx_codec_enc_init(&v->codec, vpx_codec_vp9_cx(), &v->config, 0);
    if (!v->open || !tune(v)) {
        lum_vp9_destroy(v);
        return NULL;
    }
    paint_black(&v->image);
    return v;
}

void lum_vp9_destroy(struct lum_vp9 *v)
{
    if (!v)
        return;
    if (v->open)
        vpx_codec_destroy(&v->codec);
    if (v->has_image)
        vpx_img_free(&v->image);
    lum_free(v);
}

/* ---- from red, green and blue to luma and chroma: BT.709, all of 0 .. 255, in parts of 65536 ---- */

static uint8_t luma(const uint8_t *p)
{
    return (uint8_t)((13933 * p[0] + 46871 * p[1] + 4732 * p[2] + 32768) >> 16);
}

/* Of the sum of 2^log2_n pixels. */
static uint8_t chroma(const int sum[3], const int factors[3], int log2_n)
{
    int v = factors[0] * sum[0] + factors[1] * sum[1] + factors[2] * sum[2];
    v = (v + ((128 << 16) << log2_n) + (1 << (15 + log2_n))) >> (16 + log2_n);
    return (uint8_t)(v > 255 ? 255 : v);
}

static void put_luma(vpx_image_t *image, const struct lum_vp9_part *part)
{
    const uint8_t *p = part->rgbx;
    for (uint32_t y = 0; y < part->h; y++) {
        uint8_t *row =
            image->planes[VPX_PLANE_Y] + (size_t)(part->y + y) * (size_t)image->stride[VPX_PLANE_Y] + part->x;
        for (uint32_t x = 0; x < part->w; x++, p += 4)
            row[x] = luma(p);
    }
}

/* Adds pixels of a square of 2 x 2, as far as the part has them; how many, as a logarithm. */
static int sum_of(const struct lum_vp9_part *part, uint32_t x, uint32_t y, int ret_sum[3])
{
    const uint32_t nx = part->w - x > 1 ? 2 : 1, ny = part->h - y > 1 ? 2 : 1;
    ret_sum[0] = ret_sum[1] = ret_sum[2] = 0;
    for (uint32_t j = 0; j < ny; j++)
        for (uint32_t i = 0; i < nx; i++)
            for (int c = 0; c < 3; c++)
                ret_sum[c] += part->rgbx[4 * ((size_t)(y + j) * part->w + x + i) + (size_t)c];
    return (nx == 2) + (ny == 2);
}

static void put_chroma(vpx_image_t *image, const struct lum_vp9_part *part)
{
    static const int blue[3] = {-7509, -25259, 32768}, red[3] = {32768, -29763, -3005};
    for (uint32_t y = 0; y < part->h; y += 2) {
        size_t row = (part->y + y) / 2, column = part->x / 2;
        uint8_t *u = image->planes[VPX_PLANE_U] + row * (size_t)image->stride[VPX_PLANE_U] + column;
        uint8_t *v = image->planes[VPX_PLANE_V] + row * (size_t)image->stride[VPX_PLANE_V] + column;
        for (uint32_t x = 0; x < part->w; x += 2) {
            int sum[3], log2_n = sum_of(part, x, y, sum);
            *u++ = chroma(sum, blue, log2_n);
            *v++ = chroma(sum, red, log2_n);
        }
    }
}

void lum_vp9_put(struct lum_vp9 *v, const struct lum_vp9_part *part)
{
    put_luma(&v->image, part);
    put_chroma(&v->image, part);
}

/* ---- frames ---- */

static double between(double v, double least, double most)
{
    return v < least ? least : v > most ? most : v;
}

static double coarser_by(double bytes, double wanted_bytes)
{
    return HALVES * log2(bytes / wanted_bytes);
}

/* Before a frame. */
static bool choose_quantizer(struct lum_vp9 *v, double wanted_bytes, bool key)
{
    const double n_pixels = (double)v->config.g_w * v->config.g_h;
    double q = key ? KEY_AT + coarser_by(KEY_BYTES * n_pixels, KEY_SHARE * wanted_bytes)
                   : v->quantizer + coarser_by(v->wanted_bytes, wanted_bytes);
    v->quantizer = between(q, FINEST, COARSEST);
    v->wanted_bytes = wanted_bytes;
    unsigned rounded = (unsigned)(v->quantizer + 0.5);
    if (v->config.rc_min_quantizer == rounded && v->config.rc_max_quantizer == rounded)
        return true;
    v->config.rc_min_quantizer = v->config.rc_max_quantizer = rounded;
    return !vpx_codec_enc_config_set(&v->codec, &v->config);
}

/* What it took tells how the next should be. */
static void note_bytes(struct lum_vp9 *v, double bytes, bool key)
{
    double q = v->quantizer + coarser_by(bytes, key ? KEY_SHARE * v->wanted_bytes : v->wanted_bytes);
    if (key || 2.0 * bytes > v->wanted_bytes)
        v->moving = q;
    else
        v->moving -= FORGET;
    v->quantizer = between(q > v->moving - STILL_FINER ? q : v->moving - STILL_FINER, FINEST, COARSEST);
    v->moving = between(v->moving, FINEST, COARSEST);
}

/* The one packet that a picture becomes. */
static bool take(struct lum_vp9 *v, struct lum_vp9_frame *ret_frame)
{
    vpx_codec_iter_t at = NULL;
    const vpx_codec_cx_pkt_t *p;
    int quantizer = 0;
    while ((p = vpx_codec_get_cx_data(&v->codec, &at)))
        if (p->kind == VPX_CODEC_CX_FRAME_PKT) {
            if (ret_frame->n > 0 || vpx_codec_control(&v->codec, VP8E_GET_LAST_QUANTIZER_64, &quantizer))
                return false;
            *ret_frame = (struct lum_vp9_frame){.bytes = p->data.frame.buf,
                                                .n = p->data.frame.sz,
                                                .key = (p->data.frame.flags & VPX_FRAME_IS_KEY) != 0,
                                                .quality = (uint8_t)(100 - quantizer * 100 / 63)};
        }
    return ret_frame->n > 0;
}

struct lum_vp9_frame lum_vp9_encode(struct lum_vp9 *v, uint32_t wanted_bytes, bool key)
{
    struct lum_vp9_frame frame = {0};
    key = key || v->n_frames == 0;
    v->broken = v->broken || !choose_quantizer(v, wanted_bytes, key) ||
                vpx_codec_encode(&v->codec, &v->image, v->n_frames, 1, key ? VPX_EFLAG_FORCE_KF : 0, VPX_DL_REALTIME) ||
                !take(v, &frame);
    v->n_frames++;
    if (v->broken)
        return (struct lum_vp9_frame){0};
    note_bytes(v, (double)frame.n, key);
    return frame;
}

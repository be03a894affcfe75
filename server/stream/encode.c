#include "server/stream/encode.h"

#include <stdlib.h>
#include <string.h>

#include <turbojpeg.h>
#include <zlib.h>

#include "server/stream/png.h"
#include "server/stream/video.h"
#include "server/stream/webp.h"

#define SIDE LUM_LIMIT_TILE_SIDE
#define TILE_PIXELS ((size_t)SIDE * SIDE)

enum {
    CHROMA_FULL_FROM = 90, /* JPEG quality from which colour keeps full resolution */
    PNG_LEVEL = 1,         /* a noisy picture gains 3 % from level 6, for four times the time */
    DEFLATE_LEVEL = 1,
    EXACT = 255, /* as a quality */
};

/* One worker's memory: pixels of a tile, and room for its encoded form. */
struct scratch {
    tjhandle jpeg;
    uint8_t *pixels; /* RGBA8 or RGBA half */
    uint8_t *rgb;    /* for PNG */
    uint8_t *out;
    size_t out_size;
    struct lum_coding_cost cost;
};

struct lum_encoder {
    struct lum_pool *pool;
    struct scratch *workers;
    uint32_t n_workers;
    struct lum_video_room videos;
};

struct encode_run {
    struct lum_encoder *encoder;
    const struct lum_picture *picture;
    struct lum_tile_state *states;
    struct lum_tile_state *next; /* becomes states when all tiles succeeded */
    struct lum_encoded_tile **tiles;
    bool force;
    _Atomic int failed; /* enum lum_status */
};

uint32_t lum_tile_count(uint32_t w, uint32_t h)
{
    return ((w + SIDE - 1) / SIDE) * ((h + SIDE - 1) / SIDE);
}

uint16_t lum_half_from_float(float f)
{
    uint32_t bits;
    memcpy(&bits, &f, sizeof bits);
    uint32_t sign = bits >> 16 & 0x8000u, magnitude = bits & 0x7fffffffu;
    if (magnitude > 0x7f800000u)
        return 0; /* NaN */
    if (magnitude >= 0x477ff000u)
        return (uint16_t)(sign | 0x7bffu); /* would round to infinity */
    uint32_t shift = 13, value;
    if (magnitude >= 0x38800000u) {
        value = magnitude - 0x38000000u; /* rebias the exponent from 127 to 15 */
    } else {
        uint32_t exponent = magnitude >> 23;
        if (exponent < 102)
            return (uint16_t)sign; /* below half the smallest subnormal */
        value = (magnitude & 0x7fffffu) | 0x800000u;
        shift = 126 - exponent;
    }
    uint32_t rest = value & ((1u << shift) - 1), half_way = 1u << (shift - 1);
    value >>= shift;
    value += rest > half_way || (rest == half_way && (value & 1));
    return (uint16_t)(sign | value);
}

/* 64-bit multiply-and-fold over 8-byte words: the chance that two different tiles agree is 2^-64. n is a multiple of 4.
 */
static uint64_t hash_bytes(const uint8_t *bytes, size_t n)
{
    uint64_t h = 0x9e3779b97f4a7c15ull ^ n;
    for (size_t i = 0; i < n; i += 8) {
        uint64_t word = 0;
        memcpy(&word, bytes + i, n - i < 8 ? n - i : 8);
        h = (h ^ word) * 0xd6e8feb86659fd93ull;
        h ^= h >> 32;
    }
    return h;
}

static void resolve_half(const struct lum_film *film, const struct lum_frame_header *t, uint16_t *ret_rgba)
{
    for (uint32_t y = 0; y < t->h; y++)
        for (uint32_t x = 0; x < t->w; x++) {
            struct lum_rgb c = lum_film_mean(film, t->x + x, t->y + y);
            *ret_rgba++ = lum_half_from_float(c.r);
            *ret_rgba++ = lum_half_from_float(c.g);
            *ret_rgba++ = lum_half_from_float(c.b);
            *ret_rgba++ = 0x3c00u; /* 1.0 */
        }
}

/* Averages 2^d x 2^d blocks in place, display-referred, as an image viewer would. */
static void downscale_rgba8(uint8_t *pixels, uint32_t *w, uint32_t *h, uint32_t d)
{
    uint32_t step = 1u << d, small_w = (*w + step - 1) >> d, small_h = (*h + step - 1) >> d;
    for (uint32_t y = 0; y < small_h; y++)
        for (uint32_t x = 0; x < small_w; x++)
            for (uint32_t c = 0; c < 4; c++) {
                uint32_t sum = 0, n = 0;
                for (uint32_t j = y * step; j < (y + 1) * step && j < *h; j++)
                    for (uint32_t i = x * step; i < (x + 1) * step && i < *w; i++, n++)
                        sum += pixels[((size_t)j * *w + i) * 4 + c];
                pixels[((size_t)y * small_w + x) * 4 + c] = (uint8_t)((sum + n / 2) / n);
            }
    *w = small_w;
    *h = small_h;
}

static struct lum_encoded_tile *blob_from(const void *bytes, size_t n)
{
    struct lum_encoded_tile *blob = lum_encoded_tile_create((uint32_t)n);
    if (blob)
        memcpy(blob->bytes, bytes, n);
    return blob;
}

static struct lum_encoded_tile *encode_jpeg(struct scratch *s, uint32_t w, uint32_t h, int quality)
{
    int chroma = quality >= CHROMA_FULL_FROM ? TJSAMP_444 : TJSAMP_420;
    unsigned char *out = s->out;
    unsigned long n = s->out_size;
    if (tjCompress2(s->jpeg, s->pixels, (int)w, 0, (int)h, TJPF_RGBX, &out, &n, chroma, quality,
                    TJFLAG_NOREALLOC | TJFLAG_FASTDCT) != 0)
        return NULL;
    return blob_from(out, n);
}

static struct lum_encoded_tile *encode_png(struct scratch *s, uint32_t w, uint32_t h)
{
    size_t n_pixels = (size_t)w * h, n;
    for (size_t i = 0; i < n_pixels; i++)
        memcpy(s->rgb + 3 * i, s->pixels + 4 * i, 3);
    uint8_t *bytes;
    if (lum_png_encode(&(struct lum_png){s->rgb, w, h, PNG_LEVEL}, &bytes, &n, NULL))
        return NULL;
    struct lum_encoded_tile *blob = blob_from(bytes, n);
    free(bytes);
    return blob;
}

static struct lum_encoded_tile *encode_deflate(struct scratch *s, size_t n_bytes)
{
    uLongf n = s->out_size;
    if (compress2(s->out, &n, s->pixels, n_bytes, DEFLATE_LEVEL) != Z_OK)
        return NULL;
    return blob_from(s->out, n);
}

static struct lum_encoded_tile *encode_webp(struct scratch *s, uint32_t w, uint32_t h, const struct lum_frame_header *t)
{
    const struct lum_webp image = {s->pixels, w, h, lum_coding_webp_quality(t->quality),
                                   (t->flags & LUM_FRAME_LOSSLESS) != 0};
    size_t n = lum_webp_encode(&image, s->out, s->out_size);
    return n > 0 ? blob_from(s->out, n) : NULL;
}

static struct lum_encoded_tile *encode_pixels(struct scratch *s, const struct lum_frame_header *t, uint32_t w,
                                              uint32_t h)
{
    switch (t->codec) {
    case LUM_CODEC_JPEG:
        return encode_jpeg(s, w, h, t->quality);
    case LUM_CODEC_PNG:
        return encode_png(s, w, h);
    case LUM_CODEC_WEBP:
        return encode_webp(s, w, h, t);
    case LUM_CODEC_HALF_DEFLATE:
        return encode_deflate(s, (size_t)w * h * 8);
    default:
        return blob_from(s->pixels, (size_t)w * h * 4);
    }
}

static uint8_t quality_of(const struct lum_frame_header *t)
{
    bool lossy = t->codec == LUM_CODEC_JPEG || (t->codec == LUM_CODEC_WEBP && !(t->flags & LUM_FRAME_LOSSLESS));
    return lossy ? t->quality : EXACT;
}

/* Does tile i show these pixels already, as well as t asks? */
static bool up_to_date(const struct lum_tile_state *was, const struct lum_frame_header *t, uint64_t hash)
{
    return was->shown && was->hash == hash && was->downscale == t->downscale && was->quality >= quality_of(t);
}

static struct lum_frame_header tile_header(const struct lum_picture *p, uint32_t i)
{
    struct lum_frame_header t = p->header;
    uint32_t per_row = (p->film->w + SIDE - 1) / SIDE, x = i % per_row * SIDE, y = i / per_row * SIDE;
    t.kind = t.codec == LUM_CODEC_HALF_DEFLATE ? LUM_FRAME_HDR_TILE : LUM_FRAME_TILE;
    t.full_w = (uint16_t)p->film->w;
    t.full_h = (uint16_t)p->film->h;
    t.x = (uint16_t)x;
    t.y = (uint16_t)y;
    t.w = (uint16_t)(p->film->w - x < SIDE ? p->film->w - x : SIDE);
    t.h = (uint16_t)(p->film->h - y < SIDE ? p->film->h - y : SIDE);
    if (t.codec == LUM_CODEC_HALF_DEFLATE)
        t.downscale = 0;
    return t;
}

/* As it is shown, 4 * w * h bytes. */
static void draw_tile(const struct lum_picture *p, const struct lum_frame_header *t, uint8_t *ret_rgbx)
{
    lum_film_resolve(p->film, t->x, t->y, t->w, t->h, &p->display, ret_rgbx, (size_t)t->w * 4);
    lum_overlay_paint(p->overlay, t, ret_rgbx);
}

static void encode_tile(void *ctx, uint32_t i, uint32_t worker)
{
    struct encode_run *run = ctx;
    struct scratch *s = &run->encoder->workers[worker];
    const struct lum_picture *p = run->picture;
    struct lum_frame_header t = tile_header(p, i);
    uint32_t w = t.w, h = t.h;
    if (t.codec == LUM_CODEC_HALF_DEFLATE) {
        resolve_half(p->film, &t, (uint16_t *)(void *)s->pixels);
    } else {
        draw_tile(p, &t, s->pixels);
        if (t.downscale)
            downscale_rgba8(s->pixels, &w, &h, t.downscale);
    }
    uint64_t hash = hash_bytes(s->pixels, (size_t)w * h * (t.codec == LUM_CODEC_HALF_DEFLATE ? 8 : 4));
    if (!run->force && up_to_date(&run->states[i], &t, hash))
        return;
    int64_t start_ns = lum_cpu_clock_ns();
    struct lum_encoded_tile *blob = encode_pixels(s, &t, w, h);
    if (!blob) {
        atomic_store_explicit(&run->failed, LUM_ERR_NOMEM, memory_order_relaxed);
        return;
    }
    blob->header = t;
    blob->header.payload_len = blob->n_bytes;
    run->tiles[i] = blob;
    run->next[i] = (struct lum_tile_state){hash, quality_of(&t), t.downscale, true};
    s->cost.n_bytes += blob->n_bytes + LUM_FRAME_HEADER_BYTES;
    s->cost.n_pixels += (uint64_t)w * h;
    s->cost.cpu_ns += (uint64_t)(lum_cpu_clock_ns() - start_ns);
}

static void drop_tiles(struct lum_encoded_tile **tiles, uint32_t n)
{
    for (uint32_t i = 0; i < n; i++)
        if (tiles[i]) {
            lum_encoded_tile_unref(tiles[i]);
            tiles[i] = NULL;
        }
}

enum lum_status lum_encoder_run(struct lum_encoder *e, const struct lum_picture *picture, struct lum_tile_state *states,
                                struct lum_encoded_tile **ret_tiles, struct lum_error *err)
{
    uint32_t n = lum_tile_count(picture->film->w, picture->film->h), n_new = 0;
    memset(ret_tiles, 0, n * sizeof *ret_tiles);
    struct lum_tile_state *next = lum_calloc(n, sizeof *next);
    if (!next)
        return lum_fail(err, LUM_ERR_NOMEM, "", "no memory to encode %u tiles", n);
    memcpy(next, states, n * sizeof *next);
    for (uint32_t i = 0; i < e->n_workers; i++)
        e->workers[i].cost = (struct lum_coding_cost){0};
    struct encode_run run = {e, picture, states, next, ret_tiles, false, LUM_OK};
    lum_pool_run(e->pool, n, encode_tile, &run, NULL);
    for (uint32_t i = 0; i < n; i++)
        n_new += ret_tiles[i] != NULL;
    if (n_new == 0 && n > 0 && run.failed == LUM_OK) {
        run.force = true;
        lum_pool_run(e->pool, 1, encode_tile, &run, NULL);
        for (uint32_t i = 0; i < e->n_workers; i++) /* that says nothing of a frame */
            e->workers[i].cost = (struct lum_coding_cost){0};
    }
    enum lum_status st = (enum lum_status)run.failed;
    if (st) {
        drop_tiles(ret_tiles, n);
        st = lum_fail(err, st, "", "a tile could not be encoded");
    } else {
        memcpy(states, next, n * sizeof *next);
    }
    lum_free(next);
    return st;
}

struct draw_run {
    struct lum_encoder *encoder;
    const struct lum_picture *picture;
    struct lum_vp9 *into;
};

static void draw_into(void *ctx, uint32_t i, uint32_t worker)
{
    struct draw_run *run = ctx;
    uint8_t *pixels = run->encoder->workers[worker].pixels;
    const struct lum_frame_header t = tile_header(run->picture, i);
    draw_tile(run->picture, &t, pixels);
    lum_vp9_put(run->into, &(struct lum_vp9_part){pixels, t.x, t.y, t.w, t.h});
}
_Static_assert(SIDE % 2 == 0, "parts of a video begin at even pixels");

void lum_encoder_draw(struct lum_encoder *e, const struct lum_picture *picture, struct lum_vp9 *into)
{
    struct draw_run run = {e, picture, into};
    lum_pool_run(e->pool, lum_tile_count(picture->film->w, picture->film->h), draw_into, &run, NULL);
}

uint32_t lum_encoder_threads(const struct lum_encoder *e)
{
    return e->n_workers;
}

struct lum_video_room *lum_encoder_videos(struct lum_encoder *e)
{
    return &e->videos;
}

struct lum_coding_cost lum_encoder_cost(const struct lum_encoder *e)
{
    struct lum_coding_cost sum = {0};
    for (uint32_t i = 0; i < e->n_workers; i++) {
        sum.n_bytes += e->workers[i].cost.n_bytes;
        sum.n_pixels += e->workers[i].cost.n_pixels;
        sum.cpu_ns += e->workers[i].cost.cpu_ns;
    }
    return sum;
}

static bool scratch_init(struct scratch *s)
{
    size_t jpeg = tjBufSize(SIDE, SIDE, TJSAMP_444), deflate = compressBound(TILE_PIXELS * 8);
    s->out_size = jpeg > deflate ? jpeg : deflate;
    s->pixels = lum_calloc(TILE_PIXELS, 8);
    s->rgb = lum_calloc(TILE_PIXELS, 3);
    s->out = lum_calloc(s->out_size, 1);
    s->jpeg = tjInitCompress();
    return s->pixels && s->rgb && s->out && s->jpeg;
}

enum lum_status lum_encoder_create(struct lum_pool *pool, struct lum_encoder **ret_encoder, struct lum_error *err)
{
    struct lum_encoder *e = lum_calloc(1, sizeof *e);
    if (!e)
        goto fail;
    e->pool = pool;
    e->workers = lum_calloc(lum_pool_size(pool), sizeof *e->workers);
    if (!e->workers)
        goto fail;
    e->n_workers = lum_pool_size(pool);
    for (uint32_t i = 0; i < e->n_workers; i++)
        if (!scratch_init(&e->workers[i]))
            goto fail;
    *ret_encoder = e;
    return LUM_OK;
fail:
    lum_encoder_destroy(e);
    return lum_fail(err, LUM_ERR_NOMEM, "", "no memory for the encoder");
}

void lum_encoder_destroy(struct lum_encoder *e)
{
    if (!e)
        return;
    for (uint32_t i = 0; i < e->n_workers; i++) {
        struct scratch *s = &e->workers[i];
        if (s->jpeg)
            tjDestroy(s->jpeg);
        lum_free(s->out);
        lum_free(s->rgb);
        lum_free(s->pixels);
    }
    lum_free(e->workers);
    lum_free(e);
}

/* What tiles cost as JPEG, WebP and PNG: bytes, time of one thread, and how far they are off from what they were made
 * of; first frames of every place, which is what a drag sends. */
#include <math.h>
#include <string.h>

#include <spng.h>
#include <turbojpeg.h>
#ifdef LUM_BENCH_WEBP
#include <webp/decode.h>
#endif

#include "core/film/film.h"
#include "core/metric/flip.h"
#include "core/metric/metric.h"
#include "server/stream/encode.h"
#include "server/stream/webp.h"
#include "tests/bench/places.h"
#include "tests/bench/table.h"

#define METHODS "live,path"

struct coding {
    const char *name;
    uint8_t codec, quality;
    uint32_t flags;
};
static const struct coding codings[] = {
    {"jpeg", LUM_CODEC_JPEG, 20, 0},
    {"jpeg", LUM_CODEC_JPEG, 50, 0},
    {"jpeg", LUM_CODEC_JPEG, 70, 0},
    {"jpeg", LUM_CODEC_JPEG, 85, 0},
    {"jpeg", LUM_CODEC_JPEG, 90, 0},
    {"jpeg", LUM_CODEC_JPEG, 95, 0},
    {"webp", LUM_CODEC_WEBP, 20, 0},
    {"webp", LUM_CODEC_WEBP, 50, 0},
    {"webp", LUM_CODEC_WEBP, 70, 0},
    {"webp", LUM_CODEC_WEBP, 85, 0},
    {"webp", LUM_CODEC_WEBP, 90, 0},
    {"png", LUM_CODEC_PNG, 100, LUM_FRAME_LOSSLESS},
    {"webp exact", LUM_CODEC_WEBP, 100, LUM_FRAME_LOSSLESS},
};

struct rig {
    struct lum_bench_stand at;
    struct lum_encoder *encoder;
    struct lum_encoded_tile **tiles;
    struct lum_tile_state *states;
    float *planes[6]; /* as sent and as made: R, G, B each, linear */
    uint32_t n_tiles;
};

static const struct lum_bench_column columns[] = {
    {"scene", "scene", LUM_BENCH_TEXT},
    {"method", "method", LUM_BENCH_TEXT},
    {"coding", "coding", LUM_BENCH_TEXT},
    {"quality", "quality", 0},
    {"bytes_pixel", "bytes/pixel", 4},
    {"ns_pixel", "ns/pixel", 1},
    {"rms", "rms of 255", 2},
    {"smape", "SMAPE", 4},
    {"flip", "FLIP", 4},
};

static bool open_rig(struct rig *rig)
{
    struct lum_error err = {0};
    if (!lum_bench_stand_open(&rig->at, (const uint32_t[]){600, 400}, (const uint32_t[]){160, 96}))
        return false;
    const struct lum_view_settings *s = &rig->at.settings;
    rig->n_tiles = lum_tile_count(s->w, s->h);
    rig->tiles = lum_calloc(rig->n_tiles, sizeof *rig->tiles);
    rig->states = lum_calloc(rig->n_tiles, sizeof *rig->states);
    bool ok = rig->tiles && rig->states;
    for (int i = 0; i < 6; i++) {
        rig->planes[i] = lum_calloc((size_t)s->w * s->h, sizeof(float));
        ok = ok && rig->planes[i];
    }
    return ok && lum_encoder_create(rig->at.world.pool, &rig->encoder, &err) == LUM_OK
               ? true
               : lum_bench_failed("out of memory");
}

static bool decode(const struct lum_encoded_tile *t, uint8_t *ret_rgba)
{
    const struct lum_frame_header *h = &t->header;
    const size_t size = (size_t)4 * h->w * h->h;
    bool ok = false;
    if (h->codec == LUM_CODEC_JPEG) {
        tjhandle j = tjInitDecompress();
        ok = tjDecompress2(j, t->bytes, t->n_bytes, ret_rgba, h->w, 0, h->h, TJPF_RGBA, 0) == 0;
        tjDestroy(j);
    } else if (h->codec == LUM_CODEC_PNG) {
        spng_ctx *ctx = spng_ctx_new(0);
        ok = spng_set_png_buffer(ctx, t->bytes, t->n_bytes) == 0 &&
             spng_decode_image(ctx, ret_rgba, size, SPNG_FMT_RGBA8, 0) == 0;
        spng_ctx_free(ctx);
    }
#ifdef LUM_BENCH_WEBP
    if (h->codec == LUM_CODEC_WEBP)
        ok = WebPDecodeRGBAInto(t->bytes, t->n_bytes, ret_rgba, size, h->w * 4) != NULL;
#endif
    return ok || lum_bench_failed("a tile cannot be decoded");
}

static float linear(uint8_t v)
{
    float x = (float)v / 255.0f;
    return x <= 0.04045f ? x / 12.92f : powf((x + 0.055f) / 1.055f, 2.4f);
}

static void put(float *const planes[3], uint32_t w, const struct lum_frame_header *h, const uint8_t *rgba)
{
    for (uint32_t y = 0; y < h->h; y++)
        for (uint32_t x = 0; x < h->w; x++, rgba += 4)
            for (int c = 0; c < 3; c++)
                planes[c][(size_t)(h->y + y) * w + h->x + x] = linear(rgba[c]);
}

/* Both pictures into planes; the square error of the values. */
static bool unpack(struct rig *rig, const struct lum_film *film, const struct lum_display *display, double *ret_squares)
{
    static uint8_t got[4 * LUM_LIMIT_TILE_SIDE * LUM_LIMIT_TILE_SIDE], made[sizeof got];
    *ret_squares = 0.0;
    for (uint32_t i = 0; i < rig->n_tiles; i++) {
        const struct lum_frame_header *h = &rig->tiles[i]->header;
        lum_film_resolve(film, h->x, h->y, h->w, h->h, display, made, (size_t)h->w * 4);
        if (!decode(rig->tiles[i], got))
            return false;
        for (size_t k = 0; k < (size_t)4 * h->w * h->h; k++)
            *ret_squares += k % 4 == 3 ? 0.0 : (got[k] - made[k]) * (double)(got[k] - made[k]);
        put(rig->planes, film->w, h, got);
        put(rig->planes + 3, film->w, h, made);
    }
    return true;
}

static void drop_tiles(struct rig *rig)
{
    for (uint32_t i = 0; i < rig->n_tiles; i++) {
        lum_encoded_tile_unref(rig->tiles[i]);
        rig->tiles[i] = NULL;
    }
}

static bool measure_coding(struct rig *rig, const struct lum_film *film, const struct coding *c, const char *method,
                           struct lum_bench_table *table)
{
    const size_t n = (size_t)film->w * film->h;
    struct lum_error err = {0};
    struct lum_picture picture = {.film = film,
                                  .display = {.ev100 = lum_exposure_auto(film), .tone = LUM_TONE_AGX},
                                  .header = {.codec = c->codec, .quality = c->quality, .flags = c->flags}};
    struct lum_flip_input flip = {film->w, film->h, {0}, {0}, LUM_FLIP_PIXELS_PER_DEGREE};
    struct lum_flip_result seen;
    double squares, smape = 0.0;
    memset(rig->states, 0, rig->n_tiles * sizeof *rig->states);
    bool ok = lum_encoder_run(rig->encoder, &picture, rig->states, rig->tiles, &err) == LUM_OK &&
              unpack(rig, film, &picture.display, &squares);
    drop_tiles(rig);
    if (!ok)
        return lum_bench_failed(err.text);
    for (int k = 0; k < 3; k++) {
        flip.x[k] = rig->planes[k];
        flip.r[k] = rig->planes[3 + k];
        struct lum_metric_result r =
            lum_metric_compare(&(struct lum_metric_input){flip.x[k], flip.r[k], n, LUM_METRIC_EPSILON});
        smape += r.smape / 3.0;
    }
    if (lum_flip_compare(&flip, NULL, &seen, &err))
        return lum_bench_failed(err.text);
    const struct lum_coding_cost cost = lum_encoder_cost(rig->encoder);
    LUM_BENCH_TEXTS(table, rig->at.place->scene, method, c->name);
    LUM_BENCH_NUMBERS(table, (double)c->quality, (double)cost.n_bytes / (double)n, (double)cost.cpu_ns / (double)n,
                      sqrt(squares / (3.0 * (double)n)), smape, seen.mean);
    return true;
}

static bool measure_method(struct rig *rig, const struct lum_method *method, struct lum_bench_table *table)
{
    struct lum_error err = {0};
    struct lum_view *view = NULL;
    struct lum_pass_stats stats;
    rig->at.settings.method = method;
    bool ok = (lum_view_create(rig->at.world.pool, &view, &err) == LUM_OK &&
               lum_view_pass(view, rig->at.world.snapshot, &rig->at.settings, NULL, &stats, &err) == LUM_OK) ||
              lum_bench_failed(err.text);
    for (size_t i = 0; ok && i < LUM_ARRAY_LEN(codings); i++)
        if (codings[i].codec != LUM_CODEC_WEBP || lum_webp_available())
            ok = measure_coding(rig, lum_view_film(view), &codings[i], method->name, table);
    lum_view_destroy(view);
    return ok;
}

static bool measure_place(void *of, void *table)
{
    struct rig *rig = of;
    lum_bench_progress("codecs: %s", rig->at.place->scene);
    if (!open_rig(rig)) {
        printf("skipped: %s\n", rig->at.place->scene);
        return true;
    }
    for (size_t m = 0; m < rig->at.n_methods; m++)
        if (!measure_method(rig, rig->at.methods[m], table))
            return false;
    return true;
}

static void close_rig(void *of)
{
    struct rig *rig = of;
    for (int i = 0; i < 6; i++)
        lum_free(rig->planes[i]);
    lum_free(rig->tiles);
    lum_free(rig->states);
    lum_encoder_destroy(rig->encoder);
    lum_bench_stand_close(&rig->at);
}

int lum_bench_codecs(const struct lum_bench_options *options)
{
    const struct lum_bench_tour tour = {METHODS, sizeof(struct rig), measure_place, close_rig};
    struct lum_bench_table table = LUM_BENCH_TABLE(columns);
    lum_thread_init_fp();
    bool ok = lum_bench_go(&tour, options, &table);
    ok = lum_bench_table_finish(&table, options, "codecs") && ok;
    return ok ? 0 : 1;
}

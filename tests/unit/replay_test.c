/* lumend-replay without a server: percentiles, what waits for which frame, pictures from tiles. */
#define _GNU_SOURCE
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include <cmocka.h>
#include <spng.h>
#include <turbojpeg.h>

#include "clients/replay/canvas.h"
#include "clients/replay/latency.h"

static void nearest_rank(void **state)
{
    struct samples s = {0};
    (void)state;
    assert_true(samples_percentile(&s, 50) == 0.0);
    for (int i = 100; i >= 1; i--)
        samples_add(&s, i);
    /* of 1..100 the p-th percentile is p itself */
    for (int p = 1; p <= 100; p++)
        assert_true(samples_percentile(&s, p) == (double)p);
    assert_true(samples_percentile(&s, 0) == 1.0 && samples_percentile(&s, 99.5) == 100.0);
    samples_finish(&s);
    samples_add(&s, 7);
    assert_true(samples_percentile(&s, 1) == 7.0 && samples_percentile(&s, 99) == 7.0);
    samples_finish(&s);
}

static void first_frame_that_shows_it(void **state)
{
    static struct latency l;
    (void)state;
    memset(&l, 0, sizeof l);
    assert_true(latency_sent(&l, 1, 0, 1000));
    assert_true(latency_sent(&l, 2, 0, 2000));
    latency_frame(&l, 4, 3000); /* nothing is known yet */
    assert_int_equal(l.n_waiting, 2);
    latency_marked(&l, 1, 5);
    latency_frame(&l, 4, 4000); /* too old */
    assert_int_equal(l.n_waiting, 2);
    latency_frame(&l, 5, 6000);
    assert_int_equal(l.samples.n, 1);
    assert_true(l.samples.us[0] == 5.0);
    latency_frame(&l, 6, 9000);
    latency_frame(&l, 6, 9500);
    latency_marked(&l, 2, 6); /* the reply came after its frame: the first one counts */
    assert_int_equal(l.samples.n, 2);
    assert_true(l.samples.us[1] == 7.0);
    assert_int_equal(l.n_waiting, 0);
    assert_true(latency_sent(&l, 3, 0, 9600)); /* older frames that are new enough do not count for later edits */
    latency_marked(&l, 3, 6);
    assert_int_equal(l.n_waiting, 1);
    latency_refused(&l, 3);
    latency_refused(&l, 99);
    assert_int_equal(l.n_waiting, 0);
    for (unsigned i = 0; i < LATENCY_WAITING_MAX; i++)
        assert_true(latency_sent(&l, 100 + i, 10, 10000));
    assert_false(latency_sent(&l, 5000, 10, 10000));
    for (unsigned i = 0; i < 3 * LATENCY_FRAMES_KEPT; i++)
        latency_frame(&l, 9, 10000 + i);
    latency_frame(&l, 10, 12000);
    assert_int_equal(l.n_waiting, 0);
    samples_finish(&l.samples);
}

/* A tile of one colour in the codec. */
static uint8_t *encode_tile(struct lum_frame_header *h, const uint8_t rgb[3])
{
    uint32_t w = h->w >> h->downscale, high = h->h >> h->downscale;
    uint8_t *pixels = malloc((size_t)w * high * 4), *bytes = NULL;
    for (size_t i = 0; i < (size_t)w * high; i++) {
        memcpy(pixels + 4 * i, rgb, 3);
        pixels[4 * i + 3] = 255;
    }
    if (h->codec == LUM_CODEC_RGBA8) {
        h->payload_len = 4 * w * high;
        return pixels;
    }
    if (h->codec == LUM_CODEC_JPEG) {
        unsigned long n = 0;
        tjhandle tj = tjInitCompress();
        tjCompress2(tj, pixels, (int)w, 0, (int)high, TJPF_RGBA, &bytes, &n, TJSAMP_444, 95, 0);
        tjDestroy(tj);
        h->payload_len = (uint32_t)n;
    } else {
        size_t n = 0;
        int error = 0;
        spng_ctx *ctx = spng_ctx_new(SPNG_CTX_ENCODER);
        struct spng_ihdr ihdr = {
            .width = w, .height = high, .bit_depth = 8, .color_type = SPNG_COLOR_TYPE_TRUECOLOR_ALPHA};
        spng_set_option(ctx, SPNG_ENCODE_TO_BUFFER, 1);
        spng_set_ihdr(ctx, &ihdr);
        spng_encode_image(ctx, pixels, (size_t)4 * w * high, SPNG_FMT_PNG, SPNG_ENCODE_FINALIZE);
        bytes = spng_get_png_buffer(ctx, &n, &error);
        spng_ctx_free(ctx);
        h->payload_len = (uint32_t)n;
    }
    free(pixels);
    return bytes;
}

static void free_tile(const struct lum_frame_header *h, uint8_t *bytes)
{
    if (h->codec == LUM_CODEC_JPEG)
        tjFree(bytes);
    else
        free(bytes);
}

static void tiles_make_a_picture(void **state)
{
    static const uint8_t codecs[] = {LUM_CODEC_RGBA8, LUM_CODEC_JPEG, LUM_CODEC_PNG};
    (void)state;
    for (size_t k = 0; k < 3; k++)
        for (uint8_t downscale = 0; downscale <= 2; downscale++) {
            struct canvas c;
            const char *reason;
            assert_true(canvas_init(&c, 40, 24, true));
            for (uint16_t ty = 0; ty < 24; ty = (uint16_t)(ty + 8))
                for (uint16_t tx = 0; tx < 40; tx = (uint16_t)(tx + 16)) {
                    struct lum_frame_header h = {.kind = LUM_FRAME_TILE,
                                                 .x = tx,
                                                 .y = ty,
                                                 .full_w = 40,
                                                 .full_h = 24,
                                                 .codec = codecs[k],
                                                 .downscale = downscale,
                                                 .h = 8};
                    h.w = tx == 32 ? 8 : 16;
                    const uint8_t rgb[3] = {(uint8_t)(50 + tx * 4), (uint8_t)(60 + ty * 6), 128};
                    uint8_t *bytes = encode_tile(&h, rgb);
                    if (!canvas_draw(&c, &h, bytes, &reason))
                        fail_msg("codec %u: %s", codecs[k], reason);
                    free_tile(&h, bytes);
                }
            for (int y = 0; y < 24; y++)
                for (int x = 0; x < 40; x++) {
                    const uint8_t *p = c.rgb + 3 * (y * 40 + x);
                    int dr = p[0] - (50 + x / 16 * 16 * 4), dg = p[1] - (60 + y / 8 * 8 * 6);
                    /* JPEG of one colour: the rounding of YCbCr and of one quantisation step of its DC term at quality
                     * 95 */
                    if (abs(dr) > 3 || abs(dg) > 3 || abs(p[2] - 128) > 3)
                        fail_msg("codec %u, downscale %u: pixel %d,%d is %d %d %d", codecs[k], downscale, x, y, p[0],
                                 p[1], p[2]);
                }
            canvas_finish(&c);
        }
}

static void tiles_that_do_not_fit(void **state)
{
    static const struct {
        uint16_t x, y, w, h, full_w;
        uint32_t n;
    } bad[] = {{33, 0, 8, 8, 40, 256}, {0, 17, 8, 8, 40, 256}, {0, 0, 0, 8, 40, 0},
               {0, 0, 8, 8, 41, 256},  {0, 0, 8, 8, 40, 255},  {65535, 0, 8, 8, 40, 256}};
    uint8_t bytes[512] = {0};
    struct canvas c;
    const char *reason;
    (void)state;
    assert_true(canvas_init(&c, 40, 24, true));
    for (size_t i = 0; i < sizeof bad / sizeof bad[0]; i++) {
        struct lum_frame_header h = {.kind = LUM_FRAME_TILE,
                                     .x = bad[i].x,
                                     .y = bad[i].y,
                                     .w = bad[i].w,
                                     .h = bad[i].h,
                                     .full_w = bad[i].full_w,
                                     .full_h = 24,
                                     .payload_len = bad[i].n};
        assert_false(canvas_draw(&c, &h, bytes, &reason));
    }
    struct lum_frame_header h = {
        .kind = LUM_FRAME_TILE, .w = 8, .h = 8, .full_w = 40, .full_h = 24, .payload_len = 512};
    for (h.codec = LUM_CODEC_JPEG; h.codec < 9; h.codec++)
        assert_false(canvas_draw(&c, &h, bytes, &reason));
    canvas_finish(&c);
}

static void pictures_are_written(void **state)
{
    char path[] = "/tmp/lumend-replay-test-XXXXXX";
    uint8_t *back;
    size_t size;
    struct canvas c;
    (void)state;
    int fd = mkstemp(path);
    assert_true(fd >= 0);
    close(fd);
    assert_true(canvas_init(&c, 5, 3, true));
    for (int i = 0; i < 45; i++)
        c.rgb[i] = (uint8_t)(i * 5);
    assert_true(canvas_write_png(&c, path));
    FILE *f = fopen(path, "rb");
    spng_ctx *ctx = spng_ctx_new(0);
    assert_int_equal(spng_set_png_file(ctx, f), 0);
    assert_int_equal(spng_decoded_image_size(ctx, SPNG_FMT_RGB8, &size), 0);
    assert_int_equal(size, 45);
    back = malloc(size);
    assert_int_equal(spng_decode_image(ctx, back, size, SPNG_FMT_RGB8, 0), 0);
    assert_memory_equal(back, c.rgb, 45);
    free(back);
    spng_ctx_free(ctx);
    fclose(f);
    assert_false(canvas_write_png(&c, "/tmp/no-such-folder-of-lumend/x.png"));
    unlink(path);
    canvas_finish(&c);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(nearest_rank),         cmocka_unit_test(first_frame_that_shows_it),
        cmocka_unit_test(tiles_make_a_picture), cmocka_unit_test(tiles_that_do_not_fit),
        cmocka_unit_test(pictures_are_written),
    };
    return cmocka_run_group_tests_name("replay", tests, NULL, NULL);
}

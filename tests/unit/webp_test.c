/* WebP tiles: exact where they say so, else no further off than JPEG of the same quality; bounded in size. */
#include <string.h>

#include <turbojpeg.h>
#include <webp/decode.h>

#include "server/stream/webp.h"
#include "tests/support/encoder_bed.h"

enum { SIDE = 128, ROOM = 4 * SIDE * SIDE + 4096 };

static uint8_t out[ROOM];

static uint32_t next_random(uint32_t *state)
{
    *state = *state * 1664525u + 1013904223u;
    return *state >> 8;
}

/* Noise that no compression makes smaller; smooth; of two colours. The fourth byte is anything. */
static void fill(uint8_t *rgbx, uint32_t w, uint32_t h, int kind)
{
    uint32_t random = 5;
    for (uint32_t y = 0; y < h; y++)
        for (uint32_t x = 0; x < w; x++, rgbx += 4) {
            uint32_t r = next_random(&random);
            for (int k = 0; k < 3; k++)
                rgbx[k] = (uint8_t)(kind == 0   ? r >> 8 * k
                                    : kind == 1 ? (x * (uint32_t)(k + 1) + y) * 255 / (4 * SIDE)
                                                : ((x / 5 + y / 3) & 1) * 200 + (uint32_t)k);
            rgbx[3] = (uint8_t)r;
        }
}

static void lossless_is_exact(void **state)
{
    (void)state;
    static const uint32_t sizes[][2] = {{1, 1}, {1, 128}, {128, 1}, {3, 7}, {71, 2}, {127, 126}, {128, 128}};
    static uint8_t pixels[4 * SIDE * SIDE], back[4 * SIDE * SIDE];
    for (size_t i = 0; i < sizeof sizes / sizeof sizes[0]; i++)
        for (int kind = 0; kind < 3; kind++) {
            const uint32_t w = sizes[i][0], h = sizes[i][1];
            fill(pixels, w, h, kind);
            size_t n = lum_webp_encode(&(struct lum_webp){pixels, w, h, 100, true}, out, sizeof out);
            assert_true(n > 0);
            int got_w, got_h;
            assert_true(WebPGetInfo(out, n, &got_w, &got_h));
            assert_true(got_w == (int)w && got_h == (int)h);
            assert_non_null(WebPDecodeRGBAInto(out, n, back, sizeof back, (int)w * 4));
            for (uint32_t p = 0; p < w * h; p++) {
                assert_memory_equal(back + 4 * p, pixels + 4 * p, 3);
                assert_int_equal(back[4 * p + 3], 255);
            }
        }
}

/* What does not fit is an answer, and nothing is written behind the end. */
static void room_has_an_end(void **state)
{
    (void)state;
    static uint8_t pixels[4 * SIDE * SIDE];
    fill(pixels, SIDE, SIDE, 0);
    const struct lum_webp images[] = {{pixels, SIDE, SIDE, 100, true}, {pixels, SIDE, SIDE, 90, false}};
    for (int i = 0; i < 2; i++) {
        size_t n = lum_webp_encode(&images[i], out, sizeof out);
        assert_true(n > 0);
        uint8_t *tight = malloc(n); /* its end is guarded where addresses are */
        assert_non_null(tight);
        assert_int_equal(lum_webp_encode(&images[i], tight, n), n);
        assert_memory_equal(tight, out, n);
        for (size_t size = 0; size < n; size += 1 + n / 40)
            assert_int_equal(lum_webp_encode(&images[i], tight, size), 0);
        assert_int_equal(lum_webp_encode(&images[i], tight, n - 1), 0);
        free(tight);
    }
}

/* ---- through the encoder ---- */

/* As a room is: light that falls off, edges, and fine grain, in colours that hardly differ. */
static struct lum_rgb room(uint32_t x, uint32_t y)
{
    uint32_t random = 3 + W * y + x;
    float light = 1.0f / (1.0f + 1e-4f * (float)((x - 60) * (x - 60) + (y - 40) * (y - 40)));
    float wall = (x / 37 + y / 29) % 2 ? 0.8f : 0.35f;
    next_random(&random);
    float grain = 1.0f + 0.03f * ((float)next_random(&random) / (1 << 24) - 0.5f);
    float v = light * wall * grain;
    return lum_rgb(v, v * 0.93f, v * 0.8f);
}

static int setup(void **state)
{
    *state = encoder_bed_begin(room);
    return 0;
}

static int encode(struct fixture *f, uint8_t codec, uint8_t quality, uint32_t flags)
{
    f->picture.header.codec = codec;
    f->picture.header.quality = quality;
    f->picture.header.flags = flags;
    return encoder_bed_run(f);
}

static void decode(const struct lum_encoded_tile *t, uint8_t *ret_rgba)
{
    if (t->header.codec == LUM_CODEC_WEBP) {
        assert_non_null(
            WebPDecodeRGBAInto(t->bytes, t->n_bytes, ret_rgba, (size_t)4 * SIDE * SIDE, (int)t->header.w * 4));
        return;
    }
    tjhandle j = tjInitDecompress();
    assert_int_equal(tjDecompress2(j, t->bytes, t->n_bytes, ret_rgba, t->header.w, 0, t->header.h, TJPF_RGBA, 0), 0);
    tjDestroy(j);
}

/* Root mean square over all values, and bytes. */
static double error_of(struct fixture *f, size_t *ret_bytes)
{
    static uint8_t want[4 * SIDE * SIDE], got[4 * SIDE * SIDE];
    double sum = 0.0;
    *ret_bytes = 0;
    for (int i = 0; i < TILES; i++) {
        const struct lum_frame_header *t = &f->tiles[i]->header;
        lum_film_resolve(&f->film, t->x, t->y, t->w, t->h, &f->picture.display, want, (size_t)t->w * 4);
        decode(f->tiles[i], got);
        *ret_bytes += f->tiles[i]->n_bytes;
        for (uint32_t p = 0; p < 4u * t->w * t->h; p++)
            sum += p % 4 == 3 ? 0.0 : pow((double)want[p] - got[p], 2);
    }
    return sqrt(sum / (3.0 * W * H));
}

/* The quality of a tile is the same error in both codecs. It is so of renderings on average (coding.c); of one picture
 * within a third. In fewer bytes. */
static void quality_means_the_same_error(void **state)
{
    struct fixture *f = *state;
    for (uint8_t quality = 20; quality < 90; quality += 5) {
        size_t jpeg_bytes, webp_bytes;
        memset(f->states, 0, sizeof f->states);
        assert_int_equal(encode(f, LUM_CODEC_JPEG, quality, 0), TILES);
        double jpeg = error_of(f, &jpeg_bytes);
        memset(f->states, 0, sizeof f->states);
        assert_int_equal(encode(f, LUM_CODEC_WEBP, quality, 0), TILES);
        double webp = error_of(f, &webp_bytes);
        if (!(webp < jpeg * 4 / 3 && webp_bytes < jpeg_bytes))
            fail_msg("quality %d: WebP is off by %.2f in %zu bytes, JPEG by %.2f in %zu", quality, webp, webp_bytes,
                     jpeg, jpeg_bytes);
    }
}

static void the_last_picture_is_exact(void **state)
{
    struct fixture *f = *state;
    size_t bytes;
    assert_int_equal(encode(f, LUM_CODEC_WEBP, 80, 0), TILES);
    assert_int_equal(encode(f, LUM_CODEC_WEBP, 100, LUM_FRAME_LOSSLESS), TILES); /* lossy before: all are sent again */
    assert_true(error_of(f, &bytes) == 0.0);
    assert_int_equal(encode(f, LUM_CODEC_WEBP, 80, 0), 1); /* one, so that the frame is seen: no worse copy is needed */
}

/* What the client has is not sent again in another codec, if it is as good. */
static void a_change_of_codec_sends_what_is_worse(void **state)
{
    struct fixture *f = *state;
    assert_int_equal(encode(f, LUM_CODEC_JPEG, 80, 0), TILES);
    assert_int_equal(encode(f, LUM_CODEC_WEBP, 80, 0), 1);
    assert_int_equal(encode(f, LUM_CODEC_WEBP, 50, 0), 1);
    assert_int_equal(encode(f, LUM_CODEC_WEBP, 81, 0), TILES);
    assert_int_equal(encode(f, LUM_CODEC_JPEG, 81, 0), 1);
    assert_int_equal(encode(f, LUM_CODEC_JPEG, 82, 0), TILES);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(lossless_is_exact),
        cmocka_unit_test(room_has_an_end),
        cmocka_unit_test_setup_teardown(quality_means_the_same_error, setup, encoder_bed_end),
        cmocka_unit_test_setup_teardown(the_last_picture_is_exact, setup, encoder_bed_end),
        cmocka_unit_test_setup_teardown(a_change_of_codec_sends_what_is_worse, setup, encoder_bed_end),
    };
    assert_true(lum_webp_available());
    return cmocka_run_group_tests(tests, NULL, NULL);
}

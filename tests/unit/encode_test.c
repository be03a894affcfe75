/* Tiles: what is decoded is what the film showed; unchanged tiles are not encoded again. */
#include <string.h>

#include <spng.h>
#include <turbojpeg.h>
#include <zlib.h>

#include "tests/support/encoder_bed.h"

enum { TILE_BYTES = 128 * 128 * 8 };

static struct lum_rgb gradient(uint32_t x, uint32_t y)
{
    return lum_rgb((float)x / W, (float)y / H, 0.25f);
}

static int setup(void **state)
{
    *state = encoder_bed_begin(gradient);
    return 0;
}

/* Encodes and returns how many tiles came out. */
static int encode(struct fixture *f, uint8_t codec, uint8_t downscale)
{
    f->picture.header.codec = codec;
    f->picture.header.downscale = downscale;
    return encoder_bed_run(f);
}

/* The tile's pixels as RGB8. */
static void decode(const struct lum_encoded_tile *t, uint32_t w, uint32_t h, uint8_t *ret_rgb)
{
    if (t->header.codec == LUM_CODEC_JPEG) {
        tjhandle j = tjInitDecompress();
        assert_int_equal(tjDecompress2(j, t->bytes, t->n_bytes, ret_rgb, (int)w, 0, (int)h, TJPF_RGB, 0), 0);
        tjDestroy(j);
    } else if (t->header.codec == LUM_CODEC_PNG) {
        spng_ctx *ctx = spng_ctx_new(0);
        spng_set_png_buffer(ctx, t->bytes, t->n_bytes);
        size_t n;
        assert_int_equal(spng_decoded_image_size(ctx, SPNG_FMT_RGB8, &n), 0);
        assert_int_equal(n, (size_t)3 * w * h);
        assert_int_equal(spng_decode_image(ctx, ret_rgb, n, SPNG_FMT_RGB8, 0), 0);
        spng_ctx_free(ctx);
    } else {
        assert_int_equal(t->n_bytes, (size_t)4 * w * h);
        for (size_t i = 0; i < (size_t)w * h; i++)
            memcpy(ret_rgb + 3 * i, t->bytes + 4 * i, 3);
    }
}

/* Root mean square over all values of all tiles. */
static double rms_difference(const struct fixture *f)
{
    static uint8_t want[128 * 128 * 4], got[128 * 128 * 3];
    double sum = 0.0;
    for (int i = 0; i < TILES; i++) {
        const struct lum_frame_header *t = &f->tiles[i]->header;
        lum_film_resolve(&f->film, t->x, t->y, t->w, t->h, &f->picture.display, want, (size_t)t->w * 4);
        decode(f->tiles[i], t->w, t->h, got);
        for (uint32_t p = 0; p < (uint32_t)t->w * t->h; p++)
            for (int c = 0; c < 3; c++) {
                int d = abs(want[4 * p + (uint32_t)c] - got[3 * p + (uint32_t)c]);
                sum += (double)d * d;
            }
    }
    return sqrt(sum / (3.0 * W * H));
}

static void tiles_cover_the_picture(void **state)
{
    struct fixture *f = *state;
    assert_int_equal(lum_tile_count(W, H), TILES);
    assert_int_equal(encode(f, LUM_CODEC_RGBA8, 0), TILES);
    uint32_t area = 0;
    for (int i = 0; i < TILES; i++) {
        const struct lum_frame_header *t = &f->tiles[i]->header;
        area += (uint32_t)t->w * t->h;
        assert_true(t->x + t->w <= W && t->y + t->h <= H);
        assert_int_equal(t->full_w, W);
        assert_int_equal(t->full_h, H);
        assert_int_equal(t->payload_len, f->tiles[i]->n_bytes);
        assert_int_equal(t->kind, LUM_FRAME_TILE);
        assert_int_equal(t->frame_seq, 7);
    }
    assert_int_equal(area, W * H);
}

static void lossless_codecs_are_exact(void **state)
{
    struct fixture *f = *state;
    assert_int_equal(encode(f, LUM_CODEC_RGBA8, 0), TILES);
    assert_true(rms_difference(f) == 0.0);
    memset(f->states, 0, sizeof f->states);
    assert_int_equal(encode(f, LUM_CODEC_PNG, 0), TILES);
    assert_true(rms_difference(f) == 0.0);
}

/* At quality 95 the largest quantiser steps are 12 (luma) and 10 (chroma): uniform errors of rms 3.5 and 2.9. The worst
 * channel is B = Y + 1.772 Cb: sqrt(3.5^2 + (1.772 * 2.9)^2) = 6.2. Swapped channels would differ by 80. */
static void jpeg_is_close(void **state)
{
    struct fixture *f = *state;
    assert_int_equal(encode(f, LUM_CODEC_JPEG, 0), TILES);
    assert_true(rms_difference(f) <= 6.2);
}

static void half_tiles_hold_the_radiance(void **state)
{
    struct fixture *f = *state;
    assert_int_equal(encode(f, LUM_CODEC_HALF_DEFLATE, 0), TILES);
    static uint16_t half[TILE_BYTES / 2];
    for (int i = 0; i < TILES; i++) {
        const struct lum_frame_header *t = &f->tiles[i]->header;
        uLongf n = sizeof half;
        assert_int_equal(uncompress((Bytef *)half, &n, f->tiles[i]->bytes, f->tiles[i]->n_bytes), Z_OK);
        assert_int_equal(n, (size_t)8 * t->w * t->h);
        assert_int_equal(t->kind, LUM_FRAME_HDR_TILE);
        struct lum_rgb last = gradient(t->x + t->w - 1u, t->y + t->h - 1u);
        const uint16_t *p = half + ((size_t)t->w * t->h - 1) * 4;
        assert_int_equal(p[0], lum_half_from_float(last.r));
        assert_int_equal(p[2], 0x3400); /* 0.25 */
        assert_int_equal(p[3], 0x3c00); /* 1 */
    }
}

static void unchanged_tiles_are_not_encoded_again(void **state)
{
    struct fixture *f = *state;
    assert_int_equal(encode(f, LUM_CODEC_JPEG, 0), TILES);
    assert_true(lum_encoder_cost(f->encoder).n_pixels > 0);
    assert_int_equal(encode(f, LUM_CODEC_JPEG, 0), 1); /* one, so that the frame is seen */
    struct lum_coding_cost cost = lum_encoder_cost(f->encoder);
    assert_true(cost.n_pixels == 0 && cost.n_bytes == 0 &&
                cost.cpu_ns == 0); /* which says nothing of what frames cost */
    uint64_t nonfinite = 0;
    lum_film_reset_pixel(&f->film, 150, 10); /* in tile 1 */
    lum_film_add(&f->film, 150, 10, 0, lum_grey(0.9f), &nonfinite);
    assert_int_equal(encode(f, LUM_CODEC_JPEG, 0), 1);
    assert_non_null(f->tiles[1]);
    assert_int_equal(encode(f, LUM_CODEC_PNG, 0), TILES); /* lossy before: all are sent again */
    assert_int_equal(encode(f, LUM_CODEC_JPEG, 0), 1);    /* a lossless tile needs no worse copy */
}

static void downscaled_tiles_are_smaller(void **state)
{
    struct fixture *f = *state;
    for (uint8_t d = 1; d <= 2; d++) {
        assert_int_equal(encode(f, LUM_CODEC_RGBA8, d), TILES);
        for (int i = 0; i < TILES; i++) {
            const struct lum_frame_header *t = &f->tiles[i]->header;
            uint32_t round = (1u << d) - 1, w = (t->w + round) >> d, h = (t->h + round) >> d;
            assert_int_equal(f->tiles[i]->n_bytes, 4 * w * h);
            assert_int_equal(t->downscale, d);
        }
    }
}

/* A map's colours over grey; alone where it is opaque; grey alone where it says nothing; the picture as it is without
 * one. */
static void colours_of_a_map_lie_over_grey(void **state)
{
    struct fixture *f = *state;
    uint8_t map[W * H];
    struct lum_overlay overlay = {
        .w = W, .h = H, .scale = {.n_colors = 3, .colors = {{0, 0, 255}, {255, 0, 0}, {9, 99, 200}}}};
    for (uint32_t i = 0; i < W * H; i++)
        map[i] = (uint8_t)(i % 4 == 3 ? LUM_OVERLAY_NONE : i % 4);
    const struct lum_frame_header tile = {.x = 3, .y = 5, .w = 100, .h = 2};
    uint8_t plain[100 * 2 * 4], shown[100 * 2 * 4];
    lum_film_resolve(&f->film, tile.x, tile.y, tile.w, tile.h, &f->picture.display, plain, 400);
    memcpy(shown, plain, sizeof plain);
    lum_overlay_paint(NULL, &tile, shown);
    lum_overlay_paint(&overlay, &tile, shown);
    assert_memory_equal(shown, plain, sizeof plain);
    overlay.classes = map;
    for (int opaque = 0; opaque < 2; opaque++) {
        overlay.opaque = opaque;
        memcpy(shown, plain, sizeof plain);
        lum_overlay_paint(&overlay, &tile, shown);
        for (uint32_t i = 0; i < 200; i++) {
            const uint8_t *p = plain + 4 * (size_t)i, *c = shown + 4 * (size_t)i;
            int grey = (54 * p[0] + 183 * p[1] + 19 * p[2] + 128) / 256; /* Rec.709 luma */
            uint8_t class = map[(size_t)(tile.y + i / 100) * W + tile.x + i % 100];
            for (int k = 0; k < 3; k++) {
                int color = class == LUM_OVERLAY_NONE ? grey : overlay.scale.colors[class][k];
                assert_int_equal(c[k], class != LUM_OVERLAY_NONE && opaque ? color : (grey + color + 1) / 2);
            }
            assert_int_equal(c[3], p[3]);
        }
    }
}

/* Every half is a float exactly, and comes back; what lies between two of them goes to the even one. */
static void halves_round_to_nearest_even(void **state)
{
    (void)state;
    for (uint32_t h = 0; h < 0x7c00; h++) {
        float value = h < 0x400 ? ldexpf((float)h, -24) : ldexpf((float)(0x400 | (h & 0x3ff)), (int)(h >> 10) - 25);
        float next = h + 1 < 0x400 ? ldexpf((float)(h + 1), -24)
                                   : ldexpf((float)(0x400 | ((h + 1) & 0x3ff)), (int)((h + 1) >> 10) - 25);
        assert_int_equal(lum_half_from_float(value), h);
        assert_int_equal(lum_half_from_float(-value), h | 0x8000);
        uint16_t middle = lum_half_from_float(0.5f * (value + next));
        assert_int_equal(middle, h + 1 == 0x7c00 ? 0x7bff : h + (h & 1));
    }
    assert_int_equal(lum_half_from_float(INFINITY), 0x7bff);
    assert_int_equal(lum_half_from_float(1e30f), 0x7bff);
    assert_int_equal(lum_half_from_float(NAN), 0);
}

static void failing_memory_leaves_the_states(void **state)
{
    struct fixture *f = *state;
    struct lum_tile_state before[TILES];
    memcpy(before, f->states, sizeof before);
    lum_alloc_fail_after(1);
    f->picture.header.codec = LUM_CODEC_JPEG;
    assert_int_equal(lum_encoder_run(f->encoder, &f->picture, f->states, f->tiles, NULL), LUM_ERR_NOMEM);
    lum_alloc_fail_after(0);
    assert_memory_equal(before, f->states, sizeof before);
    for (int i = 0; i < TILES; i++)
        assert_null(f->tiles[i]);
    struct lum_encoder *e = NULL;
    for (uint64_t k = 1;; k++) { /* every allocation of create fails once */
        lum_alloc_fail_after(k);
        enum lum_status st = lum_encoder_create(f->pool, &e, NULL);
        lum_alloc_fail_after(0);
        if (!st)
            break;
        assert_null(e);
    }
    lum_encoder_destroy(e);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup_teardown(tiles_cover_the_picture, setup, encoder_bed_end),
        cmocka_unit_test_setup_teardown(lossless_codecs_are_exact, setup, encoder_bed_end),
        cmocka_unit_test_setup_teardown(jpeg_is_close, setup, encoder_bed_end),
        cmocka_unit_test_setup_teardown(half_tiles_hold_the_radiance, setup, encoder_bed_end),
        cmocka_unit_test_setup_teardown(unchanged_tiles_are_not_encoded_again, setup, encoder_bed_end),
        cmocka_unit_test_setup_teardown(downscaled_tiles_are_smaller, setup, encoder_bed_end),
        cmocka_unit_test_setup_teardown(colours_of_a_map_lie_over_grey, setup, encoder_bed_end),
        cmocka_unit_test(halves_round_to_nearest_even),
        cmocka_unit_test_setup_teardown(failing_memory_leaves_the_states, setup, encoder_bed_end),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

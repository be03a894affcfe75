/* Pictures as VP9, decoded again by libvpx: every size, every picture at once and in its colours, key frames that stand
 * alone, bytes near what was asked for, and memory that runs short. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include <vpx/vp8dx.h>
#include <vpx/vpx_decoder.h>

#include "core/base/base.h"
#include "protocol/base/limits.h"
#include "server/stream/vp9.h"

enum {
    PLENTY = 1000000, /* bytes of a frame: no picture here needs them */
    TILE = 128        /* as the encoder of tiles cuts a picture */
};

struct picture {
    uint32_t w, h;
    uint8_t *rgbx;
};

static struct picture new_picture(uint32_t w, uint32_t h)
{
    struct picture p = {w, h, calloc((size_t)w * h, 4)};
    assert_non_null(p.rgbx);
    return p;
}

/* Light that falls off and hardly differs in colour, with edges; moved by so many pixels. */
static void paint_room(struct picture *p, uint32_t shift)
{
    uint8_t *at = p->rgbx;
    for (uint32_t y = 0; y < p->h; y++)
        for (uint32_t x = 0; x < p->w; x++, at += 4) {
            double u = (double)x / p->w - 0.5, v = (double)y / p->h - 0.3;
            double light = 1.0 / (1.0 + u * u + v * v);
            double wall = ((x + shift) / 37 + y / 29) % 2 ? 220.0 : 120.0;
            at[0] = (uint8_t)(wall * light);
            at[1] = (uint8_t)(wall * light * 0.93);
            at[2] = (uint8_t)(wall * light * 0.8);
            at[3] = (uint8_t)(x ^ y); /* anything */
        }
}

static void paint_flat(struct picture *p, const uint8_t rgb[3])
{
    for (size_t i = 0; i < (size_t)p->w * p->h; i++)
        memcpy(p->rgbx + 4 * i, rgb, 3);
}

/* In parts, as tiles come. */
static void put(struct lum_vp9 *v, const struct picture *p)
{
    uint8_t *part = malloc((size_t)4 * TILE * TILE);
    assert_non_null(part);
    for (uint32_t y = 0; y < p->h; y += TILE)
        for (uint32_t x = 0; x < p->w; x += TILE) {
            uint32_t w = p->w - x < TILE ? p->w - x : TILE, h = p->h - y < TILE ? p->h - y : TILE;
            for (uint32_t row = 0; row < h; row++)
                memcpy(part + (size_t)4 * w * row, p->rgbx + 4 * ((size_t)p->w * (y + row) + x), (size_t)4 * w);
            lum_vp9_put(v, &(struct lum_vp9_part){part, x, y, w, h});
        }
    free(part);
}

static uint8_t byte_of(double v)
{
    return (uint8_t)(v < 0.0 ? 0.0 : v > 255.0 ? 255.0 : v + 0.5);
}

/* BT.709, all of 0 .. 255, each chroma sample for its four pixels. */
static void to_rgbx(const vpx_image_t *image, struct picture *ret_picture)
{
    uint8_t *out = ret_picture->rgbx;
    for (uint32_t y = 0; y < ret_picture->h; y++)
        for (uint32_t x = 0; x < ret_picture->w; x++, out += 4) {
            double l = image->planes[0][(size_t)y * (size_t)image->stride[0] + x];
            double cb = image->planes[1][(size_t)(y / 2) * (size_t)image->stride[1] + x / 2] - 128.0;
            double cr = image->planes[2][(size_t)(y / 2) * (size_t)image->stride[2] + x / 2] - 128.0;
            double r = l + 1.5748 * cr, b = l + 1.8556 * cb;
            out[0] = byte_of(r);
            out[1] = byte_of((l - 0.2126 * r - 0.0722 * b) / 0.7152);
            out[2] = byte_of(b);
        }
}

/* False: it cannot be decoded. Exactly one picture comes of a frame, of the right size and kind. */
static bool decode(vpx_codec_ctx_t *d, const struct lum_vp9_frame *f, struct picture *ret_picture)
{
    vpx_codec_iter_t at = NULL;
    if (vpx_codec_decode(d, f->bytes, (unsigned)f->n, NULL, 0))
        return false;
    const vpx_image_t *image = vpx_codec_get_frame(d, &at);
    if (!image)
        return false;
    assert_null(vpx_codec_get_frame(d, &at));
    assert_true(image->fmt == VPX_IMG_FMT_I420 && image->cs == VPX_CS_BT_709 && image->range == VPX_CR_FULL_RANGE);
    assert_int_equal(image->d_w, ret_picture->w);
    assert_int_equal(image->d_h, ret_picture->h);
    to_rgbx(image, ret_picture);
    return true;
}

static void open_decoder(vpx_codec_ctx_t *ret_decoder)
{
    assert_int_equal(vpx_codec_dec_init(ret_decoder, vpx_codec_vp9_dx(), NULL, 0), VPX_CODEC_OK);
}

static double linear(uint8_t v)
{
    double x = v / 255.0;
    return x <= 0.04045 ? x / 12.92 : pow((x + 0.055) / 1.055, 2.4);
}

/* Mean of 2 |a - b| / (a + b) of linear light. */
static double smape(const struct picture *a, const struct picture *b)
{
    double sum = 0.0;
    size_t n = (size_t)a->w * a->h;
    for (size_t i = 0; i < 4 * n; i++)
        if (i % 4 < 3) {
            double x = linear(a->rgbx[i]), y = linear(b->rgbx[i]);
            sum += x + y > 0.0 ? 2.0 * fabs(x - y) / (x + y) : 0.0;
        }
    return sum / (3.0 * (double)n);
}

/* Values of 60 to 220 of a screen, which are 3 to 2 % of light each: the finest quantizer is off by one of them on
 * average, and colours of half the resolution by less, as there is an edge every 29 pixels. */
#define NEAR 0.03

/* A picture of every size, and one that follows it. */
static void all_sizes(void **state)
{
    (void)state;
    static const uint32_t sizes[][2] = {{1, 1},       {1, 2},       {2, 1},      {3, 5},     {8, 8},
                                        {1, 300},     {301, 1},     {199, 130},  {257, 129}, {640, 360},
                                        {4096, 1024}, {1024, 4096}, {2048, 2048}};
    for (size_t i = 0; i < sizeof sizes / sizeof sizes[0]; i++) {
        const uint32_t w = sizes[i][0], h = sizes[i][1];
        assert_true((uint64_t)w * h <= LUM_LIMIT_VIDEO_PIXELS);
        struct picture made = new_picture(w, h), got = new_picture(w, h);
        vpx_codec_ctx_t d;
        struct lum_vp9 *v = lum_vp9_create(w, h, 2);
        assert_non_null(v);
        open_decoder(&d);
        for (uint32_t k = 0; k < 2; k++) {
            paint_room(&made, 3 * k);
            put(v, &made);
            struct lum_vp9_frame f = lum_vp9_encode(v, PLENTY, false);
            assert_true(f.n > 0 && f.key == (k == 0) && f.quality <= 100);
            assert_true(decode(&d, &f, &got));
            if (!(smape(&made, &got) < NEAR))
                fail_msg("%u x %u, picture %u: SMAPE %.4f", w, h, k, smape(&made, &got));
        }
        vpx_codec_destroy(&d);
        lum_vp9_destroy(v);
        free(made.rgbx);
        free(got.rgbx);
    }
}

struct show {
    struct lum_vp9 *v;
    vpx_codec_ctx_t d;
    struct picture made, got;
};

static struct show begin_show(uint32_t w, uint32_t h)
{
    struct show s = {.v = lum_vp9_create(w, h, 1), .made = new_picture(w, h), .got = new_picture(w, h)};
    assert_non_null(s.v);
    open_decoder(&s.d);
    return s;
}

static void end_show(struct show *s)
{
    vpx_codec_destroy(&s->d);
    lum_vp9_destroy(s->v);
    free(s->made.rgbx);
    free(s->got.rgbx);
}

static struct lum_vp9_frame next(struct show *s, uint32_t shift, uint32_t wanted_bytes, bool key)
{
    paint_room(&s->made, shift);
    put(s->v, &s->made);
    struct lum_vp9_frame f = lum_vp9_encode(s->v, wanted_bytes, key);
    assert_true(f.n > 0);
    return f;
}

/* Whatever is bright, dark or coloured comes as bright and as coloured: chroma and luma are rounded once, and the
 * finest quantizer is off by no more than its step. */
static void colours_come_as_they_are(void **state)
{
    (void)state;
    static const uint8_t colours[][3] = {{0, 0, 0},     {255, 255, 255}, {255, 0, 0},   {0, 255, 0},  {0, 0, 255},
                                         {255, 255, 0}, {0, 255, 255},   {255, 0, 255}, {40, 41, 39}, {250, 128, 3}};
    struct show s = begin_show(160, 96);
    for (size_t i = 0; i < sizeof colours / sizeof colours[0]; i++) {
        paint_flat(&s.made, colours[i]);
        put(s.v, &s.made);
        struct lum_vp9_frame f = lum_vp9_encode(s.v, PLENTY, true);
        assert_true(f.n > 0 && decode(&s.d, &f, &s.got));
        for (size_t k = 0; k < (size_t)4 * 160 * 96; k++)
            if (k % 4 < 3 && abs(s.got.rgbx[k] - colours[i][k % 4]) > 4)
                fail_msg("colour %zu came as %d, not %d", i, s.got.rgbx[k], colours[i][k % 4]);
    }
    end_show(&s);
}

/* Each picture is there with its own chunk, none later. */
static void pictures_follow_at_once(void **state)
{
    (void)state;
    struct show s = begin_show(199, 130);
    double worst = 0.0;
    for (uint32_t k = 0; k < 40; k++) {
        struct lum_vp9_frame f = next(&s, 5 * k, PLENTY, false);
        assert_int_equal(f.key, k == 0);
        assert_true(decode(&s.d, &f, &s.got));
        worst = fmax(worst, smape(&s.made, &s.got));
    }
    if (!(worst < NEAR))
        fail_msg("SMAPE %.4f", worst);
    end_show(&s);
}

static void what_stands_still_takes_nothing(void **state)
{
    (void)state;
    struct show s = begin_show(400, 300);
    size_t key = next(&s, 0, 6000, false).n, n = 0;
    for (int k = 0; k < 30; k++)
        n = next(&s, 0, 6000, false).n;
    if (!(n < key / 5))
        fail_msg("the picture took %zu bytes, and still takes %zu", key, n);
    end_show(&s);
}

/* Over a drag, with a wish that changes on the way: on average no more than it by half. */
static void frames_take_what_they_may(void **state)
{
    (void)state;
    struct show s = begin_show(640, 400);
    next(&s, 0, 3000, false);
    for (uint32_t wanted = 3000; wanted <= 12000; wanted *= 2) {
        size_t sum = 0;
        for (uint32_t k = 1; k <= 40; k++)
            sum += next(&s, 7 * k, wanted, false).n;
        if (!(sum / 40 < wanted * 3 / 2))
            fail_msg("of %u bytes wanted frames took %zu", wanted, sum / 40);
    }
    end_show(&s);
}

/* Who comes, or lost a chunk, goes on from a key frame, and not from another. */
static void a_key_frame_stands_alone(void **state)
{
    (void)state;
    struct show s = begin_show(199, 130);
    for (uint32_t k = 0; k < 4; k++)
        next(&s, 5 * k, PLENTY, false); /* not seen */
    struct lum_vp9_frame f = next(&s, 25, PLENTY, false);
    assert_false(f.key || decode(&s.d, &f, &s.got));
    f = next(&s, 30, PLENTY, true);
    assert_true(f.key && decode(&s.d, &f, &s.got));
    assert_true(smape(&s.made, &s.got) < NEAR);
    f = next(&s, 35, PLENTY, false);
    assert_true(!f.key && decode(&s.d, &f, &s.got));
    assert_true(smape(&s.made, &s.got) < NEAR);
    end_show(&s);
}

/* Neither encoder knows of the other: the same pictures are the same bytes, whatever else was encoded between. */
static void encoders_are_independent(void **state)
{
    (void)state;
    struct show a = begin_show(120, 80), b = begin_show(120, 80), other = begin_show(64, 64);
    for (uint32_t k = 0; k < 6; k++) {
        struct lum_vp9_frame f = next(&a, k, 4000, false);
        uint8_t *copy = malloc(f.n);
        assert_non_null(copy);
        memcpy(copy, f.bytes, f.n);
        next(&other, 9 * k, 500, k % 2);
        struct lum_vp9_frame g = next(&b, k, 4000, false);
        assert_int_equal(g.n, f.n);
        assert_memory_equal(g.bytes, copy, f.n);
        free(copy);
    }
    end_show(&a);
    end_show(&b);
    end_show(&other);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(all_sizes),
        cmocka_unit_test(colours_come_as_they_are),
        cmocka_unit_test(pictures_follow_at_once),
        cmocka_unit_test(what_stands_still_takes_nothing),
        cmocka_unit_test(frames_take_what_they_may),
        cmocka_unit_test(a_key_frame_stands_alone),
        cmocka_unit_test(encoders_are_independent),
    };
    assert_true(lum_vp9_available());
    return cmocka_run_group_tests(tests, NULL, NULL);
}

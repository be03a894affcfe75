/* The pattern of interleaved sampling, the guidance of listings 5.2 to 5.4, the discontinuity buffer and upsampling. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/interleave/interleave.h"
#include "core/math/sampler.h"

/* ---- the pattern ---- */

static void every_window_holds_each_set_once(void **state)
{
    (void)state;
    for (uint32_t side = 1; side <= LUM_PATTERN_MAX; side++)
        for (uint32_t y0 = 0; y0 < 2 * side; y0++)
            for (uint32_t x0 = 0; x0 < 2 * side; x0++)
                for (uint32_t iteration = 0; iteration < side * side; iteration++) {
                    uint32_t seen = 0;
                    for (uint32_t i = 0; i < side * side; i++) {
                        uint32_t set = lum_pattern_subset(side, x0 + i % side, y0 + i / side);
                        seen |= 1u << lum_pattern_next(side, set, iteration);
                    }
                    assert_int_equal(seen, (1u << side * side) - 1);
                }
}

static void places_are_those_of_their_sets(void **state)
{
    (void)state;
    for (uint32_t side = 1; side <= LUM_PATTERN_MAX; side++)
        for (uint32_t set = 0; set < side * side; set++) {
            uint32_t x, y;
            lum_pattern_pixel(side, set, &x, &y);
            assert_true(x < side && y < side && lum_pattern_subset(side, x, y) == set);
        }
}

static void a_pixel_takes_each_set_once(void **state)
{
    (void)state;
    for (uint32_t side = 1; side <= LUM_PATTERN_MAX; side++)
        for (uint32_t set = 0; set < side * side; set++) {
            assert_int_equal(lum_pattern_next(side, set, 0), set);
            uint32_t seen = 0;
            for (uint32_t iteration = 0; iteration < side * side; iteration++)
                seen |= 1u << lum_pattern_next(side, set, iteration);
            assert_int_equal(seen, (1u << side * side) - 1);
        }
}

/* What a window sees beyond an edge is a period further in, and so of its set; or nothing, in a smaller picture. */
static void windows_beyond_an_edge_find_their_sets(void **state)
{
    (void)state;
    for (uint32_t period = 1; period <= 4; period++)
        for (uint32_t size = 1; size <= 9; size++)
            for (uint32_t first = 0; first < size; first++)
                for (uint32_t border = 0; border <= period; border++) {
                    uint32_t n = size - first < 5 ? size - first : 5, at[5 + 2 * 4];
                    lum_pattern_positions(first, n, border, period, size, at);
                    for (uint32_t i = 0; i < n + 2 * border; i++) {
                        int64_t p = (int64_t)first + i - border;
                        if (p < 0 || p >= size)
                            p += p < 0 ? (int64_t)period : -(int64_t)period;
                        assert_int_equal(at[i], p >= 0 && p < size ? p : LUM_NOWHERE);
                    }
                }
}

static void packets_are_whole_patterns(void **state)
{
    (void)state;
    for (uint32_t side = 1; side <= LUM_PATTERN_MAX; side++)
        assert_int_equal(LUM_CELL_SIDE / 2 % side, 0); /* at a quarter of the resolution too */
}

/* ---- guidance ---- */

static uint32_t indirect(const uint16_t *sampled, const uint16_t *missed)
{
    return lum_guidance_indirect(sampled, missed, 9, 9);
}

static void listing_5_2(void **state)
{
    (void)state;
    uint16_t sampled[9], missed[9] = {0};
    for (int i = 0; i < 9; i++)
        sampled[i] = 28;
    assert_int_equal(indirect(sampled, missed), 0);
    missed[4] = 1; /* 1 / (28 * 9) * 9, rounded up */
    assert_int_equal(indirect(sampled, missed), 1);
    for (int i = 0; i < 9; i++)
        missed[i] = 14; /* 4.5 */
    assert_int_equal(indirect(sampled, missed), 5);
    for (int i = 0; i < 9; i++)
        missed[i] = 28; /* all: "if no VPLs are deemed visible refinement is continued"; one of nine is done */
    assert_int_equal(indirect(sampled, missed), 8);
    for (int i = 0; i < 9; i++)
        missed[i] = i < 3 ? 28 : 0; /* a third, however its quotients are rounded */
    assert_int_equal(indirect(sampled, missed), 3);
    for (int i = 0; i < 9; i++) { /* a whole number from quotients that are none: 9 * 1/3 */
        sampled[i] = (uint16_t)(3 * (i + 1));
        missed[i] = (uint16_t)(i + 1);
    }
    assert_int_equal(indirect(sampled, missed), 3);
    memset(sampled, 0, sizeof sampled);
    memset(missed, 0, sizeof missed);
    assert_int_equal(indirect(sampled, missed), 0);
    assert_int_equal(lum_guidance_indirect(sampled, missed, 0, 9), 0);
}

static void listing_5_3(void **state)
{
    (void)state;
    assert_int_equal(lum_guidance_shadow(9, 0, 9), 0);
    assert_int_equal(lum_guidance_shadow(9, 9, 9), 0);
    for (uint32_t missed = 1; missed < 9; missed++)
        assert_int_equal(lum_guidance_shadow(9, missed, 9), missed); /* refine * SSmaxSamples */
    assert_int_equal(lum_guidance_shadow(7, 1, 9), 2);               /* 1.29 */
    assert_int_equal(lum_guidance_shadow(100, 99, 9), 8);            /* 8.91, but only 8 are left */
    assert_int_equal(lum_guidance_shadow(0, 0, 9), 0);
    assert_int_equal(lum_guidance_shadow(9, 4, 1), 0); /* never refined */
}

static void listing_5_4(void **state)
{
    (void)state;
    assert_true(lum_guidance_media_value(0, 0, 8) == 0.0f);
    assert_true(lum_guidance_media_value(8, 8, 8) == 0.0f); /* wholly in shadow, wholly in the halo */
    assert_true(lum_guidance_media_value(2, 0, 8) == 0.25f);
    assert_true(lum_guidance_media_value(8, 4, 8) == 0.5f);
    assert_true(lum_guidance_media_value(2, 4, 8) == 0.375f); /* the mean of both */
    float same[9] = {.5f, .5f, .5f, .5f, .5f, .5f, .5f, .5f, .5f};
    assert_int_equal(lum_guidance_media(same, 9, 8, 9), 0);
    float one[9] = {.5f, .625f, .5f, .375f, .5f, .5f, .5f, .5f, .5f}; /* one point of 8 is no difference */
    assert_int_equal(lum_guidance_media(one, 9, 8, 9), 0);
    float edge[9] = {.5f, .5f, .5f, 0, 0, 0, .5f, .5f, .5f}; /* two changes in scan order */
    assert_int_equal(lum_guidance_media(edge, 9, 8, 9), 2);
    float all[9] = {0, 1, 0, 1, 0, 1, 0, 1, 0}; /* 8 changes: the first pixel has none before it */
    assert_int_equal(lum_guidance_media(all, 9, 8, 9), 8);
    float half[9] = {0, 0.1875f, 0, 0, 0, 0, 0, 0, 0}; /* a point and a half */
    assert_int_equal(lum_guidance_media(half, 9, 8, 9), 2);
    assert_int_equal(lum_guidance_media(all, 1, 8, 9), 0);
    assert_int_equal(lum_guidance_media(all, 0, 8, 9), 0);
}

/* ---- pictures ---- */

enum { W_MAX = 120, H_MAX = 101, NEED = 2 };
struct picture {
    struct lum_vec3 p[W_MAX * H_MAX], n[W_MAX * H_MAX];
    float depth[W_MAX * H_MAX];
    uint8_t kind[W_MAX * H_MAX];
    struct lum_rgb in[W_MAX * H_MAX], out[W_MAX * H_MAX];
    struct lum_guide guide;
};

/* Pixels are 0.01 apart on a wall that is seen square on from distance 1. */
static struct picture *make_wall(uint32_t w, uint32_t h)
{
    struct picture *pic = calloc(1, sizeof *pic);
    assert_non_null(pic);
    pic->guide = (struct lum_guide){w, h, pic->p, pic->n, pic->depth, pic->kind, 0.01f};
    for (uint32_t i = 0; i < w * h; i++) {
        pic->p[i] = lum_v3(0.01f * (float)(i % w), 0.01f * (float)(i / w), 1.0f);
        pic->n[i] = lum_v3(0, 0, -1);
        pic->depth[i] = 1.0f;
        pic->kind[i] = NEED;
    }
    return pic;
}

static struct lum_filter_rect packet_at(uint32_t x, uint32_t y, uint32_t w, uint32_t h)
{
    return (struct lum_filter_rect){x, y, w - x < LUM_CELL_SIDE ? w - x : LUM_CELL_SIDE,
                                    h - y < LUM_CELL_SIDE ? h - y : LUM_CELL_SIDE};
}

static void filter_by(struct picture *pic, const struct lum_filter *pattern)
{
    struct lum_filter f = *pattern;
    uint32_t step = f.step;
    f.guide = &pic->guide, f.in = pic->in;
    uint32_t w = lum_filter_size(pic->guide.w, step), h = lum_filter_size(pic->guide.h, step);
    for (uint32_t y = 0; y < h; y += LUM_CELL_SIDE) /* in cells, as it is used */
        for (uint32_t x = 0; x < w; x += LUM_CELL_SIDE) {
            struct lum_filter_rect r = packet_at(x, y, w, h);
            lum_filter_box(&f, &r, pic->out + (size_t)y * w + x, w);
        }
}

static void filter(struct picture *pic, uint32_t side, uint32_t step, uint8_t need)
{
    filter_by(pic, &(struct lum_filter){.need = need, .side = side, .apart = 1, .step = step});
}

static void upsample_by(struct picture *pic, uint32_t side, uint32_t step, bool lenient)
{
    struct lum_filter f = {&pic->guide, NEED, side, 1, step, pic->in, lenient};
    for (uint32_t y = 0; y < pic->guide.h; y += LUM_CELL_SIDE)
        for (uint32_t x = 0; x < pic->guide.w; x += LUM_CELL_SIDE) {
            struct lum_filter_rect r = packet_at(x, y, pic->guide.w, pic->guide.h);
            lum_filter_upsampled(&f, &r, pic->out);
        }
}

static void upsample(struct picture *pic, uint32_t side)
{
    upsample_by(pic, side, 2, false);
}

static bool close_to(float a, float b, float ulps)
{
    return fabsf(a - b) <= ulps * 0x1p-23f * fabsf(b);
}

static const uint32_t sizes[][2] = {{1, 1}, {1, 17}, {17, 1}, {2, 2}, {3, 3}, {5, 4}, {49, 50}, {120, 101}};

static void a_constant_stays(void **state)
{
    (void)state;
    for (size_t k = 0; k < LUM_ARRAY_LEN(sizes); k++)
        for (uint32_t side = 1; side <= LUM_PATTERN_MAX; side++)
            for (uint32_t step = 1; step <= 2; step++) {
                struct picture *pic = make_wall(sizes[k][0], sizes[k][1]);
                uint32_t n = lum_filter_size(sizes[k][0], step) * lum_filter_size(sizes[k][1], step);
                for (uint32_t i = 0; i < n; i++)
                    pic->in[i] = lum_rgb(0.1f, 3.7f, 1e20f);
                filter(pic, side, step, NEED);
                for (uint32_t i = 0; i < n; i++) /* up to 24 sums and products, half an ulp each, and a division */
                    assert_true(close_to(pic->out[i].r, 0.1f, 13) && close_to(pic->out[i].g, 3.7f, 13) &&
                                close_to(pic->out[i].b, 1e20f, 13));
                free(pic);
            }
}

/* Any picture with the pattern's period becomes its mean, up to the very edge. */
static void structured_noise_cancels(void **state)
{
    (void)state;
    for (uint32_t side = 2; side <= LUM_PATTERN_MAX; side++)
        for (uint32_t step = 1; step <= 2; step++) {
            struct picture *pic = make_wall(101, 98);
            uint32_t w = lum_filter_size(101, step), h = lum_filter_size(98, step);
            double mean = 0.0;
            for (uint32_t i = 0; i < side * side; i++)
                mean += (double)(lum_hash_u32(i + 77) >> 8) * 0x1p-24 / (side * side);
            for (uint32_t i = 0; i < w * h; i++)
                pic->in[i] = lum_grey((float)(lum_hash_u32(i % w % side + i / w % side * side + 77) >> 8) * 0x1p-24f);
            filter(pic, side, step, NEED);
            for (uint32_t i = 0; i < w * h;
                 i++) /* the mean is about a half: 24 roundings of sums up to 16 times that */
                assert_true(fabs((double)pic->out[i].g - mean) < 24 * 0x1p-24);
            free(pic);
        }
}

/* So does any with a period of 16, by tents over places 8 and 4 pixels apart and a window of 4. */
static void wide_windows_cancel(void **state)
{
    (void)state;
    static const struct lum_filter steps[] = {
        {.need = NEED, .side = 2, .apart = 8, .step = 1},
        {.need = NEED, .side = 2, .apart = 4, .step = 1},
        {.need = NEED, .side = 4, .apart = 1, .step = 1},
    };
    struct picture *pic = make_wall(101, 98);
    double mean = 0.0;
    for (uint32_t i = 0; i < 256; i++)
        mean += (double)(lum_hash_u32(i + 77) >> 8) * 0x1p-24 / 256;
    for (uint32_t i = 0; i < 101 * 98; i++)
        pic->in[i] = lum_grey((float)(lum_hash_u32(i % 101 % 16 + i / 101 % 16 * 16 + 77) >> 8) * 0x1p-24f);
    for (size_t k = 0; k < LUM_ARRAY_LEN(steps); k++) {
        filter_by(pic, &steps[k]);
        memcpy(pic->in, pic->out, sizeof pic->in);
    }
    for (uint32_t i = 0; i < 101 * 98;
         i++) /* roundings of sums up to 4, 4 and 16 times what comes of them, half an ulp each */
        assert_true(fabs((double)pic->out[i].g - mean) < (8 + 8 + 24) * 0x1p-24);
    free(pic);
}

/* Left half at 1, right half at 100, told apart by depth or by their normals. */
static void nothing_bleeds_over_edges(void **state)
{
    (void)state;
    enum { DEPTH, NORMAL, KIND, BACKGROUND, CASES };
    for (int edge = 0; edge < CASES; edge++)
        for (uint32_t side = 2; side <= LUM_PATTERN_MAX; side++) {
            struct picture *pic = make_wall(60, 60);
            for (uint32_t i = 0; i < 60 * 60; i++) {
                bool right = i % 60 >= 31;
                pic->in[i] = lum_grey(right ? 100.0f : 1.0f);
                if (right && edge == DEPTH)
                    pic->p[i].z += 0.02f; /* two pixels */
                if (right && edge == NORMAL)
                    pic->n[i] = lum_v3(-1, 0, 0);
                if (right && edge == KIND)
                    pic->kind[i] = 1;
                if (right && edge == BACKGROUND) {
                    pic->n[i] = pic->p[i] = lum_v3(0, 0, 0);
                    pic->depth[i] = INFINITY;
                }
            }
            filter(pic, side, 1, NEED);
            for (uint32_t i = 0; i < 60 * 60; i++)
                assert_true(close_to(pic->out[i].r, i % 60 >= 31 ? 100.0f : 1.0f, 13));
            filter(pic, side, 1, edge == KIND ? NEED : 0);
            for (uint32_t i = 0; i < 60 * 60; i++)
                assert_true(close_to(pic->out[i].r, i % 60 >= 31 ? 100.0f : 1.0f, 13));
            free(pic);
        }
}

/* Pixels that do not take part may hold anything; a background that takes part is smoothed. */
static void who_takes_part(void **state)
{
    (void)state;
    struct picture *pic = make_wall(30, 30);
    for (uint32_t i = 0; i < 900; i++) {
        pic->in[i] = lum_grey(1.0f);
        if (i % 7 == 0) {
            pic->kind[i] = 0;
            pic->in[i] = lum_grey(NAN);
        }
    }
    filter(pic, 3, 1, NEED);
    for (uint32_t i = 0; i < 900; i++)
        assert_true(i % 7 == 0 ? isnan(pic->out[i].r) : close_to(pic->out[i].r, 1.0f, 13));
    for (uint32_t i = 0; i < 900; i++) {
        pic->n[i] = pic->p[i] = lum_v3(0, 0, 0);
        pic->depth[i] = INFINITY;
        pic->in[i] = lum_grey((float)(i % 3));
    }
    filter(pic, 3, 1, 0);
    for (uint32_t i = 0; i < 900; i++)
        assert_true(close_to(pic->out[i].r, 1.0f, 13));
    free(pic);
}

/* The fast test agrees with the plain one, pixel by pixel, on random surfaces. */
static void rows_agree_with_pixels(void **state)
{
    (void)state;
    enum { SIDE = 40 };
    struct picture *pic = make_wall(SIDE, SIDE);
    for (uint32_t i = 0; i < SIDE * SIDE; i++) {
        float u = (float)(lum_hash_u32(3 * i) >> 8) * 0x1p-24f, v = (float)(lum_hash_u32(3 * i + 1) >> 8) * 0x1p-24f;
        pic->p[i].z += 0.02f * (u - 0.5f);
        pic->n[i] = lum_normalize(lum_v3(0.5f * (v - 0.5f), 0, -1));
        pic->in[i] = lum_grey(v);
    }
    filter(pic, 3, 1, NEED);
    uint32_t joined = 0;
    for (uint32_t y = 1; y < SIDE - 1; y++)
        for (uint32_t x = 1; x < SIDE - 1; x++) {
            double sum = 0.0, n = 0.0;
            for (uint32_t k = 0; k < 9; k++) {
                size_t a = y * SIDE + x, b = (y + k / 3 - 1) * SIDE + x + k % 3 - 1;
                assert_int_equal(lum_guide_same_surface(&pic->guide, a, b), lum_guide_same_surface(&pic->guide, b, a));
                if (!lum_guide_same_surface(&pic->guide, a, b))
                    continue;
                sum += (double)pic->in[b].r;
                n++;
                joined++;
            }
            assert_true(fabs((double)pic->out[y * SIDE + x].r - sum / n) < 1e-6);
        }
    assert_in_range(joined, 3000, 11000); /* of 12996: the test is of both answers */
    free(pic);
}

/* Spheres are smooth down to a few pixels, and steps above a pixel are not. */
static void what_is_one_surface(void **state)
{
    (void)state;
    for (float radius = 0.04f; radius < 50.0f; radius *= 1.7f) { /* of pixels of 0.01 */
        struct lum_vec3 p[2] = {{0}}, n[2] = {{0}};
        float depth[2] = {1, 1};
        struct lum_guide g = {2, 1, p, n, depth, NULL, 0.01f};
        for (float angle = 0.0f; angle < 1.4f; angle += 0.1f) {
            for (int k = 0; k < 2; k++) {
                float s = sinf(angle) + 0.01f * (float)k / radius;
                if (s >= 1.0f)
                    continue;
                n[k] = lum_v3(s, 0, -sqrtf(1.0f - s * s));
                p[k] = lum_v3_add(lum_v3(0, 0, 1 + radius), lum_v3_mul(n[k], radius));
            }
            if (lum_dot(n[0], n[1]) > 0.901f)
                assert_true(lum_guide_same_surface(&g, 0, 1));
        }
    }
}

/* side 1: the upsampling alone. */
static void ramps_are_upsampled(void **state)
{
    (void)state;
    for (uint32_t step = 2; step <= 4; step += 2) {
        struct picture *pic = make_wall(101, 60);
        uint32_t low_w = lum_filter_size(101, step), low_h = 60 / step, last = step * (low_h - 1);
        for (uint32_t i = 0; i < low_w * low_h; i++)
            pic->in[i] = lum_rgb((float)(step * (i % low_w)), (float)(step * (i / low_w)), 7.0f);
        upsample_by(pic, 1, step, false);
        for (uint32_t y = 0; y < 60; y++)
            for (uint32_t x = 0; x < 101; x++) { /* weights are multiples of 1/16: all of this is exact */
                struct lum_rgb v = pic->out[y * 101 + x];
                assert_true(v.r == (float)x && v.b == 7.0f);
                assert_true(v.g == (float)(y < last ? y : last)); /* further rows lie beyond the samples */
            }
        free(pic);
    }
}

/* A pixel on a surface without a sample takes from what is around it, if that is lenient; a share of 2^-10 of it where
 * there are samples of its own. */
static void lenient_upsampling_serves_all(void **state)
{
    (void)state;
    struct picture *pic = make_wall(40, 40);
    for (uint32_t i = 0; i < 10 * 10; i++)
        pic->in[i] = lum_grey(3.0f);
    for (uint32_t y = 0; y < 40; y++)
        pic->p[y * 40 + 5].z = 3.0f; /* no sample lies on this column, */
    for (uint32_t y = 0; y < 40; y++)
        pic->n[y * 40 + 6] = lum_v3(0, 0, 1); /* and this one faces away from all */
    pic->out[6] = lum_grey(-1.0f);
    upsample_by(pic, 1, 4, true);
    assert_true(close_to(pic->out[5].r, 3.0f, 13) && pic->out[6].r == -1.0f);
    for (uint32_t i = 0; i < 10 * 10; i++)
        pic->in[i] = lum_grey(i % 10 == 1 ? 3.0f : 1024.0f); /* at x = 4; the others lie on the farther wall */
    for (uint32_t i = 0; i < 40 * 40; i++)
        pic->p[i].z = i % 40 == 4 || i % 40 == 3 ? 1.0f : 3.0f;
    upsample_by(pic, 1, 4, true);
    float v = pic->out[3].r; /* 3/4 on its wall, against 1/4 of the share at most */
    assert_true(v >= 3.0f && v <= 3.0f + 1024.0f * LUM_LENIENT_SHARE / 3.0f);
    free(pic);
}

static void constants_are_upsampled(void **state)
{
    (void)state;
    for (size_t k = 0; k < LUM_ARRAY_LEN(sizes); k++) {
        struct picture *pic = make_wall(sizes[k][0], sizes[k][1]);
        for (uint32_t i = 0; i < lum_filter_size(sizes[k][0], 2) * lum_filter_size(sizes[k][1], 2); i++)
            pic->in[i] = lum_grey(2.0f);
        upsample(pic, 3);
        for (uint32_t i = 0; i < sizes[k][0] * sizes[k][1]; i++)
            assert_true(close_to(pic->out[i].r, 2.0f, 13));
        free(pic);
    }
}

static void upsampling_stops_at_edges(void **state)
{
    (void)state;
    struct picture *pic = make_wall(40, 40);
    for (uint32_t i = 0; i < 20 * 20; i++)
        pic->in[i] = lum_grey(i % 20 >= 10 ? 100.0f : 1.0f);
    for (uint32_t i = 0; i < 40 * 40; i++) {
        if (i % 40 >= 20)
            pic->n[i] = lum_v3(-1, 0, 0);
        pic->out[i] = lum_grey(-1.0f);
    }
    for (uint32_t y = 0; y < 40; y++)
        pic->p[y * 40 + 5].z = 3.0f; /* a column that no sample lies on */
    pic->kind[0] = 0;
    upsample(pic, 3);
    struct lum_filter f = {&pic->guide, NEED, 3, 1, 2, pic->in, false};
    for (uint32_t y = 0; y < 40; y++)
        for (uint32_t x = 0; x < 40; x++) {
            float v = pic->out[y * 40 + x].r;
            bool served = x != 5 && x + y > 0;
            if (x + y > 0)
                assert_int_equal(lum_upsample_taps(&f, x, y) != 0, served);
            assert_true(served ? close_to(v, x >= 20 ? 100.0f : 1.0f, 13) : v == -1.0f);
        }
    free(pic);
}

/* With all taps known, the plain mean is what the bilinear weights give, bit for bit. */
static void taps_say_the_same(void **state)
{
    (void)state;
    for (size_t k = 0; k < LUM_ARRAY_LEN(sizes); k++) {
        uint32_t w = sizes[k][0], h = sizes[k][1], low_w = lum_filter_size(w, 2), low_h = lum_filter_size(h, 2);
        struct picture *pic = make_wall(w, h);
        uint8_t *taps = calloc(w * h, 1);
        struct lum_rgb *mean = calloc(w * h, sizeof *mean);
        assert_true(taps && mean);
        for (uint32_t i = 0; i < low_w * low_h; i++)
            pic->in[i] = lum_rgb(0.1f * (float)(i % 7), 1.0f / (float)(i + 3), 1e3f * (float)(i % 3));
        for (uint32_t i = 0; i < w * h; i++) { /* three walls, and holes */
            pic->p[i].z = (float)(lum_hash_u32(i) % 3);
            pic->kind[i] = lum_hash_u32(i + 1000) % 5 ? pic->kind[i] : 0;
            pic->out[i] = mean[i] = lum_grey(-1.0f);
        }
        upsample_by(pic, 1, 2, false);
        struct lum_filter f = {&pic->guide, NEED, 1, 1, 2, pic->in, false};
        for (uint32_t y = 0; y < h; y++)
            for (uint32_t x = 0; x < w; x++)
                if (pic->kind[y * w + x] & NEED)
                    taps[y * w + x] = lum_upsample_taps(&f, x, y);
        struct lum_filter_rect all = {0, 0, w, h};
        lum_filter_by_taps(&f, taps, &all, mean);
        assert_memory_equal(mean, pic->out, w * h * sizeof *mean);
        free(taps);
        free(mean);
        free(pic);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_window_holds_each_set_once),
        cmocka_unit_test(places_are_those_of_their_sets),
        cmocka_unit_test(a_pixel_takes_each_set_once),
        cmocka_unit_test(windows_beyond_an_edge_find_their_sets),
        cmocka_unit_test(packets_are_whole_patterns),
        cmocka_unit_test(listing_5_2),
        cmocka_unit_test(listing_5_3),
        cmocka_unit_test(listing_5_4),
        cmocka_unit_test(a_constant_stays),
        cmocka_unit_test(structured_noise_cancels),
        cmocka_unit_test(wide_windows_cancel),
        cmocka_unit_test(nothing_bleeds_over_edges),
        cmocka_unit_test(who_takes_part),
        cmocka_unit_test(rows_agree_with_pixels),
        cmocka_unit_test(what_is_one_surface),
        cmocka_unit_test(ramps_are_upsampled),
        cmocka_unit_test(taps_say_the_same),
        cmocka_unit_test(lenient_upsampling_serves_all),
        cmocka_unit_test(constants_are_upsampled),
        cmocka_unit_test(upsampling_stops_at_edges),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

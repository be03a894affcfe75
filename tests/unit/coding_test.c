/* Which coding is chosen for which line: in steps, without flapping, and never worse than what was asked for where the
 * line is wide. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "server/stream/coding.h"

#define PIXELS 400000.0
#define QUALITY 85u

/* Of a picture of 400 000 pixels, smooth, as WebP of so many times the bytes that the table has. The numbers are those
 * of the measurement that the table is from. */
struct picture {
    double jpeg_bytes, webp_of_jpeg, rough_of_jpeg;
};
static const struct picture smooth = {92000, 0.55, 0.28}, noisy = {204000, 0.75, 0.48}, simple = {43000, 0.38, 0.2};

static struct lum_coding frame(struct lum_coding_state *s, const struct picture *p, double bytes_s, double wobble)
{
    struct lum_coding c = lum_coding_choose(
        s, QUALITY, &(struct lum_coding_line){.bytes_s = bytes_s, .threads = 2, .webp = true, .colors = false});
    double share = c.codec == LUM_CODEC_JPEG ? 1.0 : c.quality == QUALITY ? p->webp_of_jpeg : p->rough_of_jpeg;
    double ns = c.codec == LUM_CODEC_JPEG ? 3.0 : 35.0;
    lum_coding_note(s, QUALITY,
                    &(struct lum_coding_cost){(uint64_t)(p->jpeg_bytes * share * wobble), (uint64_t)PIXELS,
                                              (uint64_t)(ns * PIXELS)});
    return c;
}

static int step_of(struct lum_coding c)
{
    return c.codec == LUM_CODEC_JPEG ? 0 : c.quality == QUALITY ? 1 : 2;
}

static struct lum_coding settled(const struct picture *p, double bytes_s, struct lum_coding_state *s)
{
    struct lum_coding c = {0};
    for (int n = 0; n < 40; n++)
        c = frame(s, p, bytes_s, 1.0);
    return c;
}

static void without_webp_it_is_what_was_asked_for(void **state)
{
    (void)state;
    for (uint32_t quality = 1; quality <= 100; quality++) {
        struct lum_coding_state s = {0};
        for (int n = 0; n < 20; n++) {
            struct lum_coding c =
                lum_coding_choose(&s, quality, &(struct lum_coding_line){.bytes_s = 1000, .threads = 1});
            assert_true(c.codec == LUM_CODEC_JPEG && c.quality == quality);
            lum_coding_note(&s, quality, &(struct lum_coding_cost){100000, 400000, 1000000});
        }
    }
}

/* Nothing is known of the line: as it was asked for. JPEG is there within 60 ms: likewise. */
static void wide_lines_have_jpeg(void **state)
{
    (void)state;
    const struct picture *pictures[] = {&smooth, &noisy, &simple};
    for (int i = 0; i < 3; i++)
        for (double bytes_s = pictures[i]->jpeg_bytes / 0.055; bytes_s < 1e12; bytes_s *= 1.3) {
            struct lum_coding_state s = {0};
            assert_int_equal(step_of(settled(pictures[i], bytes_s, &s)), 0);
            s = (struct lum_coding_state){0};
            assert_int_equal(step_of(settled(pictures[i], 0.0, &s)), 0);
        }
}

/* From the widest to the thinnest line the steps only go down, all are taken, and thin ones have the last. */
static void thinner_lines_have_fewer_bytes(void **state)
{
    (void)state;
    const struct picture *pictures[] = {&smooth, &noisy, &simple};
    for (int i = 0; i < 3; i++) {
        int last = 0, taken = 0;
        for (double bytes_s = 1e8; bytes_s > 5e3; bytes_s /= 1.1) {
            struct lum_coding_state s = {0};
            int step = step_of(settled(pictures[i], bytes_s, &s));
            assert_true(step >= last);
            taken |= 1 << step;
            last = step;
        }
        assert_int_equal(last, 2);
        assert_int_equal(taken, 7);
    }
}

/* On a line of any rate, with frames whose sizes go up and down by a quarter: once it has found its step it stays. */
static void it_does_not_flap(void **state)
{
    (void)state;
    const struct picture *pictures[] = {&smooth, &noisy, &simple};
    for (int i = 0; i < 3; i++)
        for (double bytes_s = 1e8; bytes_s > 5e3; bytes_s /= 1.03) {
            struct lum_coding_state s = {0};
            uint32_t random = 7;
            int changes = 0, step = 0;
            for (int n = 0; n < 400; n++) {
                random = random * 1664525u + 1013904223u;
                double wobble = 0.88 + 0.24 * (double)(random >> 8) / (1 << 24);
                int now = step_of(frame(&s, pictures[i], bytes_s, wobble));
                changes += now != step;
                step = now;
            }
            if (changes > 3)
                fail_msg("%d changes at %.0f bytes a second, picture %d", changes, bytes_s, i);
        }
}

/* A line that gets wide again has what was asked for again. */
static void it_comes_back(void **state)
{
    (void)state;
    struct lum_coding_state s = {0};
    assert_int_equal(step_of(settled(&smooth, 1e5, &s)), 2);
    assert_int_equal(step_of(settled(&smooth, 1e7, &s)), 0);
    assert_int_equal(step_of(settled(&smooth, 8e5, &s)), 1);
}

/* Where WebP takes this machine longer than the line gains, JPEG stays. */
static void slow_encoding_counts(void **state)
{
    (void)state;
    struct lum_coding_state s = {0};
    for (int n = 0; n < 40; n++) {
        struct lum_coding c =
            lum_coding_choose(&s, QUALITY, &(struct lum_coding_line){.bytes_s = 1e6, .threads = 1, .webp = true});
        assert_int_equal(c.codec, LUM_CODEC_JPEG);
        lum_coding_note(&s, QUALITY, &(struct lum_coding_cost){92000, 400000, 12000000}); /* ten times ours */
    }
}

/* Maps of values, and clients that ask for little anyway, have no more error than they asked for. */
static void error_has_a_limit(void **state)
{
    (void)state;
    for (uint32_t quality = 1; quality <= 100; quality++)
        for (int colors = 0; colors < 2; colors++) {
            struct lum_coding_state s = {0};
            for (int n = 0; n < 60; n++) {
                if (n == 30) /* the map comes when the picture is rough already */
                    colors = 1;
                struct lum_coding c = lum_coding_choose(
                    &s, quality,
                    &(struct lum_coding_line){.bytes_s = 3e4, .threads = 2, .webp = true, .colors = colors});
                assert_true(c.quality <= quality && c.quality >= (quality < 50 || colors ? quality : 50));
                /* WebP of the same error: there is none above 90, nor of 90 with the edges of a map's colours. */
                if (c.codec == LUM_CODEC_WEBP && c.quality == quality)
                    assert_true(quality < 90 || (quality == 90 && !colors));
                lum_coding_note(&s, quality, &(struct lum_coding_cost){60000, 400000, 3000000});
            }
        }
}

/* Qualities that WebP has no like of go from JPEG to what is rougher and back, and stay where they are. */
static void above_ninety_there_are_two_steps(void **state)
{
    (void)state;
    for (uint32_t quality = 89; quality <= 100; quality++)
        for (int colors = 0; colors < 2; colors++) {
            struct lum_coding_state s = {0};
            int seen = 0, changes = 0;
            uint8_t codec = LUM_CODEC_JPEG;
            for (double bytes_s = 1e7; bytes_s > 1e4; bytes_s /= 1.02) {
                const struct lum_coding_line line = {.bytes_s = bytes_s, .threads = 2, .webp = true, .colors = colors};
                struct lum_coding c = lum_coding_choose(&s, quality, &line);
                bool rough = c.codec == LUM_CODEC_WEBP && c.quality == 50;
                double bytes = c.codec == LUM_CODEC_JPEG ? 150000 : rough ? 20000 : 75000;
                lum_coding_note(&s, quality, &(struct lum_coding_cost){(uint64_t)bytes, 400000, 2000000});
                seen |= c.codec == LUM_CODEC_JPEG ? 1 : rough ? 4 : 2;
                changes += c.codec != codec;
                codec = c.codec;
            }
            bool like = quality < 90 || (quality == 90 && !colors);
            assert_int_equal(seen, 1 | (like ? 2 : 0) | (colors ? 0 : 4));
            assert_int_equal(changes, like || !colors);
            for (int n = 0; n < 40; n++) {
                const struct lum_coding_line wide = {.bytes_s = 1e8, .threads = 2, .webp = true, .colors = colors};
                codec = lum_coding_choose(&s, quality, &wide).codec;
                lum_coding_note(&s, quality, &(struct lum_coding_cost){20000, 400000, 2000000});
            }
            assert_int_equal(codec, LUM_CODEC_JPEG);
        }
}

static void webp_qualities_rise(void **state)
{
    (void)state;
    for (uint32_t quality = 1; quality <= 100; quality++) {
        int q = lum_coding_webp_quality(quality);
        assert_true(q >= 1 && q <= 100 && (quality == 1 || q >= lum_coding_webp_quality(quality - 1)));
    }
}

/* ---- video ---- */

static struct lum_coding_line thin_line(double bytes_s, bool webp)
{
    return (struct lum_coding_line){.bytes_s = bytes_s, .threads = 2, .webp = webp, .vp9 = true};
}

/* As frame(), of a client that reads VP9; the bytes of a video are what may be on that line. */
static uint8_t video_frame(struct lum_coding_state *s, const struct picture *p, double bytes_s, bool webp)
{
    const struct lum_coding_line line = thin_line(bytes_s, webp);
    struct lum_coding c = lum_coding_choose(s, QUALITY, &line);
    double share = c.codec == LUM_CODEC_JPEG ? 1.0 : c.quality == QUALITY ? p->webp_of_jpeg : p->rough_of_jpeg;
    double ns = c.codec == LUM_CODEC_JPEG ? 3.0 : 35.0;
    lum_coding_note(
        s, QUALITY,
        &(struct lum_coding_cost){(uint64_t)(p->jpeg_bytes * share), (uint64_t)PIXELS, (uint64_t)(ns * PIXELS)});
    return c.codec;
}

/* Where tiles in the fewest bytes take more than a tenth of a second it is video: with the second frame, for on such a
 * line each tile less is a gain. Where they are there in half the time it is not, whatever it was before. */
static void video_is_for_lines_too_thin_for_tiles(void **state)
{
    (void)state;
    const struct picture *pictures[] = {&smooth, &noisy, &simple};
    for (int i = 0; i < 3; i++)
        for (int webp = 0; webp < 2; webp++)
            for (double bytes_s = 5e3; bytes_s < 1e8; bytes_s *= 1.2) {
                struct lum_coding_state s = {0};
                const struct picture *p = pictures[i];
                double fewest = p->jpeg_bytes * (webp ? p->rough_of_jpeg : 1.0);
                assert_int_equal(video_frame(&s, p, bytes_s, webp), LUM_CODEC_JPEG);
                uint8_t second = video_frame(&s, p, bytes_s, webp);
                if (fewest / bytes_s > 0.2)
                    assert_int_equal(second, LUM_CODEC_VP9);
                uint8_t last = 0;
                for (int n = 0; n < 60; n++)
                    last = video_frame(&s, p, bytes_s, webp);
                if (fewest / bytes_s > 0.15)
                    assert_int_equal(last, LUM_CODEC_VP9);
                if (fewest / bytes_s < 0.05)
                    assert_int_not_equal(last, LUM_CODEC_VP9);
                for (int n = 0; n < 60; n++) /* the line gets wide */
                    last = video_frame(&s, p, 1e8, webp);
                assert_int_equal(last, LUM_CODEC_JPEG);
            }
}

static void video_does_not_flap(void **state)
{
    (void)state;
    for (double bytes_s = 1e6; bytes_s > 5e3; bytes_s /= 1.03) {
        struct lum_coding_state s = {0};
        uint32_t random = 3;
        int changes = 0;
        uint8_t codec = LUM_CODEC_JPEG;
        for (int n = 0; n < 400; n++) {
            random = random * 1664525u + 1013904223u;
            double wobble = 0.88 + 0.24 * (double)(random >> 8) / (1 << 24);
            uint8_t now = video_frame(&s, &smooth, bytes_s * wobble, true);
            changes += now != codec;
            codec = now;
        }
        if (changes > 3)
            fail_msg("%d changes at %.0f bytes a second", changes, bytes_s);
    }
}

/* What stands for values never comes as video, nor does anything to who stopped reading it. */
static void values_are_no_video(void **state)
{
    (void)state;
    for (int webp = 0; webp < 2; webp++)
        for (int colors = 0; colors < 2; colors++) {
            struct lum_coding_state s = {0};
            for (int n = 0; n < 10; n++)
                video_frame(&s, &smooth, 2e4, webp);
            assert_int_equal(video_frame(&s, &smooth, 2e4, webp), LUM_CODEC_VP9);
            struct lum_coding_line line = thin_line(2e4, webp);
            line.colors = colors;
            line.vp9 = colors;
            for (int n = 0; n < 30; n++) {
                struct lum_coding c = lum_coding_choose(&s, QUALITY, &line);
                assert_int_equal(c.codec, webp ? LUM_CODEC_WEBP : LUM_CODEC_JPEG);
                assert_true(c.quality == (webp && !colors ? 50 : QUALITY));
                lum_coding_note(&s, QUALITY, &(struct lum_coding_cost){20000, 400000, 3000000});
            }
        }
}

/* Its pictures take the line for a fourteenth of a second; where they come seldom for longer, but not for long. */
static void a_picture_of_a_video_has_its_bytes(void **state)
{
    (void)state;
    assert_int_equal(lum_coding_video_bytes(0.0, 0.0), 5000);
    assert_int_equal(lum_coding_video_bytes(1e5, 0.0), 7000);
    assert_int_equal(lum_coding_video_bytes(1e5, 0.1), 7000);
    assert_int_equal(lum_coding_video_bytes(1e5, 0.3), 15000);
    assert_int_equal(lum_coding_video_bytes(1e5, 30.0), 20000);
    assert_int_equal(lum_coding_video_bytes(1e30, 0.1), 1000000);
}

/* The next picture, at rest: 20 times as many pixels as one that moves. */
static struct lum_coding rest_frame(struct lum_coding_state *s, double bytes_s, bool webp)
{
    struct lum_coding_line line = thin_line(bytes_s, webp);
    line.rest = true;
    struct lum_coding c = lum_coding_choose(s, QUALITY, &line);
    double share = c.codec == LUM_CODEC_JPEG ? 1.0 : c.quality == QUALITY ? 0.55 : 0.28;
    lum_coding_note(s, QUALITY,
                    &(struct lum_coding_cost){(uint64_t)(20.0 * smooth.jpeg_bytes * share), (uint64_t)(20.0 * PIXELS),
                                              (uint64_t)(60.0 * PIXELS)});
    return c;
}

/* However long it refines, it is tiles, in few bytes from the first on; and the next picture that moves is video. */
static void a_drag_goes_on_as_video_after_a_rest(void **state)
{
    (void)state;
    for (int webp = 0; webp < 2; webp++) {
        struct lum_coding_state s = {0};
        for (int n = 0; n < 10; n++)
            video_frame(&s, &smooth, 2e4, webp);
        for (int drag = 0; drag < 3; drag++) {
            assert_int_equal(video_frame(&s, &smooth, 2e4, webp), LUM_CODEC_VP9);
            for (int n = 0; n < 20; n++) {
                struct lum_coding c = rest_frame(&s, 2e4, webp);
                assert_int_equal(c.codec, webp ? LUM_CODEC_WEBP : LUM_CODEC_JPEG);
                assert_int_equal(c.quality, webp ? 50 : QUALITY);
                assert_true(lum_coding_is_video(&s));
            }
        }
        for (int n = 0; n < 60; n++) /* the line gets wide, and the notes are still those of pictures that move */
            video_frame(&s, &smooth, 1e8, webp);
        assert_false(lum_coding_is_video(&s));
    }
}

/* On a line that has pictures that move as JPEG they stay so, whatever those at rest take. */
static void a_rest_tells_nothing_of_a_drag(void **state)
{
    (void)state;
    const double bytes_s = smooth.jpeg_bytes / 0.05;
    for (int webp = 0; webp < 2; webp++) {
        struct lum_coding_state s = {0};
        for (int drag = 0; drag < 3; drag++) {
            for (int n = 0; n < 10; n++)
                assert_int_equal(video_frame(&s, &smooth, bytes_s, webp), LUM_CODEC_JPEG);
            for (int n = 0; n < 20; n++)
                assert_int_not_equal(rest_frame(&s, bytes_s, webp).codec, LUM_CODEC_VP9);
        }
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(without_webp_it_is_what_was_asked_for),
        cmocka_unit_test(wide_lines_have_jpeg),
        cmocka_unit_test(thinner_lines_have_fewer_bytes),
        cmocka_unit_test(it_does_not_flap),
        cmocka_unit_test(it_comes_back),
        cmocka_unit_test(slow_encoding_counts),
        cmocka_unit_test(error_has_a_limit),
        cmocka_unit_test(above_ninety_there_are_two_steps),
        cmocka_unit_test(webp_qualities_rise),
        cmocka_unit_test(video_is_for_lines_too_thin_for_tiles),
        cmocka_unit_test(video_does_not_flap),
        cmocka_unit_test(values_are_no_video),
        cmocka_unit_test(a_picture_of_a_video_has_its_bytes),
        cmocka_unit_test(a_drag_goes_on_as_video_after_a_rest),
        cmocka_unit_test(a_rest_tells_nothing_of_a_drag),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

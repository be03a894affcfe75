/* Pictures of views as chunks of a video: what their headers say, when they stand alone, and how encoders share the
 * room that there is for them. */
#include <string.h>

#include "server/stream/video.h"
#include "tests/support/encoder_bed.h"

static struct lum_rgb room(uint32_t x, uint32_t y)
{
    float v = (x / 37 + y / 29) % 2 ? 0.8f : 0.35f;
    return lum_rgb(v, v * 0.93f, v * 0.8f);
}

static int setup(void **state)
{
    *state = encoder_bed_begin(room);
    return 0;
}

/* The next chunk's header, or kind 0: there is none. */
static struct lum_frame_header chunk(struct fixture *f, struct lum_video *v, bool key)
{
    struct lum_encoded_tile *tile = NULL;
    struct lum_frame_header h = {0};
    struct lum_error err;
    if (lum_video_run(v, f->encoder, &f->picture, &(struct lum_video_want){4000, key}, &tile, &err)) {
        assert_null(tile);
        assert_null(v->vp9);
        return h;
    }
    h = tile->header;
    assert_int_equal(h.payload_len, tile->n_bytes);
    lum_encoded_tile_unref(tile);
    return h;
}

/* They were used this moment, for an hour: what a slow machine takes for the others is no rest. */
static void keep_busy(struct lum_video *v, uint32_t n)
{
    for (uint32_t i = 0; i < n; i++)
        v[i].used_ns = lum_clock_ns() + 3600 * (int64_t)1e9;
}

static bool is_key(struct lum_frame_header h)
{
    assert_int_equal(h.kind, LUM_FRAME_TILE);
    return h.flags & LUM_FRAME_KEY;
}

static void a_chunk_covers_the_picture(void **state)
{
    struct fixture *f = *state;
    struct lum_video v = {0};
    f->picture.header.downscale = 2; /* of a rough picture: it is shown in full size */
    struct lum_frame_header h = chunk(f, &v, false);
    assert_true(h.kind == LUM_FRAME_TILE && h.codec == LUM_CODEC_VP9 && h.downscale == 0);
    assert_true(h.x == 0 && h.y == 0 && h.w == W && h.h == H && h.full_w == W && h.full_h == H);
    assert_true(h.frame_seq == 7 && h.scene_rev == 3 && h.view_id == 9 && h.quality <= 100);
    assert_int_equal(h.flags, LUM_FRAME_KEY);
    assert_false(is_key(chunk(f, &v, false)));
    assert_true(is_key(chunk(f, &v, true)));
    lum_video_close(&v);
    lum_video_close(&v);
    assert_true(is_key(chunk(f, &v, false)));
    lum_video_close(&v);
    assert_int_equal(lum_encoder_videos(f->encoder)->n, 0);
}

/* A film of another size is another video. */
static void a_size_begins_with_a_key(void **state)
{
    struct fixture *f = *state;
    struct lum_video v = {0};
    struct lum_film small;
    assert_int_equal(lum_film_init(&small, 33, 21, NULL), LUM_OK);
    assert_true(is_key(chunk(f, &v, false)));
    f->picture.film = &small;
    struct lum_frame_header h = chunk(f, &v, false);
    assert_true(is_key(h) && h.w == 33 && h.full_h == 21);
    f->picture.film = &f->film;
    assert_true(is_key(chunk(f, &v, false)));
    const struct lum_video_room *room = lum_encoder_videos(f->encoder);
    assert_true(room->n == 1 && room->n_pixels == W * H);
    lum_video_close(&v);
    assert_true(room->n == 0 && room->n_pixels == 0 && !room->first);
    lum_film_finish(&small);
}

/* Of views that all move the first have it; one that rests gives its place to another, and comes back with a key. */
static void there_is_room_for_so_many(void **state)
{
    struct fixture *f = *state;
    static struct lum_video v[LUM_LIMIT_VIDEOS + 1];
    struct lum_video *last = &v[LUM_LIMIT_VIDEOS];
    for (uint32_t i = 0; i < LUM_LIMIT_VIDEOS; i++)
        assert_true(is_key(chunk(f, &v[i], false)));
    keep_busy(v, LUM_LIMIT_VIDEOS);
    assert_int_equal(chunk(f, last, false).kind, 0);
    for (uint32_t i = 0; i < LUM_LIMIT_VIDEOS; i++) /* who asks in vain takes nothing away */
        assert_false(is_key(chunk(f, &v[i], false)));
    keep_busy(v, LUM_LIMIT_VIDEOS);
    v[3].used_ns = lum_clock_ns() - 2 * LUM_VIDEO_UNUSED_NS;
    v[5].used_ns = v[3].used_ns - LUM_VIDEO_UNUSED_NS;
    assert_true(is_key(chunk(f, last, false)));
    assert_true(v[3].vp9 && !v[5].vp9);
    keep_busy(last, 1);
    assert_true(is_key(chunk(f, &v[5], false))); /* in the place of 3 */
    assert_null(v[3].vp9);
    keep_busy(&v[5], 1);
    assert_int_equal(chunk(f, &v[3], false).kind, 0);
    assert_int_equal(lum_encoder_videos(f->encoder)->n, LUM_LIMIT_VIDEOS);
    for (uint32_t i = 0; i <= LUM_LIMIT_VIDEOS; i++)
        lum_video_close(&v[i]);
    assert_int_equal(lum_encoder_videos(f->encoder)->n_pixels, 0);
}

/* One that nobody uses does not keep its memory, though nobody else needs the room. */
static void who_rests_for_long_gives_it_back(void **state)
{
    struct fixture *f = *state;
    struct lum_video_room *room = lum_encoder_videos(f->encoder);
    struct lum_video a = {0}, b = {0};
    assert_int_equal(lum_video_close_unused(room, INT64_MAX), INT64_MAX);
    assert_true(is_key(chunk(f, &a, false)) && is_key(chunk(f, &b, false)));
    int64_t now_ns = a.used_ns;
    b.used_ns = now_ns + 7;
    assert_int_equal(lum_video_close_unused(room, now_ns + LUM_VIDEO_KEPT_NS - 1), 1);
    assert_true(a.vp9 && b.vp9);
    assert_int_equal(lum_video_close_unused(room, now_ns + LUM_VIDEO_KEPT_NS), 7);
    assert_true(!a.vp9 && b.vp9 && room->n == 1);
    assert_true(is_key(chunk(f, &a, false)));
    lum_video_close(&a);
    assert_int_equal(lum_video_close_unused(room, b.used_ns + LUM_VIDEO_KEPT_NS), INT64_MAX);
    assert_true(!b.vp9 && room->n == 0 && room->n_pixels == 0);
}

/* Their pixels have an end, too. */
static void pixels_have_an_end(void **state)
{
    struct fixture *f = *state;
    struct lum_video a = {0}, b = {0};
    struct lum_film large;
    assert_true(lum_video_fits(2048, 2048));
    assert_false(lum_video_fits(2049, 2048) || lum_video_fits(4096, 4096));
    assert_int_equal(lum_film_init(&large, 2049, 2048, NULL), LUM_OK);
    f->picture.film = &large;
    assert_int_equal(chunk(f, &a, false).kind, 0);
    large.w = 2048;
    large.h = 2047;
    assert_true(is_key(chunk(f, &a, false)));
    f->picture.film = &f->film;
    keep_busy(&a, 1);
    assert_int_equal(chunk(f, &b, false).kind, 0); /* 2048 pixels are left */
    a.used_ns = lum_clock_ns() - 2 * LUM_VIDEO_UNUSED_NS;
    assert_true(is_key(chunk(f, &b, false)));
    assert_null(a.vp9);
    lum_video_close(&b);
    lum_film_finish(&large);
}

/* Then it is closed, and begins anew. */
static void memory_that_is_short_is_an_answer(void **state)
{
    struct fixture *f = *state;
    struct lum_video v = {0};
    unsigned n_failed = 0;
    for (uint64_t k = 1;; k++) {
        lum_alloc_fail_after(k);
        struct lum_frame_header h = chunk(f, &v, false);
        lum_alloc_fail_after(0);
        if (h.kind)
            break;
        n_failed++;
        assert_int_equal(lum_encoder_videos(f->encoder)->n, 0);
    }
    assert_true(n_failed >= 2); /* the encoder, and the chunk */
    assert_false(is_key(chunk(f, &v, false)));
    lum_alloc_fail_after(1);
    assert_int_equal(chunk(f, &v, false).kind, 0); /* that chunk is lost to the client */
    lum_alloc_fail_after(0);
    assert_true(is_key(chunk(f, &v, false)));
    lum_video_close(&v);
}

static void without_vp9_there_is_none(void **state)
{
    struct fixture *f = *state;
    struct lum_video v = {0};
    assert_int_equal(chunk(f, &v, false).kind, 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup_teardown(a_chunk_covers_the_picture, setup, encoder_bed_end),
        cmocka_unit_test_setup_teardown(a_size_begins_with_a_key, setup, encoder_bed_end),
        cmocka_unit_test_setup_teardown(there_is_room_for_so_many, setup, encoder_bed_end),
        cmocka_unit_test_setup_teardown(who_rests_for_long_gives_it_back, setup, encoder_bed_end),
        cmocka_unit_test_setup_teardown(pixels_have_an_end, setup, encoder_bed_end),
        cmocka_unit_test_setup_teardown(memory_that_is_short_is_an_answer, setup, encoder_bed_end),
    };
    const struct CMUnitTest none[] = {
        cmocka_unit_test_setup_teardown(without_vp9_there_is_none, setup, encoder_bed_end)};
    if (!lum_vp9_available())
        return cmocka_run_group_tests(none, NULL, NULL);
    return cmocka_run_group_tests(tests, NULL, NULL);
}

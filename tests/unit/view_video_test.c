/* A view whose pictures are video while they move, and larger at rest: which of them take an encoder, of which size. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "core/base/base.h"
#include "server/director/rest.h"
#include "server/director/view_frames.h"
#include "server/stream/vp9.h"

enum { W = 96, H = 64, PASSES = 1000 };
/* Alone more pixels than all videos may have. */
enum { REST_W = 4096, REST_H = 1025 };
_Static_assert(REST_W *REST_H > LUM_LIMIT_VIDEO_PIXELS, "no video is as large");

struct bed {
    struct lum_world world;
    struct lum_encoder *encoder;
    struct lum_server_view *view;
    uint64_t order;
};

static void bed_begin(struct bed *b)
{
    struct lum_proto_error err;
    const struct lum_view_params params = {.given = LUM_VIEW_BIT(SIZE) | LUM_VIEW_BIT(REST_SIZE) | LUM_VIEW_BIT(SPP) |
                                                    LUM_VIEW_BIT(EXPOSURE_EV),
                                           .size = {W, H},
                                           .rest_size = {REST_W, REST_H},
                                           .spp = 1,
                                           .codecs_given = true,
                                           .codecs = 1u << LUM_CODEC_WEBP | 1u << LUM_CODEC_VP9,
                                           .exposure_ev = {true, 10.0}};
    *b = (struct bed){0};
    assert_int_equal(lum_world_init(&b->world, 2, NULL, NULL, NULL), LUM_OK);
    assert_int_equal(lum_world_commit(&b->world, NULL), LUM_OK);
    assert_int_equal(lum_encoder_create(b->world.pool, &b->encoder, NULL), LUM_OK);
    assert_true(lum_server_view_create(&b->world, &params, 1, &b->view, &err));
    b->view->codec = LUM_CODEC_JPEG;
}

static void bed_end(struct bed *b)
{
    lum_server_view_destroy(b->view);
    assert_int_equal(lum_encoder_videos(b->encoder)->n, 0);
    lum_encoder_destroy(b->encoder);
    lum_world_finish(&b->world);
}

/* As on a line that is too thin for tiles. */
static void have_video(struct lum_server_view *v)
{
    const struct lum_coding_line line = {.bytes_s = 1e4, .threads = 2, .vp9 = true};
    lum_coding_choose(&v->coding, 85, &line);
    lum_coding_note(&v->coding, 85, &(struct lum_coding_cost){100000, W * H, 1000000});
    assert_int_equal(lum_coding_choose(&v->coding, 85, &line).codec, LUM_CODEC_VP9);
}

static void move(struct bed *b)
{
    struct lum_proto_error err;
    const struct lum_view_params params = {
        .given = LUM_VIEW_BIT(CAMERA),
        .camera = {.position = {0.1 * (double)++b->order, 2, 4}, .up = {0, 1, 0}, .vfov_deg = 40}};
    assert_true(lum_server_view_update(b->view, &b->world, &params, &err));
    lum_server_view_refresh(b->view, &b->world, lum_clock_ns(), b->order);
}

static void pass(struct bed *b)
{
    struct lum_error err;
    assert_int_equal(lum_server_view_pass(b->view, lum_world_lit(&b->world), NULL, &err), LUM_OK);
}

static uint8_t published(struct bed *b)
{
    struct lum_published p;
    struct lum_error err;
    assert_int_equal(lum_server_view_publish(b->view, lum_world_lit(&b->world), b->encoder, LUM_DUE_FRAME, &p, &err),
                     LUM_OK);
    return p.coding.codec;
}

static void come_to_rest(struct bed *b)
{
    int n = 0;
    do
        pass(b);
    while (!b->view->rest.shown && ++n < PASSES);
    assert_true(b->view->rest.shown);
}

static void a_picture_at_rest_takes_no_encoder(void **state)
{
    (void)state;
    if (!lum_vp9_available())
        skip();
    struct bed b;
    bed_begin(&b);
    struct lum_server_view *v = b.view;
    const struct lum_video_room *room = lum_encoder_videos(b.encoder);
    have_video(v);
    for (int drag = 0; drag < 3; drag++) {
        for (int n = 0; n < 3; n++) {
            move(&b);
            pass(&b);
            assert_int_equal(published(&b), LUM_CODEC_VP9);
            assert_true(room->n == 1 && room->n_pixels == W * H);
        }
        come_to_rest(&b);
        assert_int_not_equal(published(&b), LUM_CODEC_VP9);
        assert_true(room->n == 1 && room->n_pixels == W * H);
        assert_int_equal(v->video.failed_ns, 0);
    }
    bed_end(&b);
}

/* A picture that found no room keeps those of its size from asking, not smaller ones. */
static void what_had_no_room_is_known_by_its_size(void **state)
{
    (void)state;
    if (!lum_vp9_available())
        skip();
    struct bed b;
    bed_begin(&b);
    struct lum_server_view *v = b.view;
    for (int smaller = 0; smaller < 2; smaller++) {
        have_video(v);
        v->video.failed_ns = lum_clock_ns();
        v->video.failed_pixels = W * H + (uint64_t)smaller;
        move(&b);
        pass(&b);
        if (smaller)
            assert_int_equal(published(&b), LUM_CODEC_VP9);
        else
            assert_int_not_equal(published(&b), LUM_CODEC_VP9);
        v->coding = (struct lum_coding_state){0};
    }
    bed_end(&b);
}

/* The encoder's memory is free as soon as tiles do. */
static void tiles_close_the_video(void **state)
{
    (void)state;
    if (!lum_vp9_available())
        skip();
    struct bed b;
    bed_begin(&b);
    have_video(b.view);
    for (int video = 1; video >= 0; video--) {
        move(&b);
        pass(&b);
        assert_true((published(&b) == LUM_CODEC_VP9) == video);
        assert_int_equal(lum_encoder_videos(b.encoder)->n, (uint32_t)video);
        b.view->coding = (struct lum_coding_state){0}; /* as once the line got wide */
    }
    bed_end(&b);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_picture_at_rest_takes_no_encoder),
        cmocka_unit_test(what_had_no_room_is_known_by_its_size),
        cmocka_unit_test(tiles_close_the_video),
    };
    return cmocka_run_group_tests_name("view_video", tests, NULL, NULL);
}

/* The stream between director and client: no torn frames, newest wins, bounded memory, credit. */
#include <stdarg.h>
#include <setjmp.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

#include <pthread.h>
#include <stdlib.h>
#include <string.h>

#include "core/base/base.h"
#include "protocol/base/limits.h"
#include "server/stream/stream.h"

#define N_TILES 6u

/* Publishes frame `seq`, in which the tiles of the bit mask are new; revision and camera are functions of seq, so that
 * a reader can check that they belong together. */
static bool publish(struct lum_stream *s, uint64_t seq, unsigned mask)
{
    struct lum_encoded_tile *tiles[N_TILES] = {NULL};
    for (uint32_t i = 0; i < N_TILES; i++) {
        if (!(mask & (1u << i)))
            continue;
        tiles[i] = lum_encoded_tile_create(8);
        assert_non_null(tiles[i]);
        tiles[i]->header = (struct lum_frame_header){.kind = LUM_FRAME_TILE,
                                                     .frame_seq = seq,
                                                     .scene_rev = 100 + seq,
                                                     .camera_seq = (uint32_t)(7 * seq),
                                                     .x = (uint16_t)i};
        memcpy(tiles[i]->bytes, &seq, sizeof seq);
    }
    return lum_stream_publish(s, seq, tiles);
}

/* Reads one whole frame; returns the mask of its tiles and checks what every frame promises. */
static unsigned read_frame(struct lum_stream *s, uint64_t *ret_seq)
{
    unsigned mask = 0;
    struct lum_stream_tile t;
    *ret_seq = 0;
    while (lum_stream_next(s, &t)) {
        assert_true(*ret_seq == 0 || t.header.frame_seq == *ret_seq);
        *ret_seq = t.header.frame_seq;
        assert_int_equal(t.header.scene_rev, 100 + *ret_seq);
        assert_int_equal(t.header.camera_seq, 7 * *ret_seq);
        mask |= 1u << t.header.x;
        bool last = t.header.flags & LUM_FRAME_LAST_TILE;
        lum_encoded_tile_unref(t.blob);
        if (last)
            return mask;
    }
    assert_int_equal(mask, 0); /* a frame that began must end with a last tile */
    return 0;
}

static void test_unchanged_tiles_are_not_sent_again(void **state)
{
    (void)state;
    struct lum_stream *s = lum_stream_create(3, N_TILES);
    uint64_t seq;
    assert_int_equal(lum_stream_view_id(s), 3);
    assert_true(lum_stream_wants_frame(s));
    assert_false(lum_stream_pending(s));
    assert_true(publish(s, 1, 0x3f));
    assert_true(lum_stream_pending(s));
    assert_false(lum_stream_wants_frame(s));
    assert_int_equal(read_frame(s, &seq), 0x3f);
    assert_int_equal(seq, 1);
    assert_true(publish(s, 2, 0x05));
    assert_int_equal(read_frame(s, &seq), 0x05);
    assert_int_equal(seq, 2);
    lum_stream_unref(s);
}

/* From the first frame until the last that was published is acknowledged, the client may have it to come. */
static void test_idle_is_when_the_client_has_all(void **state)
{
    (void)state;
    struct lum_stream *s = lum_stream_create(3, N_TILES);
    uint64_t seq;
    int64_t since_ns, before_ns;
    assert_true(lum_stream_is_idle(s, &since_ns) && since_ns == 0);
    for (uint64_t n = 1; n <= 4; n += 2) {
        assert_true(publish(s, n, 0x3f) && !lum_stream_is_idle(s, &since_ns));
        read_frame(s, &seq);
        assert_false(lum_stream_is_idle(s, &since_ns));
        assert_true(publish(s, n + 1, 1));
        assert_true(lum_stream_ack(s, n, 0) && !lum_stream_is_idle(s, &since_ns));
        read_frame(s, &seq);
        assert_false(lum_stream_is_idle(s, &since_ns));
        before_ns = lum_clock_ns();
        assert_true(lum_stream_ack(s, n + 1, 0) && lum_stream_is_idle(s, &since_ns));
        assert_true(since_ns >= before_ns && since_ns <= lum_clock_ns());
    }
    lum_stream_unref(s);
}

static void test_skipped_frame_leaves_its_tiles_to_the_next(void **state)
{
    (void)state;
    struct lum_stream *s = lum_stream_create(1, N_TILES);
    uint64_t seq;
    publish(s, 1, 0x3f);
    read_frame(s, &seq);
    publish(s, 2, 0x01);
    publish(s, 3, 0x02);
    publish(s, 4, 0x22);
    assert_int_equal(read_frame(s, &seq), 0x23);
    assert_int_equal(seq, 4);
    assert_int_equal(lum_stream_skipped(s), 2);
    lum_stream_unref(s);
}

static void test_newer_frame_waits_for_the_end_of_the_one_begun(void **state)
{
    (void)state;
    struct lum_stream *s = lum_stream_create(1, N_TILES);
    struct lum_stream_tile t;
    uint64_t seq;
    publish(s, 1, 0x3f);
    assert_true(lum_stream_next(s, &t));
    lum_encoded_tile_unref(t.blob);
    publish(s, 2, 0x3f);
    assert_int_equal(read_frame(s, &seq), 0x3e);
    assert_int_equal(seq, 1);
    assert_int_equal(read_frame(s, &seq), 0x3f);
    assert_int_equal(seq, 2);
    lum_stream_unref(s);
}

static void test_credit(void **state)
{
    (void)state;
    struct lum_stream *s = lum_stream_create(1, N_TILES);
    uint64_t seq, n = 0;
    for (uint64_t i = 1; i <= LUM_LIMIT_UNACKED_FRAMES; i++) {
        assert_true(lum_stream_wants_frame(s));
        publish(s, ++n, 1);
        assert_int_equal(read_frame(s, &seq), 1);
    }
    assert_false(lum_stream_wants_frame(s));
    publish(s, ++n, 1);
    assert_false(lum_stream_pending(s)); /* no credit: the frame waits, and may be skipped */
    assert_false(lum_stream_ack(s, 0, 0));
    assert_false(lum_stream_ack(s, 999, 0));
    assert_false(lum_stream_pending(s));
    assert_true(lum_stream_ack(s, 1, 0));
    assert_true(lum_stream_pending(s));
    assert_false(lum_stream_ack(s, 1, 0)); /* repeated: ignored */
    assert_int_equal(read_frame(s, &seq), 1);
    assert_int_equal(seq, n);
    assert_false(lum_stream_wants_frame(s));
    lum_stream_ack(s, n, 0); /* the newest gives back all */
    for (uint64_t i = 1; i <= LUM_LIMIT_UNACKED_FRAMES; i++) {
        assert_true(lum_stream_wants_frame(s));
        publish(s, ++n, 1);
        read_frame(s, &seq);
    }
    assert_false(lum_stream_wants_frame(s));
    lum_stream_unref(s);
}

/* frame.stats names a frame before its tiles are sent. A client that acknowledges then, with n_sent tiles out, must
 * never run out of credit, and still gets one frame after the other. */
static void test_an_ack_before_the_last_tile_counts(void **state)
{
    (void)state;
    struct lum_stream *s = lum_stream_create(1, N_TILES);
    uint64_t seq = 0, got;
    for (uint32_t n_sent = 0; n_sent < N_TILES; n_sent++) {
        assert_true(lum_stream_wants_frame(s));
        assert_false(lum_stream_ack(s, seq + 1, 0)); /* not published yet */
        publish(s, ++seq, 0x3f);
        for (uint32_t i = 0; i < n_sent; i++) {
            struct lum_stream_tile t;
            assert_true(lum_stream_next(s, &t));
            assert_false(t.header.flags & LUM_FRAME_LAST_TILE);
            lum_encoded_tile_unref(t.blob);
        }
        assert_true(lum_stream_ack(s, seq, 0));
        assert_false(lum_stream_ack(s, seq, 0));
        assert_false(lum_stream_wants_frame(s)); /* not before its last tile */
        assert_int_equal(read_frame(s, &got), 0x3f & ~((1u << n_sent) - 1u));
        assert_int_equal(got, seq);
    }
    lum_stream_unref(s);
}

/* Also one that the client never saw: it was skipped, or acknowledged by its number in frame.stats alone. */
static void test_an_ack_covers_all_before_it(void **state)
{
    (void)state;
    struct lum_stream *s = lum_stream_create(1, N_TILES);
    uint64_t got;
    publish(s, 10, 1);
    read_frame(s, &got);
    publish(s, 20, 1);
    read_frame(s, &got);
    publish(s, 30, 1); /* waits for credit, and is skipped */
    publish(s, 40, 1);
    assert_false(lum_stream_pending(s));
    assert_true(lum_stream_ack(s, 30, 0));
    assert_false(lum_stream_ack(s, 20, 0));
    assert_int_equal(read_frame(s, &got), 1);
    assert_int_equal(got, 40);
    assert_true(lum_stream_wants_frame(s)); /* 40 alone is out */
    lum_stream_unref(s);
}

static void test_resize_after_an_early_ack(void **state)
{
    (void)state;
    struct lum_stream *s = lum_stream_create(1, N_TILES);
    struct lum_stream_tile t;
    uint64_t got;
    publish(s, 1, 0x3f);
    assert_true(lum_stream_next(s, &t));
    lum_encoded_tile_unref(t.blob);
    assert_true(lum_stream_ack(s, 1, 0));
    assert_true(lum_stream_resize(s, N_TILES)); /* its credit came back already */
    for (uint64_t seq = 2; seq < 2 + LUM_LIMIT_UNACKED_FRAMES; seq++) {
        assert_true(lum_stream_wants_frame(s));
        publish(s, seq, 1);
        read_frame(s, &got);
        assert_int_equal(got, seq);
    }
    assert_false(lum_stream_wants_frame(s));
    lum_stream_unref(s);
}

static void test_resize_in_mid_frame(void **state)
{
    (void)state;
    struct lum_stream *s = lum_stream_create(1, N_TILES);
    struct lum_stream_tile t;
    uint64_t seq = 0;
    for (unsigned round = 0; round < 5; round++) { /* more rounds than credit: a cut frame must give its own back */
        assert_true(publish(s, ++seq, 0x3f));
        assert_true(lum_stream_next(s, &t));
        lum_encoded_tile_unref(t.blob);
        assert_true(lum_stream_resize(s, N_TILES));
        assert_false(lum_stream_pending(s));
        assert_true(lum_stream_wants_frame(s));
    }
    uint64_t got;
    publish(s, ++seq, 0x03);
    assert_int_equal(read_frame(s, &got), 0x03);
    assert_int_equal(got, seq);
    lum_stream_unref(s);
}

static void test_refused_frames(void **state)
{
    (void)state;
    struct lum_stream *s = lum_stream_create(1, N_TILES);
    uint64_t seq;
    assert_false(publish(s, 1, 0));
    assert_true(publish(s, 5, 1));
    assert_false(publish(s, 5, 2));
    assert_false(publish(s, 4, 2));
    assert_int_equal(read_frame(s, &seq), 1);
    assert_int_equal(seq, 5);
    lum_stream_unref(s);
}

static void test_out_of_memory(void **state)
{
    (void)state;
    for (uint64_t k = 1; k <= 2; k++) {
        lum_alloc_fail_after(k);
        assert_null(lum_stream_create(1, N_TILES));
    }
    lum_alloc_fail_after(0);
    struct lum_stream *s = lum_stream_create(1, N_TILES);
    publish(s, 1, 0x3f);
    lum_alloc_fail_after(1);
    assert_false(lum_stream_resize(s, 2 * N_TILES));
    lum_alloc_fail_after(1);
    assert_null(lum_encoded_tile_create(10));
    lum_alloc_fail_after(0);
    uint64_t seq;
    assert_int_equal(read_frame(s, &seq), 0x3f);
    lum_stream_unref(s);
    lum_stream_unref(NULL);
    lum_encoded_tile_unref(NULL);
}

/* Against a model: after any interleaving the client's picture is, at each last tile, exactly the frame it names. */
static void test_random_interleaving_against_a_model(void **state)
{
    (void)state;
    struct lum_stream *s = lum_stream_create(1, N_TILES);
    enum { N_FRAMES = 4000 };
    static uint64_t truth[N_FRAMES + 1][N_TILES]; /* content of each published frame */
    uint64_t client[N_TILES] = {0}, published = 0, last_ack = 0;
    uint32_t rng = 12345;
    while (published < N_FRAMES) {
        rng = rng * 1664525u + 1013904223u;
        unsigned action = rng >> 30, mask = (rng >> 8) & 0x3f;
        struct lum_stream_tile t;
        if (action == 0) {
            mask = mask ? mask : 1;
            published++;
            for (uint32_t i = 0; i < N_TILES; i++)
                truth[published][i] = mask & (1u << i) ? published : truth[published - 1][i];
            assert_true(publish(s, published, mask));
        } else if (action == 1) {
            lum_stream_ack(s, last_ack, 0);
        } else if (lum_stream_next(s, &t)) {
            memcpy(&client[t.header.x], t.blob->bytes, sizeof client[0]);
            if (t.header.flags & LUM_FRAME_LAST_TILE) {
                last_ack = t.header.frame_seq;
                assert_memory_equal(client, truth[last_ack], sizeof client);
            }
            lum_encoded_tile_unref(t.blob);
        }
    }
    lum_stream_unref(s);
}

static void *director_thread(void *arg)
{
    struct lum_stream *s = arg;
    for (uint64_t seq = 1; seq <= 20000; seq++)
        publish(s, seq, 1u << (seq % N_TILES));
    lum_stream_unref(s);
    return NULL;
}

/* For ThreadSanitizer, and: the last frame always arrives. */
static void test_two_threads(void **state)
{
    (void)state;
    struct lum_stream *s = lum_stream_create(1, N_TILES);
    pthread_t thread;
    assert_int_equal(pthread_create(&thread, NULL, director_thread, lum_stream_ref(s)), 0);
    uint64_t seq, n_frames = 0, newest = 0;
    while (newest < 20000) {
        if (!read_frame(s, &seq))
            continue;
        assert_true(seq > newest);
        newest = seq;
        n_frames++;
        lum_stream_ack(s, seq, 0);
    }
    pthread_join(thread, NULL);
    assert_int_equal(n_frames + lum_stream_skipped(s), 20000);
    lum_stream_unref(s);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_unchanged_tiles_are_not_sent_again),
        cmocka_unit_test(test_idle_is_when_the_client_has_all),
        cmocka_unit_test(test_skipped_frame_leaves_its_tiles_to_the_next),
        cmocka_unit_test(test_newer_frame_waits_for_the_end_of_the_one_begun),
        cmocka_unit_test(test_credit),
        cmocka_unit_test(test_an_ack_before_the_last_tile_counts),
        cmocka_unit_test(test_an_ack_covers_all_before_it),
        cmocka_unit_test(test_resize_after_an_early_ack),
        cmocka_unit_test(test_resize_in_mid_frame),
        cmocka_unit_test(test_refused_frames),
        cmocka_unit_test(test_out_of_memory),
        cmocka_unit_test(test_random_interleaving_against_a_model),
        cmocka_unit_test(test_two_threads),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

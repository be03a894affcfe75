/* When a view sends the exact picture, and what goes before it: by the clock that it is given, and by what the client
 * has acknowledged. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "core/base/base.h"
#include "protocol/base/limits.h"
#include "server/director/view_frames.h"

#define SECOND 1000000000ll

/* A picture of JPEG that is complete, and of which a frame was sent. */
static struct lum_server_view complete_view(void)
{
    struct lum_server_view v = {.codec = LUM_CODEC_JPEG, .complete = true, .sent_spp = 4};
    v.last_pass.spp = 4;
    v.stream = lum_stream_create(1, 1);
    assert_non_null(v.stream);
    return v;
}

/* The next frame, of so many bytes, all sent. */
static void send_frame(struct lum_server_view *v, uint32_t n_bytes)
{
    struct lum_encoded_tile *tile = lum_encoded_tile_create(n_bytes);
    struct lum_stream_tile sent;
    assert_non_null(tile);
    tile->header.frame_seq = ++v->frame_seq;
    assert_true(lum_stream_publish(v->stream, v->frame_seq, &tile));
    assert_true(lum_stream_next(v->stream, &sent));
    lum_encoded_tile_unref(sent.blob);
    v->sent_ns = lum_clock_ns();
    v->unsent = false;
}

static enum lum_frame_due due(const struct lum_server_view *v, int64_t now_ns)
{
    int64_t wait_ns;
    enum lum_frame_due is = lum_server_view_due(v, now_ns, &wait_ns);
    assert_true(is == LUM_DUE_FINAL || wait_ns < INT64_MAX); /* it is looked at again, whatever the client says */
    return is;
}

/* Its last change was at newest_ns: nothing exact comes sooner than 0.2 s later, however long ago anything was sent. */
static void it_waits_until_nothing_changes(void **state)
{
    (void)state;
    struct lum_server_view v = complete_view();
    send_frame(&v, 1000);
    for (int heard = 0; heard < 2; heard++) {
        if (heard)
            assert_true(lum_stream_ack(v.stream, v.frame_seq, 0));
        v.newest_ns = v.sent_ns + 5 * SECOND;
        assert_int_equal(due(&v, v.newest_ns), LUM_DUE_NONE);
        assert_int_equal(due(&v, v.newest_ns + LUM_VIEW_SETTLE_NS - 1), LUM_DUE_NONE);
        assert_int_equal(due(&v, v.newest_ns + LUM_VIEW_SETTLE_NS), LUM_DUE_FINAL);
    }
    lum_stream_unref(v.stream);
}

/* What was not sent yet is sent as it is while a hand moves: first of all where the client has not said that it has the
 * frame before, and where the picture shows what a hand just did. */
static void the_lossy_one_comes_first(void **state)
{
    (void)state;
    struct lum_server_view v = complete_view();
    send_frame(&v, 1000);
    int64_t late_ns = v.sent_ns + 10 * SECOND;
    v.unsent = true;
    assert_int_equal(due(&v, late_ns), LUM_DUE_FRAME);
    v.unsent = false;
    assert_int_equal(due(&v, late_ns), LUM_DUE_FINAL);
    assert_true(lum_stream_ack(v.stream, v.frame_seq, 0));
    v.unsent = true; /* more samples of a picture that the client has: the exact one has them, too */
    assert_int_equal(due(&v, late_ns), LUM_DUE_FINAL);
    v.sent_spp = 0; /* a pass took longer than hands rest */
    assert_int_equal(due(&v, late_ns), LUM_DUE_FRAME);
    v.codec = LUM_CODEC_PNG; /* exact anyway */
    assert_int_equal(due(&v, late_ns), LUM_DUE_FINAL);
    lum_stream_unref(v.stream);
}

/* Who does not acknowledge gets it after two seconds, or after twice the time that the line takes for what is on it. */
static void who_is_silent_gets_it_later(void **state)
{
    (void)state;
    struct lum_server_view v = complete_view();
    send_frame(&v, 1000);
    assert_int_equal(due(&v, v.sent_ns + LUM_VIEW_UNHEARD_NS - 1), LUM_DUE_NONE);
    assert_int_equal(due(&v, v.sent_ns + LUM_VIEW_UNHEARD_NS), LUM_DUE_FINAL);
    assert_true(lum_stream_ack(v.stream, v.frame_seq, 0));

    /* A line that brought 10 000 bytes in what the test takes here, so at least 1 ms: for as many as it brings in 3 s.
     */
    send_frame(&v, 10000);
    assert_true(lum_stream_ack(v.stream, v.frame_seq, 0));
    double bytes_s = lum_stream_line(v.stream);
    assert_true(bytes_s > 0.0 && bytes_s <= 1.1e7);
    send_frame(&v, (uint32_t)(3.0 * bytes_s));
    double owed_s = lum_stream_owed_s(v.stream);
    assert_true(owed_s >= 2.99 && owed_s < 4.0);
    int64_t at_ns = v.sent_ns + (int64_t)(2.0 * owed_s * 1e9);
    assert_int_equal(due(&v, at_ns - 1), LUM_DUE_NONE);
    assert_int_equal(due(&v, at_ns), LUM_DUE_FINAL);
    assert_true(lum_stream_ack(v.stream, v.frame_seq, 0));

    /* Whatever is thought of a line, not for ever. */
    bytes_s = lum_stream_line(v.stream);
    send_frame(&v, 20u << 20);
    at_ns = v.sent_ns + (int64_t)(LUM_VIEW_UNHEARD_MOST_S * 1e9);
    assert_int_equal(due(&v, at_ns), LUM_DUE_FINAL);
    lum_stream_unref(v.stream);
}

/* A drag goes on where the client reads, however close to each other frames come; who stops reading is waited for no
 * longer, until she reads again. */
static void who_does_not_read_is_not_awaited(void **state)
{
    (void)state;
    struct lum_server_view v = complete_view();
    assert_true(lum_server_view_is_awaited(&v, 10 * SECOND)); /* the first */
    for (unsigned i = 0; i < LUM_LIMIT_UNACKED_FRAMES; i++)
        send_frame(&v, 1000);
    assert_true(lum_server_view_is_awaited(&v, v.sent_ns + LUM_VIEW_UNREAD_NS - 1));
    assert_false(lum_server_view_is_awaited(&v, v.sent_ns + LUM_VIEW_UNREAD_NS));
    assert_true(lum_stream_ack(v.stream, v.frame_seq, 0));
    assert_true(lum_server_view_is_awaited(&v, v.sent_ns + 10 * SECOND));
    lum_stream_unref(v.stream);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(it_waits_until_nothing_changes),
        cmocka_unit_test(the_lossy_one_comes_first),
        cmocka_unit_test(who_is_silent_gets_it_later),
        cmocka_unit_test(who_does_not_read_is_not_awaited),
    };
    return cmocka_run_group_tests_name("view_due", tests, NULL, NULL);
}

/* What work beside the frames has of the time, beside views that wait for a picture. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "protocol/base/limits.h"
#include "server/director/beside.h"
#include "server/director/view_frames.h"

enum { N_VIEWS = 9 };

/* With a stream that takes a frame. */
static void make_views(struct lum_server_view *views)
{
    for (uint32_t i = 0; i < N_VIEWS; i++) {
        views[i] = (struct lum_server_view){.stale = true, .next = i + 1 < N_VIEWS ? &views[i + 1] : NULL};
        views[i].stream = lum_stream_create(i + 1, 1);
        assert_non_null(views[i].stream);
    }
}

/* So many frames that nobody acknowledged, the last one at 0. */
static void go_deaf(struct lum_server_view *v)
{
    for (uint64_t seq = 1; seq <= LUM_LIMIT_UNACKED_FRAMES; seq++) {
        struct lum_encoded_tile *tile = lum_encoded_tile_create(1);
        struct lum_stream_tile sent;
        assert_non_null(tile);
        tile->header.frame_seq = seq;
        assert_true(lum_stream_publish(v->stream, seq, &tile));
        assert_true(lum_stream_next(v->stream, &sent));
        lum_encoded_tile_unref(sent.blob);
    }
}

/* n views and what is beside them share alike, but for a quarter at most; those that nobody reads are none. */
static void deaf_views_take_no_share(void **state)
{
    (void)state;
    static struct lum_server_view views[N_VIEWS];
    make_views(views);
    double all = lum_beside_share(views, LUM_VIEW_UNREAD_NS);
    assert_true(all == 1.0 / (1 + N_VIEWS));
    for (int n_deaf = 1; n_deaf <= N_VIEWS; n_deaf++) {
        go_deaf(&views[n_deaf - 1]);
        double share = lum_beside_share(views, LUM_VIEW_UNREAD_NS), fair = 1.0 / (1 + N_VIEWS - n_deaf);
        assert_true(share == (fair < 0.25 ? fair : 0.25));
        assert_true(lum_beside_share(views, LUM_VIEW_UNREAD_NS - 1) == all); /* it may still be on its way */
    }
    for (int i = 0; i < N_VIEWS; i++)
        lum_stream_unref(views[i].stream);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(deaf_views_take_no_share)};
    return cmocka_run_group_tests_name("beside", tests, NULL, NULL);
}

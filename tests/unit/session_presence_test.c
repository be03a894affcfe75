/* Who hears of where people are, and when: by the clock that the test gives, on lines that take as long as it says. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include <stdlib.h>
#include <string.h>

#include "server/net/metrics.h"
#include "server/net/session_internal.h"
#include "tests/support/fake_director.h"

#define TICK_NS (1000000000ll / LUM_LIMIT_PRESENCE_PER_S)
#define BEGIN_NS (1000 * TICK_NS)
#define REQUEST(method) "{\"jsonrpc\":\"2.0\",\"id\":1,\"method\":\"" method "\",\"params\":{}}"

struct fixture {
    struct lum_director director;
    struct lum_auth auth;
    struct lum_net_counters counters;
    struct lum_projects *projects;
    struct lum_sessions *sessions;
};

static int set_up(void **state)
{
    struct fixture *f = calloc(1, sizeof *f);
    if (!f)
        return -1;
    fake_director_init(&f->director);
    if (lum_projects_of_one(&f->director, NULL, &f->projects, NULL))
        return -1;
    const struct lum_sessions_config config = {.projects = f->projects, .auth = &f->auth, .counters = &f->counters};
    *state = f;
    return lum_sessions_create(&config, &f->sessions, NULL) ? -1 : 0;
}

static int tear_down(void **state)
{
    struct fixture *f = *state;
    lum_sessions_destroy(f->sessions);
    bool ok = lum_projects_destroy(f->projects);
    fake_director_finish(&f->director);
    free(f);
    return ok ? 0 : -1;
}

/* What is sent to it at once. */
static void read_all(struct lum_session *s)
{
    struct lum_message m;
    while (lum_session_next(s, &m))
        lum_session_sent(s);
}

/* One who listens, and has read all but news. */
static struct lum_session *come(struct fixture *f)
{
    static const char hello[] = REQUEST("session.hello"), here[] = REQUEST("presence.set");
    struct lum_session *s = lum_session_open(f->sessions, "192.0.2.7");
    assert_non_null(s);
    lum_session_receive(s, hello, sizeof hello - 1);
    lum_session_receive(s, here, sizeof here - 1);
    read_all(s);
    assert_true(s->greeted && s->presence.listens);
    return s;
}

/* Whether the news that s has next name another one. */
static bool hears_of(struct lum_session *s, const struct lum_session *other)
{
    struct lum_message m;
    assert_true(lum_session_next(s, &m));
    assert_false(m.binary);
    assert_non_null(strstr((const char *)m.body, "\"presence\""));
    bool named = strstr((const char *)m.body, other->user) != NULL;
    lum_session_sent(s);
    return named;
}

static void who_has_outstayed_hears_nothing_and_is_not_there(void **state)
{
    struct fixture *f = *state;
    struct lum_session *ann = come(f), *bob = come(f);
    (void)lum_sessions_tell_presence(f->sessions, BEGIN_NS);
    assert_true(hears_of(ann, bob));
    assert_true(hears_of(bob, ann));
    bob->person.ends_s = 1;
    lum_session_stir(ann);
    (void)lum_sessions_tell_presence(f->sessions, BEGIN_NS + TICK_NS);
    assert_false(hears_of(ann, bob));
    assert_null(bob->text.first);
    assert_int_equal(lum_session_close_now(bob), LUM_CLOSE_REVOKED);
}

static bool takes_news(struct lum_session *s)
{
    struct lum_message m;
    bool any = lum_session_next(s, &m);
    lum_session_sent(s);
    return any;
}

/* Each comes at a time of her own, and hears at once; from the next tick on one text is for all. */
static void one_text_of_each_tick_serves_all(void **state)
{
    struct fixture *f = *state;
    enum { N = 8 };
    struct lum_session *s[N];
    for (int i = 0; i < N; i++) {
        s[i] = come(f);
        int64_t now_ns = BEGIN_NS + i * TICK_NS / N, wait_ns = lum_sessions_tell_presence(f->sessions, now_ns);
        assert_true(takes_news(s[i]));
        lum_session_stir(s[i]);
        assert_true(lum_sessions_presence_waits(f->sessions));
        assert_true(wait_ns == INT64_MAX || wait_ns == BEGIN_NS + TICK_NS - now_ns);
        assert_true(lum_sessions_tell_presence(f->sessions, now_ns) == BEGIN_NS + TICK_NS - now_ns);
        for (int k = 0; k <= i; k++)
            assert_false(takes_news(s[k])); /* no more in this tick */
    }
    for (int n = 1; n < 4; n++) {
        assert_true(lum_sessions_tell_presence(f->sessions, BEGIN_NS + n * TICK_NS) == INT64_MAX);
        struct lum_message m[N];
        for (int i = 0; i < N; i++) {
            assert_true(lum_session_next(s[i], &m[i])); /* all are held at once: none has another's place */
            assert_ptr_equal(m[i].body, m[0].body);
        }
        for (int i = 0; i < N; i++)
            lum_session_sent(s[i]);
        lum_session_stir(s[0]);
    }
}

static struct lum_stream *add_view(struct fixture *f, struct lum_session *s, uint32_t view_id)
{
    struct lum_out *o = lum_calloc(1, sizeof *o);
    struct lum_stream *stream = lum_stream_create(view_id, 1);
    assert_true(o && stream);
    *o = (struct lum_out){.kind = LUM_OUT_VIEW_OPENED, .session = s->ref, .stream = lum_stream_ref(stream)};
    *f->director.last = o;
    f->director.last = &o->next;
    lum_sessions_deliver(f->sessions);
    return stream;
}

/* There is always a tile that waits, and the client has all that was sent. */
static void keep_pending(struct lum_stream *stream, uint64_t *seq, uint32_t n_bytes)
{
    if (lum_stream_pending(stream))
        return;
    struct lum_encoded_tile *tile = lum_encoded_tile_create(n_bytes);
    assert_non_null(tile);
    (void)lum_stream_ack(stream, *seq, 0);
    tile->header.frame_seq = ++*seq;
    assert_true(lum_stream_publish(stream, *seq, &tile));
}

/* A line that is busy with a message for so many steps of 30 ms, and then takes the next one: what goes over it. */
struct line {
    int busy, gap, left;
    bool sends;
    uint32_t n_news, n_tiles;
    size_t news_bytes, tile_bytes; /* of the news before, and of tiles since */
};

static void take_next(struct line *line, struct lum_session *s)
{
    struct lum_message m;
    line->sends = lum_session_next(s, &m);
    assert_true(line->sends);
    line->left = line->busy;
    if (m.binary) {
        line->n_tiles++;
        line->tile_bytes += m.n_body;
        return;
    }
    if (line->n_news++ > 0 && line->tile_bytes < line->news_bytes)
        fail_msg("%zu bytes of tiles between news, the first of %zu", line->tile_bytes, line->news_bytes);
    line->news_bytes = m.n_body;
    line->tile_bytes = 0;
}

static void turn(struct line *line, struct lum_session *s)
{
    if (--line->left > 0)
        return;
    if (line->sends) { /* the kernel has it all, and takes more after a while */
        lum_session_sent(s);
        line->sends = false;
        line->left = line->gap;
    }
    if (line->left <= 0)
        take_next(line, s);
}

/* Others move all the time, and the line takes as long for each message as the test says, with each length of the
 * moment in which the kernel has one whole and takes no more: the picture has half of it, or more. */
static void tiles_go_out_between_news_on_a_slow_line(void **state)
{
    struct fixture *f = *state;
    struct lum_session *ann = come(f), *bob = come(f);
    struct lum_stream *stream = add_view(f, ann, 1);
    uint64_t seq = 0;
    int64_t now_ns = BEGIN_NS;
    for (int k = 0; k < 7 * 7; k++) {
        struct line line = {.busy = 1 + k / 7, .gap = k % 7};
        ann->presence.text_bytes = ann->presence.tile_bytes = 0;
        for (int i = 0; i < 400; i++, now_ns += 30000000) {
            keep_pending(stream, &seq, 100);
            lum_session_stir(bob);
            (void)lum_sessions_tell_presence(f->sessions, now_ns);
            read_all(bob);
            turn(&line, ann);
        }
        if (line.sends)
            lum_session_sent(ann);
        read_all(ann);
        assert_true(line.n_news > 2 && line.n_tiles > 2);
    }
    lum_stream_unref(stream);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup_teardown(who_has_outstayed_hears_nothing_and_is_not_there, set_up, tear_down),
        cmocka_unit_test_setup_teardown(one_text_of_each_tick_serves_all, set_up, tear_down),
        cmocka_unit_test_setup_teardown(tiles_go_out_between_news_on_a_slow_line, set_up, tear_down),
    };
    return cmocka_run_group_tests_name("session_presence", tests, NULL, NULL);
}

/* Memory that runs short in a session: each allocation of each message failed in turn. It hears so, or is closed; the
 * next message is answered, and what it announced in vain takes no place. */
#define _GNU_SOURCE
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "server/net/metrics.h"
#include "server/net/session_internal.h"
#include "server/net/uploads.h"
#include "tests/support/fake_director.h"
#include "tests/unit/failing_alloc.h"

#define N_BYTES (LUM_LIMIT_UPLOAD_SESSION_BYTES / 4u) /* four of these, and the session has had its share */

struct fixture {
    struct lum_director director;
    struct lum_auth auth; /* nobody needs a token */
    struct lum_net_counters counters;
    struct lum_upload_root root;
    struct lum_uploads *uploads;
    struct lum_projects *projects;
    struct lum_sessions *sessions;
    struct lum_session *s;
};

static void wake(void *user)
{
    (void)user;
}

static void receive(struct lum_session *s, const char *text)
{
    lum_session_receive(s, text, strlen(text));
}

/* Whether one of the messages that wait has this in it; all are taken. */
static bool hears(struct lum_session *s, const char *part)
{
    bool heard = false;
    struct lum_message m;
    while (lum_session_next(s, &m)) {
        heard = heard || memmem(m.body, m.n_body, part, strlen(part));
        lum_session_sent(s);
    }
    return heard;
}

static void come(struct fixture *f)
{
    f->s = lum_session_open(f->sessions, "192.0.2.7");
    assert_non_null(f->s);
    receive(f->s, "{\"jsonrpc\":\"2.0\",\"id\":1,\"method\":\"session.hello\",\"params\":{}}");
    assert_true(hears(f->s, "\"scene_rev\""));
}

static int set_up(void **state)
{
    struct lum_error err;
    struct fixture *f = calloc(1, sizeof *f);
    if (!f || lum_upload_root_make(&f->root, &err))
        return -1;
    const struct lum_uploads_config uploads = {
        .root = f->root.path, .max_bytes = 1ull << 40, .disk = &lum_disk_real, .wake = wake};
    fake_director_init(&f->director);
    if (lum_uploads_create(&uploads, &f->uploads, &err) ||
        lum_projects_of_one(&f->director, f->uploads, &f->projects, &err))
        return -1;
    const struct lum_sessions_config config = {.projects = f->projects, .auth = &f->auth, .counters = &f->counters};
    if (lum_sessions_create(&config, &f->sessions, &err))
        return -1;
    *state = f;
    come(f);
    return 0;
}

static int tear_down(void **state)
{
    struct fixture *f = *state;
    lum_sessions_destroy(f->sessions);
    assert_true(lum_projects_destroy(f->projects));
    lum_uploads_destroy(f->uploads);
    lum_upload_root_remove(&f->root);
    fake_director_finish(&f->director);
    free(f);
    return 0;
}

static void announce(struct lum_session *s)
{
    char text[200];
    snprintf(text, sizeof text,
             "{\"jsonrpc\":\"2.0\",\"id\":2,\"method\":\"asset.upload\",\"params\":{\"files\":[{\"name\":\"a.glb\","
             "\"bytes\":%u}]}}",
             N_BYTES);
    receive(s, text);
}

static void what_is_announced_in_vain_takes_no_place(void **state)
{
    struct fixture *f = *state;
    unsigned k = 0, n_told = 0;
    for (bool failed = true; failed;) {
        failing_alloc_arm(++k);
        announce(f->s);
        failed = failing_alloc_disarm();
        if (lum_session_close_now(f->s)) { /* not even the answer had room */
            lum_session_close(f->s);
            come(f);
            continue;
        }
        if (!hears(f->s, "\"put\"")) {
            assert_true(failed);
            n_told++;
            announce(f->s);
            assert_true(hears(f->s, "\"put\""));
        }
        lum_session_close(f->s); /* and what it announced is forgotten with it */
        come(f);
    }
    print_message("%u allocations failed in turn, %u were told\n", k - 1, n_told);
    assert_true(n_told > 5);
}

#define REQUEST(method, params) "{\"jsonrpc\":\"2.0\",\"id\":2,\"method\":\"" method "\",\"params\":" params "}"

static const char *const requests[] = {
    REQUEST("scene.get", "{\"expand\":true}"),
    REQUEST("scene.apply",
            "{\"op_id\":\"a-1\",\"ops\":[{\"op\":\"add\",\"type\":\"light\",\"id\":\"l\",\"kind\":\"point\","
            "\"position\":[0,1,0],\"flux_lm\":100},{\"op\":\"remove\",\"id\":\"l\"}]}"),
    REQUEST("scene.apply", "{\"ops\":[{\"op\":\"no such\"}]}"),
    REQUEST("scene.undo", "{\"op_id\":\"a-2\"}"),
    REQUEST("preset.store", "{\"id\":\"evening\",\"name\":\"Evening\",\"fade_s\":2}"),
    REQUEST("view.open", "{\"camera\":{\"position\":[0,1,3],\"target\":[0,1,0]},\"size\":[64,48],\"codec\":\"jpeg\"}"),
    REQUEST("view.update", "{\"view_id\":1,\"camera_id\":\"main\",\"camera_seq\":1}"),
    REQUEST("probe", "{\"point\":[0,1,0],\"normal\":[0,1,0],\"samples\":4}"),
    REQUEST("asset.list", "{\"kind\":\"photometry\",\"match\":\"down\"}"),
    REQUEST("frame.ack", "{\"view_id\":1,\"frame_seq\":1}"),
    REQUEST("project.list", "{}"),
    REQUEST("project.create", "{\"name\":\"Foyer\",\"scene\":\"furnace\"}"),
    REQUEST("session.list", "{}"),
    REQUEST("presence.set", "{\"camera\":{\"position\":[0,1,3],\"target\":[0,1,0]}}"),
    REQUEST("session.hello", "{\"client\":\"ann\"}"),
    REQUEST("no.such", "{\"a\":[1,{\"b\":null}]}"),
    "{\"jsonrpc\":\"2.0\",\"method\":\"scene.undo\"}",
    "[1,2",
};

/* One request, and whether the k-th allocation of it failed. */
static bool receive_with_fault(struct fixture *f, const char *text, unsigned k)
{
    failing_alloc_arm(k);
    receive(f->s, text);
    bool failed = failing_alloc_disarm();
    (void)hears(f->s, "");
    fake_director_forget(&f->director);
    if (!lum_session_close_now(f->s))
        return failed;
    assert_true(failed);
    lum_session_close(f->s);
    fake_director_forget(&f->director);
    come(f);
    return true;
}

static void each_request_outlasts_it(void **state)
{
    struct fixture *f = *state;
    unsigned n = 0;
    for (size_t i = 0; i < LUM_ARRAY_LEN(requests); i++) {
        lum_session_close(f->s);
        come(f); /* who may send as many as two seconds allow */
        for (unsigned k = 1; receive_with_fault(f, requests[i], k); k++, n++) {
            receive(f->s, REQUEST("no.such", "{}"));
            assert_true(hears(f->s, "no.such"));
        }
    }
    print_message("%u allocations failed in turn\n", n);
    assert_true(n > 10 * LUM_ARRAY_LEN(requests));
}

static void a_hello_outlasts_it(void **state)
{
    struct fixture *f = *state;
    static const char hello[] = REQUEST("session.hello", "{\"client\":\"ann\",\"resume\":\"x.0-1\",\"key\":\"k\"}");
    unsigned k = 0;
    for (bool failed = true; failed;) {
        lum_session_close(f->s);
        fake_director_forget(&f->director);
        f->s = lum_session_open(f->sessions, "192.0.2.7");
        assert_non_null(f->s);
        failing_alloc_arm(++k);
        receive(f->s, hello);
        failed = failing_alloc_disarm();
        bool closed = lum_session_close_now(f->s) != LUM_CLOSE_NONE, heard = hears(f->s, "\"scene_rev\"");
        assert_true(failed || (heard && !closed));
        if (closed || lum_session_greeted(f->s))
            continue;
        receive(f->s, hello);
        assert_true(hears(f->s, "\"scene_rev\""));
    }
    assert_true(k > 10);
}

/* Where others are: for one who has other text to read first nothing is made, and what cannot be made is made the next
 * time. */
static void news_of_others_outlast_it(void **state)
{
    struct fixture *f = *state;
    const int64_t tick_ns = 1000000000 / LUM_LIMIT_PRESENCE_PER_S;
    int64_t now_ns = 1000 * tick_ns;
    receive(f->s, REQUEST("presence.set", "{}"));
    failing_alloc_arm(1);
    assert_true(lum_sessions_tell_presence(f->sessions, now_ns += tick_ns) == tick_ns);
    assert_false(failing_alloc_disarm());
    assert_true(hears(f->s, "\"result\""));
    unsigned k = 0;
    for (bool failed = true; failed;) {
        failing_alloc_arm(++k);
        int64_t wait_ns = lum_sessions_tell_presence(f->sessions, now_ns += tick_ns);
        failed = failing_alloc_disarm();
        if (lum_session_close_now(f->s)) { /* no room in its queue */
            assert_true(failed);
            lum_session_close(f->s);
            come(f);
            receive(f->s, REQUEST("presence.set", "{}"));
            assert_true(hears(f->s, "\"result\""));
        } else {
            assert_true(wait_ns == (failed ? tick_ns : INT64_MAX));
            assert_true(hears(f->s, "\"presence\"") != failed);
        }
    }
    assert_true(k > 10);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup_teardown(what_is_announced_in_vain_takes_no_place, set_up, tear_down),
        cmocka_unit_test_setup_teardown(each_request_outlasts_it, set_up, tear_down),
        cmocka_unit_test_setup_teardown(a_hello_outlasts_it, set_up, tear_down),
        cmocka_unit_test_setup_teardown(news_of_others_outlast_it, set_up, tear_down),
    };
    failing_alloc_begin();
    return cmocka_run_group_tests(tests, NULL, NULL);
}

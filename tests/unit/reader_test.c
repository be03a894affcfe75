/* Large messages are read beside the net thread: what comes of them is what comes of small ones. */
#define _GNU_SOURCE
#include <stdarg.h>
#include <setjmp.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

#include <semaphore.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "server/net/metrics.h"
#include "server/net/reader.h"
#include "server/net/session_internal.h"
#include "tests/support/fake_director.h"

struct fixture {
    struct lum_director director;
    struct lum_auth auth;
    struct lum_net_counters counters;
    struct lum_projects *projects;
    struct lum_sessions *sessions;
    struct lum_reader *reader;
    sem_t ready;
};

static void tell(void *user)
{
    sem_post(&((struct fixture *)user)->ready);
}

static char *next_text(struct lum_session *s)
{
    struct lum_message m;
    if (!lum_session_next(s, &m))
        return NULL;
    char *text = strndup((const char *)m.body, m.n_body);
    assert_non_null(text);
    lum_session_sent(s);
    return text;
}

static struct lum_session *open_greeted(struct fixture *f)
{
    static const char hello[] = "{\"jsonrpc\":\"2.0\",\"id\":1,\"method\":\"session.hello\",\"params\":{}}";
    struct lum_session *s = lum_session_open(f->sessions, "192.0.2.7");
    assert_non_null(s);
    lum_session_receive(s, hello, sizeof hello - 1);
    free(next_text(s));
    assert_true(lum_session_greeted(s));
    return s;
}

static int set_up(void **state)
{
    struct fixture *f = calloc(1, sizeof *f);
    assert_non_null(f);
    fake_director_init(&f->director);
    assert_int_equal(sem_init(&f->ready, 0, 0), 0);
    assert_int_equal(lum_projects_of_one(&f->director, NULL, &f->projects, NULL), LUM_OK);
    assert_int_equal(lum_reader_create(tell, f, &f->reader, NULL), LUM_OK);
    const struct lum_sessions_config config = {.projects = f->projects, .auth = &f->auth, .counters = &f->counters};
    assert_int_equal(lum_sessions_create(&config, &f->sessions, NULL), LUM_OK);
    *state = f;
    return 0;
}

static int tear_down(void **state)
{
    struct fixture *f = *state;
    lum_reader_destroy(f->reader);
    lum_sessions_destroy(f->sessions);
    assert_true(lum_projects_destroy(f->projects));
    fake_director_finish(&f->director);
    sem_destroy(&f->ready);
    free(f);
    return 0;
}

static struct lum_reading *wait_for_next(struct fixture *f)
{
    sem_wait(&f->ready);
    struct lum_reading *m = lum_reader_next(f->reader);
    assert_non_null(m);
    return m;
}

/* What the session says to a message, or "": nothing; ret_type: what the director is asked, or NULL. */
static char *answer(struct fixture *f, struct lum_session *s, const char *text, bool beside,
                    const struct lum_request_type **ret_type, char ret_id[32])
{
    fake_director_forget(&f->director);
    if (beside) {
        assert_true(lum_session_read_beside(s, f->reader, strdup(text), strlen(text)));
        struct lum_reading *m = wait_for_next(f);
        assert_ptr_equal(lum_sessions_receive_read(f->sessions, m), s);
        lum_reading_destroy(m);
    } else {
        lum_session_receive(s, text, strlen(text));
    }
    *ret_type = f->director.n_posted ? f->director.posted[0]->type : NULL;
    const char *id = f->director.n_posted ? f->director.posted[0]->rpc_id : NULL;
    snprintf(ret_id, 32, "%s", id ? id : "");
    char *said = next_text(s);
    return said ? said : strdup("");
}

static void it_is_the_same_as_at_once(void **state)
{
    static const char *const texts[] = {
        "",
        "{",
        "[]",
        "{\"jsonrpc\":\"2.0\",\"id\":1,\"method\":\"no.such\"}",
        "{\"jsonrpc\":\"2.0\",\"id\":[],\"method\":\"scene.undo\"}",
        "{\"jsonrpc\":\"2.0\",\"id\":2,\"method\":\"scene.undo\"}",
        "{\"jsonrpc\":\"2.0\",\"method\":\"scene.undo\"}",
        "{\"jsonrpc\":\"2.0\",\"id\":\"a\",\"method\":\"pick\",\"params\":{\"view_id\":7,\"x\":3,\"y\":4.5}}",
        "{\"jsonrpc\":\"2.0\",\"id\":3,\"method\":\"pick\",\"params\":{\"view_id\":7,\"x\":3}}",
        "{\"jsonrpc\":\"2.0\",\"id\":4,\"method\":\"scene.apply\",\"params\":{\"ops\":[{\"op\":\"remove\",\"id\":\"o\"}"
        "]}}",
        "{\"jsonrpc\":\"2.0\",\"id\":5,\"method\":\"scene.apply\",\"params\":{\"ops\":[{\"op\":\"remove\"}]}}",
        "{\"jsonrpc\":\"2.0\",\"id\":6,\"method\":\"frame.ack\",\"params\":{\"view_id\":1,\"frame_seq\":1}}",
        "{\"jsonrpc\":\"2.0\",\"id\":7,\"method\":\"session.hello\",\"params\":{}}",
        "{\"jsonrpc\":\"2.0\",\"id\":8,\"method\":\"presence.set\",\"params\":{\"wrong\":1}}",
    };
    struct fixture *f = *state;
    struct lum_session *s = open_greeted(f);
    for (size_t i = 0; i < LUM_ARRAY_LEN(texts); i++) {
        const struct lum_request_type *types[2];
        char ids[2][32], *said[2];
        for (int beside = 0; beside < 2; beside++)
            said[beside] = answer(f, s, texts[i], beside, &types[beside], ids[beside]);
        if (types[0] != types[1] || strcmp(ids[0], ids[1]) != 0 || strcmp(said[0], said[1]) != 0)
            fail_msg("%s: %s %s, and beside: %s %s", texts[i], ids[0], said[0], ids[1], said[1]);
        free(said[0]);
        free(said[1]);
    }
}

static void they_come_in_order(void **state)
{
    struct fixture *f = *state;
    struct lum_session *s = open_greeted(f);
    for (int i = 0; i < 20; i++) {
        char text[80];
        snprintf(text, sizeof text, "{\"jsonrpc\":\"2.0\",\"id\":%d,\"method\":\"scene.undo\"}", i);
        assert_true(lum_session_read_beside(s, f->reader, strdup(text), strlen(text)));
    }
    for (int i = 0; i < 20; i++) {
        struct lum_reading *m = wait_for_next(f);
        char id[16];
        snprintf(id, sizeof id, "%d", i);
        assert_string_equal(m->request->rpc_id, id);
        lum_reading_destroy(m);
    }
}

/* Nobody's words are put into the mouth of who comes next to the same place. */
static void who_is_gone_says_nothing(void **state)
{
    struct fixture *f = *state;
    struct lum_session *s = open_greeted(f);
    static const char undo[] = "{\"jsonrpc\":\"2.0\",\"id\":1,\"method\":\"scene.undo\"}";
    assert_true(lum_session_read_beside(s, f->reader, strdup(undo), sizeof undo - 1));
    struct lum_reading *m = wait_for_next(f);
    lum_session_leave(s);
    lum_session_close(s);
    lum_sessions_deliver(f->sessions);
    assert_ptr_equal(open_greeted(f), s);
    fake_director_forget(&f->director);
    assert_null(lum_sessions_receive_read(f->sessions, m));
    assert_int_equal(f->director.n_posted, 0);
    lum_reading_destroy(m);
}

static void before_hello_nothing_is_read_beside(void **state)
{
    struct fixture *f = *state;
    struct lum_session *s = lum_session_open(f->sessions, "192.0.2.7");
    char text[] = "{}";
    assert_false(lum_session_read_beside(s, f->reader, text, sizeof text - 1));
}

/* One who sends many does not keep another, who comes later, from her turn. */
static void sessions_take_turns(void **state)
{
    struct fixture *f = *state;
    struct lum_session *many = open_greeted(f), *one = open_greeted(f);
    static const char undo[] = "{\"jsonrpc\":\"2.0\",\"id\":1,\"method\":\"scene.undo\"}";
    for (int i = 0; i < 10; i++)
        assert_true(lum_session_read_beside(many, f->reader, strdup(undo), sizeof undo - 1));
    assert_true(lum_session_read_beside(one, f->reader, strdup(undo), sizeof undo - 1));
    int turn = 0;
    for (int i = 0; i < 11; i++) {
        struct lum_reading *m = wait_for_next(f);
        if (lum_session_same(m->from, one->ref))
            turn = i;
        lum_reading_destroy(m);
    }
    assert_in_range(turn, 0, 2); /* two were taken before hers came, at most: one is read, and one is not taken up */
}

/* A text of so many bytes, which takes no memory as long as nobody looks at it. */
static bool send_large(struct fixture *f, struct lum_session *s, size_t n_bytes, const char *begins)
{
    char *text = calloc(1, n_bytes);
    assert_non_null(text);
    memcpy(text, begins, strlen(begins));
    enum lum_read_beside how = lum_session_read_beside(s, f->reader, text, n_bytes);
    assert_int_not_equal(how, LUM_READ_NOT);
    return how == LUM_READ_LATER;
}

/* They may send the largest messages, and go, and come again. */
static void what_waits_goes_with_its_session(void **state)
{
    struct fixture *f = *state;
    struct lum_session *stays = open_greeted(f);
    assert_true(send_large(f, stays, LUM_LIMIT_MESSAGE_BYTES, "")); /* the reader ends with it, and goes no further */
    sem_wait(&f->ready);
    for (int i = 0; i < 100; i++) {
        struct lum_session *s = open_greeted(f);
        assert_true(send_large(f, s, LUM_LIMIT_MESSAGE_BYTES, ""));
        assert_int_equal(lum_reader_waiting_bytes(f->reader), LUM_LIMIT_MESSAGE_BYTES);
        lum_session_forget_beside(s, f->reader);
        lum_session_leave(s);
        lum_session_close(s);
        assert_int_equal(lum_reader_waiting_bytes(f->reader), 0);
    }
    lum_reading_destroy(lum_reader_next(f->reader));
}

static void what_waits_has_a_limit(void **state)
{
    struct fixture *f = *state;
    struct lum_session *s = open_greeted(f), *other = open_greeted(f);
    assert_true(send_large(f, s, LUM_READER_SMALL_BYTES, ""));
    sem_wait(&f->ready);
    size_t n = 0;
    while (send_large(f, s, LUM_LIMIT_MESSAGE_BYTES, "{\"id\":\"mine\","))
        n += LUM_LIMIT_MESSAGE_BYTES;
    assert_int_equal(n, LUM_READER_MAX_BYTES / LUM_LIMIT_MESSAGE_BYTES * LUM_LIMIT_MESSAGE_BYTES);
    assert_int_equal(lum_reader_waiting_bytes(f->reader), n);
    char *said = next_text(s);
    assert_non_null(said);
    assert_non_null(strstr(said, "\"busy\""));
    assert_non_null(strstr(said, "\"id\":\"mine\""));
    free(said);
    assert_true(send_large(f, s, LUM_READER_SMALL_BYTES - 1, "")); /* behind its own */
    lum_session_forget_beside(s, f->reader);
    assert_int_equal(lum_reader_waiting_bytes(f->reader), 0);
    assert_true(send_large(f, other, LUM_LIMIT_MESSAGE_BYTES, ""));
    lum_reading_destroy(lum_reader_next(f->reader));
}

/* It hears why, and what it sends meanwhile changes nothing about that. */
static void one_that_is_sent_away_is_not_read(void **state)
{
    struct fixture *f = *state;
    struct lum_session *s = open_greeted(f);
    lum_session_say(s, strdup("last"));
    lum_session_abort_after_text(s, LUM_CLOSE_RESTART);
    assert_int_equal(lum_session_read_beside(s, f->reader, strdup("{}"), 2), LUM_READ_REFUSED);
    assert_int_equal(lum_reader_waiting_bytes(f->reader), 0);
    char *said = next_text(s);
    assert_string_equal(said, "last");
    free(said);
    assert_null(next_text(s));
    assert_int_equal(lum_session_close_now(s), LUM_CLOSE_RESTART);
}

/* What is under way then is freed (which the address sanitizer sees). */
static void the_end_comes_at_any_time(void **state)
{
    (void)state;
    for (int n = 0; n < 3; n++) {
        struct fixture *f;
        set_up((void **)&f);
        struct lum_session *s = open_greeted(f);
        static const char undo[] = "{\"jsonrpc\":\"2.0\",\"id\":1,\"method\":\"scene.undo\"}";
        for (int i = 0; i < n; i++)
            assert_true(lum_session_read_beside(s, f->reader, strdup(undo), sizeof undo - 1));
        tear_down((void **)&f);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup_teardown(it_is_the_same_as_at_once, set_up, tear_down),
        cmocka_unit_test_setup_teardown(they_come_in_order, set_up, tear_down),
        cmocka_unit_test_setup_teardown(who_is_gone_says_nothing, set_up, tear_down),
        cmocka_unit_test_setup_teardown(before_hello_nothing_is_read_beside, set_up, tear_down),
        cmocka_unit_test_setup_teardown(sessions_take_turns, set_up, tear_down),
        cmocka_unit_test_setup_teardown(what_waits_goes_with_its_session, set_up, tear_down),
        cmocka_unit_test_setup_teardown(what_waits_has_a_limit, set_up, tear_down),
        cmocka_unit_test_setup_teardown(one_that_is_sent_away_is_not_read, set_up, tear_down),
        cmocka_unit_test(the_end_comes_at_any_time),
    };
    return cmocka_run_group_tests_name("reader", tests, NULL, NULL);
}

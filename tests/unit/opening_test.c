/* Who waits for a project that is being opened hears so, at times of this test's clock. Directors only record. */
#define _GNU_SOURCE
#include <fcntl.h>
#include <semaphore.h>
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
#include "tests/support/fake_director.h"

#define S_NS 1000000000ll

static sem_t woken;

struct fixture {
    char path[64];
    struct lum_projects *all;
    struct lum_auth auth;
    struct lum_net_counters counters;
    struct lum_sessions *sessions;
    struct lum_session *s;
    int64_t now_ns; /* when it said hello */
};

static void wake(void *user)
{
    (void)user;
    sem_post(&woken);
}

static void make(struct fixture *f, const char *scene, lum_project_id ret_id)
{
    struct lum_project_order o = {.verb = LUM_PROJECT_CREATE, .info.name = "room"};
    struct lum_proto_error proto;
    struct lum_error err;
    enum lum_status st;
    strcpy(o.info.scene, scene);
    assert_true(lum_projects_order(f->all, &o, &proto));
    while (!lum_projects_next_done(f->all, &o, &st, &err)) {
        sem_wait(&woken);
        lum_projects_turn(f->all, 0);
    }
    strcpy(ret_id, o.info.id);
}

static int set_up(void **state)
{
    struct fixture *f = calloc(1, sizeof *f);
    strcpy(f->path, "/tmp/lumend-opening-XXXXXX");
    if (!f || !mkdtemp(f->path))
        return -1;
    sem_init(&woken, 0, 0);
    const struct lum_projects_config projects = {
        .path = f->path, .director.wake_net = wake, .max_open = 1, .unused_ns = 600 * S_NS};
    struct lum_error err;
    assert_int_equal(lum_projects_create(&projects, &f->all, &err), LUM_OK);
    const struct lum_sessions_config config = {.projects = f->all, .auth = &f->auth, .counters = &f->counters};
    assert_int_equal(lum_sessions_create(&config, &f->sessions, &err), LUM_OK);
    *state = f;
    return 0;
}

static int tear_down(void **state)
{
    struct fixture *f = *state;
    lum_sessions_destroy(f->sessions);
    assert_true(lum_projects_destroy(f->all));
    sem_destroy(&woken);
    lum_dir_remove_tree(AT_FDCWD, f->path);
    free(f);
    return 0;
}

static void say_hello(struct fixture *f, const char *id)
{
    char text[160];
    snprintf(text, sizeof text,
             "{\"jsonrpc\":\"2.0\",\"id\":1,\"method\":\"session.hello\",\"params\":{\"project\":\"%s\"}}", id);
    f->s = lum_session_open(f->sessions, "192.0.2.7");
    assert_non_null(f->s);
    lum_session_receive(f->s, text, strlen(text));
    f->now_ns = f->s->waiting_ns;
}

/* part NULL: there is nothing. */
static void expect(struct fixture *f, const char *part)
{
    struct lum_message m;
    char text[2000];
    if (!lum_session_next(f->s, &m)) {
        assert_null(part);
        return;
    }
    snprintf(text, sizeof text, "%.*s", (int)m.n_body, (const char *)m.body);
    lum_session_sent(f->s);
    if (!part || !strstr(text, part))
        fail_msg("\"%s\" in the place of \"%s\"", text, part ? part : "nothing");
}

static void look(struct fixture *f, int64_t after_ns)
{
    lum_session_go_on_waiting(f->s, f->now_ns + after_ns);
}

static void wait_no_more(struct fixture *f)
{
    while (f->s->waiting) {
        sem_wait(&woken);
        lum_sessions_deliver(f->sessions);
    }
    if (f->s->project)
        fake_director_forget(lum_project_director(f->s->project)); /* it is none of the real ones */
}

static void who_waits_is_told_at_once_and_again(void **state)
{
    struct fixture *f = *state;
    lum_project_id id;
    make(f, "", id);
    say_hello(f, id);
    expect(f, "\"stage\":\"opening\",\"waited_s\":0");
    assert_true(lum_session_greeted(f->s)); /* no deadline runs */
    look(f, LUM_LIMIT_OPENING_TOLD_S * S_NS - 1);
    expect(f, NULL);
    look(f, LUM_LIMIT_OPENING_TOLD_S * S_NS);
    expect(f, "\"stage\":\"opening\",\"waited_s\":2");
    look(f, 3 * S_NS);
    expect(f, NULL);
    look(f, 60 * S_NS);
    expect(f, "\"stage\":\"opening\",\"waited_s\":60");
    wait_no_more(f);
    expect(f, "\"result\":{\"session\"");
    expect(f, NULL);
}

static void what_it_waits_for_is_told_when_that_changes(void **state)
{
    struct fixture *f = *state;
    struct lum_project *p = NULL;
    struct lum_proto_error err;
    lum_project_id a, b;
    make(f, "", a);
    make(f, "", b);
    while (lum_projects_enter(f->all, a, 0, &p, &err) == LUM_PROJECT_SOON) {
        sem_wait(&woken);
        lum_projects_turn(f->all, 0);
    }
    lum_project_leave(p, 0);
    say_hello(f, b); /* the first is closed for it */
    expect(f, "\"stage\":\"waiting\",\"waited_s\":0");
    while (lum_projects_find_open(f->all, a)) {
        sem_wait(&woken);
        lum_projects_turn(f->all, 0);
    }
    look(f, 1);
    expect(f, "\"stage\":\"opening\",\"waited_s\":0");
    wait_no_more(f);
}

static void who_is_refused_has_not_said_hello(void **state)
{
    struct fixture *f = *state;
    lum_project_id id;
    make(f, FAKE_DIRECTOR_FAILS, id);
    say_hello(f, id);
    expect(f, "\"stage\":\"opening\"");
    assert_true(lum_session_greeted(f->s));
    wait_no_more(f);
    expect(f, "cannot be opened");
    assert_false(lum_session_greeted(f->s)); /* its time runs again */
    assert_int_equal(lum_session_close_now(f->s), LUM_CLOSE_NONE);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup_teardown(who_waits_is_told_at_once_and_again, set_up, tear_down),
        cmocka_unit_test_setup_teardown(what_it_waits_for_is_told_when_that_changes, set_up, tear_down),
        cmocka_unit_test_setup_teardown(who_is_refused_has_not_said_hello, set_up, tear_down),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

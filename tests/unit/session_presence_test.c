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

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup_teardown(who_has_outstayed_hears_nothing_and_is_not_there, set_up, tear_down),
    };
    return cmocka_run_group_tests_name("session_presence", tests, NULL, NULL);
}

/* Memory that runs short while a session announces files: each allocation failed in turn. It hears so, or is closed;
 * what it announced in vain takes no place, and does not count as sent. */
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

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup_teardown(what_is_announced_in_vain_takes_no_place, set_up, tear_down),
    };
    failing_alloc_begin();
    return cmocka_run_group_tests(tests, NULL, NULL);
}

/* Projects that go for ever, by hand and by age, while the daemon runs; and whether the list says what the disk has
 * when a call of the disk failed. Directors only record. */
#define _GNU_SOURCE
#include <errno.h>
#include <fcntl.h>
#include <semaphore.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cmocka.h>

#include "server/net/projects.h"
#include "tests/support/fake_director.h"

#define S_NS 1000000000ll
#define HOUR_NS (3600 * S_NS)
#define BEGIN_S 1764250000ll
#define BY ((struct lum_session_ref){1, 1})

/* ---- a disk of which one call fails ---- */

static unsigned n_calls, failing_call; /* counted from 1; 0: none fails */
static sem_t woken;
static int64_t now_s;

static bool fails(void)
{
    errno = EIO;
    return ++n_calls == failing_call;
}

static int try_create(void *user, int dir_fd, const char *name)
{
    return fails() ? -1 : lum_disk_real.create(user, dir_fd, name);
}

static ssize_t try_write(void *user, int fd, const void *bytes, size_t n)
{
    return fails() ? -1 : lum_disk_real.write(user, fd, bytes, n);
}

static int try_sync(void *user, int fd)
{
    return fails() ? -1 : lum_disk_real.sync(user, fd);
}

static int try_rename(void *user, int dir_fd, const char *from, const char *to)
{
    return fails() ? -1 : lum_disk_real.rename(user, dir_fd, from, to);
}

static const struct lum_disk disk = {try_create, try_write, try_sync, try_rename, NULL};

/* ---- fixture ---- */

struct fixture {
    char path[64];
    struct lum_projects *all;
    int64_t now_ns;
};

static void wake(void *user)
{
    (void)user;
    sem_post(&woken);
}

static int64_t time_now(void)
{
    return now_s;
}

static void begin(struct fixture *f)
{
    const struct lum_projects_config config = {.path = f->path,
                                               .director.wake_net = wake,
                                               .max_open = 2,
                                               .unused_ns = 600 * S_NS,
                                               .time_now = time_now,
                                               .disk = &disk};
    struct lum_error err;
    failing_call = 0;
    assert_int_equal(lum_projects_create(&config, &f->all, &err), LUM_OK);
}

static int set_up(void **state)
{
    struct fixture *f = calloc(1, sizeof *f);
    strcpy(f->path, "/tmp/lumend-trash-XXXXXX");
    if (!f || !mkdtemp(f->path))
        return -1;
    now_s = BEGIN_S;
    f->now_ns = 1000 * S_NS;
    sem_init(&woken, 0, 0);
    begin(f);
    *state = f;
    return 0;
}

static int tear_down(void **state)
{
    struct fixture *f = *state;
    assert_true(lum_projects_destroy(f->all));
    sem_destroy(&woken);
    lum_dir_remove_tree(AT_FDCWD, f->path);
    free(f);
    return 0;
}

static bool order(struct fixture *f, enum lum_project_verb verb, const char *id, struct lum_proto_error *err)
{
    struct lum_project_order o = {.verb = verb, .by = BY, .info.name = "another"};
    strcpy(o.info.id, id);
    return lum_projects_order(f->all, &o, err);
}

static enum lum_status next_done(struct fixture *f, struct lum_project_order *ret_order)
{
    enum lum_status st;
    struct lum_error err;
    while (!lum_projects_next_done(f->all, ret_order, &st, &err)) {
        sem_wait(&woken);
        lum_projects_turn(f->all, f->now_ns);
    }
    lum_free(ret_order->versions);
    return st;
}

static enum lum_status act(struct fixture *f, enum lum_project_verb verb, lum_project_id id)
{
    struct lum_proto_error proto;
    struct lum_project_order done;
    assert_true(order(f, verb, id, &proto));
    enum lum_status st = next_done(f, &done);
    if (verb == LUM_PROJECT_CREATE)
        strcpy(id, done.info.id);
    return st;
}

static void make(struct fixture *f, bool in_trash, lum_project_id ret_id)
{
    ret_id[0] = '\0';
    assert_int_equal(act(f, LUM_PROJECT_CREATE, ret_id), LUM_OK);
    if (in_trash)
        assert_int_equal(act(f, LUM_PROJECT_DELETE, ret_id), LUM_OK);
}

/* NULL: it is not in the list. */
static const struct lum_project_info *listed(const struct fixture *f, const char *id)
{
    for (size_t i = 0; i < lum_projects_count(f->all); i++)
        if (strcmp(lum_projects_nth(f->all, i)->id, id) == 0)
            return lum_projects_nth(f->all, i);
    return NULL;
}

static void count(void *user, const char *name)
{
    *(size_t *)user += strcmp(name, "lock") != 0;
}

static size_t folders(const struct fixture *f)
{
    size_t n = 0;
    struct lum_dir dir;
    struct lum_error err;
    assert_int_equal(lum_dir_open(AT_FDCWD, f->path, false, &lum_disk_real, &dir, &err), LUM_OK);
    assert_int_equal(lum_dir_each(&dir, count, &n, &err), LUM_OK);
    lum_dir_close(&dir);
    return n;
}

/* ---- by hand ---- */

static void one_in_the_trash_goes_for_ever(void **state)
{
    struct fixture *f = *state;
    struct lum_proto_error err;
    struct lum_project_order done;
    lum_project_id stays, goes;
    make(f, true, stays);
    make(f, true, goes);
    assert_true(order(f, LUM_PROJECT_ERASE, goes, &err));
    assert_false(order(f, LUM_PROJECT_RESTORE, goes, &err)); /* from then on */
    assert_string_equal(err.app, "not_found");
    assert_false(order(f, LUM_PROJECT_ERASE, goes, &err));
    assert_int_equal(next_done(f, &done), LUM_OK);
    assert_null(listed(f, goes));
    assert_non_null(listed(f, stays));
    assert_int_equal(folders(f), 1);
    assert_int_equal(act(f, LUM_PROJECT_RESTORE, stays), LUM_OK);
}

static void only_what_is_in_the_trash_goes(void **state)
{
    struct fixture *f = *state;
    struct lum_proto_error err;
    struct lum_project *p = NULL;
    lum_project_id id;
    make(f, false, id);
    assert_false(order(f, LUM_PROJECT_ERASE, id, &err));
    assert_string_equal(err.app, "not_found");
    assert_non_null(strstr(err.text, "not in the trash"));
    while (lum_projects_enter(f->all, id, f->now_ns, &p, &err) == LUM_PROJECT_SOON) {
        sem_wait(&woken);
        lum_projects_turn(f->all, f->now_ns);
    }
    assert_non_null(p);
    fake_director_forget(lum_project_director(p)); /* it is none of the real ones */
    assert_false(order(f, LUM_PROJECT_ERASE, id, &err));
    assert_string_equal(err.app, "in_use");
    lum_project_leave(p, f->now_ns);
    assert_non_null(listed(f, id));
}

static void what_comes_back_is_not_emptied(void **state)
{
    struct fixture *f = *state;
    struct lum_proto_error err;
    struct lum_project_order done;
    lum_project_id back, goes;
    make(f, true, back);
    make(f, true, goes);
    assert_true(order(f, LUM_PROJECT_RESTORE, back, &err));
    assert_true(order(f, LUM_TRASH_EMPTY, "", &err)); /* before it is back */
    assert_int_equal(next_done(f, &done), LUM_OK);
    assert_int_equal(done.verb, LUM_PROJECT_RESTORE);
    assert_true(order(f, LUM_PROJECT_RENAME, back, &err)); /* at once */
    for (int i = 0; i < 2; i++) {
        assert_int_equal(next_done(f, &done), LUM_OK);
        assert_true(done.verb == LUM_PROJECT_RENAME || done.verb == LUM_TRASH_EMPTY);
        if (done.verb == LUM_TRASH_EMPTY)
            assert_int_equal(done.n_erased, 1);
    }
    assert_non_null(listed(f, back));
    assert_null(listed(f, goes));
}

/* One after the other, and who wants something else does not wait for all of them. */
static void the_trash_is_emptied_between_what_others_want(void **state)
{
    struct fixture *f = *state;
    struct lum_proto_error err;
    struct lum_project_order done;
    lum_project_id stays, gone[3], late;
    make(f, false, stays);
    for (size_t i = 0; i < LUM_ARRAY_LEN(gone); i++)
        make(f, true, gone[i]);
    assert_true(order(f, LUM_TRASH_EMPTY, "", &err));
    assert_false(order(f, LUM_PROJECT_RESTORE, gone[2], &err));
    assert_true(order(f, LUM_VERSION_LIST, stays, &err));
    assert_true(order(f, LUM_PROJECT_DELETE, stays, &err)); /* later than the order: it stays in the trash */
    assert_int_equal(next_done(f, &done), LUM_OK);
    assert_int_equal(done.verb, LUM_VERSION_LIST);
    assert_int_equal(next_done(f, &done), LUM_OK);
    assert_int_equal(done.verb, LUM_PROJECT_DELETE);
    assert_int_equal(next_done(f, &done), LUM_OK);
    assert_int_equal(done.verb, LUM_TRASH_EMPTY);
    assert_int_equal(done.n_erased, 3);
    assert_int_equal(folders(f), 1);
    assert_non_null(listed(f, stays));
    make(f, false, late);
    assert_true(order(f, LUM_TRASH_EMPTY, "", &err));
    assert_int_equal(next_done(f, &done), LUM_OK);
    assert_int_equal(done.n_erased, 1);
    assert_true(order(f, LUM_TRASH_EMPTY, "", &err)); /* there is nothing in it */
    assert_int_equal(next_done(f, &done), LUM_OK);
    assert_int_equal(done.n_erased, 0);
}

static struct lum_project_order next_of(struct fixture *f, enum lum_project_verb verb)
{
    struct lum_project_order done;
    assert_int_equal(next_done(f, &done), LUM_OK);
    assert_int_equal(done.verb, verb);
    return done;
}

/* Each takes what nobody takes yet, tells how many these were, and does so when nothing of all is there any more. */
static void two_who_empty_the_trash_take_nothing_of_each_other(void **state)
{
    struct fixture *f = *state;
    struct lum_proto_error err;
    lum_project_id late;
    for (int i = 0; i < 3; i++)
        make(f, true, late);
    make(f, false, late);
    assert_true(order(f, LUM_TRASH_EMPTY, "", &err));
    assert_true(order(f, LUM_PROJECT_DELETE, late, &err));
    next_of(f, LUM_PROJECT_DELETE); /* behind one of the trash, before the next */
    assert_true(order(f, LUM_TRASH_EMPTY, "", &err));
    assert_true(order(f, LUM_TRASH_EMPTY, "", &err));
    static const uint32_t expected[] = {3, 1, 0};
    for (size_t i = 0; i < LUM_ARRAY_LEN(expected); i++)
        assert_int_equal(next_of(f, LUM_TRASH_EMPTY).n_erased, expected[i]);
    assert_int_equal(folders(f), 0);
    assert_int_equal(lum_projects_count(f->all), 0);
}

static void what_is_erased_by_hand_is_not_counted_when_the_trash_is_emptied(void **state)
{
    struct fixture *f = *state;
    struct lum_proto_error err;
    lum_project_id ids[3];
    for (size_t i = 0; i < LUM_ARRAY_LEN(ids); i++)
        make(f, true, ids[i]);
    assert_true(order(f, LUM_PROJECT_ERASE, ids[1], &err));
    assert_true(order(f, LUM_TRASH_EMPTY, "", &err));
    assert_false(order(f, LUM_PROJECT_ERASE, ids[0], &err));
    assert_string_equal(err.app, "not_found");
    assert_string_equal(next_of(f, LUM_PROJECT_ERASE).info.id, ids[1]);
    assert_int_equal(next_of(f, LUM_TRASH_EMPTY).n_erased, 2);
    assert_int_equal(folders(f), 0);
}

/* The disk keeps one that the first wanted to remove: the second is not told that it failed, and the third takes it. */
static void what_another_failed_to_remove_is_taken_by_the_next(void **state)
{
    struct fixture *f = *state;
    struct lum_proto_error err;
    struct lum_project_order done;
    lum_project_id ids[2];
    for (size_t i = 0; i < LUM_ARRAY_LEN(ids); i++)
        make(f, true, ids[i]);
    n_calls = 0;
    failing_call = 1;
    assert_true(order(f, LUM_TRASH_EMPTY, "", &err));
    assert_true(order(f, LUM_TRASH_EMPTY, "", &err));
    assert_int_equal(next_done(f, &done), LUM_ERR_IO);
    assert_int_equal(done.n_erased, 1);
    assert_int_equal(next_of(f, LUM_TRASH_EMPTY).n_erased, 0);
    assert_true(order(f, LUM_TRASH_EMPTY, "", &err));
    assert_int_equal(next_of(f, LUM_TRASH_EMPTY).n_erased, 1);
    assert_int_equal(folders(f), 0);
}

static void one_that_cannot_be_removed_keeps_no_other(void **state)
{
    struct fixture *f = *state;
    struct lum_proto_error err;
    struct lum_project_order done;
    lum_project_id ids[3];
    for (size_t i = 0; i < LUM_ARRAY_LEN(ids); i++)
        make(f, true, ids[i]);
    n_calls = 0;
    failing_call = 3; /* rename and sync of one, rename of the next */
    assert_true(order(f, LUM_TRASH_EMPTY, "", &err));
    assert_int_equal(next_done(f, &done), LUM_ERR_IO);
    assert_int_equal(done.n_erased, 2);
    assert_int_equal(lum_projects_count(f->all), 1);
    assert_int_equal(act(f, LUM_PROJECT_RESTORE, ids[1]), LUM_OK); /* it is there as before */
}

/* ---- by age ---- */

static void turn_until(struct fixture *f, size_t n_items)
{
    lum_projects_turn(f->all, f->now_ns);
    while (lum_projects_count(f->all) != n_items) {
        sem_wait(&woken);
        lum_projects_turn(f->all, f->now_ns);
    }
}

static void what_is_too_old_goes_while_the_daemon_runs(void **state)
{
    struct fixture *f = *state;
    lum_project_id stays, old, young;
    make(f, false, stays);
    make(f, true, old);
    now_s++;
    make(f, true, young);
    now_s = BEGIN_S + LUM_LIMIT_TRASH_S + 1;
    lum_projects_turn(f->all, f->now_ns + HOUR_NS - 1); /* it was looked at when the others were made */
    assert_int_equal(lum_projects_count(f->all), 3);
    f->now_ns += HOUR_NS;
    turn_until(f, 2);
    assert_null(listed(f, old));
    assert_int_equal(folders(f), 2);
    now_s++;
    f->now_ns += HOUR_NS;
    turn_until(f, 1);
    assert_non_null(listed(f, stays));
}

/* ---- what failed ---- */

static void note(struct fixture *f, struct lum_project_info ret_infos[8], size_t *ret_n)
{
    *ret_n = lum_projects_count(f->all);
    assert_true(*ret_n <= 8);
    for (size_t i = 0; i < *ret_n; i++)
        ret_infos[i] = *lum_projects_nth(f->all, i);
}

/* The list is what the next start reads, whatever call of the disk fails. True: all went well. */
static bool list_is_disk(struct fixture *f, enum lum_project_verb verb, unsigned n)
{
    struct lum_project_info before[8];
    size_t n_before;
    lum_project_id id, other;
    make(f, verb == LUM_PROJECT_RESTORE || verb == LUM_PROJECT_ERASE || verb == LUM_TRASH_EMPTY, id);
    make(f, false, other);
    n_calls = 0;
    failing_call = n;
    lum_project_id given = "";
    if (verb != LUM_PROJECT_CREATE)
        strcpy(given, id);
    struct lum_proto_error proto;
    struct lum_project_order done;
    assert_true(order(f, verb, given, &proto));
    enum lum_status st = next_done(f, &done);
    note(f, before, &n_before);
    assert_true(lum_projects_destroy(f->all));
    begin(f);
    assert_int_equal(lum_projects_count(f->all), n_before);
    for (size_t i = 0; i < n_before; i++) {
        const struct lum_project_info *now = listed(f, before[i].id);
        if (!now || strcmp(now->name, before[i].name) != 0 || now->deleted_s != before[i].deleted_s)
            fail_msg("verb %d, call %u: the list has \"%s\", the disk \"%s\"", (int)verb, n, before[i].name,
                     now ? now->name : "nothing");
    }
    assert_int_equal(folders(f), n_before); /* and nothing is left of what was half done */
    assert_true(lum_projects_destroy(f->all));
    lum_dir_remove_tree(AT_FDCWD, f->path);
    assert_int_equal(mkdir(f->path, 0700), 0);
    begin(f);
    return !st;
}

static void what_failed_is_in_the_list_as_on_disk(void **state)
{
    unsigned n_failures = 0;
    for (enum lum_project_verb verb = LUM_PROJECT_CREATE; verb < LUM_VERSION_KEEP; verb++)
        for (unsigned n = 1; !list_is_disk(*state, verb, n); n++)
            n_failures++;
    assert_in_range(n_failures, 14, 60); /* four verbs of a rename and its sync, and two that write a file, too */
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup_teardown(one_in_the_trash_goes_for_ever, set_up, tear_down),
        cmocka_unit_test_setup_teardown(only_what_is_in_the_trash_goes, set_up, tear_down),
        cmocka_unit_test_setup_teardown(what_comes_back_is_not_emptied, set_up, tear_down),
        cmocka_unit_test_setup_teardown(the_trash_is_emptied_between_what_others_want, set_up, tear_down),
        cmocka_unit_test_setup_teardown(two_who_empty_the_trash_take_nothing_of_each_other, set_up, tear_down),
        cmocka_unit_test_setup_teardown(what_is_erased_by_hand_is_not_counted_when_the_trash_is_emptied, set_up,
                                        tear_down),
        cmocka_unit_test_setup_teardown(what_another_failed_to_remove_is_taken_by_the_next, set_up, tear_down),
        cmocka_unit_test_setup_teardown(one_that_cannot_be_removed_keeps_no_other, set_up, tear_down),
        cmocka_unit_test_setup_teardown(what_is_too_old_goes_while_the_daemon_runs, set_up, tear_down),
        cmocka_unit_test_setup_teardown(what_failed_is_in_the_list_as_on_disk, set_up, tear_down),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

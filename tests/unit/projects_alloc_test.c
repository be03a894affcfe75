/* Memory that runs short while something is done with projects: each allocation of each order failed in turn, whichever
 * thread's it is. Each order is refused, or answered; the list says what the next start finds, nothing is half done,
 * and the next order works. Directors only record. */
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

#include "server/net/projects.h"
#include "tests/support/fake_director.h"
#include "tests/unit/failing_alloc.h"

#define BY ((struct lum_session_ref){1, 1})

static sem_t woken;

/* What this is about is not what a disk does. */
static int sync_nothing(void *user, int fd)
{
    (void)user, (void)fd;
    return 0;
}

struct fixture {
    char path[64];
    struct lum_disk disk;
    struct lum_projects *all;
    lum_project_id here, gone, version; /* version: of here */
};

static void wake(void *user)
{
    (void)user;
    sem_post(&woken);
}

static void begin(struct fixture *f)
{
    const struct lum_projects_config config = {
        .path = f->path, .director.wake_net = wake, .max_open = 2, .unused_ns = INT64_MAX, .disk = &f->disk};
    struct lum_error err;
    assert_int_equal(lum_projects_create(&config, &f->all, &err), LUM_OK);
}

static int set_up(void **state)
{
    struct fixture *f = calloc(1, sizeof *f);
    strcpy(f->path, "/tmp/lumend-projects-XXXXXX");
    if (!f || !mkdtemp(f->path))
        return -1;
    f->disk = lum_disk_real;
    f->disk.sync = sync_nothing;
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

/* How it ended. LUM_ERR_LIMIT: it was refused at once. */
static enum lum_status carry_out(struct fixture *f, struct lum_project_order *o)
{
    struct lum_proto_error proto;
    struct lum_error err;
    enum lum_status st;
    if (!lum_projects_order(f->all, o, &proto))
        return LUM_ERR_LIMIT;
    while (!lum_projects_next_done(f->all, o, &st, &err)) {
        sem_wait(&woken);
        lum_projects_turn(f->all, 0);
    }
    lum_free(o->versions);
    o->versions = NULL;
    return st;
}

static struct lum_project_order order_of(const struct fixture *f, enum lum_project_verb verb, bool copies)
{
    struct lum_project_order o = {.verb = verb, .by = BY, .info.name = "another", .version_name = "evening"};
    bool of_trash = verb == LUM_PROJECT_RESTORE || verb == LUM_PROJECT_ERASE;
    if (verb != LUM_PROJECT_CREATE && verb != LUM_TRASH_EMPTY)
        strcpy(o.info.id, of_trash ? f->gone : f->here);
    if (verb == LUM_PROJECT_CREATE && copies)
        strcpy(o.from, f->here);
    if (verb == LUM_VERSION_REMOVE || (verb == LUM_PROJECT_CREATE && copies))
        strcpy(o.version, f->version);
    return o;
}

static void make(struct fixture *f, lum_project_id ret_id)
{
    struct lum_project_order o = order_of(f, LUM_PROJECT_CREATE, false);
    assert_int_equal(carry_out(f, &o), LUM_OK);
    strcpy(ret_id, o.info.id);
}

/* One with a version, and one in the trash. */
static void furnish(struct fixture *f)
{
    make(f, f->here);
    struct lum_project_order o = order_of(f, LUM_VERSION_KEEP, false);
    assert_int_equal(carry_out(f, &o), LUM_OK);
    strcpy(f->version, o.version);
    make(f, f->gone);
    o = order_of(f, LUM_PROJECT_DELETE, false);
    strcpy(o.info.id, f->gone);
    assert_int_equal(carry_out(f, &o), LUM_OK);
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

static void list_is_that_of_the_next_start(struct fixture *f)
{
    struct lum_project_info before[8];
    size_t n = lum_projects_count(f->all);
    assert_true(n <= LUM_ARRAY_LEN(before));
    for (size_t i = 0; i < n; i++)
        before[i] = *lum_projects_nth(f->all, i);
    assert_true(lum_projects_destroy(f->all));
    begin(f);
    assert_int_equal(lum_projects_count(f->all), n);
    assert_int_equal(folders(f), n);
    for (size_t i = 0, found = 0; i < n; i++, found = 0) {
        for (size_t j = 0; j < n; j++) {
            const struct lum_project_info *now = lum_projects_nth(f->all, j);
            found += strcmp(now->id, before[i].id) == 0 && strcmp(now->name, before[i].name) == 0 &&
                     now->deleted_s == before[i].deleted_s;
        }
        assert_int_equal(found, 1);
    }
}

/* True: the k-th allocation failed. */
static bool order_with_fault(struct fixture *f, enum lum_project_verb verb, bool copies, unsigned k)
{
    furnish(f);
    struct lum_project_order o = order_of(f, verb, copies);
    failing_alloc_arm_all(k);
    enum lum_status st = carry_out(f, &o);
    bool failed = failing_alloc_disarm();
    assert_true(failed || !st);
    if (st)
        assert_true(st == LUM_ERR_LIMIT || st == LUM_ERR_NOMEM || st == LUM_ERR_IO || st == LUM_ERR_INVALID);
    list_is_that_of_the_next_start(f);
    if (st) { /* nothing was done, and what was asked for is done now */
        o = order_of(f, verb, copies);
        assert_int_equal(carry_out(f, &o), LUM_OK);
    }
    assert_true(lum_projects_destroy(f->all));
    lum_dir_remove_tree(AT_FDCWD, f->path);
    begin(f);
    return failed;
}

static void each_allocation_of_each_order_fails_in_turn(void **state)
{
    struct fixture *f = *state;
    unsigned n = 0;
    for (enum lum_project_verb verb = LUM_PROJECT_CREATE; verb <= LUM_VERSION_REMOVE; verb++)
        for (int copies = 0; copies <= (verb == LUM_PROJECT_CREATE); copies++)
            for (unsigned k = 1; order_with_fault(f, verb, copies, k); k++)
                n++;
    print_message("%u allocations failed in turn\n", n);
    assert_true(n > 20);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup_teardown(each_allocation_of_each_order_fails_in_turn, set_up, tear_down)};
    failing_alloc_begin();
    return cmocka_run_group_tests(tests, NULL, NULL);
}

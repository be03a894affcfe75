/* Projects on disk, with each call that changes it failed in turn; and which are open, with directors that only record.
 */
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
#define NOW_S 1764250000ll

/* ---- a folder ---- */

static int make_folder(void **state)
{
    char path[] = "/tmp/lumend-projects-XXXXXX";
    *state = strdup(mkdtemp(path));
    return *state ? 0 : -1;
}

static int remove_folder(void **state)
{
    lum_dir_remove_tree(AT_FDCWD, *state);
    free(*state);
    return 0;
}

/* ---- a disk whose n-th call fails, and all after it: as where the process ends there ---- */

struct dying {
    unsigned n_until, n_calls;
};

static bool dead(struct dying *d)
{
    errno = ENOSPC;
    return d->n_calls++ >= d->n_until;
}

static int dying_create(void *user, int dir_fd, const char *name)
{
    return dead(user) ? -1 : lum_disk_real.create(NULL, dir_fd, name);
}

static ssize_t dying_write(void *user, int fd, const void *bytes, size_t n)
{
    return dead(user) ? -1 : write(fd, bytes, n);
}

static int dying_sync(void *user, int fd)
{
    return dead(user) ? -1 : lum_disk_real.sync(NULL, fd);
}

static int dying_rename(void *user, int dir_fd, const char *from, const char *to)
{
    return dead(user) ? -1 : lum_disk_real.rename(NULL, dir_fd, from, to);
}

struct found {
    struct lum_project_info infos[8];
    size_t n;
};

static bool note(void *user, const struct lum_project_info *info)
{
    struct found *f = user;
    assert_true(f->n < LUM_ARRAY_LEN(f->infos));
    f->infos[f->n++] = *info;
    return true;
}

/* As the next start finds it. */
static struct found look(const char *path, int64_t now_s)
{
    struct lum_project_store store;
    struct lum_error err;
    struct found f = {0};
    assert_int_equal(lum_project_store_open(path, &lum_disk_real, now_s, &store, &err), LUM_OK);
    assert_int_equal(lum_project_store_each(&store, &(struct lum_log){0}, note, &f, &err), LUM_OK);
    lum_project_store_close(&store);
    return f;
}

enum deed { MAKE, RENAME, DELETE, RESTORE, ERASE };

static enum lum_status act(struct lum_project_store *store, enum deed deed, struct lum_project_info *info)
{
    struct lum_error err;
    switch (deed) {
    case MAKE:
        return lum_project_make(store, info, &err);
    case RENAME:
        strcpy(info->name, "after");
        return lum_project_write(store, info, &err);
    case DELETE:
        return lum_project_delete(store, info, NOW_S, &err);
    case RESTORE:
        return lum_project_restore(store, info, &err);
    default:
        return lum_project_erase(store, info, &err);
    }
}

/* True: the call with that number was the last that there was. */
static bool dies_at(const char *path, enum deed deed, unsigned n_until)
{
    struct dying dying = {.n_until = n_until};
    const struct lum_disk disk = {dying_create, dying_write, dying_sync, dying_rename, &dying};
    struct lum_project_store store;
    struct lum_error err;
    struct lum_project_info info = {.name = "before", .scene = "cornell", .changed_s = NOW_S};
    assert_int_equal(lum_project_store_open(path, &lum_disk_real, NOW_S, &store, &err), LUM_OK);
    if (deed != MAKE)
        assert_int_equal(act(&store, MAKE, &info), LUM_OK);
    if (deed == RESTORE || deed == ERASE)
        assert_int_equal(act(&store, DELETE, &info), LUM_OK);
    store.dir.disk = &disk;
    enum lum_status st = act(&store, deed, &info);
    lum_project_store_close(&store);
    struct found f = look(path, NOW_S);
    assert_true(f.n == 1 || ((deed == MAKE || deed == ERASE) && f.n == 0)); /* whole, or not there */
    if (f.n == 1) {
        bool renamed = strcmp(f.infos[0].name, "after") == 0;
        assert_true(renamed || strcmp(f.infos[0].name, "before") == 0);
        assert_string_equal(f.infos[0].scene, "cornell");
        if (!st) { /* what was answered is so */
            assert_int_equal(renamed, deed == RENAME);
            assert_int_equal(f.infos[0].deleted_s, deed == DELETE ? NOW_S : 0);
        }
    }
    assert_true(st || f.n == (deed == ERASE ? 0 : 1));
    lum_dir_remove_tree(AT_FDCWD, path);
    assert_int_equal(mkdir(path, 0700), 0);
    return !st;
}

static void a_crash_leaves_what_was_or_what_is(void **state)
{
    unsigned n_points = 0;
    for (enum deed deed = MAKE; deed <= ERASE; deed++)
        for (unsigned n = 0; !dies_at(*state, deed, n); n++)
            n_points++;
    assert_in_range(n_points, 12, 60);
}

static void the_trash_is_emptied_after_its_time(void **state)
{
    struct lum_project_store store;
    struct lum_error err;
    struct lum_project_info info = {.name = "gone", .changed_s = NOW_S};
    assert_int_equal(lum_project_store_open(*state, &lum_disk_real, NOW_S, &store, &err), LUM_OK);
    assert_int_equal(lum_project_make(&store, &info, &err), LUM_OK);
    assert_int_equal(lum_project_delete(&store, &info, NOW_S, &err), LUM_OK);
    lum_project_store_close(&store);
    assert_int_equal(look(*state, NOW_S + LUM_LIMIT_TRASH_S).n, 1);
    assert_int_equal(look(*state, NOW_S + LUM_LIMIT_TRASH_S + 1).n, 0);
}

static void one_daemon_has_the_folder(void **state)
{
    struct lum_project_store store, second;
    struct lum_error err;
    assert_int_equal(lum_project_store_open(*state, &lum_disk_real, NOW_S, &store, &err), LUM_OK);
    assert_int_equal(lum_project_store_open(*state, &lum_disk_real, NOW_S, &second, &err), LUM_ERR_CONFLICT);
    lum_project_store_close(&store);
}

static void names_are_at_most_so_long(void **state)
{
    char name[LUM_LIMIT_PROJECT_NAME_BYTES + 2];
    (void)state;
    memset(name, 'x', sizeof name - 1);
    name[sizeof name - 1] = '\0';
    assert_false(lum_project_name_is(name));
    assert_true(lum_project_name_is(name + 1));
    assert_true(lum_project_name_is(name + 2));
    assert_false(lum_project_name_is(""));
}

static void names_show_something(void **state)
{
    static const char *const nothing[] = {"\u200b", "\u00ad", "\u3164", "\u2800\u3000", "\U000e0041", "\ufeff\u00a0"};
    static const char *const something[] = {"a",
                                            "\u00e9",
                                            "\u0646\u0645\u06cc\u200c\u062e\u0648\u0627\u0647\u0645",
                                            "\u6771\u3000\u4eac",
                                            "\U0001f4a1\ufe0f",
                                            "\u00bf"};
    (void)state;
    for (size_t i = 0; i < LUM_ARRAY_LEN(nothing); i++)
        if (lum_project_name_shows(nothing[i]) || !lum_project_name_is(nothing[i]))
            fail_msg("name %zu shows nothing", i);
    for (size_t i = 0; i < LUM_ARRAY_LEN(something); i++)
        if (!lum_project_name_shows(something[i]))
            fail_msg("name %zu is one", i);
}

/* ---- which are open ---- */

static sem_t woken;
static uint64_t memory_bytes;

static void wake(void *user)
{
    (void)user;
    sem_post(&woken);
}

static uint64_t memory_now(void)
{
    return memory_bytes;
}

struct open_fixture {
    struct lum_projects *all;
    int64_t now_ns;
    lum_project_id ids[4];
};

/* Threads end, and are seen to, until fn is true. */
static enum lum_project_door try_to_enter(struct open_fixture *f, const char *id, struct lum_project **ret,
                                          struct lum_proto_error *err)
{
    enum lum_project_door door;
    while ((door = lum_projects_enter(f->all, id, f->now_ns, ret, err)) == LUM_PROJECT_SOON) {
        sem_wait(&woken);
        lum_projects_turn(f->all, f->now_ns);
    }
    return door;
}

static struct lum_project *enter(struct open_fixture *f, const char *id)
{
    struct lum_project *p = NULL;
    struct lum_proto_error err;
    assert_int_equal(try_to_enter(f, id, &p, &err), LUM_PROJECT_IN);
    fake_director_forget(lum_project_director(p)); /* it is none of the real ones */
    return p;
}

static unsigned n_open(const struct open_fixture *f)
{
    struct lum_projects_metrics m;
    lum_projects_metrics(f->all, &m);
    return m.n_open;
}

static void create(struct open_fixture *f, const char *scene, lum_project_id ret_id)
{
    struct lum_project_order o = {.verb = LUM_PROJECT_CREATE, .info.name = "room"};
    struct lum_proto_error proto;
    struct lum_error err;
    enum lum_status st;
    strcpy(o.info.scene, scene);
    assert_true(lum_projects_order(f->all, &o, &proto));
    while (!lum_projects_next_done(f->all, &o, &st, &err)) {
        sem_wait(&woken);
        lum_projects_turn(f->all, f->now_ns);
    }
    assert_int_equal(st, LUM_OK);
    strcpy(ret_id, o.info.id);
}

static void begin(struct open_fixture *f, const char *path, uint32_t max_open)
{
    const struct lum_projects_config config = {.path = path,
                                               .director.wake_net = wake,
                                               .max_open = max_open,
                                               .max_bytes = 100,
                                               .unused_ns = 600 * S_NS,
                                               .memory_now = memory_now};
    struct lum_error err;
    *f = (struct open_fixture){.now_ns = 1000 * S_NS};
    memory_bytes = 0;
    sem_init(&woken, 0, 0);
    assert_int_equal(lum_projects_create(&config, &f->all, &err), LUM_OK);
    for (size_t i = 0; i < LUM_ARRAY_LEN(f->ids); i++)
        create(f, i == 3 ? FAKE_DIRECTOR_FAILS : "", f->ids[i]);
}

static void end(struct open_fixture *f)
{
    assert_true(lum_projects_destroy(f->all));
    sem_destroy(&woken);
}

static void one_that_nobody_is_in_is_closed_after_a_while(void **state)
{
    struct open_fixture f;
    begin(&f, *state, 4);
    struct lum_project *a = enter(&f, f.ids[0]), *b = enter(&f, f.ids[1]);
    assert_ptr_not_equal(lum_project_director(a), lum_project_director(b));
    assert_ptr_equal(enter(&f, f.ids[0]), a);
    lum_project_leave(a, f.now_ns);
    f.now_ns += 10000 * S_NS;
    lum_projects_turn(f.all, f.now_ns);
    assert_int_equal(n_open(&f), 2); /* somebody is in each */
    lum_project_leave(a, f.now_ns);
    lum_projects_turn(f.all, f.now_ns + 600 * S_NS - 1);
    assert_int_equal(n_open(&f), 2);
    uint64_t opening = lum_project_opening(a);
    lum_projects_turn(f.all, f.now_ns + 600 * S_NS);
    assert_int_equal(n_open(&f), 1);
    assert_int_not_equal(lum_project_opening(a), opening);
    a = enter(&f, f.ids[0]);
    assert_true(lum_project_opening(a) > opening);
    end(&f);
}

static void the_longest_unused_goes_first(void **state)
{
    struct open_fixture f;
    struct lum_project *p;
    struct lum_proto_error err;
    begin(&f, *state, 2);
    struct lum_project *a = enter(&f, f.ids[0]), *b = enter(&f, f.ids[1]);
    assert_int_equal(try_to_enter(&f, f.ids[2], &p, &err), LUM_PROJECT_NO);
    assert_string_equal(err.app, "busy");
    lum_project_leave(b, f.now_ns++);
    lum_project_leave(a, f.now_ns++);
    (void)enter(&f, f.ids[2]);
    assert_non_null(lum_projects_find_open(f.all, f.ids[0]));
    assert_null(lum_projects_find_open(f.all, f.ids[1]));
    end(&f);
}

static void memory_comes_back_from_those_that_nobody_is_in(void **state)
{
    struct open_fixture f;
    struct lum_project *p;
    struct lum_proto_error err;
    begin(&f, *state, 4);
    struct lum_project *a = enter(&f, f.ids[0]);
    (void)enter(&f, f.ids[1]);
    memory_bytes = 101;
    lum_projects_turn(f.all, f.now_ns);
    assert_int_equal(n_open(&f), 2);
    assert_int_equal(try_to_enter(&f, f.ids[2], &p, &err), LUM_PROJECT_NO);
    assert_non_null(strstr(err.text, "memory"));
    lum_project_leave(a, f.now_ns);
    lum_projects_turn(f.all, f.now_ns);
    assert_int_equal(n_open(&f), 1);
    memory_bytes = 100;
    (void)enter(&f, f.ids[2]);
    end(&f);
}

static void one_that_cannot_be_opened_is_told_and_tried_again(void **state)
{
    struct open_fixture f;
    struct lum_project *p;
    struct lum_proto_error err;
    begin(&f, *state, 1);
    for (int i = 0; i < 2; i++) {
        assert_int_equal(try_to_enter(&f, f.ids[3], &p, &err), LUM_PROJECT_NO);
        if (!strstr(err.text, "as asked"))
            fail_msg("%s", err.text);
        lum_projects_turn(f.all, f.now_ns);
    }
    (void)enter(&f, f.ids[0]); /* it holds no place */
    end(&f);
}

/* What begins as ours do and is another's is let be. */
static void files_of_others_stay(void **state)
{
    char path[600];
    struct stat st;
    static const char *const names[] = {"part.mine", "part.", "part.ABCDEFGHIJKLMNOP"};
    for (size_t i = 0; i < LUM_ARRAY_LEN(names); i++) {
        snprintf(path, sizeof path, "%s/%s", (const char *)*state, names[i]);
        assert_int_equal(mkdir(path, 0700), 0);
    }
    assert_int_equal(look(*state, NOW_S).n, 0);
    for (size_t i = 0; i < LUM_ARRAY_LEN(names); i++) {
        snprintf(path, sizeof path, "%s/%s", (const char *)*state, names[i]);
        assert_int_equal(stat(path, &st), 0);
    }
}

/* Orders of one project that wait together: a name that was given before the trash is that in the trash, and from the
 * order on nobody gets in, whatever else is done first. */
static void orders_that_wait_together(void **state)
{
    struct open_fixture f;
    struct lum_proto_error proto;
    struct lum_error err;
    enum lum_status st;
    struct lum_project *p = NULL;
    const enum lum_project_verb verbs[] = {LUM_PROJECT_RENAME, LUM_VERSION_LIST, LUM_PROJECT_DELETE};
    begin(&f, *state, 1);
    for (size_t i = 0; i < LUM_ARRAY_LEN(verbs); i++) {
        struct lum_project_order o = {.verb = verbs[i], .info.name = "foyer"};
        strcpy(o.info.id, f.ids[0]);
        assert_true(lum_projects_order(f.all, &o, &proto));
    }
    for (size_t n = 0; n < LUM_ARRAY_LEN(verbs);) {
        struct lum_project_order o;
        assert_int_equal(lum_projects_enter(f.all, f.ids[0], f.now_ns, &p, &proto), LUM_PROJECT_NO);
        if (lum_projects_next_done(f.all, &o, &st, &err)) {
            assert_int_equal(st, LUM_OK);
            lum_free(o.versions);
            n++;
            continue;
        }
        sem_wait(&woken);
        lum_projects_turn(f.all, f.now_ns);
    }
    const struct lum_project_info *info = NULL;
    for (size_t i = 0; i < lum_projects_count(f.all); i++)
        if (strcmp(lum_projects_nth(f.all, i)->id, f.ids[0]) == 0)
            info = lum_projects_nth(f.all, i);
    assert_non_null(info);
    assert_string_equal(info->name, "foyer");
    assert_true(info->deleted_s > 0);
    end(&f);
}

static void one_session_does_not_fill_the_line(void **state)
{
    struct open_fixture f;
    struct lum_proto_error proto;
    struct lum_error err;
    enum lum_status st;
    begin(&f, *state, 1);
    struct lum_project_order o = {.verb = LUM_VERSION_LIST, .by = {1, 1}};
    strcpy(o.info.id, f.ids[0]);
    /* some may be done before the last of them is asked for */
    size_t n_taken = 0;
    while (lum_projects_order(f.all, &o, &proto) && n_taken < 100000)
        n_taken++;
    assert_in_range(n_taken, LUM_LIMIT_PROJECT_REQUESTS_OF, 100000 - 1);
    assert_string_equal(proto.app, "busy");
    o.by.slot = 2;
    assert_true(lum_projects_order(f.all, &o, &proto));
    for (size_t n = 0; n < n_taken + 1;) {
        struct lum_project_order done;
        if (lum_projects_next_done(f.all, &done, &st, &err)) {
            lum_free(done.versions);
            n++;
            continue;
        }
        sem_wait(&woken);
        lum_projects_turn(f.all, f.now_ns);
    }
    o.by.slot = 1;
    assert_true(lum_projects_order(f.all, &o, &proto));
    end(&f);
}

/* A name that is given while the project is closed, and written down at its end, is not lost. */
static void what_is_noted_at_the_end_keeps_a_new_name(void **state)
{
    struct open_fixture f;
    struct lum_proto_error proto;
    begin(&f, *state, 1);
    struct lum_project *p = enter(&f, f.ids[0]);
    lum_project_note_change(p, 42, NULL);
    struct lum_project_order o = {.verb = LUM_PROJECT_RENAME, .info.name = "foyer"};
    strcpy(o.info.id, f.ids[0]);
    assert_true(lum_projects_order(f.all, &o, &proto));
    lum_project_leave(p, f.now_ns);
    end(&f);
    struct found found = look(*state, NOW_S);
    for (size_t i = 0; i < found.n; i++)
        if (strcmp(found.infos[i].id, o.info.id) == 0)
            assert_string_equal(found.infos[i].name, "foyer");
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup_teardown(a_crash_leaves_what_was_or_what_is, make_folder, remove_folder),
        cmocka_unit_test_setup_teardown(the_trash_is_emptied_after_its_time, make_folder, remove_folder),
        cmocka_unit_test_setup_teardown(one_daemon_has_the_folder, make_folder, remove_folder),
        cmocka_unit_test(names_are_at_most_so_long),
        cmocka_unit_test(names_show_something),
        cmocka_unit_test_setup_teardown(one_that_nobody_is_in_is_closed_after_a_while, make_folder, remove_folder),
        cmocka_unit_test_setup_teardown(the_longest_unused_goes_first, make_folder, remove_folder),
        cmocka_unit_test_setup_teardown(memory_comes_back_from_those_that_nobody_is_in, make_folder, remove_folder),
        cmocka_unit_test_setup_teardown(one_that_cannot_be_opened_is_told_and_tried_again, make_folder, remove_folder),
        cmocka_unit_test_setup_teardown(files_of_others_stay, make_folder, remove_folder),
        cmocka_unit_test_setup_teardown(orders_that_wait_together, make_folder, remove_folder),
        cmocka_unit_test_setup_teardown(one_session_does_not_fill_the_line, make_folder, remove_folder),
        cmocka_unit_test_setup_teardown(what_is_noted_at_the_end_keeps_a_new_name, make_folder, remove_folder),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

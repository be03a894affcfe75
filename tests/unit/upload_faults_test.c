/* Every call of an upload that changes the disk failed in turn: what has an id is whole, nothing else stays, and the
 * next upload works. And two that send the same at once. */
#define _GNU_SOURCE
#include <dirent.h>
#include <errno.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include <cmocka.h>

#include "server/journal/upload_store.h"

/* A disk whose n-th call fails, and no other. */
struct faulty {
    unsigned n_until, n_calls;
};

static bool fails(struct faulty *f)
{
    errno = ENOSPC;
    return f->n_calls++ == f->n_until;
}

static int faulty_create(void *user, int dir_fd, const char *name)
{
    return fails(user) ? -1 : lum_disk_real.create(NULL, dir_fd, name);
}

static ssize_t faulty_write(void *user, int fd, const void *bytes, size_t n)
{
    return fails(user) ? -1 : write(fd, bytes, n);
}

static int faulty_sync(void *user, int fd)
{
    return fails(user) ? -1 : lum_disk_real.sync(NULL, fd);
}

static int faulty_rename(void *user, int dir_fd, const char *from, const char *to)
{
    return fails(user) ? -1 : lum_disk_real.rename(NULL, dir_fd, from, to);
}

static const struct lum_upload_file files[] = {{"room.obj", 5}, {"maps/wood.mtl", 4}, {"empty", 0}};

static enum lum_status upload(struct lum_upload_store *store, lum_upload_id ret_id, bool *ret_known)
{
    struct lum_upload_writer *w = NULL;
    struct lum_error err;
    enum lum_status st = lum_upload_writer_create(store, files, LUM_ARRAY_LEN(files), &w, &err);
    if (!st)
        st = lum_upload_write(w, "v 0 0newm", 9, &err);
    if (!st)
        st = lum_upload_finish(w, ret_id, ret_known, &err);
    lum_upload_writer_destroy(w);
    return st;
}

static unsigned n_names(const char *root)
{
    char path[sizeof((struct lum_upload_root *)NULL)->path + 16];
    unsigned n = 0;
    snprintf(path, sizeof path, "%s/" LUM_UPLOAD_FOLDER, root);
    DIR *list = opendir(path);
    for (struct dirent *e = list ? readdir(list) : NULL; e; e = readdir(list))
        n += e->d_name[0] != '.';
    if (list)
        closedir(list);
    return n;
}

/* Whether a call failed: false after the last one. */
static bool upload_with_fault(unsigned n_until)
{
    struct lum_upload_root root;
    lum_upload_id id, again;
    bool known;
    struct lum_error err;
    struct faulty f = {.n_until = n_until};
    const struct lum_disk disk = {faulty_create, faulty_write, faulty_sync, faulty_rename, &f};
    struct lum_upload_store store;
    assert_int_equal(lum_upload_root_make(&root, &err), LUM_OK);
    enum lum_status st = lum_upload_store_open(root.path, &disk, &store, &err);
    bool opened = !st;
    if (opened)
        st = upload(&store, id, &known);
    bool failed = f.n_calls > n_until;
    if (failed)
        assert_int_equal(st, LUM_ERR_IO);
    else
        assert_int_equal(st, LUM_OK);
    if (opened && failed) { /* a rename whose folder was not synced has its name, and is whole */
        unsigned n_left = n_names(root.path);
        assert_true(n_left <= 1);
        assert_int_equal(upload(&store, again, &known), LUM_OK);
        assert_int_equal(known, n_left == 1);
    }
    if (opened) {
        assert_int_equal(n_names(root.path), 1);
        lum_upload_store_close(&store);
    }
    lum_upload_root_remove(&root);
    assert_int_equal(access(root.path, F_OK), -1);
    return failed;
}

static void each_call_fails_in_turn(void **state)
{
    (void)state;
    unsigned n = 0;
    while (upload_with_fault(n))
        n++;
    print_message("%u calls failed in turn\n", n);
    assert_true(n >= 10);
}

/* ---- the same, twice at once ---- */

static struct lum_upload_store *raced;

/* Before the first has its name the second gets it. */
static int second_is_faster(void *user, int dir_fd, const char *from, const char *to)
{
    struct lum_upload_store *store = raced;
    lum_upload_id id;
    bool known = true;
    raced = NULL;
    if (store) {
        assert_int_equal(upload(store, id, &known), LUM_OK);
        assert_false(known);
        assert_string_equal(id, to);
    }
    return lum_disk_real.rename(user, dir_fd, from, to);
}

static void the_same_at_once_is_known_to_one(void **state)
{
    (void)state;
    struct lum_upload_root root;
    struct lum_upload_store store;
    struct lum_error err;
    lum_upload_id id;
    bool known = false;
    struct lum_disk disk = lum_disk_real;
    disk.rename = second_is_faster;
    assert_int_equal(lum_upload_root_make(&root, &err), LUM_OK);
    assert_int_equal(lum_upload_store_open(root.path, &disk, &store, &err), LUM_OK);
    raced = &store;
    assert_int_equal(upload(&store, id, &known), LUM_OK);
    assert_true(known);
    assert_int_equal(n_names(root.path), 1);
    lum_upload_store_close(&store);
    lum_upload_root_remove(&root);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(each_call_fails_in_turn),
                                       cmocka_unit_test(the_same_at_once_is_known_to_one)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}

/* Every allocation of an upload, and each thread of it, failed in turn: those of the library that makes its id, too. It
 * is refused, or cut short; its bytes are not charged, its place is free, nothing of it stays, and the next works. */
#define _GNU_SOURCE
#include <dirent.h>
#include <errno.h>
#include <pthread.h>
#include <semaphore.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cjson/cJSON.h>
#include <cmocka.h>

#include "server/net/people.h"
#include "server/net/uploads.h"
#include "tests/unit/failing_alloc.h"
#include "tests/unit/failing_openssl.h"

int __real_pthread_create(pthread_t *thread, const pthread_attr_t *attr, void *(*run)(void *), void *arg);
int __wrap_pthread_create(pthread_t *thread, const pthread_attr_t *attr, void *(*run)(void *), void *arg);

static bool no_thread;

int __wrap_pthread_create(pthread_t *thread, const pthread_attr_t *attr, void *(*run)(void *), void *arg)
{
    return no_thread ? EAGAIN : __real_pthread_create(thread, attr, run, arg);
}

static const struct lum_upload_file sent[] = {{"room.obj", 5}, {"maps/wood.mtl", 4}};
static const char bytes[] = "v 0 0newm";
#define N_BYTES (sizeof bytes - 1)

struct fixture {
    struct lum_upload_root root;
    struct lum_uploads *all;
    sem_t woken;
    int connection; /* whose address it has */
};

static void wake(void *user)
{
    sem_post(user);
}

static int set_up(void **state)
{
    struct lum_error err;
    struct fixture *f = calloc(1, sizeof *f);
    if (!f || lum_upload_root_make(&f->root, &err))
        return -1;
    sem_init(&f->woken, 0, 0);
    const struct lum_uploads_config config = {.root = f->root.path,
                                              .max_bytes = 2 * N_BYTES, /* what is kept, and one more */
                                              .disk = &lum_disk_real,
                                              .wake = wake,
                                              .wake_user = &f->woken};
    *state = f;
    return lum_uploads_create(&config, &f->all, &err);
}

static int tear_down(void **state)
{
    struct fixture *f = *state;
    lum_uploads_destroy(f->all);
    lum_upload_root_remove(&f->root);
    sem_destroy(&f->woken);
    free(f);
    return 0;
}

static unsigned n_names(const struct fixture *f)
{
    char path[sizeof f->root.path + 16];
    unsigned n = 0;
    snprintf(path, sizeof path, "%s/" LUM_UPLOAD_FOLDER, f->root.path);
    DIR *list = opendir(path);
    for (struct dirent *e = list ? readdir(list) : NULL; e; e = readdir(list))
        n += e->d_name[0] != '.';
    if (list)
        closedir(list);
    return n;
}

static void announce(struct fixture *f, char ret_ticket[LUM_UPLOAD_TICKET_BYTES + 1])
{
    struct lum_proto_error err;
    struct lum_upload_file *files = malloc(sizeof sent);
    assert_non_null(files);
    memcpy(files, sent, sizeof sent);
    if (!lum_uploads_announce(f->all, (struct lum_session_ref){1, 1}, "ann", files, LUM_ARRAY_LEN(sent), ret_ticket,
                              &err))
        fail_msg("%s", err.text);
}

/* The HTTP status; *ret_folder: where it lies, to be freed. */
static int put(struct fixture *f, const char *ticket, char **ret_folder)
{
    int status;
    cJSON *json;
    struct lum_upload *u = lum_uploads_begin(f->all, ticket, N_BYTES, &f->connection, &status);
    if (!u)
        return status;
    enum lum_upload_go go = lum_upload_add(u, bytes, N_BYTES);
    assert_int_equal(go, LUM_UPLOAD_GO_ON);
    lum_upload_end(u);
    while (!lum_upload_is_done(u))
        sem_wait(&f->woken);
    status = lum_upload_answer(u, &json);
    const cJSON *folder = json ? cJSON_GetObjectItemCaseSensitive(json, "folder") : NULL;
    *ret_folder = folder ? strdup(folder->valuestring) : NULL;
    cJSON_Delete(json);
    return status;
}

/* Without a fault: it is there, under the name that it always has. */
static void put_again(struct fixture *f, const char *expected)
{
    char ticket[LUM_UPLOAD_TICKET_BYTES + 1], *folder = NULL;
    announce(f, ticket);
    assert_int_equal(put(f, ticket, &folder), 200);
    assert_non_null(folder);
    if (expected)
        assert_string_equal(folder, expected);
    assert_int_equal(n_names(f), 1);
    free(folder);
}

static void each_allocation_fails_in_turn(void **state)
{
    struct fixture *f = *state;
    char ticket[LUM_UPLOAD_TICKET_BYTES + 1], *folder = NULL, *whole = NULL;
    unsigned n_refused = 0, k = 0;
    for (bool failed = true; failed; free(folder)) {
        announce(f, ticket); /* what is charged for those that failed would be too much here */
        folder = NULL;
        failing_alloc_arm_all(++k);
        int status = put(f, ticket, &folder);
        failed = failing_alloc_disarm();
        n_refused += status != 200;
        assert_true(status == 200 || status == 500 || status == 503);
        assert_true(n_names(f) == (status == 200 || whole));
        assert_true(failed || (status == 200 && folder));
        if (status == 200 && folder && !whole)
            whole = strdup(folder);
        if (status == 200 && folder)
            assert_string_equal(folder, whole);
        if (status != 200)
            assert_null(folder);
    }
    print_message("%u allocations failed in turn, by %u the upload\n", k - 1, n_refused);
    assert_true(n_refused >= 5);
    put_again(f, whole);
    free(whole);
}

static void no_thread_is_there(void **state)
{
    struct fixture *f = *state;
    char ticket[LUM_UPLOAD_TICKET_BYTES + 1], *folder = NULL;
    for (int i = 0; i < 3; i++) { /* more than fits, if it stayed charged */
        announce(f, ticket);
        no_thread = true;
        assert_int_equal(put(f, ticket, &folder), 503);
        no_thread = false;
        assert_int_equal(put(f, ticket, &folder), 404); /* a ticket is for one */
    }
    assert_int_equal(n_names(f), 0);
    put_again(f, NULL);
}

/* Who comes while memory is short is not let in, and is when it is not. */
static void a_token_is_hashed_when_there_is_memory_again(void **state)
{
    (void)state;
    uint8_t expected[LUM_TOKEN_SHA_BYTES], sha[LUM_TOKEN_SHA_BYTES];
    assert_true(lum_token_sha("token", expected));
    unsigned k = 0;
    for (bool failed = true; failed;) {
        failing_alloc_arm(++k);
        bool ok = lum_token_sha("token", sha);
        failed = failing_alloc_disarm();
        assert_true(ok ? memcmp(sha, expected, sizeof sha) == 0 : failed);
        assert_true(lum_token_sha("token", sha));
        assert_memory_equal(sha, expected, sizeof sha);
    }
    assert_true(k > 1);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup_teardown(each_allocation_fails_in_turn, set_up, tear_down),
        cmocka_unit_test_setup_teardown(no_thread_is_there, set_up, tear_down),
        cmocka_unit_test(a_token_is_hashed_when_there_is_memory_again),
    };
    if (!failing_openssl_begin())
        return 1;
    failing_alloc_begin();
    return cmocka_run_group_tests(tests, NULL, NULL);
}

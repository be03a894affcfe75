/* Every system call of the journal failed in turn, those that read too: nothing acknowledged is lost, a disk that does
 * not answer is no damage, and what fails says so. */
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
#include <sys/stat.h>
#include <unistd.h>

#include <cmocka.h>

#include "tests/support/journal_keeper.h"
#include "tests/unit/document_util.h"

/* The linker sends the calls of our libraries here (-Wl,--wrap), those of both threads. */
static struct {
    _Atomic bool armed;
    _Atomic unsigned n_calls;
    unsigned n_until;           /* calls that work before the one that fails */
    const char *always;         /* fails each time; NULL: none */
    int error;                  /* errno */
    const char *_Atomic failed; /* which one */
} calls;

static bool fails(const char *name)
{
    if (!calls.armed)
        return false;
    bool always = calls.always && strcmp(name, calls.always) == 0;
    if (!always && atomic_fetch_add(&calls.n_calls, 1) != calls.n_until)
        return false;
    calls.failed = name;
    errno = calls.error;
    return true;
}

/* RESULT NAME PARAMETERS: fails with FAILURE, else calls NAME ARGUMENTS. */
#define WRAP(result, name, parameters, arguments, failure)                                                             \
    result __real_##name parameters;                                                                                   \
    result __wrap_##name parameters;                                                                                   \
    result __wrap_##name parameters                                                                                    \
    {                                                                                                                  \
        return fails(#name) ? failure : __real_##name arguments;                                                       \
    }
WRAP(int, mkdirat, (int fd, const char *name, mode_t mode), (fd, name, mode), -1)
WRAP(int, openat, (int fd, const char *name, int flags, mode_t mode), (fd, name, flags, mode), -1)
WRAP(int, flock, (int fd, int how), (fd, how), -1)
WRAP(DIR *, fdopendir, (int fd), (fd), NULL)
WRAP(struct dirent *, readdir, (DIR * list), (list), NULL)
WRAP(int, fstat, (int fd, struct stat *st), (fd, st), -1)
WRAP(int, fstatat, (int fd, const char *name, struct stat *st, int flags), (fd, name, st, flags), -1)
WRAP(ssize_t, read, (int fd, void *to, size_t n), (fd, to, n), -1)
WRAP(ssize_t, pread, (int fd, void *to, size_t n, off_t at), (fd, to, n, at), -1)
WRAP(ssize_t, write, (int fd, const void *from, size_t n), (fd, from, n), -1)
WRAP(int, ftruncate, (int fd, off_t n), (fd, n), -1)
WRAP(int, renameat, (int from, const char *a, int to, const char *b), (from, a, to, b), -1)
WRAP(int, unlinkat, (int fd, const char *name, int flags), (fd, name, flags), -1)

/* No power is cut here: what a sync takes is saved. */
int __wrap_fsync(int fd);
int __wrap_fsync(int fd)
{
    (void)fd;
    return fails("fsync") ? -1 : 0;
}

static void arm(unsigned n_until, int error)
{
    calls.n_until = n_until;
    calls.error = error;
    calls.n_calls = 0;
    calls.failed = NULL;
    calls.armed = true;
}

/* Two lights, and a mesh that is content. */
static char *scene(void)
{
    char *text = malloc(200000), *at = text;
    at += sprintf(
        at, "[" LIGHT("l0") "," LIGHT("l1") ",{'op':'add','type':'mesh','id':'big','positions':[0,0,0,1,0,0,0,1,0");
    for (int i = 0; i < 9000; i++)
        at += sprintf(at, ",%d.5", i % 7);
    sprintf(at, "],'indices':[0,1,2]}]");
    return text;
}

struct life {
    struct keeper *k;
    unsigned last[2]; /* acknowledged */
    bool begun;
};

/* A start, some edits with a snapshot among them, an end. */
static void live(struct life *l, const char *ops, unsigned first)
{
    struct lum_error err = {0};
    struct keeper *k = l->k;
    if (!keeper_open(k, ops, &err)) {
        assert_int_equal(err.status, LUM_ERR_IO);
        assert_true(strlen(err.text) > 10);
        return;
    }
    l->begun = true;
    assert_true(flux(k->doc, "l0") == l->last[0] && flux(k->doc, "l1") == l->last[1]);
    for (unsigned i = first; i < first + 5; i++) {
        char edit[96];
        snprintf(edit, sizeof edit, "[{'op':'set','id':'l%u','path':'/flux_lm','value':%u}]", i % 2, i);
        bool accepted = keeper_edit(k, "ann", edit);
        if (accepted && keeper_settle(k))
            l->last[i % 2] = i;
        else
            keeper_wait_writable(k);
        assert_true(flux(k->doc, "l0") == l->last[0] && flux(k->doc, "l1") == l->last[1]);
    }
    keeper_close(k);
}

/* True when call n was reached. */
static bool live_three_times(const char *ops, unsigned n, int error)
{
    struct life l = {.k = malloc(sizeof *l.k), .last = {800, 800}};
    struct lum_recovery r;
    struct lum_error err = {0};
    keeper_init(l.k);
    l.k->config.compact_bytes = 300;
    arm(n, error);
    for (unsigned i = 0; i < 3; i++)
        live(&l, ops, 1 + 5 * i);
    calls.armed = false;
    const char *failed = calls.failed;
    assert_true(l.begun);
    l.k->log[0] = '\0';
    if (keeper_recover(l.k, &r, &err))
        fail_msg("call %u, %s: %s", n, failed, err.text);
    if (r.n_lost || r.n_damages || flux(r.doc, "l0") != l.last[0] || flux(r.doc, "l1") != l.last[1])
        fail_msg("call %u, %s: %s", n, failed, l.k->log);
    lum_recovery_finish(&r);
    if (keeper_count(l.k, "", "snapshot-0.damaged") + keeper_count(l.k, "", "journal-0.damaged") > 0)
        fail_msg("call %u, %s: a whole file was put aside", n, failed);
    keeper_finish(l.k);
    free(l.k);
    return failed != NULL;
}

static void each_call_fails_once(void **state)
{
    static const int errors[] = {EIO, ENOSPC, EACCES, EMFILE};
    char *ops = scene();
    unsigned n = 0;
    (void)state;
    while (live_three_times(ops, n, errors[n % LUM_ARRAY_LEN(errors)]))
        n++;
    free(ops);
    print_message("%u calls failed in turn\n", n);
    assert_true(n > 150);
}

/* What is interrupted is done again. */
static void each_call_is_interrupted_once(void **state)
{
    char *ops = scene();
    unsigned n = 0;
    (void)state;
    while (live_three_times(ops, n, EINTR))
        n += 3;
    free(ops);
}

/* A start reads all again: where the disk does not give a file, it says which, and changes nothing. */
static void a_start_that_cannot_read_changes_nothing(void **state)
{
    char *ops = scene();
    struct keeper *k = malloc(sizeof *k);
    struct lum_error err;
    struct lum_recovery r;
    unsigned n = 0, n_refused = 0;
    (void)state;
    keeper_init(k);
    assert_true(keeper_open(k, ops, &err));
    assert_true(keeper_edit(k, "ann", "[" SET("l0", "/flux_lm", "5") "]") && keeper_settle(k));
    keeper_close(k);
    for (bool failed = true; failed; n++) {
        arm(n, EIO);
        enum lum_status st = keeper_recover(k, &r, &err);
        calls.armed = false;
        failed = calls.failed != NULL;
        n_refused += st == LUM_ERR_IO;
        if (st)
            assert_true(st == LUM_ERR_IO && strstr(err.text, "Input/output error"));
        else if (flux(r.doc, "l0") != 5 || r.n_lost || r.n_damages)
            fail_msg("call %u, %s: %s", n, calls.failed ? calls.failed : "none", k->log);
        if (!st)
            lum_recovery_finish(&r);
    }
    print_message("%u calls of a start failed in turn, %u were told\n", n - 1, n_refused);
    assert_true(n_refused > 10);
    keeper_finish(k);
    free(k);
    free(ops);
}

/* What was stored is looked for, as it may have been removed; that nobody can look is no reason to store it for ever.
 */
static void a_store_that_cannot_look_ends(void **state)
{
    char *ops = scene();
    struct keeper *k = malloc(sizeof *k);
    struct lum_error err;
    lum_sha sha;
    (void)state;
    keeper_init(k);
    assert_true(keeper_open(k, ops, &err));
    struct lum_record *big = lum_record_clone(lum_document_find(k->doc, "big"));
    calls.always = "fstatat";
    arm(UINT32_MAX, EIO);
    assert_int_equal(lum_journal_store(k->journal, &big, 1, sha, &err), LUM_ERR_IO);
    calls.armed = false;
    calls.always = NULL;
    assert_int_equal(lum_journal_store(k->journal, &big, 1, sha, &err), LUM_OK);
    lum_record_unref(big);
    keeper_finish(k);
    free(k);
    free(ops);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(each_call_fails_once),
        cmocka_unit_test(each_call_is_interrupted_once),
        cmocka_unit_test(a_start_that_cannot_read_changes_nothing),
        cmocka_unit_test(a_store_that_cannot_look_ends),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

/* Every call that changes the disk failed in turn: nothing acknowledged is lost, nothing refused stays, and what is
 * said is true. */
#define _GNU_SOURCE
#include <dirent.h>
#include <errno.h>
#include <fcntl.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cjson/cJSON.h>
#include <cmocka.h>

#include "tests/support/journal_keeper.h"
#include "tests/unit/document_util.h"

/* A disk that fails at its n-th call, of any kind or of one, once or from then on. */
struct faulty {
    enum { CREATE = 1, WRITE = 2, SYNC = 4, RENAME = 8, ANY = 15 } what;
    int error;                /* errno */
    _Atomic unsigned n_until; /* calls that work; UINT32_MAX: all */
    unsigned n_fail;          /* calls that fail then */
    bool half;                /* a write that fails writes half of its bytes before */
    unsigned n_short;         /* every write is cut to 1 .. n_short bytes; 0: none is */
    bool interrupted;         /* every other write is interrupted before it writes */
    struct {
        ino_t file;
        off_t n_bytes;
    } synced[256]; /* how much of each file a power cut leaves */
    unsigned n_synced;
    _Atomic unsigned n_calls; /* of `what` */
    unsigned n_writes;
};

static bool fails(struct faulty *f, unsigned what)
{
    if (!(f->what & what))
        return false;
    unsigned call = atomic_fetch_add(&f->n_calls, 1);
    unsigned n_until = f->n_until;
    if (call < n_until || call - n_until >= f->n_fail)
        return false;
    errno = f->error;
    return true;
}

static int faulty_create(void *user, int dir_fd, const char *name)
{
    return fails(user, CREATE) ? -1 : lum_disk_real.create(NULL, dir_fd, name);
}

static ssize_t faulty_write(void *user, int fd, const void *bytes, size_t n)
{
    struct faulty *f = user;
    f->n_writes++;
    if (f->interrupted && f->n_writes % 2) {
        errno = EINTR;
        return -1;
    }
    if (fails(f, WRITE)) {
        if (f->half)
            (void)!write(fd, bytes, n / 2);
        errno = f->error;
        return -1;
    }
    if (f->n_short && n > f->n_short)
        n = 1 + f->n_writes % f->n_short;
    return write(fd, bytes, n);
}

static int faulty_sync(void *user, int fd)
{
    struct faulty *f = user;
    struct stat st;
    if (fails(f, SYNC))
        return -1;
    unsigned i = 0;
    assert_int_equal(fstat(fd, &st), 0);
    while (i < f->n_synced && f->synced[i].file != st.st_ino)
        i++;
    assert_true(i < LUM_ARRAY_LEN(f->synced));
    f->n_synced += i == f->n_synced;
    f->synced[i].file = st.st_ino;
    f->synced[i].n_bytes = st.st_size;
    return 0;
}

/* Cuts every file to what was synced. */
static void cut_power(const struct faulty *f, const char *folder)
{
    char path[400];
    struct stat st;
    DIR *list = opendir(folder);
    for (struct dirent *e = readdir(list); e; e = readdir(list)) {
        snprintf(path, sizeof path, "%s/%s", folder, e->d_name);
        off_t n_bytes = 0;
        if (stat(path, &st) != 0 || !S_ISREG(st.st_mode))
            continue;
        for (unsigned i = 0; i < f->n_synced; i++)
            if (f->synced[i].file == st.st_ino)
                n_bytes = f->synced[i].n_bytes;
        assert_int_equal(truncate(path, n_bytes < st.st_size ? n_bytes : st.st_size), 0);
    }
    closedir(list);
}

static int faulty_rename(void *user, int dir_fd, const char *from, const char *to)
{
    return fails(user, RENAME) ? -1 : lum_disk_real.rename(NULL, dir_fd, from, to);
}

static struct lum_disk faulty_disk(struct faulty *f)
{
    return (struct lum_disk){faulty_create, faulty_write, faulty_sync, faulty_rename, f};
}

#define SCENE "[" LIGHT("l0") "," LIGHT("l1") "]"

/* What the folder gives to a new start: the text of the scene; the caller frees it. */
static char *found_again(struct keeper *k, uint64_t *ret_rev)
{
    struct lum_recovery r;
    struct lum_error err;
    if (keeper_recover(k, &r, &err))
        fail_msg("%s", err.text);
    assert_string_equal(k->log, "");
    char *text = document_text(r.doc);
    *ret_rev = lum_document_rev(r.doc);
    lum_recovery_finish(&r);
    return text;
}

static void set_flux(struct keeper *k, unsigned light, unsigned lm, bool *ret_accepted)
{
    char ops[96];
    snprintf(ops, sizeof ops, "[{'op':'set','id':'l%u','path':'/flux_lm','value':%u}]", light, lm);
    *ret_accepted = keeper_edit(k, "ann", ops);
}

/* Thirty edits one by one, snapshots in between, on a disk that fails as told. After each edit the folder holds what
 * was acknowledged, and a refused edit is not in the document. Returns how many were taken back. */
static uint64_t edit_on(struct faulty *f)
{
    struct keeper *k = malloc(sizeof *k);
    struct lum_disk disk = faulty_disk(f);
    struct lum_error err;
    unsigned last[2] = {800, 800};
    keeper_init(k);
    k->config.compact_bytes = 300;
    k->config.disk = &disk;
    bool opened = keeper_open(k, SCENE, &err);
    if (!opened)
        assert_int_equal(err.status, LUM_ERR_IO);
    for (unsigned i = 0; i < 30 && opened; i++) {
        bool accepted;
        set_flux(k, i % 2, i + 1, &accepted);
        if (accepted && keeper_settle(k))
            last[i % 2] = i + 1;
        assert_true(flux(k->doc, "l0") == last[0] && flux(k->doc, "l1") == last[1]);
        if (!accepted || k->n_taken_back)
            keeper_wait_writable(k);
    }
    if (opened) {
        char *text = document_text(k->doc), *found;
        uint64_t rev = lum_document_rev(k->doc), found_rev;
        assert_true(keeper_settle(k));
        keeper_close(k);
        found = found_again(k, &found_rev);
        assert_string_equal(found, text);
        assert_int_equal(found_rev, rev);
        free(text);
        free(found);
    }
    uint64_t n_taken_back = k->n_taken_back;
    keeper_finish(k);
    free(k);
    return n_taken_back;
}

/* One failure at each call in turn, until there are no more calls: once with nothing written, once with half. */
static void each_call_fails_once(void **state)
{
    (void)state;
    uint64_t n_taken_back = 0, n_runs = 0;
    for (unsigned n = 0;; n++) {
        struct faulty f = {.what = ANY, .error = n % 2 ? EIO : ENOSPC, .n_until = n, .n_fail = 1, .half = n % 3 == 0};
        n_taken_back += edit_on(&f);
        n_runs++;
        if (f.n_calls <= n)
            break;
    }
    print_message("%llu runs, %llu edits taken back\n", (unsigned long long)n_runs, (unsigned long long)n_taken_back);
    assert_true(n_runs > 40 && n_taken_back >= 12);
}

/* The power goes at each call in turn: nothing that comes later reaches the disk, nor does what was not synced. */
static void power_is_cut_at_each_call(void **state)
{
    (void)state;
    uint64_t n_found = 0;
    for (unsigned n = 0, done = 0; !done; n++) {
        struct keeper *k = malloc(sizeof *k);
        struct faulty f = {.what = ANY, .error = EIO, .n_until = n, .n_fail = UINT32_MAX};
        struct lum_disk disk = faulty_disk(&f);
        struct lum_error err;
        struct lum_recovery r;
        unsigned last[2] = {800, 800}, i = 0;
        bool accepted = true;
        keeper_init(k);
        k->config.compact_bytes = 300;
        k->config.disk = &disk;
        if (keeper_open(k, SCENE, &err)) {
            for (; i < 30 && accepted; i++) {
                set_flux(k, i % 2, i + 1, &accepted);
                accepted = accepted && keeper_settle(k);
                last[i % 2] = accepted ? i + 1 : last[i % 2];
            }
            keeper_close(k);
            cut_power(&f, k->dir);
            assert_int_equal(keeper_recover(k, &r, &err), LUM_OK);
            assert_true(flux(r.doc, "l0") == last[0] && flux(r.doc, "l1") == last[1]);
            assert_int_equal(r.n_lost, 0);
            lum_recovery_finish(&r);
            n_found++;
        }
        done = f.n_calls <= n;
        keeper_finish(k);
        free(k);
    }
    assert_true(n_found > 50);
}

static void short_and_interrupted_writes_are_gone_on_with(void **state)
{
    (void)state;
    for (unsigned n = 1; n < 40; n += 6) {
        struct faulty f = {.n_short = n, .interrupted = n % 4 == 1};
        assert_int_equal(edit_on(&f), 0);
    }
}

/* After a sync that failed the same file is never synced again and believed: the edit is lost, new files are begun. */
static void a_failed_sync_is_not_tried_again(void **state)
{
    (void)state;
    struct keeper *k = malloc(sizeof *k);
    struct faulty f = {.what = SYNC, .error = EIO, .n_until = UINT32_MAX, .n_fail = UINT32_MAX};
    struct lum_disk disk = faulty_disk(&f);
    struct lum_error err;
    struct lum_journal_status s;
    bool accepted;
    keeper_init(k);
    k->config.disk = &disk;
    assert_true(keeper_open(k, SCENE, &err));
    set_flux(k, 0, 5, &accepted);
    assert_true(accepted && keeper_settle(k));
    uint64_t rev = lum_document_rev(k->doc);
    f.n_until = f.n_calls;
    set_flux(k, 0, 6, &accepted);
    assert_true(accepted);
    assert_false(keeper_settle(k));
    assert_true(flux(k->doc, "l0") == 5);
    assert_true(keeper_said(k, "Input/output error: the scene is read-only until it can be saved again"));
    assert_int_equal(lum_document_rev(k->doc), rev + 2); /* others may have seen rev + 1 */
    struct lum_recovery r;
    assert_int_equal(keeper_recover(k, &r, &err), LUM_OK); /* its bytes were written: they are cut off again */
    assert_true(flux(r.doc, "l0") == 5 && r.n_cut == 0);
    lum_recovery_finish(&r);
    f.n_until = UINT32_MAX;
    keeper_forget_log(k);
    keeper_wait_writable(k);
    lum_journal_status(k->journal, &s);
    assert_int_equal(s.n_failures, 1);
    assert_int_equal(s.n_snapshots, 2); /* the state is in new files */
    assert_true(keeper_said(k, "the scene is saved again"));
    keeper_close(k);
    uint64_t found_rev;
    char *found = found_again(k, &found_rev);
    assert_non_null(strstr(found, "\"flux_lm\":5"));
    assert_null(strstr(found, "\"flux_lm\":6"));
    assert_int_equal(found_rev, rev + 2);
    free(found);
    keeper_finish(k);
    free(k);
}

/* A full disk refuses edits and nothing else; all that wait are taken back, newest first; a start on it is read-only.
 */
static void a_full_disk_is_read_only(void **state)
{
    (void)state;
    struct keeper *k = malloc(sizeof *k);
    struct faulty f = {.what = WRITE, .error = ENOSPC, .n_until = UINT32_MAX, .n_fail = UINT32_MAX};
    struct lum_disk disk = faulty_disk(&f);
    struct lum_error err;
    struct lum_journal_status s;
    bool accepted;
    keeper_init(k);
    k->config.disk = &disk;
    assert_true(keeper_open(k, SCENE, &err));
    for (unsigned i = 0; i < 6; i++) {
        set_flux(k, i % 2, 10 + i, &accepted);
        assert_true(accepted);
    }
    assert_true(keeper_settle(k));
    f.n_until = 0;
    unsigned n = 0;
    for (unsigned i = 0; i < 6; i++) {
        set_flux(k, i % 2, 20 + i, &accepted);
        n += accepted;
    }
    keeper_settle(k);
    assert_int_equal(k->n_taken_back, n);
    assert_true(flux(k->doc, "l0") == 14 && flux(k->doc, "l1") == 15);
    assert_int_equal(lum_journal_accepts(k->journal, &err), LUM_ERR_IO);
    assert_non_null(strstr(err.text, "No space left on device"));
    /* one who leaves is noted in the next state: nobody waits for a number that never comes */
    struct lum_entry *left = lum_entry_create(LUM_ENTRY_FORGET, "ann");
    uint64_t seq = lum_journal_submit(k->journal, left, lum_document_rev(k->doc));
    assert_true(seq <= lum_journal_acknowledged(k->journal));
    keeper_close(k);

    assert_true(keeper_open(k, SCENE, &err)); /* served all the same */
    assert_true(flux(k->doc, "l0") == 14 && flux(k->doc, "l1") == 15);
    lum_journal_status(k->journal, &s);
    assert_true(s.read_only);
    set_flux(k, 0, 1, &accepted);
    assert_false(accepted);
    f.n_until = UINT32_MAX; /* there is room */
    keeper_wait_writable(k);
    lum_journal_status(k->journal, &s);
    assert_int_equal(s.saved_rev, lum_document_rev(k->doc));
    set_flux(k, 0, 2, &accepted);
    assert_true(accepted && keeper_settle(k));
    keeper_close(k);
    uint64_t rev;
    char *found = found_again(k, &rev);
    assert_non_null(strstr(found, "\"flux_lm\":2"));
    free(found);
    keeper_finish(k);

    keeper_init(k); /* a first start has nothing to serve: it fails */
    f.n_until = 0;
    k->config.disk = &disk;
    assert_false(keeper_open(k, SCENE, &err));
    assert_non_null(strstr(err.text, "No space left on device"));
    keeper_finish(k);
    free(k);
}

/* The state is asked for, and before it is given an edit that is in it fails: that state is not kept, or the edit would
 * come back, and those after it be lost. */
static void a_state_from_before_a_failure_is_not_kept(void **state)
{
    (void)state;
    struct keeper *k = malloc(sizeof *k);
    struct faulty f = {.what = SYNC, .error = EIO, .n_until = UINT32_MAX, .n_fail = 1};
    struct lum_disk disk = faulty_disk(&f);
    struct lum_error err;
    struct lum_journal_status s;
    struct lum_document_state taken;
    bool accepted;
    keeper_init(k);
    k->config.disk = &disk;
    assert_true(keeper_open(k, SCENE, &err));
    set_flux(k, 0, 10, &accepted);
    assert_true(accepted && keeper_settle(k));
    f.n_until = f.n_calls;
    set_flux(k, 0, 99, &accepted);
    assert_true(accepted);
    do
        lum_journal_status(k->journal, &s);
    while (s.n_failures == 0);
    assert_true(lum_document_take_state(k->doc, &taken));
    lum_journal_give_state(k->journal, &taken);
    assert_false(keeper_settle(k));
    for (unsigned i = 0; i < 3; i++) {
        keeper_wait_writable(k);
        set_flux(k, 1, 50 + i, &accepted);
        assert_true(accepted && keeper_settle(k));
    }
    uint64_t rev;
    char *text = document_text(k->doc), *found;
    assert_true(flux(k->doc, "l0") == 10 && flux(k->doc, "l1") == 52);
    keeper_close(k);
    found = found_again(k, &rev);
    assert_string_equal(found, text);
    free(text);
    free(found);
    keeper_finish(k);
    free(k);
}

/* A snapshot that cannot be written costs nothing: edits go on, or are refused for a moment where it is not known which
 * file a start would find (the second and third rename are those of a journal's and a snapshot's name). */
static void a_snapshot_that_fails_costs_nothing(void **state)
{
    (void)state;
    for (unsigned n = 0; n < 3; n++) {
        struct keeper *k = malloc(sizeof *k);
        struct faulty f = {.what = n == 0 ? CREATE : RENAME, .error = ENOSPC, .n_until = UINT32_MAX, .n_fail = 1};
        struct lum_disk disk = faulty_disk(&f);
        struct lum_error err;
        bool accepted;
        keeper_init(k);
        k->config.disk = &disk;
        k->config.compact_bytes = 300;
        assert_true(keeper_open(k, SCENE, &err));
        f.n_until = f.n_calls + n / 2;
        for (unsigned i = 0; i < 30; i++) {
            do { /* what is refused or taken back is made again */
                keeper_wait_writable(k);
                set_flux(k, i % 2, i, &accepted);
            } while (!accepted || !keeper_settle(k));
        }
        assert_true(n == 1 ? k->n_taken_back <= 1 : k->n_taken_back == 0);
        keeper_wait_snapshots(k, 2); /* it was tried again */
        assert_true(keeper_said(k, n == 1 ? "the scene is read-only" : "no snapshot: "));
        char *text = document_text(k->doc), *found;
        uint64_t rev;
        keeper_close(k);
        found = found_again(k, &rev);
        assert_string_equal(found, text);
        assert_int_equal(rev, 31 + 2 * k->n_taken_back);
        free(text);
        free(found);
        keeper_finish(k);
        free(k);
    }
}

/* LUM_DURABILITY_INTERVAL: acknowledged at once; a failure takes nothing back, and the next snapshot has it all. */
static void interval_acknowledges_at_once(void **state)
{
    (void)state;
    struct keeper *k = malloc(sizeof *k);
    struct faulty f = {.what = WRITE | SYNC, .error = EIO, .n_until = UINT32_MAX, .n_fail = 1};
    struct lum_disk disk = faulty_disk(&f);
    struct lum_error err;
    struct lum_journal_status s;
    bool accepted;
    keeper_init(k);
    k->config.disk = &disk;
    k->config.durability = LUM_DURABILITY_INTERVAL;
    assert_true(keeper_open(k, SCENE, &err));
    for (unsigned i = 0; i < 40; i++) {
        set_flux(k, i % 2, i, &accepted);
        assert_true(accepted);
    }
    f.n_until = f.n_calls; /* soon, or in its second */
    do {
        set_flux(k, 0, 41, &accepted);
        lum_journal_status(k->journal, &s);
    } while (s.n_failures == 0);
    keeper_wait_writable(k);
    assert_int_equal(k->n_taken_back, 0);
    assert_true(flux(k->doc, "l0") == 41);
    keeper_close(k);
    uint64_t rev;
    char *found = found_again(k, &rev);
    assert_non_null(strstr(found, "\"flux_lm\":41"));
    free(found);
    keeper_finish(k);
    free(k);
}

/* The folder itself is new: its name outlives a power cut only once the folder above is synced. */
static void a_new_folder_is_synced_in_the_one_above(void **state)
{
    (void)state;
    struct keeper *k = malloc(sizeof *k);
    struct faulty f = {.n_until = UINT32_MAX};
    struct lum_disk disk = faulty_disk(&f);
    struct lum_error err;
    struct stat st;
    char dir[100];
    unsigned n_above = 0, n_runs = 0;
    keeper_init(k);
    snprintf(dir, sizeof dir, "%s/below/", k->dir);
    k->config.dir = dir;
    k->config.disk = &disk;
    for (; n_runs < 2; n_runs++) {
        assert_true(keeper_open(k, SCENE, &err));
        keeper_close(k);
        assert_int_equal(stat(k->dir, &st), 0);
        for (unsigned i = 0; i < f.n_synced; i++)
            n_above += f.synced[i].file == st.st_ino;
        assert_int_equal(n_above, 1);
        n_above = f.n_synced = 0;
        if (n_runs == 0) { /* where that fails there is no state */
            snprintf(dir, sizeof dir, "%s/other", k->dir);
            f = (struct faulty){.what = SYNC, .error = EIO, .n_fail = 1};
            assert_false(keeper_open(k, SCENE, &err));
            assert_non_null(strstr(err.text, "Input/output error"));
            f = (struct faulty){.n_until = UINT32_MAX};
        }
    }
    keeper_finish(k);
    free(k);
}

static void put(struct lum_block_writer *w, uint64_t seq, const char *text)
{
    struct lum_error err;
    cJSON *json = cJSON_Parse(text);
    assert_non_null(json);
    assert_int_equal(lum_block_put(w, seq, 1, json, NULL, &err), LUM_OK);
}

/* Records have numbers, and there may be any number of them: histories hold on to what is gone. */
static void a_snapshot_of_many_million_records_is_read(void **state)
{
    (void)state;
    struct keeper *k = malloc(sizeof *k);
    struct lum_dir dir, content;
    struct lum_block_writer w;
    struct lum_recovery r;
    struct lum_error err;
    keeper_init(k);
    assert_int_equal(lum_dir_open(AT_FDCWD, k->dir, false, &lum_disk_real, &dir, &err), LUM_OK);
    assert_int_equal(lum_dir_open(dir.fd, "content", true, &lum_disk_real, &content, &err), LUM_OK);
    assert_int_equal(lum_block_create(&w, &dir, "snapshot-0", LUM_FILE_SNAPSHOT, 0, 0, &err), LUM_OK);
    put(&w, 1, "{\"snapshot\":{\"records\":50000000,\"starts\":1}}");
    put(&w, 2, "{\"index\":49999998,\"stands\":true,\"op\":{\"op\":\"add\",\"type\":\"material\",\"id\":\"a\"}}");
    put(&w, 3, "{\"index\":49999999,\"stands\":false,\"op\":{\"op\":\"add\",\"type\":\"material\",\"id\":\"b\"}}");
    put(&w, 4, "{\"user\":\"ann\"}");
    put(&w, 5, "{\"step\":{\"changes\":[49999999,-1],\"user\":\"ann\",\"redo\":false,\"undo_group\":\"\",\"rev\":1}}");
    put(&w, 6, "{\"end\":true}");
    assert_int_equal(lum_block_sync(&w, &err), LUM_OK);
    lum_block_close(&w);
    if (keeper_recover(k, &r, &err))
        fail_msg("%s", err.text);
    assert_string_equal(k->log, "");
    assert_non_null(lum_document_find(r.doc, "a"));
    assert_true(undo(r.doc, "ann", NULL));
    assert_non_null(lum_document_find(r.doc, "b"));
    lum_recovery_finish(&r);
    lum_dir_close(&content);
    lum_dir_close(&dir);
    keeper_finish(k);
    free(k);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(each_call_fails_once),
        cmocka_unit_test(power_is_cut_at_each_call),
        cmocka_unit_test(short_and_interrupted_writes_are_gone_on_with),
        cmocka_unit_test(a_failed_sync_is_not_tried_again),
        cmocka_unit_test(a_full_disk_is_read_only),
        cmocka_unit_test(a_state_from_before_a_failure_is_not_kept),
        cmocka_unit_test(a_snapshot_that_fails_costs_nothing),
        cmocka_unit_test(interval_acknowledges_at_once),
        cmocka_unit_test(a_new_folder_is_synced_in_the_one_above),
        cmocka_unit_test(a_snapshot_of_many_million_records_is_read),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

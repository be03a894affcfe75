/* A start for which memory is short fails; it takes no edit for lost. And a snapshot that memory is short for is not
 * written. Each allocation fails in turn, until there are no more. */
#define _GNU_SOURCE
#include <fcntl.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cjson/cJSON.h>
#include <cmocka.h>

#include "tests/support/journal_keeper.h"
#include "tests/unit/document_util.h"
#include "tests/unit/failing_alloc.h"

/* Two snapshots, entries of every kind, an undo that found a conflict, bulk data that is content. */
static void fill(struct keeper *k)
{
    struct lum_error err;
    char *mesh = malloc(200000), *at = mesh;
    at += sprintf(at, "[{'op':'add','type':'mesh','id':'big','positions':[0,0,0,1,0,0,0,1,0");
    for (int i = 0; i < 9000; i++)
        at += sprintf(at, ",%d.5", i % 7);
    at += sprintf(at, "],'indices':[0,1,2]}]");
    assert_true(keeper_open(k, "[" LIGHT("l") "," MESH("m") "," MATERIAL("w") "]", &err));
    assert_true(keeper_edit(k, "ann", mesh) && keeper_settle(k));
    keeper_close(k);
    assert_true(keeper_open(k, "", &err));
    assert_true(keeper_edit(k, "ann", "[" OBJECT("o", "m", "w") "]"));
    assert_true(keeper_edit(k, "ann", "[" SET("l", "/flux_lm", "5") "]"));
    assert_true(keeper_walk(k, "ann", false) && keeper_walk(k, "ann", true));
    assert_true(keeper_edit(k, "bob", "[" SET("l", "/flux_lm", "6") "]"));
    assert_false(keeper_walk(k, "ann", false));
    assert_true(keeper_settle(k));
    keeper_close(k);
    free(mesh);
}

static void a_start_without_memory_loses_nothing(void **state)
{
    struct keeper k;
    struct lum_recovery r;
    struct lum_error err;
    unsigned n = 1;
    (void)state;
    keeper_init(&k);
    fill(&k);
    assert_int_equal(keeper_recover(&k, &r, &err), LUM_OK);
    assert_int_equal(r.n_damages, 0);
    char *text = document_text(r.doc);
    lum_recovery_finish(&r);
    for (bool failed = true; failed; n++) {
        failing_alloc_arm(n);
        enum lum_status st = keeper_recover(&k, &r, &err);
        failed = failing_alloc_disarm();
        if (st) {
            assert_int_equal(st, LUM_ERR_NOMEM);
            assert_true(failed);
            continue;
        }
        char *found = document_text(r.doc); /* it could do without, as for a list of what is known to be on disk */
        assert_string_equal(found, text);
        assert_int_equal(r.n_lost, 0);
        free(found);
        lum_recovery_finish(&r);
    }
    assert_true(n > 200);
    free(text);
    keeper_finish(&k);
}

static void a_snapshot_without_memory_is_not_written(void **state)
{
    struct keeper k;
    struct lum_recovery r;
    struct lum_error err;
    struct lum_dir dir, content;
    struct lum_kept_list none = {0};
    unsigned n = 1;
    (void)state;
    keeper_init(&k);
    fill(&k);
    assert_int_equal(keeper_recover(&k, &r, &err), LUM_OK);
    assert_int_equal(lum_dir_open(AT_FDCWD, k.dir, false, &lum_disk_real, &dir, &err), LUM_OK);
    assert_int_equal(lum_dir_open(dir.fd, "content", false, &lum_disk_real, &content, &err), LUM_OK);
    for (bool failed = true; failed; n++) {
        const struct lum_snapshot_config config = {&dir, &content, "snapshot.part", 1, 1, &none, NULL};
        struct lum_snapshot_writer *w = NULL;
        struct lum_document_state s;
        bool done = false;
        failing_alloc_arm(n);
        enum lum_status st = lum_document_take_state(r.doc, &s) ? LUM_OK : LUM_ERR_NOMEM;
        if (!st)
            st = lum_snapshot_begin(&config, &s, &w, &err);
        while (!st && !done)
            st = lum_snapshot_step(w, &done, &err);
        failed = failing_alloc_disarm();
        assert_true(!st || (failed && st == LUM_ERR_NOMEM));
        lum_snapshot_end(w);
    }
    assert_true(n > 200);
    lum_dir_close(&content);
    lum_dir_close(&dir);
    lum_recovery_finish(&r);
    keeper_finish(&k);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_start_without_memory_loses_nothing),
        cmocka_unit_test(a_snapshot_without_memory_is_not_written),
    };
    failing_alloc_begin();
    return cmocka_run_group_tests(tests, NULL, NULL);
}

#define _GNU_SOURCE /* memmem */
/* What a daemon finds again: all edits, revisions and histories, after any end. */
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

#include "server/journal/entry.h"
#include "tests/unit/journal_scene.h"

static void edits_are_found_again(void **state)
{
    struct keeper *k = *state;
    open_new(k);
    for (unsigned i = 0; i < 50; i++)
        set_flux(k, "ann", i % N_LIGHTS, 100 + i);
    assert_true(keeper_edit(k, "bob", "[" MESH("m") "," MATERIAL("w") "," OBJECT("o", "m", "w") "]"));
    assert_true(keeper_edit(k, "bob",
                            "[{'op':'add','type':'mesh','id':'tri','positions':[0,0,0,1,0,0,0.1,1,0.3],"
                            "'indices':[0,1,2]}]"));
    assert_true(keeper_settle(k));
    assert_int_equal(k->n_acknowledged, 52);
    char *text = document_text(k->doc);
    assert_found(k, text, 53); /* as after a kill: nothing was closed */
    keeper_close(k);
    for (int i = 0; i < 3; i++) { /* and after starts without an edit */
        assert_found(k, text, 53);
        open_new(k);
        keeper_close(k);
    }
    free(text);
}

static void folders_and_files_are_private(void **state)
{
    struct keeper *k = *state;
    char path[96];
    size_t n;
    struct stat st;
    open_new(k);
    free(keeper_read(k, "journal", path, &n));
    assert_true(stat(path, &st) == 0 && (st.st_mode & 0777) == 0600);
    free(keeper_read(k, "snapshot", path, &n));
    assert_true(stat(path, &st) == 0 && (st.st_mode & 0777) == 0600);
    snprintf(path, sizeof path, "%s/content", k->dir);
    assert_true(stat(path, &st) == 0 && (st.st_mode & 0777) == 0700);
    /* a link in place of a file is not followed */
    keeper_close(k);
    free(keeper_read(k, "snapshot", path, &n));
    char target[128];
    snprintf(target, sizeof target, "%s.elsewhere", path);
    assert_true(rename(path, target) == 0 && symlink(target, path) == 0);
    struct lum_recovery r;
    struct lum_error err;
    assert_int_equal(keeper_recover(k, &r, &err), LUM_ERR_INVALID);
}

static void one_writer(void **state)
{
    struct keeper *k = *state;
    struct lum_journal *second;
    struct lum_document *doc;
    struct lum_error err;
    open_new(k);
    assert_int_equal(lum_journal_open(&k->config, &second, &doc, &err), LUM_ERR_CONFLICT);
    assert_non_null(strstr(err.text, "another lumend writes the state in /tmp/"));
    keeper_close(k);
    open_new(k);
}

/* Moments, their names, who and when: after a kill, and after starts, from entries and from snapshots. */
static void moments_are_found_again(void **state)
{
    struct keeper *k = *state;
    for (int compact = 0; compact < 2; compact++) {
        k->config.compact_bytes = compact ? 1 : 1 << 20;
        open_new(k);
        uint64_t first = lum_document_rev(k->doc);
        for (unsigned i = 0; i < 20; i++)
            set_flux(k, i % 2 ? "ann" : "bob", i % N_LIGHTS, 100 + i);
        assert_true(keeper_name(k, "ann", first + 3, "before lunch"));
        assert_true(keeper_revert(k, "cat", first + 3));
        set_flux(k, "cat", 7, 1);
        assert_true(keeper_name(k, "bob", lum_document_rev(k->doc), "other way"));
        assert_true(keeper_settle(k));
        for (int i = 0; i < 3; i++) {
            struct lum_recovery r;
            struct lum_error err;
            struct lum_proto_error e = {0};
            struct lum_changes changes;
            assert_int_equal(keeper_recover(k, &r, &err), LUM_OK);
            assert_string_equal(k->log, "");
            size_t n = lum_document_n_moments(r.doc);
            assert_int_equal(n, lum_document_n_moments(k->doc));
            for (size_t m = 0; m < n; m++) {
                const struct lum_moment *a = lum_document_moment(k->doc, m), *b = lum_document_moment(r.doc, m);
                assert_true(a->rev == b->rev && a->at_ms == b->at_ms && a->did == b->did && a->to == b->to);
                assert_true(a->n_edits == b->n_edits && a->changes.n == b->changes.n);
                assert_string_equal(a->user, b->user);
                assert_string_equal(a->name, b->name);
                assert_string_equal(a->named_by, b->named_by);
            }
            assert_true(lum_document_revert(r.doc, "dan", first + 1, &changes, &e));
            assert_true(flux(r.doc, "l0") == 100.0 && flux(r.doc, "l1") == 800.0);
            lum_changes_finish(&changes);
            lum_recovery_finish(&r);
            keeper_close(k);
            open_new(k);
        }
        keeper_finish(k);
        keeper_init(k);
    }
}

/* Random edits, undos and redos by three users, with snapshots in between: a document that went through the folder does
 * what its twin does that did not. */
static void histories_are_found_again(void **state)
{
    struct keeper *k = *state;
    static const char *const users[] = {"ann", "bob", "cat"};
    for (uint64_t seed = 1; seed <= 12; seed++) {
        struct rng rng = {seed};
        k->config.compact_bytes = seed % 3 ? 2000 : 1;
        open_new(k);
        for (int i = 0; i < 60; i++) {
            const char *user = users[rng_below(&rng, 3)];
            uint32_t what = rng_below(&rng, 8);
            if (what < 2)
                keeper_walk(k, user, false);
            else if (what == 2)
                keeper_walk(k, user, true);
            else if (what == 7 && rng_below(&rng, 2))
                keeper_revert(k, user, rng_below(&rng, (uint32_t)lum_document_rev(k->doc)));
            else if (what == 3)
                keeper_edit(k, user, rng_below(&rng, 2) ? "[" MESH("m") "]" : "[" REMOVE("m") "]");
            else
                set_flux(k, user, rng_below(&rng, 3), rng_below(&rng, 1000));
            if (rng_below(&rng, 4) == 0)
                assert_true(keeper_settle(k));
        }
        assert_true(keeper_settle(k));
        keeper_stop(k);
        struct lum_recovery r;
        struct lum_error err;
        assert_int_equal(keeper_recover(k, &r, &err), LUM_OK);
        assert_string_equal(k->log, "");
        assert_int_equal(lum_document_rev(r.doc), lum_document_rev(k->doc));
        for (int i = 0; i < 200; i++) {
            const char *user = users[i % 3];
            bool again = rng_below(&rng, 5) == 0;
            assert_int_equal(lum_document_next_undo(k->doc, user, again), lum_document_next_undo(r.doc, user, again));
            assert_int_equal(again ? redo(k->doc, user, NULL) : undo(k->doc, user, NULL),
                             again ? redo(r.doc, user, NULL) : undo(r.doc, user, NULL));
            char *a = document_text(k->doc), *b = document_text(r.doc);
            assert_string_equal(a, b);
            free(a);
            free(b);
        }
        lum_recovery_finish(&r);
        keeper_finish(k);
        keeper_init(k);
    }
}

/* Limits of one transaction are for who asks for it: what was accepted once is done again, whatever they are by now. */
static void larger_edits_than_are_accepted_are_found_again(void **state)
{
    struct keeper *k = *state;
    const unsigned n = LUM_LIMIT_OPS_PER_MESSAGE + 1;
    struct lum_recovery r;
    struct lum_error err;
    open_new(k);
    struct lum_entry *e = lum_entry_create(LUM_ENTRY_APPLY, "ann");
    assert_non_null(e);
    e->ops = cJSON_CreateArray();
    for (unsigned i = 1; i <= n; i++) {
        char op[80];
        snprintf(op, sizeof op, "{\"op\":\"set\",\"id\":\"l0\",\"path\":\"/flux_lm\",\"value\":%u}", i);
        cJSON_AddItemToArray(e->ops, cJSON_Parse(op));
    }
    lum_journal_submit(k->journal, e, lum_document_rev(k->doc) + 1);
    keeper_stop(k);
    assert_int_equal(keeper_recover(k, &r, &err), LUM_OK);
    assert_string_equal(k->log, "");
    assert_true(lum_document_find(r.doc, "l0")->light.flux_lm.value == n);
    lum_recovery_finish(&r);
    keeper_close(k);
}

static void snapshots_take_the_place_of_edits(void **state)
{
    struct keeper *k = *state;
    k->config.compact_bytes = 4000;
    open_new(k);
    for (unsigned i = 0; i < 400; i++) {
        set_flux(k, "ann", i % N_LIGHTS, i);
        if (i % 16 == 0)
            assert_true(keeper_settle(k));
    }
    assert_true(keeper_settle(k));
    keeper_wait_snapshots(k, 3);
    assert_in_range(keeper_count(k, "", "snapshot-"), 1, 2);
    assert_in_range(keeper_count(k, "", "journal-"), 1, 3);
    char *text = document_text(k->doc);
    keeper_close(k);
    assert_found(k, text, 401);
    free(text);
}

/* What importers made, and nothing refers to any more, is on disk and in memory until two snapshots have passed: they
 * are due when there is much of it, too, however short its edits are. Of three times eight records the first eight are
 * gone, and the memory of the second. */
static void content_that_is_not_used_goes(void **state)
{
    struct keeper *k = *state;
    k->config.compact_content_bytes = 1000;
    open_new(k);
    enum { ROUNDS = 3, EACH = 8 };
    struct lum_record *made[ROUNDS][EACH];
    for (unsigned round = 0; round < ROUNDS; round++) {
        for (unsigned i = 0; i < EACH; i++) {
            char id[16];
            lum_sha sha;
            struct lum_error err;
            snprintf(id, sizeof id, "m%u-%u", round, i);
            made[round][i] = lum_record_create(LUM_RECORD_MATERIAL, id);
            assert_int_equal(lum_journal_store(k->journal, &made[round][i], 1, sha, &err), LUM_OK);
        }
        keeper_wait_snapshots(k, 2 + round);
    }
    assert_int_equal(keeper_count(k, "/content", ""), 2 * EACH);
    for (unsigned i = 0; i < EACH; i++)
        assert_int_equal(atomic_load(&made[0][i]->refs) + atomic_load(&made[1][i]->refs), 2);
    for (unsigned i = 0; i < ROUNDS * EACH; i++)
        lum_record_unref(made[i / EACH][i % EACH]);
}

/* A file of content that was damaged since is whole once the same is made again. */
static void content_that_is_made_again_is_mended(void **state)
{
    struct keeper *k = *state;
    open_new(k);
    struct lum_record *made = lum_record_create(LUM_RECORD_MATERIAL, "m");
    struct lum_error err;
    lum_sha sha;
    char path[128];
    assert_int_equal(lum_journal_store(k->journal, &made, 1, sha, &err), LUM_OK);
    snprintf(path, sizeof path, "%s/content/%s", k->dir, sha);
    keeper_write(path, (const uint8_t *)"damaged", 7);
    assert_int_equal(lum_journal_store(k->journal, &made, 1, sha, &err), LUM_OK);
    struct lum_dir dir, content;
    assert_int_equal(lum_dir_open(AT_FDCWD, k->dir, false, &lum_disk_real, &dir, &err), LUM_OK);
    assert_int_equal(lum_dir_open(dir.fd, "content", false, &lum_disk_real, &content, &err), LUM_OK);
    assert_int_equal(lum_content_check(&content, sha, &err), LUM_OK);
    lum_dir_close(&content);
    lum_dir_close(&dir);
    lum_record_unref(made);
}

/* From the journal alone, and from a snapshot; with what a field was before an edit, and what was removed. */
static void daylight_and_sensors_are_found_again(void **state)
{
    struct keeper *k = *state;
    static const char *const edits[] = {
        "[{'op':'add','type':'light','id':'sun','kind':'sun','latitude_deg':48.2,'longitude_deg':16.4,"
        "'date':'2026-06-21','time_h':15,'utc_offset_h':2,'north_deg':30},"
        "{'op':'add','type':'light','id':'sky','kind':'sky','cie_type':12,'ground_albedo':0.3}]",
        "[{'op':'add','type':'sensor','id':'desks','kind':'grid','position':[0,0.75,0],'u':[4,0,0],'v':[0,0,3],"
        "'spacing_m':0.5,'target_lx':500,'target_uo':0.6,'name':'work plane'},"
        "{'op':'add','type':'sensor','id':'eye','kind':'observer','position':[0,1.2,1],'direction':[0,0,-1],"
        "'target_ugr':19}]",
        "[{'op':'set','id':'sun','path':'/time_h','value':18.5},"
        "{'op':'set','id':'sky','path':'/illuminance_lx','value':9000}]",
        "[{'op':'set','id':'desks','path':'/quantity','value':'cylindrical'},{'op':'remove','id':'eye'}]",
    };
    k->config.compact_bytes = 1u << 20;
    open_new(k);
    for (size_t i = 0; i < sizeof edits / sizeof *edits; i++)
        if (!keeper_edit(k, "ann", edits[i]))
            fail_msg("refused: %s", edits[i]);
    assert_true(keeper_walk(k, "ann", false)); /* the observer is back */
    assert_true(keeper_settle(k));
    char *text = document_text(k->doc);
    assert_non_null(strstr(text, "\"eye\""));
    assert_found(k, text, lum_document_rev(k->doc));
    keeper_close(k);
    k->config.compact_bytes = 1; /* from now on all is a snapshot */
    open_new(k);
    set_flux(k, "ann", 0, 1);
    assert_true(keeper_settle(k));
    keeper_wait_snapshots(k, 1);
    assert_true(keeper_walk(k, "ann", false)); /* the flux */
    assert_true(keeper_walk(k, "ann", false)); /* hour and amount, after the removal was undone */
    assert_true(keeper_settle(k));
    char *before = document_text(k->doc);
    uint64_t rev = lum_document_rev(k->doc);
    keeper_close(k);
    assert_found(k, before, rev);
    assert_non_null(strstr(before, "\"time_h\":15"));
    free(before);
    free(text);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup_teardown(edits_are_found_again, setup, teardown),
        cmocka_unit_test_setup_teardown(folders_and_files_are_private, setup, teardown),
        cmocka_unit_test_setup_teardown(one_writer, setup, teardown),
        cmocka_unit_test_setup_teardown(moments_are_found_again, setup, teardown),
        cmocka_unit_test_setup_teardown(histories_are_found_again, setup, teardown),
        cmocka_unit_test_setup_teardown(larger_edits_than_are_accepted_are_found_again, setup, teardown),
        cmocka_unit_test_setup_teardown(snapshots_take_the_place_of_edits, setup, teardown),
        cmocka_unit_test_setup_teardown(content_that_is_not_used_goes, setup, teardown),
        cmocka_unit_test_setup_teardown(content_that_is_made_again_is_mended, setup, teardown),
        cmocka_unit_test_setup_teardown(daylight_and_sensors_are_found_again, setup, teardown),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

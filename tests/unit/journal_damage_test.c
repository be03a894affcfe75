#define _GNU_SOURCE /* memmem */
/* What each damage of a journal and its snapshots costs. */
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

/* Edit i of light i; the journal's bytes, and where each edit's block begins (one more: the end). */
static uint8_t *make_journal(struct keeper *k, char path[96], size_t *n, size_t at[N_LIGHTS + 1])
{
    open_new(k);
    for (unsigned i = 0; i < N_LIGHTS; i++) {
        set_flux(k, "ann", i, 1 + i);
        assert_true(keeper_settle(k));
    }
    keeper_close(k);
    uint8_t *bytes = keeper_read(k, "journal", path, n);
    size_t found = 0;
    for (size_t i = 0; i + 4 <= *n; i += 8)
        if (memcmp(bytes + i, "LUMR", 4) == 0)
            at[found++] = i;
    assert_int_equal(found, N_LIGHTS);
    at[N_LIGHTS] = *n;
    return bytes;
}

static bool edited(const struct lum_document *doc, unsigned i)
{
    char id[8];
    snprintf(id, sizeof id, "l%u", i);
    return lum_document_find(doc, id)->light.flux_lm.value == 1 + i;
}

static void a_torn_tail_is_cut(void **state)
{
    struct keeper *k = *state;
    char path[96];
    size_t n, at[N_LIGHTS + 1];
    uint8_t *bytes = make_journal(k, path, &n, at);
    for (size_t cut = at[N_LIGHTS - 2]; cut <= n; cut++) {
        struct lum_recovery r;
        struct lum_error err;
        keeper_write(path, bytes, cut);
        assert_int_equal(keeper_recover(k, &r, &err), LUM_OK);
        unsigned whole = 0;
        while (whole < N_LIGHTS && at[whole + 1] <= cut)
            whole++;
        assert_int_equal(r.n_done, whole);
        assert_int_equal(r.n_cut, cut - at[whole]);
        assert_int_equal(r.n_lost, 0);
        for (unsigned i = 0; i < N_LIGHTS; i++)
            assert_int_equal(edited(r.doc, i), i < whole);
        lum_recovery_finish(&r);
    }
    /* a start tells it, and goes on from there */
    keeper_write(path, bytes, n - 5);
    k->log[0] = '\0';
    open_new(k);
    assert_non_null(strstr(k->log, "of an edit that was never acknowledged are cut off"));
    set_flux(k, "ann", 0, 77);
    assert_true(keeper_settle(k));
    char *text = document_text(k->doc);
    keeper_close(k);
    assert_found(k, text, N_LIGHTS + 1);
    free(text);
    free(bytes);
}

/* A bit at any place costs at most the one edit whose block has it, which is named by number and place. */
static void a_flipped_bit_costs_one_edit(void **state)
{
    struct keeper *k = *state;
    char path[96], line[120];
    size_t n, at[N_LIGHTS + 1];
    unsigned n_harmless = 0;
    uint8_t *bytes = make_journal(k, path, &n, at);
    for (size_t i = 0; i < n; i++) {
        struct lum_recovery r;
        struct lum_error err;
        bytes[i] ^= (uint8_t)(1u << (i % 8));
        keeper_write(path, bytes, n);
        bytes[i] ^= (uint8_t)(1u << (i % 8));
        assert_int_equal(keeper_recover(k, &r, &err), LUM_OK);
        unsigned hit = 0;
        while (hit < N_LIGHTS && at[hit + 1] <= i)
            hit++;
        bool hits = i >= at[0] && r.n_damages + r.n_cut > 0; /* zeros behind a body are no part of it */
        n_harmless += !hits;
        for (unsigned e = 0; e < N_LIGHTS; e++)
            assert_int_equal(edited(r.doc, e), !hits || e != hit);
        snprintf(line, sizeof line, "edit %u at offset %zu is damaged", hit + 1, at[hit]);
        if (r.n_damages > 0 && !strstr(k->log, line))
            fail_msg("byte %zu: not named as %s but: %s", i, line, k->log);
        if (hits)
            assert_int_equal(r.n_lost, 1);
        lum_recovery_finish(&r);
    }
    assert_in_range(n_harmless, at[0], at[0] + 7 * N_LIGHTS);
    free(bytes);
}

/* What needs a lost edit is named too, and an undo never takes back another step than its own. */
static void what_needs_a_lost_edit_is_named(void **state)
{
    struct keeper *k = *state;
    char path[96];
    size_t n;
    open_new(k);
    set_flux(k, "ann", 0, 11);
    set_flux(k, "ann", 1, 12); /* lost */
    assert_true(keeper_walk(k, "ann", false));
    assert_true(keeper_edit(k, "ann", "[" LIGHT("extra") "]")); /* lost */
    assert_true(keeper_edit(k, "bob", "[" SET("extra", "/flux_lm", "5") "]"));
    set_flux(k, "ann", 2, 13);
    assert_true(keeper_settle(k));
    keeper_close(k);
    uint8_t *bytes = keeper_read(k, "journal", path, &n);
    char *second = memmem(bytes, n, "\"value\":12", 10), *fourth = memmem(bytes, n, "\"id\":\"extra\",\"kind\"", 19);
    assert_true(second && fourth);
    second[9] = '9';
    fourth[0] ^= 4;
    keeper_write(path, bytes, n);
    free(bytes);
    struct lum_recovery r;
    struct lum_error err;
    assert_int_equal(keeper_recover(k, &r, &err), LUM_OK);
    assert_int_equal(r.n_lost, 4);
    assert_non_null(strstr(k->log, "edit 2 at offset"));
    assert_non_null(strstr(k->log, "(revision 4) cannot be done: the step that it takes back is lost"));
    assert_non_null(strstr(k->log, "edit 4 at offset"));
    assert_non_null(strstr(k->log, "cannot be done: there is no \"extra\""));
    assert_true(flux(r.doc, "l0") == 11 && flux(r.doc, "l1") == 800 && flux(r.doc, "l2") == 13);
    assert_int_equal(lum_document_rev(r.doc), 7);
    lum_recovery_finish(&r);
    /* a start keeps the damaged file, and its own state is whole */
    open_new(k);
    assert_int_equal(lum_document_rev(k->doc), 7);
    assert_int_equal(keeper_count(k, "", "journal-0.damaged"), 1);
    set_flux(k, "ann", 3, 14);
    assert_true(keeper_settle(k));
    char *text = document_text(k->doc);
    keeper_close(k);
    assert_found(k, text, 8);
    free(text);
}

/* The older snapshot and the edits since stand in for a damaged one, wherever it is damaged. */
static void a_damaged_snapshot_costs_nothing(void **state)
{
    struct keeper *k = *state;
    char path[96];
    size_t n;
    open_new(k);
    set_flux(k, "ann", 0, 11);
    assert_true(keeper_settle(k));
    keeper_close(k);
    open_new(k); /* the second snapshot */
    set_flux(k, "ann", 1, 12);
    assert_true(keeper_settle(k));
    char *text = document_text(k->doc);
    keeper_close(k);
    uint8_t *bytes = keeper_read(k, "snapshot", path, &n);
    for (size_t i = 0; i < n; i += 3) {
        struct lum_recovery r;
        struct lum_error err;
        bytes[i] ^= 16;
        keeper_write(path, bytes, n);
        bytes[i] ^= 16;
        assert_int_equal(keeper_recover(k, &r, &err), LUM_OK);
        char *found = document_text(r.doc);
        assert_string_equal(found, text);
        assert_int_equal(r.n_lost, 0);
        assert_int_equal(lum_document_next_undo(r.doc, "ann", false), 3);
        free(found);
        lum_recovery_finish(&r);
    }
    free(bytes);
    free(text);
}

/* Where there is only one, what can be read of it is kept. */
static void the_only_snapshot_loses_what_is_damaged(void **state)
{
    struct keeper *k = *state;
    char path[96];
    size_t n;
    open_new(k);
    keeper_close(k);
    uint8_t *bytes = keeper_read(k, "snapshot", path, &n);
    char *lamp = memmem(bytes, n, "\"id\":\"l3\"", 9);
    assert_non_null(lamp);
    lamp[6] = 'x';
    keeper_write(path, bytes, n);
    struct lum_recovery r;
    struct lum_error err;
    assert_int_equal(keeper_recover(k, &r, &err), LUM_OK);
    assert_null(lum_document_find(r.doc, "l3"));
    for (unsigned i = 0; i < N_LIGHTS; i++) {
        char id[8];
        snprintf(id, sizeof id, "l%u", i);
        assert_int_equal(lum_document_find(r.doc, id) != NULL, i != 3);
    }
    assert_non_null(strstr(k->log, "is lost: its bytes are not what was written"));
    lum_recovery_finish(&r);
    open_new(k); /* keeps it, and takes its number not again */
    assert_int_equal(keeper_count(k, "", "snapshot-0.damaged"), 1);
    keeper_close(k);
    assert_int_equal(keeper_recover(k, &r, &err), LUM_OK);
    assert_string_equal(k->log, "");
    lum_recovery_finish(&r);
    free(bytes);
}

static void another_version_is_refused(void **state)
{
    struct keeper *k = *state;
    char path[96];
    size_t n;
    struct lum_error err;
    static const uint8_t head[40] = {'L', 'U', 'M', 'S', 'T', 'A', 'T', 'E', 4, 0, 0, 0, 1};
    static const uint8_t crc[4] = {0xc2, 0xc8, 0x28, 0x35}; /* of these 36 bytes, by Python's zlib.crc32 */
    open_new(k);
    keeper_close(k);
    uint8_t *bytes = keeper_read(k, "journal", path, &n);
    memcpy(bytes, head, sizeof head);
    memcpy(bytes + 36, crc, sizeof crc);
    keeper_write(path, bytes, n);
    free(bytes);
    assert_false(keeper_open(k, SCENE, &err));
    assert_non_null(
        strstr(err.text, "journal-0 has format 4, and this lumend reads formats 1 to 3: start the lumend that wrote"));
}

static void a_folder_without_a_snapshot_is_not_begun_anew(void **state)
{
    struct keeper *k = *state;
    char path[96];
    size_t n;
    struct lum_error err;
    open_new(k);
    keeper_close(k);
    free(keeper_read(k, "snapshot", path, &n));
    keeper_write(path, (const uint8_t *)"nonsense", 8);
    assert_false(keeper_open(k, SCENE, &err));
    assert_non_null(strstr(err.text, "no snapshot of the state can be read"));
}

/* Whatever the files hold, recovery ends and its document is whole. */
static void hostile_files_do_no_harm(void **state)
{
    struct keeper *k = *state;
    char paths[2][96];
    size_t n[2];
    open_new(k);
    assert_true(keeper_edit(k, "ann", "[" MESH("m") "," MATERIAL("w") "," OBJECT("o", "m", "w") "]"));
    set_flux(k, "ann", 0, 11);
    assert_true(keeper_settle(k));
    keeper_close(k);
    open_new(k);
    assert_true(keeper_walk(k, "ann", false));
    assert_true(keeper_settle(k));
    keeper_close(k);
    uint8_t *bytes[2] = {keeper_read(k, "snapshot", paths[0], &n[0]), keeper_read(k, "journal", paths[1], &n[1])};
    for (uint64_t seed = 1; seed <= 300; seed++) {
        struct rng rng = {seed};
        for (int file = 0; file < 2; file++) {
            uint8_t *copy = malloc(n[file]);
            memcpy(copy, bytes[file], n[file]);
            for (uint32_t hits = rng_below(&rng, 12); hits; hits--)
                copy[rng_below(&rng, (uint32_t)n[file])] = (uint8_t)rng_below(&rng, 256);
            keeper_write(paths[file], copy, n[file] - (rng_below(&rng, 4) ? 0 : rng_below(&rng, (uint32_t)n[file])));
            free(copy);
        }
        struct lum_recovery r;
        struct lum_error err;
        if (keeper_recover(k, &r, &err))
            continue;
        assert_true(document_whole(r.doc));
        while (undo(r.doc, "ann", NULL))
            assert_true(document_whole(r.doc));
        lum_recovery_finish(&r);
    }
    free(bytes[0]);
    free(bytes[1]);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup_teardown(a_torn_tail_is_cut, setup, teardown),
        cmocka_unit_test_setup_teardown(a_flipped_bit_costs_one_edit, setup, teardown),
        cmocka_unit_test_setup_teardown(what_needs_a_lost_edit_is_named, setup, teardown),
        cmocka_unit_test_setup_teardown(a_damaged_snapshot_costs_nothing, setup, teardown),
        cmocka_unit_test_setup_teardown(the_only_snapshot_loses_what_is_damaged, setup, teardown),
        cmocka_unit_test_setup_teardown(another_version_is_refused, setup, teardown),
        cmocka_unit_test_setup_teardown(a_folder_without_a_snapshot_is_not_begun_anew, setup, teardown),
        cmocka_unit_test_setup_teardown(hostile_files_do_no_harm, setup, teardown),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

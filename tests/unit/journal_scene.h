/* A journal of a scene of eight lights. */
#ifndef LUM_TESTS_UNIT_JOURNAL_SCENE_H
#define LUM_TESTS_UNIT_JOURNAL_SCENE_H

#include <stdio.h>
#include <stdlib.h>

#include "tests/support/journal_keeper.h"
#include "tests/unit/document_util.h"

#define N_LIGHTS 8
#define SCENE                                                                                                          \
    "[" LIGHT("l0") "," LIGHT("l1") "," LIGHT("l2") "," LIGHT("l3") "," LIGHT("l4") "," LIGHT("l5") "," LIGHT(         \
        "l6") "," LIGHT("l7") "]"

static inline int setup(void **state)
{
    struct keeper *k = *state = malloc(sizeof *k);
    keeper_init(k);
    return 0;
}

static inline int teardown(void **state)
{
    keeper_finish(*state);
    free(*state);
    return 0;
}

static inline void open_new(struct keeper *k)
{
    struct lum_error err;
    if (!keeper_open(k, SCENE, &err))
        fail_msg("%s", err.text);
}

static inline void set_flux(struct keeper *k, const char *user, unsigned light, unsigned lm)
{
    char ops[96];
    snprintf(ops, sizeof ops, "[{'op':'set','id':'l%u','path':'/flux_lm','value':%u}]", light, lm);
    assert_true(keeper_edit(k, user, ops));
}

/* The document of the keeper's folder is this one, and nothing was told. */
static inline void assert_found(struct keeper *k, const char *text, uint64_t rev)
{
    struct lum_recovery r;
    struct lum_error err;
    assert_int_equal(keeper_recover(k, &r, &err), LUM_OK);
    assert_string_equal(k->log, "");
    char *found = document_text(r.doc);
    assert_string_equal(found, text);
    assert_int_equal(lum_document_rev(r.doc), rev);
    assert_true(document_whole(r.doc));
    free(found);
    lum_recovery_finish(&r);
}

#endif

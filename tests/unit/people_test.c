/* The file of people: which lines are taken, whom a token lets in, and for how long. */
#define _GNU_SOURCE
#include <stdarg.h>
#include <setjmp.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "server/net/auth.h"

#define ZEROS "00000000000000000000000000000000000000000000000000000000000000"

static struct lum_people *parse(const char *text)
{
    struct lum_people *people = NULL;
    struct lum_error err;
    char *copy = strdup(text);
    if (lum_people_parse("people", copy, &people, &err))
        people = NULL;
    free(copy);
    return people;
}

static void lines_are_read(void **state)
{
    (void)state;
    struct lum_people *p = parse("# a comment\n\n  \t\nann admin sha256:" ZEROS "00\r\n bob.2\tview sha256:" ZEROS
                                 "fe 1970-01-01 \n#sha256:" ZEROS "02\n_c- edit sha256:" ZEROS "03 2999-12-31");
    assert_non_null(p);
    assert_int_equal(p->n, 3);
    assert_string_equal(p->list[0].name, "ann");
    assert_int_equal(p->list[0].role, LUM_ROLE_ADMIN);
    assert_true(p->list[0].ends_s == LUM_NEVER_S);
    assert_string_equal(p->list[1].name, "bob.2");
    assert_int_equal(p->list[1].sha[31], 0xfe);
    assert_true(p->list[1].ends_s == 86400); /* the end of that day */
    assert_string_equal(p->list[2].name, "_c-");
    lum_free(p);
    p = parse("");
    assert_non_null(p);
    assert_int_equal(p->n, 0);
    lum_free(p);
}

static void other_lines_are_refused(void **state)
{
    (void)state;
    static const char *const wrong[] = {
        "ann",
        "ann edit",
        "ann edit a-token-itself",
        "ann edit sha256:" ZEROS,
        "ann edit sha256:" ZEROS "000",
        "ann edit sha256:" ZEROS "0G",
        "ann edit sha256:" ZEROS "0A",
        "ann edit SHA256:" ZEROS "00",
        "ann Edit sha256:" ZEROS "00",
        "ann owner sha256:" ZEROS "00",
        "a/n edit sha256:" ZEROS "00",
        "a\xc3\xa4n edit sha256:" ZEROS "00",
        "ann edit sha256:" ZEROS "00 2026-02-29",
        "ann edit sha256:" ZEROS "00 2026-1-01",
        "ann edit sha256:" ZEROS "00 2026-00-10",
        "ann edit sha256:" ZEROS "00 2026-04-31",
        "ann edit sha256:" ZEROS "00 26-04-30",
        "ann edit sha256:" ZEROS "00 2026-04-30T",
        "ann edit sha256:" ZEROS "00 2026-04-30 more",
        "ann edit sha256:" ZEROS "00\nann view sha256:" ZEROS "01",
        "ann edit sha256:" ZEROS "00\nbob view sha256:" ZEROS "00",
        "abcdefghijklmnopqrstuvwxyz0123456 edit sha256:" ZEROS "00",
    };
    for (size_t i = 0; i < LUM_ARRAY_LEN(wrong); i++)
        if (parse(wrong[i]))
            fail_msg("\"%s\" was taken", wrong[i]);
}

/* SHA-256 of the text "abc", as FIPS 180 has it. */
static void hashes_are_those_of_the_standard(void **state)
{
    (void)state;
    uint8_t sha[LUM_TOKEN_SHA_BYTES];
    assert_true(lum_token_sha("abc", sha));
    struct lum_people *p = parse("ann edit sha256:ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad\n");
    assert_ptr_equal(lum_people_find(p, sha), &p->list[0]);
    lum_free(p);
}

/* Whoever has whatever line is found, and a hash that differs in any one bit is nobody's. */
static void every_line_counts(void **state)
{
    (void)state;
    struct lum_people *p = lum_calloc(1, sizeof *p + LUM_PEOPLE_MAX * sizeof *p->list);
    assert_non_null(p);
    p->n = LUM_PEOPLE_MAX;
    for (unsigned i = 0; i < LUM_PEOPLE_MAX; i++) {
        char token[32];
        snprintf(token, sizeof token, "token of number %u", i);
        assert_true(lum_token_sha(token, p->list[i].sha));
    }
    for (unsigned i = 0; i < LUM_PEOPLE_MAX; i++)
        assert_ptr_equal(lum_people_find(p, p->list[i].sha), &p->list[i]);
    for (unsigned bit = 0; bit < 8 * LUM_TOKEN_SHA_BYTES; bit++) {
        uint8_t sha[LUM_TOKEN_SHA_BYTES];
        memcpy(sha, p->list[LUM_PEOPLE_MAX - 1].sha, sizeof sha);
        sha[bit / 8] ^= (uint8_t)(1u << bit % 8);
        assert_null(lum_people_find(p, sha));
    }
    p->n = 0;
    assert_null(lum_people_find(p, p->list[0].sha));
    lum_free(p);
}

static void a_token_is_good_until_its_end(void **state)
{
    (void)state;
    struct lum_person who;
    struct lum_error err;
    struct lum_auth auth = {.required = true};
    auth.people =
        parse("ann view sha256:ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad 1970-01-02\n");
    assert_non_null(auth.people);
    assert_true(lum_auth_check(&auth, "abc", 2 * 86400 - 1, &who, &err));
    assert_string_equal(who.name, "ann");
    assert_int_equal(who.role, LUM_ROLE_VIEW);
    assert_true(lum_auth_still(&auth, &who, 2 * 86400 - 1));
    assert_false(lum_auth_still(&auth, &who, 2 * 86400));
    assert_false(lum_auth_check(&auth, "abc", 2 * 86400, &who, &err));
    assert_string_equal(err.text, "the time of this token, of ann, is over");
    assert_false(lum_auth_check(&auth, "abd", 0, &who, &err));
    assert_false(lum_auth_check(&auth, "", 0, &who, &err)); /* the one token that is none is no token */
    assert_false(lum_auth_check(&auth, NULL, 0, &who, &err));
    assert_true(lum_auth_check_header(&auth, "bearer abc", 0));
    assert_false(lum_auth_check_header(&auth, "abc", 0));
    lum_auth_finish(&auth);
}

/* Of a person's line everything counts but its place. */
static void who_was_changed_may_not_stay(void **state)
{
    (void)state;
    static const struct {
        const char *now;
        bool still;
    } cases[] = {
        {"bob edit sha256:" ZEROS "01\nann edit sha256:" ZEROS "00 2999-01-01", true},
        {"bob edit sha256:" ZEROS "00 2999-01-01", false},
        {"ann view sha256:" ZEROS "00 2999-01-01", false},
        {"ann admin sha256:" ZEROS "00 2999-01-01", false},
        {"ann edit sha256:" ZEROS "02 2999-01-01", false},
        {"ann edit sha256:" ZEROS "00", false},
        {"", false},
    };
    struct lum_auth auth = {.required = true};
    auth.people = parse("ann edit sha256:" ZEROS "00 2999-01-01");
    const struct lum_person ann = auth.people->list[0], anybody = {.ends_s = LUM_NEVER_S};
    assert_false(lum_auth_take_offered(&auth));
    for (size_t i = 0; i < LUM_ARRAY_LEN(cases); i++) {
        lum_auth_offer(&auth, parse(""));
        lum_auth_offer(&auth, parse(cases[i].now)); /* the newer of two counts */
        assert_true(lum_auth_take_offered(&auth));
        assert_int_equal(lum_auth_still(&auth, &ann, 0), cases[i].still);
        assert_true(lum_auth_still(&auth, &anybody, 0)); /* came by the one token */
    }
    lum_auth_finish(&auth);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(lines_are_read),
        cmocka_unit_test(other_lines_are_refused),
        cmocka_unit_test(hashes_are_those_of_the_standard),
        cmocka_unit_test(every_line_counts),
        cmocka_unit_test(a_token_is_good_until_its_end),
        cmocka_unit_test(who_was_changed_may_not_stay),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

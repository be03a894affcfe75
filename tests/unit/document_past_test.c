/* What a document was: every moment comes back, by one step that can be undone; limits; names. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cjson/cJSON.h>

#include "core/base/base.h"
#include "protocol/document/internal.h"
#include "tests/unit/document_util.h"

enum { STEPS = 120, SEEDS = 8 };

static bool revert(struct lum_document *doc, const char *user, uint64_t rev, struct lum_proto_error *err)
{
    struct lum_changes changes = {0};
    bool ok = lum_document_revert(doc, user, rev, &changes, err);
    lum_changes_finish(&changes);
    return ok;
}

static void set(struct lum_document *doc, const char *user, const char *id, unsigned value, const char *group)
{
    char text[160];
    snprintf(text, sizeof text, "[{'op':'set','id':'%s','path':'/flux_lm','value':%u}]", id, value);
    cJSON *json = json_of(text);
    struct lum_ops ops;
    struct lum_changes changes;
    struct lum_proto_error err = {0};
    assert_true(lum_ops_from_json(json, &ops, &err));
    snprintf(ops.undo_group, sizeof ops.undo_group, "%s", group);
    if (!lum_document_apply(doc, user, &ops, NULL, 0, &changes, &err))
        fail_msg("%s", err.text);
    lum_changes_finish(&changes);
    lum_ops_finish(&ops);
    cJSON_Delete(json);
}

/* A random edit by a random user: of lights, of what refers to each other, of undo and redo, back to some moment. */
static void wander(struct lum_document *doc, struct rng *r)
{
    static const char *const users[] = {"ann", "bob", "cat"};
    static const char *const ops[] = {"[" MESH("m") "]",
                                      "[" REMOVE("m") "]",
                                      "[" MATERIAL("w") "]",
                                      "[" REMOVE("w") "]",
                                      "[" OBJECT("o", "m", "w") "]",
                                      "[" REMOVE("o") "]",
                                      "[" LIGHT("k") "]",
                                      "[" REMOVE("k") "]",
                                      "[" SET("k", "/on", "false") "," SET("l", "/on", "true") "]",
                                      "[" OBJECT("p", "m", "w") "," SET("o", "/visible", "false") "]"};
    const char *user = users[rng_below(r, 3)];
    uint32_t what = rng_below(r, 16);
    struct lum_proto_error err;
    if (what < LUM_ARRAY_LEN(ops))
        apply_text(doc, user, ops[what], &err);
    else if (what < 12)
        undo(doc, user, &err);
    else if (what < 13)
        redo(doc, user, &err);
    else if (what < 14)
        revert(doc, user, rng_below(r, (uint32_t)lum_document_rev(doc) + 1), &err);
    else
        set(doc, user, "l", rng_below(r, 1000), rng_below(r, 2) ? "drag" : "");
}

static void every_moment_comes_back(void **state)
{
    (void)state;
    for (uint64_t seed = 1; seed <= SEEDS; seed++) {
        struct rng r = {seed};
        struct lum_document *doc = lum_document_create();
        char *texts[4 * STEPS] = {NULL};
        must(doc, "(scene)", "[" LIGHT("l") "]");
        lum_document_begin_past(doc);
        for (int i = 0; i < STEPS; i++) {
            free(texts[lum_document_rev(doc)]);
            texts[lum_document_rev(doc)] = document_text(doc);
            wander(doc, &r);
        }
        free(texts[lum_document_rev(doc)]);
        texts[lum_document_rev(doc)] = document_text(doc);
        uint64_t now = lum_document_rev(doc);
        size_t n = lum_document_n_moments(doc);
        assert_true(n > 10);
        for (size_t i = 0; i < n; i++) {
            struct lum_proto_error err = {0};
            uint64_t rev = lum_document_moment(doc, i)->rev;
            bool same = !texts[rev] || strcmp(texts[rev], texts[now]) == 0;
            if (!revert(doc, "dan", rev, &err)) {
                if (!same || strcmp(err.app, "conflict") != 0)
                    fail_msg("seed %u: to %u: %s", (unsigned)seed, (unsigned)rev, err.text);
                continue;
            }
            char *text = document_text(doc);
            if (texts[rev] && strcmp(text, texts[rev]) != 0)
                fail_msg("seed %u: revision %u is not what it was:\n%s\n%s", (unsigned)seed, (unsigned)rev, text,
                         texts[rev]);
            free(text);
            assert_true(document_whole(doc) && undo(doc, "dan", &err));
            text = document_text(doc);
            assert_string_equal(text, texts[now]);
            free(text);
        }
        for (size_t i = 0; i < LUM_ARRAY_LEN(texts); i++)
            free(texts[i]);
        lum_document_destroy(doc);
    }
}

static void a_branch_keeps_what_it_left(void **state)
{
    (void)state;
    struct lum_document *doc = lum_document_create();
    struct lum_proto_error err = {0};
    must(doc, "ann", "[" LIGHT("l") "]");
    lum_document_begin_past(doc);
    must(doc, "ann", "[" SET("l", "/flux_lm", "1") "]"); /* revision 2 */
    must(doc, "bob", "[" SET("l", "/flux_lm", "2") "]");
    assert_true(revert(doc, "ann", 2, &err) && flux(doc, "l") == 1.0); /* 4 */
    must(doc, "ann", "[" SET("l", "/flux_lm", "5") "]");
    assert_true(revert(doc, "bob", 3, &err) && flux(doc, "l") == 2.0); /* the other branch */
    assert_true(undo(doc, "bob", &err) && flux(doc, "l") == 5.0);
    const struct lum_moment *m = lum_document_moment(doc, 3);
    assert_true(m->did == LUM_PAST_REVERT && m->to == 2 && m->rev == 4);
    assert_string_equal(m->user, "ann");
    assert_true(lum_document_moment(doc, lum_document_n_moments(doc) - 1)->did == LUM_PAST_UNDO);
    assert_false(revert(doc, "ann", 0, &err)); /* before it began to be kept */
    assert_string_equal(err.app, "not_found");
    assert_false(revert(doc, "ann", lum_document_rev(doc) + 1, &err));
    assert_false(revert(doc, "ann", lum_document_rev(doc), &err)); /* here it is */
    assert_string_equal(err.app, "conflict");
    lum_document_destroy(doc);
}

static void a_drag_is_one_moment(void **state)
{
    (void)state;
    struct lum_document *doc = lum_document_create();
    struct lum_proto_error err = {0};
    must(doc, "ann", "[" LIGHT("l") "," LIGHT("k") "]");
    lum_document_begin_past(doc);
    for (unsigned i = 0; i < 9; i++) {
        lum_document_set_time(doc, 1000 + i);
        set(doc, "ann", "l", i, "drag-1");
    }
    assert_int_equal(lum_document_n_moments(doc), 2);
    const struct lum_moment *m = lum_document_moment(doc, 1);
    assert_true(m->rev == 10 && m->n_edits == 9 && m->at_ms == 1008 && m->changes.n == 1);
    assert_false(revert(doc, "ann", 5, &err)); /* in the middle of it */
    assert_non_null(strstr(err.text, "nearest moment is revision 1"));
    assert_true(lum_document_name_moment(doc, "bob", 10, "bright", NULL, &err));
    set(doc, "ann", "l", 77, "drag-1"); /* a name stays where it was given */
    set(doc, "bob", "k", 1, "drag-1");  /* and this is another's */
    assert_int_equal(lum_document_n_moments(doc), 4);
    assert_true(revert(doc, "ann", 10, &err) && flux(doc, "l") == 8.0 && flux(doc, "k") == 800.0);
    lum_document_destroy(doc);
}

static void what_is_taken_back_never_was(void **state)
{
    (void)state;
    struct lum_document *doc = lum_document_create();
    struct lum_proto_error err = {0};
    must(doc, "ann", "[" LIGHT("l") "]");
    lum_document_begin_past(doc);
    struct lum_changes changes[3];
    set(doc, "ann", "l", 1, "drag");
    for (int i = 0; i < 3; i++)
        changes[i] = changes_of(doc, i == 1 ? "[" LIGHT("k") "]" : "[" SET("l", "/flux_lm", "50") "]");
    for (int i = 3; i-- > 0;) { /* the last of them changed nothing */
        lum_document_rollback(doc, &changes[i]);
        lum_changes_finish(&changes[i]);
    }
    assert_int_equal(lum_document_n_moments(doc), 2);
    assert_true(flux(doc, "l") == 1.0 && lum_document_rev(doc) == 2);
    lum_document_raise_rev(doc, 9); /* as others saw them */
    must(doc, "ann", "[" SET("l", "/flux_lm", "3") "]");
    assert_true(revert(doc, "ann", 2, &err) && flux(doc, "l") == 1.0);
    assert_true(revert(doc, "ann", 10, &err) && flux(doc, "l") == 3.0);
    lum_document_destroy(doc);
}

/* Where what stood before was forgotten, as too large, now is a moment all the same. */
static void now_is_a_moment_whatever_is_taken_back(void **state)
{
    (void)state;
    struct lum_document *doc = lum_document_create();
    struct lum_proto_error err = {0};
    struct lum_changes changes[3], none;
    must(doc, "ann", "[" LIGHT("l") "]");
    for (int i = 0; i < 3; i++)
        changes[i] = changes_of(doc, "[" SET("l", "/flux_lm", "50") "]");
    lum_document_begin_past(doc);
    for (int i = 3; i-- > 0;) {
        lum_document_rollback(doc, &changes[i]);
        lum_changes_finish(&changes[i]);
        assert_int_equal(lum_document_n_moments(doc), 1);
        assert_int_equal(lum_document_moment(doc, 0)->rev, lum_document_rev(doc));
        if (!lum_document_changes_to(doc, lum_document_rev(doc), &none, &err))
            fail_msg("%s", err.text);
        assert_int_equal(none.n, 0);
        lum_changes_finish(&none);
    }
    set(doc, "ann", "l", 3, "");
    assert_true(revert(doc, "ann", 1, &err) && flux(doc, "l") == 800.0);
    lum_document_destroy(doc);
}

/* One below the limit, at it, and above, where the two oldest without a name become one. */
static void the_oldest_are_joined_but_named_ones(void **state)
{
    (void)state;
    for (unsigned n = LUM_LIMIT_PAST_STEPS - 1; n <= LUM_LIMIT_PAST_STEPS + 1; n++) {
        struct lum_document *doc = lum_document_create();
        struct lum_proto_error err = {0};
        must(doc, "ann", "[" LIGHT("l") "]");
        lum_document_begin_past(doc);
        for (unsigned i = 0; i < n; i++) {
            set(doc, i < 4 ? "ann" : "bob", "l", i + 1, "");
            if (i == 0)
                assert_true(lum_document_name_moment(doc, "ann", 2, "first", NULL, &err));
        }
        bool joined = n > LUM_LIMIT_PAST_STEPS;
        assert_int_equal(lum_document_n_moments(doc), (joined ? LUM_LIMIT_PAST_STEPS : n) + 1);
        assert_int_equal(lum_document_moment(doc, 2)->rev, joined ? 4 : 3);
        assert_int_equal(lum_document_moment(doc, 2)->n_joined, joined ? 2 : 1);
        assert_int_equal(revert(doc, "ann", 3, &err), !joined);
        assert_true(revert(doc, "ann", 2, &err) && flux(doc, "l") == 1.0);
        assert_true(revert(doc, "ann", 1, &err) && flux(doc, "l") == 800.0);
        lum_document_destroy(doc);
    }
}

static void thinned_it_has_named_moments_alone(void **state)
{
    (void)state;
    struct lum_document *doc = lum_document_create();
    struct lum_proto_error err = {0};
    must(doc, "ann", "[" LIGHT("l") "]");
    lum_document_begin_past(doc);
    for (unsigned i = 0; i < 9; i++)
        set(doc, "ann", "l", i, "");
    must(doc, "ann", "[" LIGHT("gone") "]");
    must(doc, "ann", "[" REMOVE("gone") "]");
    assert_true(lum_document_name_moment(doc, "ann", 4, "here", NULL, &err));
    lum_document_thin_past(doc);
    assert_int_equal(lum_document_n_moments(doc), 3);
    assert_int_equal(lum_document_moment(doc, 2)->changes.n, 1); /* what came and went is no more */
    assert_true(revert(doc, "ann", 4, &err) && flux(doc, "l") == 2.0);
    assert_true(revert(doc, "ann", 1, &err) && flux(doc, "l") == 800.0);
    assert_true(revert(doc, "ann", 12, &err) && flux(doc, "l") == 8.0);
    lum_document_destroy(doc);
}

/* Of a random past all but what has a name is joined, in the place of the older; what is held on to is then the sum of
 * what each moment holds on to. */
static void what_is_joined_leads_where_they_led(void **state)
{
    (void)state;
    for (uint64_t seed = 1; seed <= 4 * SEEDS; seed++) {
        struct rng r = {seed};
        struct lum_document *doc = lum_document_create();
        struct lum_proto_error err = {0};
        char *texts[4 * STEPS] = {NULL};
        must(doc, "(scene)", "[" LIGHT("l") "]");
        lum_document_begin_past(doc);
        for (int i = 0; i < STEPS; i++) {
            uint64_t rev = lum_document_rev(doc);
            free(texts[rev]);
            texts[rev] = document_text(doc);
            if (rng_below(&r, 8) == 0)
                assert_true(lum_document_name_moment(doc, "ann", rev, "here", NULL, &err));
            if (rng_below(&r, 8) == 0)
                lum_document_thin_past(doc); /* a drag goes on behind it */
            wander(doc, &r);
        }
        size_t n_before = lum_document_n_moments(doc);
        lum_document_thin_past(doc);
        size_t n = lum_document_n_moments(doc);
        assert_true(n > 2 && n <= n_before && n < STEPS / 2);
        struct lum_held held = {0};
        for (size_t i = 1; i < n; i++) {
            const struct lum_changes *c = &lum_document_moment(doc, i)->changes;
            assert_true(lum_held_add(&held, c));
            for (size_t k = 0; k < c->n; k++)
                assert_ptr_not_equal(c->changes[k].before, c->changes[k].after);
        }
        assert_int_equal(held.n_bytes, doc->past.held.n_bytes);
        assert_int_equal(held.records.n, doc->past.held.records.n);
        lum_held_finish(&held);
        uint64_t revs[2 * STEPS];
        for (size_t i = 0; i < n; i++)
            revs[i] = lum_document_moment(doc, i)->rev;
        for (size_t i = 0; i + 1 < n; i++) {
            assert_true(revert(doc, "dan", revs[i], &err) || strcmp(err.app, "conflict") == 0); /* it is that already */
            char *text = document_text(doc);
            if (texts[revs[i]] && strcmp(text, texts[revs[i]]) != 0)
                fail_msg("seed %u: revision %u is not what it was", (unsigned)seed, (unsigned)revs[i]);
            free(text);
        }
        for (size_t i = 0; i < LUM_ARRAY_LEN(texts); i++)
            free(texts[i]);
        lum_document_destroy(doc);
    }
}

/* What was joined goes on as a drag, in whose order ids are not sorted, and is joined again. */
static void a_drag_goes_on_from_what_was_joined(void **state)
{
    (void)state;
    struct lum_document *doc = lum_document_create();
    struct lum_proto_error err = {0};
    must(doc, "ann", "[" LIGHT("l") "]");
    lum_document_begin_past(doc);
    must(doc, "ann", "[" MESH("z") "," LIGHT("a") "]");
    set(doc, "ann", "l", 1, "drag");
    lum_document_thin_past(doc);
    set(doc, "ann", "l", 2, "drag");
    assert_int_equal(lum_document_n_moments(doc), 2);
    must(doc, "ann", "[" REMOVE("z") "]");
    lum_document_thin_past(doc);
    assert_int_equal(lum_document_n_moments(doc), 2);
    assert_int_equal(lum_document_moment(doc, 1)->changes.n, 2); /* the mesh came and went */
    assert_true(revert(doc, "ann", 1, &err) && flux(doc, "l") == 800.0 && document_whole(doc));
    lum_document_destroy(doc);
}

static void names_are_limited(void **state)
{
    (void)state;
    struct lum_document *doc = lum_document_create();
    struct lum_proto_error err = {0};
    must(doc, "ann", "[" LIGHT("l") "]");
    lum_document_begin_past(doc);
    for (unsigned i = 0; i <= LUM_LIMIT_MOMENTS; i++) {
        set(doc, "ann", "l", i, "");
        assert_int_equal(lum_document_name_moment(doc, "ann", i + 2, "a name", NULL, &err), i < LUM_LIMIT_MOMENTS);
    }
    assert_string_equal(err.app, "limit_exceeded");
    assert_true(lum_document_name_moment(doc, "bob", 5, "another", NULL, &err)); /* in place of one */
    assert_string_equal(lum_document_moment(doc, 4)->named_by, "bob");
    assert_true(lum_document_name_moment(doc, "bob", 5, "", NULL, &err));
    assert_true(lum_document_name_moment(doc, "bob", LUM_LIMIT_MOMENTS + 2, "room for one", NULL, &err));
    assert_false(lum_document_name_moment(doc, "bob", 0, "nothing", NULL, &err));
    assert_string_equal(err.app, "not_found");
    lum_document_destroy(doc);
}

/* A name tells the moment that has it, also where the revision is of an edit that was taken back; and it can go back.
 */
static void a_name_can_be_taken_back(void **state)
{
    (void)state;
    struct lum_document *doc = lum_document_create();
    struct lum_proto_error err = {0};
    struct lum_moment_name first, second, third;
    must(doc, "ann", "[" LIGHT("l") "]");
    lum_document_begin_past(doc);
    set(doc, "ann", "l", 1, "");
    lum_document_raise_rev(doc, 9);
    assert_true(lum_document_name_moment(doc, "ann", 5, "one", &first, &err));
    assert_true(lum_document_name_moment(doc, "bob", 2, "two", &second, &err));
    assert_true(first.rev == 2 && first.name[0] == '\0' && second.rev == 2);
    const struct lum_moment *m = lum_document_moment(doc, 1);
    assert_true(lum_document_name_back(doc, &second));
    assert_string_equal(m->name, "one");
    assert_string_equal(m->named_by, "ann");
    assert_true(lum_document_name_back(doc, &first));
    assert_true(m->name[0] == '\0' && m->named_by[0] == '\0');
    struct lum_changes changes = changes_of(doc, "[" SET("l", "/flux_lm", "50") "]");
    assert_true(lum_document_name_moment(doc, "ann", 10, "three", &third, &err));
    lum_document_rollback(doc, &changes);
    lum_changes_finish(&changes);
    assert_false(lum_document_name_back(doc, &third));
    lum_document_destroy(doc);
}

/* Each step holds on to a mesh of some 100 MB that stands no more. */
static void bytes_are_limited(void **state)
{
    (void)state;
    enum { VALUES = 3 << 22 };
    struct lum_document *doc = lum_document_create();
    lum_document_begin_past(doc);
    unsigned long long most = 0;
    for (int i = 0; i < 8; i++) {
        struct lum_record *r = lum_record_create(LUM_RECORD_MESH, "big");
        r->mesh.positions.f64 = lum_bulk_create(VALUES * sizeof(double));
        r->mesh.positions.n = VALUES;
        struct lum_op op = {.kind = LUM_OP_ADD, .id = "big", .record = r};
        struct lum_ops ops = {.ops = &op, .n = 1};
        struct lum_changes changes;
        struct lum_proto_error err = {0};
        assert_true(lum_document_apply(doc, "(test)", &ops, NULL, 0, &changes, &err));
        lum_changes_finish(&changes);
        must(doc, "(test)", "[" REMOVE("big") "]");
        lum_record_unref(r);
        assert_true(doc->past.held.n_bytes <= LUM_LIMIT_PAST_BYTES);
        most = doc->past.held.n_bytes > most ? doc->past.held.n_bytes : most;
    }
    assert_true(most > LUM_LIMIT_PAST_BYTES / 2);
    assert_true(lum_document_n_moments(doc) > 2 && lum_document_moment(doc, 0)->rev > 0);
    lum_document_destroy(doc);
}

static void an_id_of_another_type_is_a_conflict(void **state)
{
    (void)state;
    struct lum_document *doc = lum_document_create();
    struct lum_proto_error err = {0};
    lum_document_begin_past(doc);
    must(doc, "ann", "[" LIGHT("x") "]");
    must(doc, "ann", "[" REMOVE("x") "]");
    must(doc, "ann", "[" MATERIAL("x") "]");
    assert_false(revert(doc, "ann", 1, &err));
    assert_string_equal(err.app, "conflict");
    assert_true(document_whole(doc) && lum_document_rev(doc) == 3);
    assert_true(revert(doc, "ann", 2, &err) && revert(doc, "ann", 1, &err)); /* by two steps it goes */
    lum_document_destroy(doc);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_moment_comes_back),
        cmocka_unit_test(a_branch_keeps_what_it_left),
        cmocka_unit_test(a_drag_is_one_moment),
        cmocka_unit_test(what_is_taken_back_never_was),
        cmocka_unit_test(now_is_a_moment_whatever_is_taken_back),
        cmocka_unit_test(the_oldest_are_joined_but_named_ones),
        cmocka_unit_test(thinned_it_has_named_moments_alone),
        cmocka_unit_test(what_is_joined_leads_where_they_led),
        cmocka_unit_test(a_drag_goes_on_from_what_was_joined),
        cmocka_unit_test(names_are_limited),
        cmocka_unit_test(a_name_can_be_taken_back),
        cmocka_unit_test(bytes_are_limited),
        cmocka_unit_test(an_id_of_another_type_is_a_conflict),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

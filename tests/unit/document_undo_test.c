/* Undo and redo, by user and field; random walks of them. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cjson/cJSON.h>

#include "protocol/document/internal.h"
#include "protocol/json/json.h"
#include "tests/unit/document_util.h"

static void undo_is_per_user_and_per_field(void **state)
{
    (void)state;
    struct lum_document *doc = lum_document_create();
    struct lum_proto_error err = {0};
    must(doc, "ann", "[" LIGHT("l") "," LIGHT("k") "]");
    assert_false(undo(doc, "bob", &err));
    assert_string_equal(err.app, "not_found");
    must(doc, "ann", "[" SET("l", "/flux_lm", "1") "]");
    must(doc, "bob", "[" SET("l", "/on", "false") "," SET("k", "/flux_lm", "7") "]");
    assert_true(undo(doc, "ann", &err)); /* her field, not his */
    assert_true(flux(doc, "l") == 800.0 && !lum_document_find(doc, "l")->light.on);
    assert_true(undo(doc, "bob", &err));
    assert_true(lum_document_find(doc, "l")->light.on && flux(doc, "k") == 800.0);
    assert_true(redo(doc, "ann", &err) && flux(doc, "l") == 1.0);
    must(doc, "bob", "[" SET("l", "/flux_lm", "2") "]");
    assert_false(undo(doc, "ann", &err));
    assert_string_equal(err.app, "conflict");
    assert_string_equal(err.path, "flux_lm");
    assert_true(flux(doc, "l") == 2.0);
    assert_false(undo(doc, "ann", &err)); /* now the adding of l, which bob changed since */
    assert_string_equal(err.app, "conflict");
    assert_false(undo(doc, "ann", &err));
    assert_string_equal(err.app, "not_found");
    assert_true(document_whole(doc));
    lum_document_destroy(doc);
}

static void undo_of_add_in_use(void **state)
{
    (void)state;
    struct lum_document *doc = lum_document_create();
    struct lum_proto_error err = {0};
    must(doc, "ann", "[" MESH("m") "," MATERIAL("w") "]");
    must(doc, "bob", "[" OBJECT("o", "m", "w") "]");
    assert_false(undo(doc, "ann", &err));
    assert_string_equal(err.app, "conflict");
    assert_non_null(strstr(err.text, "\"o\""));
    must(doc, "bob", "[" REMOVE("o") "]");
    must(doc, "ann", "[" REMOVE("m") "]");
    assert_true(undo(doc, "bob", &err) == false); /* o cannot come back without its mesh */
    assert_string_equal(err.app, "conflict");
    lum_document_destroy(doc);
}

static void a_new_edit_ends_redo(void **state)
{
    (void)state;
    struct lum_document *doc = lum_document_create();
    struct lum_proto_error err = {0};
    must(doc, "ann", "[" LIGHT("l") "]");
    must(doc, "ann", "[" SET("l", "/flux_lm", "1") "]");
    assert_true(undo(doc, "ann", &err));
    must(doc, "ann", "[" SET("l", "/flux_lm", "2") "]");
    assert_false(redo(doc, "ann", &err));
    assert_string_equal(err.app, "not_found");
    lum_document_destroy(doc);
}

static void undo_limit(void **state)
{
    (void)state;
    for (int d = -1; d <= 1; d++) {
        struct lum_document *doc = lum_document_create();
        int n = (int)LUM_LIMIT_UNDO + d, undone = 0;
        must(doc, "bob", "[" LIGHT("l") "]");
        for (int i = 0; i < n; i++) {
            char op[100];
            snprintf(op, sizeof op, "[" SET("l", "/flux_lm", "%d") "]", i + 1);
            must(doc, "ann", op);
        }
        while (undo(doc, "ann", NULL))
            undone++;
        assert_int_equal(undone, d <= 0 ? n : (int)LUM_LIMIT_UNDO);
        lum_document_destroy(doc);
    }
}

static void users_limit(void **state)
{
    (void)state;
    struct lum_document *doc = lum_document_create();
    must(doc, "ann", "[" LIGHT("l") "]");
    for (unsigned i = 0; i < LUM_LIMIT_UNDO_USERS - 1; i++) {
        char user[20];
        snprintf(user, sizeof user, "user%u", i);
        must(doc, user, "[" SET("l", "/flux_lm", "1") "]");
    }
    assert_false(undo(doc, "nobody", NULL));
    assert_true(undo(doc, "user0", NULL)); /* still remembered, and now the latest */
    must(doc, "one-more", "[" SET("l", "/on", "false") "]");
    must(doc, "ann", "[" SET("l", "/on", "true") "]"); /* ann was idle longest */
    assert_true(undo(doc, "ann", NULL));
    assert_false(undo(doc, "ann", NULL));
    lum_document_destroy(doc);
}

/* ---- random walks ---- */

/* Ops over a few ids, most of them sensible; what is refused is part of the test. */
static void random_op(struct rng *rng, char *op, size_t n)
{
    static const char *const ids[] = {"a", "b", "c", "d"};
    const char *id = ids[rng_below(rng, 4)], *other = ids[rng_below(rng, 4)], *third = ids[rng_below(rng, 4)];
    switch (rng_below(rng, 10)) {
    case 0:
        snprintf(op, n, "{'op':'add','type':'mesh','id':'m%s','shape':'box','size':[1,%u,1]}", id, rng_below(rng, 9));
        return;
    case 1:
        snprintf(op, n, "{'op':'add','type':'material','id':'w%s','roughness':0.%u}", id, rng_below(rng, 9));
        return;
    case 2:
    case 3:
        snprintf(op, n, "{'op':'add','type':'object','id':'o%s','mesh':'m%s','material':'w%s'}", id, other, third);
        return;
    case 4:
        snprintf(op, n, "{'op':'add','type':'light','id':'l%s','kind':'point','flux_lm':%u}", id, rng_below(rng, 900));
        return;
    case 5:
        snprintf(op, n, "{'op':'set','id':'l%s','path':'/%s','value':%u}", id,
                 rng_below(rng, 2) ? "flux_lm" : "intensity_cd", rng_below(rng, 900));
        return;
    case 6:
        snprintf(op, n, "{'op':'set','id':'o%s','path':'/material','value':'w%s'}", id, other);
        return;
    case 7:
        snprintf(op, n, "{'op':'set','id':'o%s','path':'/transform/translate','value':[%u,0,1]}", id,
                 rng_below(rng, 9));
        return;
    case 8:
        snprintf(op, n, "{'op':'set','id':'render','path':'','value':{'spp':%u,'exposure_ev':%u}}", rng_below(rng, 9),
                 rng_below(rng, 9));
        return;
    default:
        snprintf(op, n, "{'op':'remove','id':'%c%s'}", "mwol"[rng_below(rng, 4)], id);
    }
}

/* A walk of one user: every undo returns to the text before the edit, every redo to the text after it. */
static void undo_and_redo_walk(void **state)
{
    enum { STEPS = 60 };
    (void)state;
    for (uint64_t seed = 0; seed < 60; seed++) {
        struct rng rng = {seed};
        struct lum_document *doc = lum_document_create();
        char *texts[STEPS + 1] = {document_text(doc)};
        int at = 0, top = 0;
        for (int step = 0; step < 400; step++) {
            uint32_t what = rng_below(&rng, 4);
            char op[200], ops[900] = "[";
            if (what == 0 && undo(doc, "ann", NULL))
                at--;
            else if (what == 1 && redo(doc, "ann", NULL))
                at++;
            else if (at < STEPS) {
                for (uint32_t k = 1 + rng_below(&rng, 4); k; k--) {
                    random_op(&rng, op, sizeof op);
                    strcat(ops, op);
                    strcat(ops, k > 1 ? "," : "]");
                }
                if (apply_text(doc, "ann", ops, NULL)) {
                    for (int i = ++at; i <= top; i++)
                        free(texts[i]);
                    texts[at] = document_text(doc);
                    top = at;
                }
            }
            char *now = document_text(doc);
            if (strcmp(now, texts[at]) != 0 || !document_whole(doc))
                fail_msg("seed %llu, step %d", (unsigned long long)seed, step);
            free(now);
        }
        while (undo(doc, "ann", NULL))
            at--;
        assert_int_equal(at, 0);
        char *now = document_text(doc);
        assert_string_equal(now, texts[0]);
        free(now);
        for (int i = 0; i <= top; i++)
            free(texts[i]);
        lum_document_destroy(doc);
    }
}

/* What each history says that it holds is what its steps hold. */
static bool histories_counted(const struct lum_document *doc)
{
    bool ok = true;
    for (const struct lum_history *h = doc->histories; h; h = h->next) {
        struct lum_held held = {0};
        for (const struct lum_history_entry *e = h->undo; e; e = e->next)
            assert_true(lum_held_add(&held, &e->changes));
        for (const struct lum_history_entry *e = h->redo; e; e = e->next)
            assert_true(lum_held_add(&held, &e->changes));
        if (doc->last.action == LUM_ACTION_APPLY && doc->last.history == h)
            assert_true(lum_held_add(&held, &doc->last.entry->changes));
        ok = ok && held.records.n == h->held.records.n && held.n_bytes == h->held.n_bytes;
        lum_held_finish(&held);
    }
    return ok;
}

/* Two users at once: whatever conflicts, the document stays whole, and its ops rebuild it. */
static void two_users_walk(void **state)
{
    (void)state;
    for (uint64_t seed = 0; seed < 60; seed++) {
        struct rng rng = {1000 + seed};
        struct lum_document *doc = lum_document_create();
        for (int step = 0; step < 300; step++) {
            const char *user = rng_below(&rng, 2) ? "ann" : "bob";
            char op[200], ops[220];
            uint32_t what = rng_below(&rng, 5);
            uint64_t rev = lum_document_rev(doc);
            random_op(&rng, op, sizeof op);
            snprintf(ops, sizeof ops, "[%s]", op);
            bool ok = what == 0   ? undo(doc, user, NULL)
                      : what == 1 ? redo(doc, user, NULL)
                                  : apply_text(doc, user, ops, NULL);
            assert_int_equal(lum_document_rev(doc), rev + ok);
            if (rng_below(&rng, 50) == 0)
                lum_document_forget_user(doc, user);
            if (!document_whole(doc) || !histories_counted(doc))
                fail_msg("seed %llu, step %d", (unsigned long long)seed, step);
        }
        char *text = document_text(doc);
        cJSON *json = lum_json_parse(text, strlen(text), NULL);
        struct lum_ops list;
        struct lum_changes c;
        struct lum_proto_error err;
        struct lum_document *copy = lum_document_create();
        if (!lum_ops_from_json(cJSON_GetObjectItem(json, "ops"), &list, &err) ||
            !lum_document_apply(copy, "x", &list, NULL, 0, &c, &err))
            fail_msg("seed %llu: %s: %s", (unsigned long long)seed, text, err.text);
        char *again = document_text(copy);
        assert_string_equal(text, again);
        lum_changes_finish(&c);
        lum_ops_finish(&list);
        cJSON_Delete(json);
        free(text);
        free(again);
        lum_document_destroy(copy);
        lum_document_destroy(doc);
    }
}

/* One transaction of many ops, and the same ops one by one or split anywhere, give the same document; and the
 * notifications lead a second document to the same state. */
static void splitting_changes_nothing(void **state)
{
    (void)state;
    for (uint64_t seed = 0; seed < 200; seed++) {
        struct rng rng = {2000 + seed};
        struct lum_document *whole = lum_document_create(), *split = lum_document_create(),
                            *told = lum_document_create();
        char op[200], all[4096] = "[";
        int n = 0;
        for (int i = 0; i < 40 && n < 14; i++) { /* keeps ops that are accepted where they stand */
            char one[220];
            random_op(&rng, op, sizeof op);
            snprintf(one, sizeof one, "[%s]", op);
            if (!apply_text(split, "ann", one, NULL))
                continue;
            snprintf(all + strlen(all), sizeof all - strlen(all), "%s%s", n++ ? "," : "", op);
        }
        strcat(all, "]");
        if (n == 0)
            continue;
        struct lum_proto_error err = {0};
        struct lum_changes c = changes_of(whole, all);
        cJSON *notification = lum_changes_to_json(&c);
        char *news = lum_json_print(notification, NULL);
        if (strcmp(news, "[]") != 0 && !apply_text(told, "x", news, &err))
            fail_msg("seed %llu: %s: %s", (unsigned long long)seed, news, err.text);
        char *a = document_text(whole), *b = document_text(split), *t = document_text(told);
        assert_string_equal(a, b);
        assert_string_equal(a, t);
        free(a);
        free(b);
        free(t);
        free(news);
        cJSON_Delete(notification);
        lum_changes_finish(&c);
        lum_document_destroy(whole);
        lum_document_destroy(split);
        lum_document_destroy(told);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(undo_is_per_user_and_per_field),
        cmocka_unit_test(undo_of_add_in_use),
        cmocka_unit_test(a_new_edit_ends_redo),
        cmocka_unit_test(undo_limit),
        cmocka_unit_test(users_limit),
        cmocka_unit_test(undo_and_redo_walk),
        cmocka_unit_test(two_users_walk),
        cmocka_unit_test(splitting_changes_nothing),
    };
    return cmocka_run_group_tests_name("document_undo", tests, NULL, NULL);
}

/* Every allocation of protocol/ may fail without harm: each scenario runs with the k-th allocation failing, for k = 1,
 * 2, ... until it runs through. A failed step must leave the document as it was. Leaks are found by AddressSanitizer.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cjson/cJSON.h>
#include <cmocka.h>

#include "protocol/document/past.h"
#include "protocol/json/json.h"
#include "protocol/message/rpc.h"
#include "tests/unit/failing_alloc.h"
#include "tests/unit/protocol_util.h"

/* Runs fn with each allocation failing in turn. fn is true when it did its work. */
static void sweep(bool (*fn)(void *), void *user, const char *name)
{
    for (unsigned k = 1; k < 100000; k++) {
        failing_alloc_arm(k);
        bool ok = fn(user);
        if (!failing_alloc_disarm()) {
            assert_true(ok);
            assert_true(k > 1); /* else the wrapping does not work */
            return;
        }
        if (ok)
            fail_msg("%s: allocation %u failed unnoticed", name, k);
    }
    fail_msg("%s: no end", name);
}

static bool text_round_trip(void *user)
{
    const char *text = user;
    cJSON *json = lum_json_parse(text, strlen(text), NULL);
    char *again = json ? lum_json_print(json, NULL) : NULL;
    bool ok = again != NULL;
    free(again);
    cJSON_Delete(json);
    return ok;
}

static bool op_round_trip(void *user)
{
    struct lum_op op;
    if (!lum_op_from_json(user, NULL, &op, NULL))
        return false;
    cJSON *json = lum_op_to_json(&op);
    struct lum_record *clone = op.record ? lum_record_clone(op.record) : NULL;
    bool ok = json && (clone || !op.record);
    lum_record_unref(clone);
    cJSON_Delete(json);
    lum_op_finish(&op);
    return ok;
}

static bool jsonl_read(void *user)
{
    struct lum_ops ops;
    const char *text = user;
    if (!lum_ops_from_jsonl(text, strlen(text), &ops, NULL))
        return false;
    lum_ops_finish(&ops);
    return true;
}

static bool rpc_round_trip(void *user)
{
    struct lum_rpc rpc;
    const char *text = user;
    bool ok = lum_rpc_parse(text, strlen(text), &rpc, NULL);
    cJSON *result = ok ? cJSON_CreateObject() : NULL;
    char *reply = result ? lum_rpc_result(rpc.id, result) : NULL;
    struct lum_proto_error err;
    lum_proto_fail_range(&err, "x", 0, 1);
    char *error = reply ? lum_rpc_error(rpc.id, &err) : NULL;
    ok = ok && reply && error;
    free(reply);
    free(error);
    lum_rpc_finish(&rpc);
    return ok;
}

static void texts_and_ops(void **state)
{
    static char text[] = "{\"a\":[1,2,{\"b\":\"c\"}],\"d\":null}";
    static char jsonl[] = "{\"lumend\":1,\"kind\":\"replay\"}\n{\"op\":\"remove\",\"id\":\"a\",\"t_ms\":1}\n"
                          "{\"op\":\"set\",\"id\":\"a\",\"path\":\"/x\",\"value\":[1],\"t_ms\":1}\n";
    static char request[] = "{\"jsonrpc\":\"2.0\",\"id\":\"x\",\"method\":\"scene.get\",\"params\":{}}";
    static const char *const ops[] = {
        "{'op':'add','type':'mesh','id':'m','positions':[0,0,0,1,0,0,0,1,0],'indices':[0,1,2],'uvs':[0,0,1,0,0,1]}",
        "{'op':'add','type':'image','id':'i','width':1,'height':1,'pixels':'AQIDBA=='}",
        "{'op':'add','type':'material','id':'w','normal_texture':{'image':'i'}}",
        "{'op':'set','id':'w','path':'/base_color','value':[1,1,1]}",
        "{'op':'import','id':'r','asset':'a.glb','transform':[1,0,0,0,0,1,0,0,0,0,1,0,0,0,0,1]}",
    };
    (void)state;
    sweep(text_round_trip, text, "text");
    sweep(jsonl_read, jsonl, "jsonl");
    sweep(rpc_round_trip, request, "rpc");
    for (size_t i = 0; i < sizeof ops / sizeof ops[0]; i++) {
        cJSON *json = json_of(ops[i]);
        sweep(op_round_trip, json, ops[i]);
        cJSON_Delete(json);
    }
}

/* ---- documents ---- */

static struct lum_document *base_document(void)
{
    struct lum_document *doc = lum_document_create();
    assert_true(apply_text(doc, "ann",
                           "[{'op':'add','type':'mesh','id':'m','shape':'box'},{'op':'add','type':'material','id':'w'},"
                           "{'op':'add','type':'object','id':'o','mesh':'m','material':'w'},"
                           "{'op':'add','type':'light','id':'l','kind':'point','flux_lm':800}]",
                           NULL));
    assert_true(apply_text(doc, "ann", "[{'op':'set','id':'l','path':'/flux_lm','value':400}]", NULL));
    assert_true(apply_text(doc, "bob", "[{'op':'set','id':'l','path':'/on','value':false}]", NULL));
    return doc;
}

enum action { APPLY, UNDO, REDO, TO_JSON };

struct attempt {
    enum action action;
    const struct lum_ops *ops;
    const struct lum_import_children *children;
    size_t n_children;
};

static bool act(struct lum_document *doc, const struct attempt *a)
{
    struct lum_changes c = {0};
    struct lum_proto_error err = {0};
    bool ok = false;
    if (a->action == APPLY)
        ok = lum_document_apply(doc, "ann", a->ops, a->children, a->n_children, &c, &err);
    else if (a->action == UNDO)
        ok = lum_document_undo(doc, "ann", &c, &err);
    else if (a->action == REDO)
        ok = lum_document_redo(doc, "ann", &c, &err);
    else {
        cJSON *json = lum_document_to_json(doc, false), *expanded = lum_document_to_json(doc, true);
        ok = json && expanded;
        cJSON_Delete(json);
        cJSON_Delete(expanded);
        return ok;
    }
    if (!ok && err.code != LUM_PROTO_INTERNAL)
        fail_msg("memory was short, but the error says %s", err.text);
    if (ok) {
        cJSON *json = lum_changes_to_json(&c);
        ok = json != NULL;
        if (!ok)
            lum_document_rollback(doc, &c); /* as a server that cannot tell */
        cJSON_Delete(json);
    }
    lum_changes_finish(&c);
    return ok;
}

static void sweep_document(const struct attempt *a)
{
    for (unsigned k = 1; k < 100000; k++) {
        struct lum_document *doc = base_document();
        if (a->action == REDO) {
            struct lum_changes c;
            assert_true(lum_document_undo(doc, "ann", &c, NULL));
            lum_changes_finish(&c);
        }
        char *before = document_text(doc);
        uint64_t rev = lum_document_rev(doc);
        failing_alloc_arm(k);
        bool ok = act(doc, a);
        bool was_hit = failing_alloc_disarm();
        assert_true(document_whole(doc));
        assert_int_equal(ok, !was_hit);
        if (!ok) {
            char *after = document_text(doc);
            assert_string_equal(before, after);
            assert_int_equal(rev, lum_document_rev(doc));
            free(after);
            assert_true(act(doc, a)); /* and works at the second try: no history was lost */
        }
        free(before);
        lum_document_destroy(doc);
        if (!was_hit)
            return;
    }
    fail_msg("no end");
}

static bool make_document(void *user)
{
    (void)user;
    struct lum_document *doc = lum_document_create();
    lum_document_destroy(doc);
    return doc != NULL;
}

static void documents(void **state)
{
    (void)state;
    cJSON *json =
        json_of("[{'op':'import','id':'room','asset':'a.glb'},{'op':'set','id':'l','path':'/flux_lm','value':7},"
                "{'op':'remove','id':'o'},{'op':'add','type':'material','id':'w2'},"
                "{'op':'set','id':'render','path':'/exposure_ev','value':3},{'op':'remove','id':'m'},"
                "{'op':'set','id':'room','path':'/transform/translate','value':[1,2,3]}]");
    struct lum_ops ops;
    assert_true(lum_ops_from_json(json, &ops, NULL));
    struct lum_record *made[] = {lum_record_create(LUM_RECORD_MATERIAL, "room/paint"),
                                 lum_record_create(LUM_RECORD_CAMERA, "room/eye")};
    made[1]->camera.target[2] = -1;
    struct lum_import_children children = {"room", made, 2};
    sweep(make_document, NULL, "create");
    sweep_document(&(struct attempt){APPLY, &ops, &children, 1});
    sweep_document(&(struct attempt){.action = UNDO});
    sweep_document(&(struct attempt){.action = REDO});
    sweep_document(&(struct attempt){.action = TO_JSON});
    lum_record_unref(made[0]);
    lum_record_unref(made[1]);
    lum_ops_finish(&ops);
    cJSON_Delete(json);
}

/* ---- what was ---- */

static bool drag(struct lum_document *doc, const struct lum_ops *ops, struct lum_changes *ret)
{
    return lum_document_apply(doc, "ann", ops, NULL, 0, ret, NULL);
}

/* Moments may be forgotten; now is one, and those that are left lead to what was. */
static void assert_moments(struct lum_document *doc, char *const *texts)
{
    size_t n = lum_document_n_moments(doc);
    uint64_t revs[8];
    assert_true(n > 0 && n <= 8 && lum_document_moment(doc, n - 1)->rev == lum_document_rev(doc));
    for (size_t i = 0; i < n; i++)
        revs[i] = lum_document_moment(doc, i)->rev;
    for (size_t i = 0; i < n; i++) {
        struct lum_changes changes;
        struct lum_proto_error err = {0};
        if (lum_document_revert(doc, "dan", revs[i], &changes, &err))
            lum_changes_finish(&changes);
        else
            assert_string_equal(err.app, "conflict"); /* it is that already */
        char *text = document_text(doc);
        assert_string_equal(text, texts[revs[i]]);
        free(text);
    }
}

/* A drag goes on, its last edit is taken back, and all are joined. */
static void moments(void **state)
{
    (void)state;
    cJSON *json = json_of("[{'op':'set','id':'l','path':'/flux_lm','value':7},{'op':'remove','id':'o'}]"),
          *more = json_of("[{'op':'set','id':'l','path':'/flux_lm','value':8},{'op':'add','type':'light','id':'k',"
                          "'kind':'point','flux_lm':800}]");
    struct lum_ops first, second;
    assert_true(lum_ops_from_json(json, &first, NULL) && lum_ops_from_json(more, &second, NULL));
    strcpy(first.undo_group, "drag");
    strcpy(second.undo_group, "drag");
    bool was_hit = true;
    for (unsigned k = 1; was_hit; k++) {
        struct lum_document *doc = base_document();
        struct lum_changes changes;
        char *texts[8] = {NULL};
        lum_document_begin_past(doc);
        texts[lum_document_rev(doc)] = document_text(doc);
        assert_true(apply_text(doc, "ann", "[{'op':'set','id':'l','path':'/flux_lm','value':5}]", NULL));
        texts[lum_document_rev(doc)] = document_text(doc);
        assert_true(drag(doc, &first, &changes));
        lum_changes_finish(&changes);
        texts[lum_document_rev(doc)] = document_text(doc);
        failing_alloc_arm(k);
        if (drag(doc, &second, &changes)) {
            lum_document_rollback(doc, &changes);
            lum_changes_finish(&changes);
        }
        lum_document_thin_past(doc);
        was_hit = failing_alloc_disarm();
        assert_true(document_whole(doc) && lum_document_rev(doc) == 5);
        assert_true(was_hit || lum_document_n_moments(doc) == 2);
        assert_moments(doc, texts);
        for (size_t i = 0; i < sizeof texts / sizeof *texts; i++)
            free(texts[i]);
        lum_document_destroy(doc);
        assert_true(was_hit || k > 1);
    }
    lum_ops_finish(&first);
    lum_ops_finish(&second);
    cJSON_Delete(json);
    cJSON_Delete(more);
}

int main(void)
{
    failing_alloc_begin();
    const struct CMUnitTest tests[] = {cmocka_unit_test(texts_and_ops), cmocka_unit_test(documents),
                                       cmocka_unit_test(moments)};
    return cmocka_run_group_tests_name("protocol_alloc", tests, NULL, NULL);
}

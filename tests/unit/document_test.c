/* Transactions, references, undo and redo, imports, the scene as ops. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cjson/cJSON.h>
#include <cmocka.h>

#include "protocol/json.h"
#include "tests/unit/protocol_util.h"

#define MESH(id) "{'op':'add','type':'mesh','id':'" id "','shape':'box'}"
#define MATERIAL(id) "{'op':'add','type':'material','id':'" id "'}"
#define OBJECT(id, mesh, material)                                                                                     \
    "{'op':'add','type':'object','id':'" id "','mesh':'" mesh "','material':'" material "'}"
#define LIGHT(id) "{'op':'add','type':'light','id':'" id "','kind':'point','flux_lm':800}"
#define SET(id, path, value) "{'op':'set','id':'" id "','path':'" path "','value':" value "}"
#define REMOVE(id) "{'op':'remove','id':'" id "'}"

static void must(struct lum_document *doc, const char *user, const char *ops)
{
    struct lum_proto_error err = {0};
    if (!apply_text(doc, user, ops, &err))
        fail_msg("%s: %s at %s", ops, err.text, err.path);
    assert_true(document_whole(doc));
}

/* Refused, and nothing changed. */
static void must_not(struct lum_document *doc, const char *ops, const char *app, const char *path)
{
    struct lum_proto_error err = {0};
    char *before = document_text(doc);
    uint64_t rev = lum_document_rev(doc);
    if (apply_text(doc, "ann", ops, &err))
        fail_msg("accepted %s", ops);
    if (strcmp(err.app, app) != 0 || strcmp(err.path, path) != 0)
        fail_msg("%s: %s at \"%s\": %s", ops, err.app, err.path, err.text);
    char *after = document_text(doc);
    assert_string_equal(before, after);
    assert_int_equal(rev, lum_document_rev(doc));
    assert_true(document_whole(doc));
    free(before);
    free(after);
}

static bool undo(struct lum_document *doc, const char *user, struct lum_proto_error *err)
{
    struct lum_changes changes = {0};
    bool ok = lum_document_undo(doc, user, &changes, err);
    lum_changes_finish(&changes);
    return ok;
}

static bool redo(struct lum_document *doc, const char *user, struct lum_proto_error *err)
{
    struct lum_changes changes = {0};
    bool ok = lum_document_redo(doc, user, &changes, err);
    lum_changes_finish(&changes);
    return ok;
}

static double flux(const struct lum_document *doc, const char *id)
{
    return lum_document_find(doc, id)->light.flux_lm.value;
}

static void all_or_nothing(void **state)
{
    (void)state;
    struct lum_document *doc = lum_document_create();
    assert_int_equal(lum_document_rev(doc), 0);
    must(doc, "ann", "[" MESH("m") "," MATERIAL("w") "," OBJECT("o", "m", "w") "," LIGHT("l") "]");
    assert_int_equal(lum_document_rev(doc), 1);
    must_not(doc, "[" SET("l", "/flux_lm", "5") "," SET("l", "/flux_lm", "-5") "]", "invalid_value", "ops/1/flux_lm");
    must_not(doc, "[" REMOVE("o") "," REMOVE("m") "," REMOVE("none") "]", "not_found", "ops/2/id");
    must_not(doc, "[" LIGHT("l2") "," LIGHT("l") "]", "conflict", "ops/1/id");
    must_not(doc, "[" REMOVE("m") "]", "in_use", "ops/0/id");
    must_not(doc, "[" REMOVE("w") "]", "in_use", "ops/0/id");
    must_not(doc, "[" REMOVE("render") "]", "in_use", "ops/0/id");
    must_not(doc, "[" OBJECT("p", "none", "w") "]", "not_found", "ops/0/mesh");
    must_not(doc, "[" OBJECT("p", "w", "w") "]", "not_found", "ops/0/mesh"); /* there, but a material */
    must_not(doc, "[" SET("o", "/material", "'none'") "]", "not_found", "ops/0/material");
    must_not(doc, "[" SET("none", "/on", "true") "]", "not_found", "ops/0/id");
    must_not(doc, "[" SET("w", "/base_color_texture", "{'image':'sky'}") "]", "not_found", "ops/0/base_color_texture");
    must_not(doc, "[{'op':'import','id':'room','asset':'a.glb'}]", "unsupported", "ops/0/id");
    must_not(doc, "[" REMOVE("l") "," MESH("l") "]", "conflict", "id"); /* one transaction, one type */
    must(doc, "ann", "[" REMOVE("l") "]");
    must(doc, "ann", "[" MESH("l") "]");
    lum_document_destroy(doc);
}

static void in_use_names_the_user(void **state)
{
    (void)state;
    struct lum_document *doc = lum_document_create();
    struct lum_proto_error err = {0};
    must(doc, "ann",
         "[{'op':'add','type':'image','id':'i','asset':'a.png'}," MESH("m") "," MATERIAL("w") "," SET(
             "w", "/normal_texture", "{'image':'i'}") "," OBJECT("chair", "m", "w") "]");
    assert_false(apply_text(doc, "ann", "[" REMOVE("m") "]", &err));
    assert_non_null(strstr(err.text, "\"chair\""));
    assert_false(apply_text(doc, "ann", "[" REMOVE("i") "]", &err));
    assert_non_null(strstr(err.text, "\"w\""));
    must(doc, "ann", "[" SET("w", "/normal_texture", "null") "," REMOVE("i") "," REMOVE("chair") "," REMOVE("m") "]");
    lum_document_destroy(doc);
}

/* The net changes come coalesced and in an order that a renderer can follow one by one. */
static void changes_are_net_and_ordered(void **state)
{
    (void)state;
    struct lum_document *doc = lum_document_create();
    must(doc, "ann", "[" MESH("z") "," MATERIAL("y") "," OBJECT("a", "z", "y") "," LIGHT("l") "]");
    cJSON *json = json_of(
        "[" MESH("m") "," SET("l", "/flux_lm", "1") "," SET("l", "/flux_lm", "2") "," OBJECT("b", "m", "y") "," REMOVE(
            "a") "," REMOVE("z") "," LIGHT("gone") "," REMOVE("gone") "," SET("l", "/on", "false") "]");
    struct lum_ops ops;
    struct lum_changes c;
    assert_true(lum_ops_from_json(json, &ops, NULL));
    assert_true(lum_document_apply(doc, "ann", &ops, NULL, 0, &c, NULL));
    static const char *const order[] = {"m", "b", "l", "a", "z"};
    assert_int_equal(c.n, 5);
    for (size_t i = 0; i < c.n; i++) {
        const struct lum_record *r = c.changes[i].after ? c.changes[i].after : c.changes[i].before;
        assert_string_equal(r->id, order[i]);
        assert_int_equal(c.changes[i].after == NULL, i >= 3);
    }
    assert_true(c.changes[2].before->light.flux_lm.value == 800.0 && c.changes[2].after->light.flux_lm.value == 2.0);
    cJSON *told = lum_changes_to_json(&c);
    char *text = lum_json_print(cJSON_GetArrayItem(told, 2), NULL);
    assert_string_equal(text, "{\"value\":{\"flux_lm\":2,\"on\":false},\"op\":\"set\",\"id\":\"l\",\"path\":\"\"}");
    free(text);
    cJSON_Delete(told);
    lum_changes_finish(&c);
    lum_ops_finish(&ops);
    cJSON_Delete(json);
    lum_document_destroy(doc);
}

/* Setting one field of a group ends the others; a mirror that knows no groups must hear of it. */
static void the_news_name_what_was_reset(void **state)
{
    (void)state;
    static const struct {
        const char *ops, *news;
    } cases[] = {
        {"[" SET("l", "/cct_k", "2700") "]", "{'value':2700,'op':'set','id':'l','path':'/cct_k'}"},
        {"[" SET("l", "/color", "[1,0,0]") "]",
         "{'value':{'color':[1,0,0],'cct_k':null},'op':'set','id':'l','path':''}"},
        {"[" SET("l", "/color", "[0,1,0]") "]", "{'value':[0,1,0],'op':'set','id':'l','path':'/color'}"},
        {"[" SET("l", "/cct_k", "4000") "]", "{'value':{'color':null,'cct_k':4000},'op':'set','id':'l','path':''}"},
        {"[" SET("l", "/cct_k", "null") "]", "{'value':null,'op':'set','id':'l','path':'/cct_k'}"},
        {"[" SET("l", "/intensity_cd", "5") "]",
         "{'value':{'flux_lm':null,'intensity_cd':5},'op':'set','id':'l','path':''}"},
    };
    struct lum_document *doc = lum_document_create();
    must(doc, "ann", "[" LIGHT("l") "]");
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        cJSON *json = json_of(cases[i].ops), *expected = json_of(cases[i].news);
        struct lum_ops ops;
        struct lum_changes c;
        assert_true(lum_ops_from_json(json, &ops, NULL));
        assert_true(lum_document_apply(doc, "ann", &ops, NULL, 0, &c, NULL));
        cJSON *told = lum_changes_to_json(&c);
        char *got = lum_json_print(cJSON_GetArrayItem(told, 0), NULL), *want = lum_json_print(expected, NULL);
        assert_string_equal(got, want);
        free(got);
        free(want);
        cJSON_Delete(told);
        cJSON_Delete(expected);
        lum_changes_finish(&c);
        lum_ops_finish(&ops);
        cJSON_Delete(json);
    }
    lum_document_destroy(doc);
}

static void rollback_leaves_no_trace(void **state)
{
    (void)state;
    struct lum_document *doc = lum_document_create();
    must(doc, "ann", "[" LIGHT("l") "]");
    must(doc, "ann", "[" SET("l", "/flux_lm", "1") "]");
    must(doc, "ann", "[" SET("l", "/flux_lm", "2") "]");
    assert_true(undo(doc, "ann", NULL));
    char *before = document_text(doc);
    uint64_t rev = lum_document_rev(doc);
    cJSON *json = json_of(
        "[" SET("l", "/flux_lm", "3") "," REMOVE("l") "," MESH("m") "," MATERIAL("w") "," OBJECT("o", "m", "w") "]");
    struct lum_ops ops;
    struct lum_changes c;
    assert_true(lum_ops_from_json(json, &ops, NULL));
    assert_true(lum_document_apply(doc, "ann", &ops, NULL, 0, &c, NULL));
    lum_document_rollback(doc, &c);
    lum_changes_finish(&c);
    char *after = document_text(doc);
    assert_string_equal(before, after);
    assert_int_equal(rev, lum_document_rev(doc));
    assert_true(redo(doc, "ann", NULL)); /* the refused edit did not cost the redo */
    assert_true(flux(doc, "l") == 2.0);
    assert_true(lum_document_undo(doc, "ann", &c, NULL));
    lum_document_rollback(doc, &c);
    lum_changes_finish(&c);
    assert_true(flux(doc, "l") == 2.0);
    assert_true(undo(doc, "ann", NULL) && flux(doc, "l") == 1.0);
    assert_true(undo(doc, "ann", NULL) && flux(doc, "l") == 800.0);
    free(before);
    free(after);
    lum_ops_finish(&ops);
    cJSON_Delete(json);
    lum_document_destroy(doc);
}

/* ---- undo ---- */

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

/* One more than the limit is refused, the limit is not. */
static void check_record_limit(enum lum_record_type type, size_t limit)
{
    struct lum_document *doc = lum_document_create();
    struct lum_ops ops = {.ops = calloc(limit + 1, sizeof(struct lum_op)), .n = limit + 1};
    char path[32];
    assert_non_null(ops.ops);
    for (size_t i = 0; i < ops.n; i++) {
        snprintf(ops.ops[i].id, sizeof ops.ops[i].id, "l%zu", i);
        ops.ops[i].record = lum_record_create(type, ops.ops[i].id);
    }
    struct lum_changes c = {0};
    struct lum_proto_error err = {0};
    assert_false(lum_document_apply(doc, "ann", &ops, NULL, 0, &c, &err));
    assert_string_equal(err.app, "limit_exceeded");
    snprintf(path, sizeof path, "ops/%zu/id", limit);
    assert_string_equal(err.path, path);
    ops.n = limit;
    assert_true(lum_document_apply(doc, "ann", &ops, NULL, 0, &c, &err));
    lum_changes_finish(&c);
    ops.n = limit + 1;
    lum_ops_finish(&ops);
    lum_document_destroy(doc);
}

static void record_limits(void **state)
{
    (void)state;
    check_record_limit(LUM_RECORD_LIGHT, LUM_LIMIT_LIGHTS);
    check_record_limit(LUM_RECORD_MEDIUM, LUM_LIMIT_MEDIA);
}

/* ---- imports ---- */

static struct lum_record *child(const char *text)
{
    cJSON *json = json_of(text);
    struct lum_op op;
    struct lum_proto_error err;
    if (!lum_op_from_json(json, NULL, &op, &err))
        fail_msg("%s", err.text);
    struct lum_record *r = lum_record_ref(op.record);
    lum_op_finish(&op);
    cJSON_Delete(json);
    return r;
}

/* Imports a small room under the id, as the importer would expand it. */
static bool import_room(struct lum_document *doc, const char *id, struct lum_proto_error *err)
{
    char texts[4][200];
    struct lum_record *records[4];
    snprintf(texts[0], 200, "{'op':'add','type':'mesh','id':'%s/box','shape':'box'}", id);
    snprintf(texts[1], 200, "{'op':'add','type':'material','id':'%s/paint'}", id);
    snprintf(texts[2], 200, "{'op':'add','type':'object','id':'%s/wall','mesh':'%s/box','material':'%s/paint'}", id, id,
             id);
    snprintf(texts[3], 200, "{'op':'add','type':'light','id':'%s/lamp','kind':'point','flux_lm':800}", id);
    for (int i = 0; i < 4; i++)
        records[i] = child(texts[i]);
    struct lum_import_children children = {.records = records, .n = 4};
    snprintf(children.import_id, sizeof children.import_id, "%s", id);
    char op[100];
    snprintf(op, sizeof op, "[{'op':'import','id':'%s','asset':'room.glb'}]", id);
    cJSON *json = json_of(op);
    struct lum_ops ops;
    struct lum_changes c = {0};
    assert_true(lum_ops_from_json(json, &ops, NULL));
    bool ok = lum_document_apply(doc, "ann", &ops, &children, 1, &c, err);
    if (ok) {
        cJSON *told = lum_changes_to_json(&c); /* the import op stands for what it brings */
        assert_int_equal(cJSON_GetArraySize(told), 1);
        cJSON_Delete(told);
    }
    lum_changes_finish(&c);
    lum_ops_finish(&ops);
    cJSON_Delete(json);
    for (int i = 0; i < 4; i++)
        lum_record_unref(records[i]);
    return ok;
}

static void imports(void **state)
{
    (void)state;
    struct lum_document *doc = lum_document_create();
    struct lum_proto_error err = {0};
    must(doc, "bob", "[" MATERIAL("red") "]");
    assert_true(import_room(doc, "room", &err));
    assert_true(document_whole(doc));
    assert_false(import_room(doc, "room", &err));
    assert_string_equal(err.app, "conflict");
    must_not(doc, "[" LIGHT("room/mine") "]", "conflict", "ops/0/id");
    must_not(doc, "[" SET("room", "/asset", "'b.glb'") "]", "unsupported", "ops/0/asset");
    must(doc, "bob",
         "[" SET("room/lamp", "/flux_lm", "5") "," SET("room/wall", "/material", "'red'") "," REMOVE("room/paint") "]");
    char *text = document_text(doc);
    assert_non_null(strstr(text, "{\"op\":\"import\",\"id\":\"room\""));
    assert_non_null(strstr(text, "{\"value\":5,\"op\":\"set\",\"id\":\"room/lamp\",\"path\":\"/flux_lm\"}"));
    assert_non_null(strstr(text, "{\"op\":\"remove\",\"id\":\"room/paint\"}"));
    assert_null(strstr(text, "room/box"));
    must_not(doc, "[" REMOVE("red") "]", "in_use", "ops/0/id");
    must(doc, "bob", "[" OBJECT("chair", "room/box", "red") "]");
    must_not(doc, "[" REMOVE("room") "]", "in_use", "ops/0/id"); /* the chair uses its mesh */
    must(doc, "bob", "[" REMOVE("chair") "]");
    must(doc, "bob", "[" REMOVE("room") "]");
    assert_null(lum_document_find(doc, "room/lamp"));
    assert_true(undo(doc, "bob", &err));
    assert_true(undo(doc, "bob", &err)); /* the chair again */
    assert_true(undo(doc, "bob", &err));
    assert_true(document_whole(doc));
    char *again = document_text(doc);
    assert_string_equal(text, again);
    free(text);
    free(again);
    must(doc, "bob", "[" REMOVE("room") "]");
    must(doc, "bob", "[" LIGHT("room/mine") "]");
    assert_false(import_room(doc, "room", &err)); /* ids below it are taken */
    assert_string_equal(err.app, "conflict");
    lum_document_destroy(doc);
}

static void assert_near(const double *got, const double *want, int n)
{
    for (int i = 0; i < n; i++)
        if (!(fabs(got[i] - want[i]) < 1e-12)) /* a few roundings of numbers below 16 */
            fail_msg("number %d is %.17g, not %.17g", i, got[i], want[i]);
}

/* The text of the news of one transaction. */
static char *told(struct lum_document *doc, const char *ops_text)
{
    cJSON *json = json_of(ops_text);
    struct lum_ops ops;
    struct lum_changes c = {0};
    struct lum_proto_error err;
    assert_true(lum_ops_from_json(json, &ops, &err));
    if (!lum_document_apply(doc, "ann", &ops, NULL, 0, &c, &err))
        fail_msg("%s", err.text);
    cJSON *news = lum_changes_to_json(&c);
    char *text = lum_json_print(news, NULL);
    cJSON_Delete(news);
    lum_changes_finish(&c);
    lum_ops_finish(&ops);
    cJSON_Delete(json);
    return text;
}

static void an_import_moves_as_a_whole(void **state)
{
    (void)state;
    struct lum_document *doc = lum_document_create();
    struct lum_proto_error err = {0};
    assert_true(import_room(doc, "room", &err));
    must(doc, "bob", "[" SET("room/lamp", "/position", "[1,0,0]") "," SET("room/lamp", "/flux_lm", "5") "]");
    char *start = document_text(doc);
    char *news = told(doc, "[{'op':'set','id':'room','path':'/transform','value':{'translate':[0,10,0],"
                           "'rotate_deg':[0,90,0],'scale':[2,2,2]}}]");
    assert_non_null(strstr(news, "\"id\":\"room\",\"path\":\"/transform\""));
    assert_non_null(strstr(news, "\"id\":\"room/lamp\""));
    assert_null(strstr(news, "room/wall")); /* objects follow their import unsaid */
    free(news);
    const double wall[16] = {0, 0, 2, 0, 0, 2, 0, 10, -2, 0, 0, 0, 0, 0, 0, 1}, lamp[3] = {0, 10, -2};
    assert_near(lum_document_find(doc, "room/wall")->object.transform.matrix, wall, 16);
    assert_near(lum_document_find(doc, "room/lamp")->light.position, lamp, 3); /* from where it was put */
    assert_true(flux(doc, "room/lamp") == 5);
    assert_true(document_whole(doc));

    must(doc, "ann", "[" SET("room", "/transform/translate", "[0,10,5]") "]"); /* a part of it alone */
    assert_near(lum_document_find(doc, "room/lamp")->light.position, (const double[]){0, 10, 3}, 3);
    assert_true(undo(doc, "ann", &err) && undo(doc, "ann", &err));
    char *back = document_text(doc);
    assert_string_equal(start, back);
    assert_true(redo(doc, "ann", &err) && redo(doc, "ann", &err));
    assert_near(lum_document_find(doc, "room/lamp")->light.position, (const double[]){0, 10, 3}, 3);
    free(start);
    free(back);

    must_not(doc, "[" SET("room", "/transform/scale", "[0,1,1]") "]", "invalid_value", "ops/0/transform");
    must_not(doc, "[" SET("room", "", "{'transform':{'translate':[1e9,0,0],'scale':[1e6,1,1]}}") "]", "invalid_value",
             "ops/0/transform"); /* the lamp would be out of bounds */
    must(doc, "bob", "[" SET("room/lamp", "/position", "[7,0,0]") "]");
    assert_false(undo(doc, "ann", &err)); /* would put bob's lamp elsewhere */
    assert_string_equal(err.app, "conflict");
    lum_document_destroy(doc);
}

/* What was not edited has no memory of the way: the same bits as an import to that place, and nothing to say about it.
 */
static void moving_leaves_no_trace(void **state)
{
    (void)state;
    struct lum_document *doc = lum_document_create(), *straight = lum_document_create();
    struct lum_proto_error err;
    assert_true(import_room(doc, "room", &err) && import_room(straight, "room", &err));
    for (int i = 1; i <= 50; i++) {
        char op[200];
        snprintf(op, sizeof op,
                 "[{'op':'set','id':'room','path':'/transform','value':{'rotate_deg':[%d.1,%d,3],"
                 "'translate':[0.%d,0,0],'scale':[%d,1,1]}}]",
                 i, 7 * i, i, i);
        must(doc, "ann", op);
    }
#define END "[" SET("room", "/transform", "{'translate':[0.1,0.2,0.3],'rotate_deg':[10,20,30]}") "]"
    must(doc, "ann", END);
    must(straight, "ann", END);
#undef END
    assert_true(records_equal(lum_document_find(doc, "room/wall"), lum_document_find(straight, "room/wall")));
    assert_true(records_equal(lum_document_find(doc, "room/lamp"), lum_document_find(straight, "room/lamp")));
    char *text = document_text(doc);
    assert_null(strstr(text, "room/"));
    free(text);
    lum_document_destroy(doc);
    lum_document_destroy(straight);
}

static void expanded_form_shows_everything(void **state)
{
    (void)state;
    struct lum_document *doc = lum_document_create();
    struct lum_proto_error err;
    assert_true(import_room(doc, "room", &err));
    must(doc, "ann", "[{'op':'add','type':'mesh','id':'tri','positions':[0,0,0,1,0,0,0,1,0],'indices':[0,1,2]}]");
    cJSON *json = lum_document_to_json(doc, true);
    char *text = lum_json_print(json, NULL);
    assert_non_null(strstr(text, "\"id\":\"room/lamp\",\"kind\":\"point\""));
    assert_non_null(strstr(text, "\"origin\":\"room\""));
    assert_non_null(strstr(text, "\"n_vertices\":3,\"n_triangles\":1"));
    assert_null(strstr(text, "\"positions\""));
    free(text);
    cJSON_Delete(json);
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
            if (!document_whole(doc))
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
        cJSON *json = json_of(all);
        struct lum_ops ops;
        struct lum_changes c;
        struct lum_proto_error err = {0};
        assert_true(lum_ops_from_json(json, &ops, NULL));
        if (!lum_document_apply(whole, "ann", &ops, NULL, 0, &c, &err))
            fail_msg("seed %llu: %s: %s", (unsigned long long)seed, all, err.text);
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
        lum_ops_finish(&ops);
        cJSON_Delete(json);
        lum_document_destroy(whole);
        lum_document_destroy(split);
        lum_document_destroy(told);
    }
}

/* Many ids: growth, removal from the middle of probe sequences, counts of users. */
static void many_records(void **state)
{
    (void)state;
    struct lum_document *doc = lum_document_create();
    struct rng rng = {7};
    bool there[500] = {false};
    must(doc, "ann", "[" MESH("m") "," MATERIAL("w") "]");
    for (int i = 0; i < 6000; i++) {
        uint32_t k = rng_below(&rng, 500);
        char op[120];
        if (there[k])
            snprintf(op, sizeof op, "[{'op':'remove','id':'o%u'}]", k);
        else
            snprintf(op, sizeof op, "[{'op':'add','type':'object','id':'o%u','mesh':'m','material':'w'}]", k);
        there[k] = !there[k];
        assert_true(apply_text(doc, "ann", op, NULL));
    }
    for (uint32_t k = 0; k < 500; k++) {
        char id[20];
        snprintf(id, sizeof id, "o%u", k);
        assert_int_equal(lum_document_find(doc, id) != NULL, there[k]);
        if (there[k]) {
            char op[60];
            snprintf(op, sizeof op, "[{'op':'remove','id':'o%u'}]", k);
            must_not(doc, "[" REMOVE("m") "]", "in_use", "ops/0/id");
            assert_true(apply_text(doc, "ann", op, NULL));
        }
    }
    must(doc, "ann", "[" REMOVE("m") "," REMOVE("w") "]");
    lum_document_destroy(doc);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(all_or_nothing),
        cmocka_unit_test(in_use_names_the_user),
        cmocka_unit_test(changes_are_net_and_ordered),
        cmocka_unit_test(the_news_name_what_was_reset),
        cmocka_unit_test(rollback_leaves_no_trace),
        cmocka_unit_test(undo_is_per_user_and_per_field),
        cmocka_unit_test(undo_of_add_in_use),
        cmocka_unit_test(a_new_edit_ends_redo),
        cmocka_unit_test(undo_limit),
        cmocka_unit_test(users_limit),
        cmocka_unit_test(record_limits),
        cmocka_unit_test(imports),
        cmocka_unit_test(an_import_moves_as_a_whole),
        cmocka_unit_test(moving_leaves_no_trace),
        cmocka_unit_test(expanded_form_shows_everything),
        cmocka_unit_test(undo_and_redo_walk),
        cmocka_unit_test(two_users_walk),
        cmocka_unit_test(splitting_changes_nothing),
        cmocka_unit_test(many_records),
    };
    return cmocka_run_group_tests_name("document", tests, NULL, NULL);
}

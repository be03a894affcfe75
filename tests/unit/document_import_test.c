/* Imports in a document: what they bring, how they move, how they are told. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cjson/cJSON.h>

#include "protocol/document/import_transform.h"
#include "protocol/json/json.h"
#include "protocol/record/aim.h"
#include "tests/unit/document_util.h"

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
    struct lum_changes c = changes_of(doc, ops_text);
    cJSON *news = lum_changes_to_json(&c);
    char *text = lum_json_print(news, NULL);
    cJSON_Delete(news);
    lum_changes_finish(&c);
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

/* The plane C 0 of a lamp goes where its model goes, however it aims and is turned. */
static void a_web_turns_with_its_import(void **state)
{
    (void)state;
    static const double aims[][3] = {{0, -1, 0}, {0, 1, 0}, {1, 0, 0}, {0.3, -0.8, 0.5}, {-0.2, 0.9, -0.3}};
    for (size_t i = 0; i < sizeof aims / sizeof aims[0]; i++)
        for (int turn = -180; turn < 180; turn += 45) {
            char text[300];
            snprintf(text, sizeof text,
                     "{'op':'add','type':'light','id':'room/lamp','kind':'ies','asset':'a.ies','direction':[%g,%g,%g],"
                     "'roll_deg':%d}",
                     aims[i][0], aims[i][1], aims[i][2], turn);
            struct lum_record *lamp = child(text);
            struct lum_record_transform t = {.rotate_deg = {30, turn, 10}, .scale = {2, 2, 2}};
            double m[3][4], c0[3], want[3], got[3];
            lum_record_transform_affine(&t, m);
            lum_aim_c0(lamp->light.direction, lamp->light.roll_deg, c0);
            for (int k = 0; k < 3; k++)
                want[k] = 0.5 * (m[k][0] * c0[0] + m[k][1] * c0[1] + m[k][2] * c0[2]);
            struct lum_record *placed = lum_import_apply_transform(&t, lamp, NULL);
            assert_non_null(placed);
            lum_aim_c0(placed->light.direction, placed->light.roll_deg, got);
            assert_near(got, want, 3);
            const double *d = aims[i];
            double along = c0[0] * d[0] + c0[1] * d[1] + c0[2] * d[2], back = lum_aim_roll_deg(d, c0) - turn;
            assert_true(fabs(along) < 1e-12 && fabs(remainder(back, 360.0)) < 1e-9);
            lum_record_unref(placed);
            lum_record_unref(lamp);
        }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(imports),
        cmocka_unit_test(an_import_moves_as_a_whole),
        cmocka_unit_test(moving_leaves_no_trace),
        cmocka_unit_test(a_web_turns_with_its_import),
        cmocka_unit_test(expanded_form_shows_everything),
    };
    return cmocka_run_group_tests_name("document_import", tests, NULL, NULL);
}

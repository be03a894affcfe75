/* Transactions, references, the news of a change, limits. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cjson/cJSON.h>

#include "protocol/json/json.h"
#include "tests/unit/document_util.h"

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
    assert_int_equal(lum_document_count(doc, LUM_RECORD_MESH), 2);
    assert_int_equal(lum_document_count(doc, LUM_RECORD_LIGHT), 0);
    assert_int_equal(lum_document_count(doc, LUM_RECORD_TYPE_COUNT), 5); /* w, o and the settings are there, too */
    lum_document_destroy(doc);
}

/* The nearest ids that there are; of the right type, where only one will do. */
static void unknown_ids_are_answered_with_near_ones(void **state)
{
    (void)state;
    struct lum_document *doc = lum_document_create();
    must(doc, "ann",
         "[" MESH("crate-mesh") "," MATERIAL("crate-paint") "," OBJECT("crate", "crate-mesh", "crate-paint") "," LIGHT(
             "hall/lamp-1") "," LIGHT("hall/lamp-2") "]");
    static const struct {
        const char *ops, *text;
    } cases[] = {
        {"[" SET("hall/lmp-1", "/flux_lm", "5") "]",
         "there is no \"hall/lmp-1\": did you mean \"hall/lamp-1\" or \"hall/lamp-2\"?"},
        {"[" REMOVE("lamp-2") "]", "there is no \"lamp-2\": did you mean \"hall/lamp-2\" or \"hall/lamp-1\"?"},
        {"[" REMOVE("zebra") "]", "there is no \"zebra\""},
        {"[" OBJECT("p", "crate", "crate-paint") "]",
         "\"p\": there is no mesh \"crate\": did you mean \"crate-mesh\"?"},
        {"[" OBJECT("p", "zebra", "crate-paint") "]", "\"p\": there is no mesh \"zebra\"; there are crate-mesh"},
    };
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        struct lum_proto_error err = {0};
        assert_false(apply_text(doc, "ann", cases[i].ops, &err));
        assert_string_equal(err.app, "not_found");
        assert_string_equal(err.text, cases[i].text);
    }
    lum_document_destroy(doc);
}

#define PATCH(id, target) "{'op':'add','type':'patch','id':'" id "','target':'" target "'}"

/* Light, object or group that is there, be it by the end of the transaction; what goes later is let go, not told again,
 * and comes back by undo. */
static void patches_name_what_is_there(void **state)
{
    (void)state;
    struct lum_document *doc = lum_document_create();
    struct lum_proto_error err;
    must_not(doc, "[" PATCH("p", "key") "]", "not_found", "ops/0/target");
    must(doc, "ann",
         "[" PATCH("p", "key") "," PATCH("q", "pair") "," LIGHT("key") "," SET("key", "/group", "'pair'") "]");
    must_not(doc, "[" PATCH("r", "pair") "," PATCH("s", "pear") "]", "not_found", "ops/1/target");
    must_not(doc, "[" SET("p", "/target", "'q'") "]", "not_found", "ops/0/target");
    must(doc, "ann", "[" SET("key", "/group", "null") "]");
    must(doc, "ann", "[" SET("q", "/universe", "2") "]"); /* nothing to do with it */
    cJSON *json = lum_document_to_json(doc, false);
    char *text = lum_json_print(json, NULL);
    assert_non_null(strstr(text, "\"p\""));
    assert_null(strstr(text, "\"q\""));
    free(text);
    cJSON_Delete(json);
    assert_false(lum_document_has_target(doc, lum_document_find(doc, "q")));
    assert_true(undo(doc, "ann", &err) && undo(doc, "ann", &err));
    assert_true(lum_document_has_target(doc, lum_document_find(doc, "q")));
    lum_document_destroy(doc);
}

/* It is set to one that is there, be it by the end of the transaction; what goes later is let go, and not told again.
 */
static void the_settings_name_a_camera_that_exists(void **state)
{
    (void)state;
#define CAMERA(id) "{'op':'add','type':'camera','id':'" id "','position':[0,0,1],'target':[0,0,0]}"
    struct lum_document *doc = lum_document_create();
    struct lum_proto_error err = {0};
    must(doc, "ann", "[" CAMERA("main") "," LIGHT("key") "]");
    static const char *const wrong[][2] = {
        {"[" LIGHT("l") "," SET("render", "/camera", "'mian'") "," LIGHT("m") "]",
         "camera of \"render\": there is no camera \"mian\": did you mean \"main\"?"},
        {"[" SET("key", "/on", "true") "," SET("render", "", "{'camera':'key'}") "]",
         "camera of \"render\": there is no camera \"key\"; there are main"},
    };
    for (size_t i = 0; i < sizeof wrong / sizeof *wrong; i++) {
        assert_false(apply_text(doc, "ann", wrong[i][0], &err));
        assert_string_equal(err.text, wrong[i][1]);
        assert_string_equal(err.path, "ops/1/camera");
        assert_string_equal(err.app, "not_found");
    }
    must(doc, "ann", "[" SET("render", "/camera", "'late'") "," CAMERA("late") "]");
    must(doc, "ann", "[" REMOVE("late") "]");
    must(doc, "ann", "[" SET("render", "/exposure_ev", "5") "]"); /* nothing to do with it */
    cJSON *json = lum_document_to_json(doc, false);
    char *text = lum_json_print(json, NULL);
    assert_null(strstr(text, "late"));
    assert_non_null(strstr(text, "exposure_ev"));
    free(text);
    cJSON_Delete(json);
    must(doc, "ann", "[" SET("render", "/camera", "'main'") "]");
    json = lum_document_to_json(doc, false);
    const cJSON *ops = cJSON_GetObjectItem(json, "ops");
    const cJSON *last = cJSON_GetArrayItem(ops, cJSON_GetArraySize(ops) - 1);
    assert_string_equal(cJSON_GetObjectItem(last, "id")->valuestring, "render"); /* after what it names */
    cJSON_Delete(json);
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
    struct lum_changes c = changes_of(
        doc,
        "[" MESH("m") "," SET("l", "/flux_lm", "1") "," SET("l", "/flux_lm", "2") "," OBJECT("b", "m", "y") "," REMOVE(
            "a") "," REMOVE("z") "," LIGHT("gone") "," REMOVE("gone") "," SET("l", "/on", "false") "]");
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
        struct lum_changes c = changes_of(doc, cases[i].ops);
        cJSON *expected = json_of(cases[i].news);
        cJSON *told = lum_changes_to_json(&c);
        char *got = lum_json_print(cJSON_GetArrayItem(told, 0), NULL), *want = lum_json_print(expected, NULL);
        assert_string_equal(got, want);
        free(got);
        free(want);
        cJSON_Delete(told);
        cJSON_Delete(expected);
        lum_changes_finish(&c);
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
    struct lum_changes c = changes_of(doc, "[" SET("l", "/flux_lm", "3") "," REMOVE("l") "," MESH("m") "," MATERIAL(
                                               "w") "," OBJECT("o", "m", "w") "]");
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
    lum_document_destroy(doc);
}

/* Steps of one id are one, so that what is taken back goes another way than it came: whatever order the ops had, and
 * where ids became others meanwhile. */
static void what_is_taken_back_may_be_entangled(void **state)
{
    (void)state;
    struct lum_document *doc = lum_document_create();
    must(doc, "ann", "[" MESH("m") "," MATERIAL("w") "," MATERIAL("v") "," OBJECT("o", "m", "w") "," LIGHT("l") "]");
    must_not(doc, /* o is named before what it comes to refer to */
             "[" SET("o", "/visible", "false") "," MESH("n") "," SET("o", "/mesh",
                                                                     "'n'") "," REMOVE("m") "," REMOVE("none") "]",
             "not_found", "ops/4/id");
    must_not(doc, /* w and m change places, and both are used */
             "[" SET("o", "/material", "'v'") "," REMOVE("w") "," MESH("w") "," SET("o", "/mesh", "'w'") "," REMOVE(
                 "m") "," MATERIAL("m") "," OBJECT("p", "w", "m") "," REMOVE("none") "]",
             "not_found", "ops/7/id");
    must_not(doc, "[" REMOVE("l") "," MESH("l") "," SET("o", "/mesh", "'l'") "," REMOVE("none") "]", "not_found",
             "ops/3/id");
    must_not(doc, "[" OBJECT("p", "m", "w") "," REMOVE("p") "," LIGHT("p") "," REMOVE("none") "]", "not_found",
             "ops/3/id");
    must(doc, "ann", "[" REMOVE("l") "," MESH("l") "," REMOVE("l") "," LIGHT("l") "]");
    must(doc, "ann", "[" OBJECT("p", "m", "w") "," REMOVE("p") "]");
    must_not(doc, "[" SET("o", "/mesh", "'z'") "]", "not_found", "ops/0/mesh");
    struct lum_proto_error err = {0};
    assert_false(apply_text(doc, "ann", "[" SET("o", "/mesh", "'z'") "]", &err));
    assert_non_null(strstr(err.text, "there is no mesh \"z\"; there are m")); /* each type is counted rightly */
    assert_null(strstr(err.text, "..."));
    must(doc, "ann", "[" REMOVE("o") "," REMOVE("m") "," REMOVE("w") "," REMOVE("v") "]"); /* so are users */
    lum_document_destroy(doc);
}

/* ---- limits ---- */

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
    check_record_limit(LUM_RECORD_SENSOR, LUM_LIMIT_SENSORS);
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
        cmocka_unit_test(unknown_ids_are_answered_with_near_ones),
        cmocka_unit_test(the_settings_name_a_camera_that_exists),
        cmocka_unit_test(patches_name_what_is_there),
        cmocka_unit_test(in_use_names_the_user),
        cmocka_unit_test(changes_are_net_and_ordered),
        cmocka_unit_test(the_news_name_what_was_reset),
        cmocka_unit_test(rollback_leaves_no_trace),
        cmocka_unit_test(what_is_taken_back_may_be_entangled),
        cmocka_unit_test(record_limits),
        cmocka_unit_test(many_records),
    };
    return cmocka_run_group_tests_name("document", tests, NULL, NULL);
}

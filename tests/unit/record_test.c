/* Records field by field, driven by the field tables: required, unknown, types, limits; coded and back. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cjson/cJSON.h>
#include <cmocka.h>

#include "protocol/json/json.h"
#include "tests/unit/protocol_util.h"

/* Where the fields of the op stand: itself, or its value. */
static cJSON *fields_of(cJSON *op)
{
    cJSON *value = cJSON_GetObjectItem(op, "value");
    return value ? value : op;
}

static void put(cJSON *object, const char *name, cJSON *value)
{
    cJSON_DeleteItemFromObjectCaseSensitive(object, name);
    lum_json_add(object, name, value);
}

/* Builds the minimal record with one field replaced; what excludes it makes way. */
static struct lum_record *with(enum lum_record_type type, const char *name, cJSON *value, struct lum_proto_error *err)
{
    cJSON *op = minimal_record(type);
    const struct lum_fields *t = lum_fields_of(type);
    const struct lum_field *f = lum_fields_find(t, name);
    for (size_t i = 0; f && f->group && i < t->n; i++)
        if (t->fields[i].group == f->group)
            cJSON_DeleteItemFromObjectCaseSensitive(op, t->fields[i].name);
    put(fields_of(op), name, value);
    memset(err, 0, sizeof *err);
    struct lum_record *r = record_of(op, err);
    cJSON_Delete(op);
    return r;
}

static void expect_refused(enum lum_record_type type, const struct lum_field *f, cJSON *value, const char *app)
{
    struct lum_proto_error err;
    char *text = lum_json_print(value, NULL);
    struct lum_record *r = with(type, f->name, value, &err);
    if (r)
        fail_msg("%s/%s accepted %.80s", lum_record_type_names[type], f->name, text);
    if (strncmp(err.path, f->name, strlen(f->name)) != 0 || strcmp(err.app, app) != 0 || !err.text[0])
        fail_msg("%s/%s with %.80s: %s at \"%s\": %s", lum_record_type_names[type], f->name, text, err.app, err.path,
                 err.text);
    free(text);
}

/* Accepted by the field; rules that span fields may still say no, under another code path. */
static void expect_inside(enum lum_record_type type, const struct lum_field *f, cJSON *value)
{
    struct lum_proto_error err;
    struct lum_record *r = with(type, f->name, value, &err);
    if (!r && err.has_range)
        fail_msg("%s/%s: %s", lum_record_type_names[type], f->name, err.text);
    lum_record_unref(r);
}

static void minimal_records_are_valid(void **state)
{
    (void)state;
    for (int type = 0; type < LUM_RECORD_TYPE_COUNT; type++) {
        struct lum_proto_error err;
        cJSON *op = minimal_record(type);
        struct lum_record *r = record_of(op, &err);
        if (!r)
            fail_msg("%s: %s", lum_record_type_names[type], err.text);
        lum_record_unref(r);
        cJSON_Delete(op);
    }
}

static void required_fields(void **state)
{
    (void)state;
    for (int type = 0; type < LUM_RECORD_TYPE_COUNT; type++)
        for (size_t i = 0; i < lum_fields_of(type)->n; i++) {
            const struct lum_field *f = &lum_fields_of(type)->fields[i];
            if (!(f->flags & LUM_FIELD_REQUIRED))
                continue;
            struct lum_proto_error err;
            cJSON *op = minimal_record(type);
            cJSON_DeleteItemFromObjectCaseSensitive(op, f->name);
            assert_null(record_of(op, &err));
            assert_string_equal(err.app, "missing_field");
            assert_string_equal(err.path, f->name);
            cJSON_Delete(op);
            expect_refused(type, f, cJSON_CreateNull(), "invalid_value");
        }
}

static void unknown_fields_are_named(void **state)
{
    (void)state;
    for (int type = 0; type < LUM_RECORD_TYPE_COUNT; type++)
        for (size_t i = 0; i < lum_fields_of(type)->n; i++) {
            char name[64], want[80];
            struct lum_proto_error err;
            snprintf(name, sizeof name, "%sx", lum_fields_of(type)->fields[i].name);
            if (lum_fields_find(lum_fields_of(type), name))
                continue;
            assert_null(with(type, name, cJSON_CreateNumber(1), &err));
            assert_string_equal(err.app, "unknown_field");
            assert_string_equal(err.path, name);
            snprintf(want, sizeof want, "did you mean \"%s\"", lum_fields_of(type)->fields[i].name);
            if (strlen(name) > 3)
                assert_non_null(strstr(err.text, want));
        }
}

/* True when a JSON value of this sort can be right for the field. */
static bool may_be(const struct lum_field *f, const cJSON *v)
{
    switch (f->kind) {
    case LUM_FIELD_NUMBER:
    case LUM_FIELD_INTEGER:
    case LUM_FIELD_U32:
    case LUM_FIELD_OPT:
        return cJSON_IsNumber(v);
    case LUM_FIELD_BOOL:
        return cJSON_IsBool(v);
    case LUM_FIELD_CHOICE:
    case LUM_FIELD_NAME:
    case LUM_FIELD_TEXT:
    case LUM_FIELD_ASSET:
    case LUM_FIELD_ID:
    case LUM_FIELD_REF:
    case LUM_FIELD_PIXELS:
        return cJSON_IsString(v);
    case LUM_FIELD_TRANSFORM:
        return cJSON_IsObject(v); /* {} is the identity */
    default:
        return false;
    }
}

static void wrong_types(void **state)
{
    static const char *const values[] = {"true", "7", "'text'", "[]", "{}", "['a','b','c']", "[[1],2,3]", "[null,1,2]"};
    (void)state;
    for (int type = 0; type < LUM_RECORD_TYPE_COUNT; type++)
        for (size_t i = 0; i < lum_fields_of(type)->n; i++)
            for (size_t k = 0; k < sizeof values / sizeof values[0]; k++) {
                const struct lum_field *f = &lum_fields_of(type)->fields[i];
                cJSON *v = json_of(values[k]);
                bool array = f->kind == LUM_FIELD_FLOATS || f->kind == LUM_FIELD_INDICES || f->kind == LUM_FIELD_LAMPS;
                if (may_be(f, v) || (array && cJSON_IsArray(v) && !v->child))
                    cJSON_Delete(v);
                else if (f->kind == LUM_FIELD_TEXTURE && cJSON_IsObject(v))
                    expect_refused(type, f, v, "missing_field");
                else if ((f->kind == LUM_FIELD_BOX || f->kind == LUM_FIELD_WEB) && cJSON_IsObject(v))
                    expect_refused(type, f, v, "missing_field");
                else
                    expect_refused(type, f, v, "invalid_value");
            }
}

static cJSON *vector_with(const struct lum_field *f, unsigned at, double v)
{
    double values[16];
    for (unsigned i = 0; i < f->n; i++)
        values[i] = f->min > 1.0 || f->max < 1.0 ? f->min : 1.0;
    values[at] = v;
    return cJSON_CreateDoubleArray(values, (int)f->n);
}

static void limits_of_numbers(void **state)
{
    (void)state;
    for (int type = 0; type < LUM_RECORD_TYPE_COUNT; type++)
        for (size_t i = 0; i < lum_fields_of(type)->n; i++) {
            const struct lum_field *f = &lum_fields_of(type)->fields[i];
            const double in[] = {f->min, f->max, nextafter(f->min, f->max), nextafter(f->max, f->min)};
            const double out[] = {nextafter(f->min, -INFINITY), nextafter(f->max, INFINITY), -1e308, 1e308};
            bool scalar = f->kind == LUM_FIELD_NUMBER || f->kind == LUM_FIELD_INTEGER || f->kind == LUM_FIELD_U32 ||
                          f->kind == LUM_FIELD_OPT;
            for (int k = 0; scalar && k < 4; k++) {
                expect_refused(type, f, cJSON_CreateNumber(out[k]), "invalid_value");
                if (k < 2 || f->kind == LUM_FIELD_NUMBER || f->kind == LUM_FIELD_OPT)
                    expect_inside(type, f, cJSON_CreateNumber(in[k]));
                else
                    expect_refused(type, f, cJSON_CreateNumber(in[k]), "invalid_value"); /* not whole */
            }
            for (unsigned e = 0; f->kind == LUM_FIELD_VECTOR && e < f->n; e++)
                for (int k = 0; k < 4; k++) {
                    expect_refused(type, f, vector_with(f, e, out[k]), "invalid_value");
                    if (k < 2)
                        expect_inside(type, f, vector_with(f, e, in[k]));
                }
            if (f->kind == LUM_FIELD_VECTOR) {
                double one_more[17] = {0};
                expect_refused(type, f, cJSON_CreateDoubleArray(one_more, (int)f->n + 1), "invalid_value");
                expect_refused(type, f, cJSON_CreateDoubleArray(one_more, (int)f->n - 1), "invalid_value");
            }
        }
}

static void lengths_of_texts(void **state)
{
    (void)state;
    char text[400];
    for (int type = 0; type < LUM_RECORD_TYPE_COUNT; type++)
        for (size_t i = 0; i < lum_fields_of(type)->n; i++) {
            const struct lum_field *f = &lum_fields_of(type)->fields[i];
            if (f->kind != LUM_FIELD_ID && f->kind != LUM_FIELD_REF && f->kind != LUM_FIELD_ASSET)
                continue;
            for (int d = -1; d <= 1; d++) {
                memset(text, 'a', sizeof text);
                text[(int)f->n - 1 + d] = '\0';
                if (d <= 0)
                    expect_inside(type, f, cJSON_CreateString(text));
                else
                    expect_refused(type, f, cJSON_CreateString(text), "invalid_value");
            }
        }
}

static void assets_stay_below_their_root(void **state)
{
    static const char *const bad[] = {"/etc/passwd", "../x", "a/../b", "a//b", "./a", "a/.", "a/", "", "a\\b", "a\x01"};
    (void)state;
    const struct lum_field *f = lum_fields_find(lum_fields_of(LUM_RECORD_IMPORT), "asset");
    for (size_t i = 0; i < sizeof bad / sizeof bad[0]; i++)
        expect_refused(LUM_RECORD_IMPORT, f, cJSON_CreateString(bad[i]), "invalid_value");
    struct lum_proto_error err;
    struct lum_record *r = with(LUM_RECORD_IMPORT, "asset", cJSON_CreateString("Räume/Raum 1..glb"), &err);
    assert_non_null(r);
    lum_record_unref(r);
}

static void lamps_of_presets(void **state)
{
    static const struct {
        const char *value, *app, *path; /* app NULL: it is right */
    } cases[] = {
        {"[]", NULL, NULL},
        {"[{'id':'a'},{'id':'b','on':false,'flux_lm':5,'color':[1,0,0]}]", NULL, NULL},
        {"[{'id':'a','luminance_cd_m2':0,'cct_k':2700}]", NULL, NULL},
        {"[{}]", "missing_field", "lamps/0/id"},
        {"[{'id':'a'},{'id':'b','flux_lm':-1}]", "invalid_value", "lamps/1/flux_lm"},
        {"[{'id':'a','flux_lmm':1}]", "unknown_field", "lamps/0/flux_lmm"},
        {"[{'id':'a','flux_lm':1,'intensity_cd':1}]", "invalid_value", "lamps"},
        {"[{'id':'a','cct_k':3000,'color':[1,1,1]}]", "invalid_value", "lamps"},
        {"[{'id':'a'},{'id':'b'},{'id':'a'}]", "invalid_value", "lamps"},
        {"[7]", "invalid_value", "lamps/0"},
    };
    (void)state;
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        struct lum_proto_error err = {0};
        struct lum_record *r = with(LUM_RECORD_PRESET, "lamps", json_of(cases[i].value), &err);
        if ((r != NULL) != (cases[i].app == NULL) ||
            (!r && (strcmp(err.app, cases[i].app) != 0 || strcmp(err.path, cases[i].path) != 0)))
            fail_msg("%s: %s at \"%s\": %s", cases[i].value, err.app, err.path, err.text);
        struct lum_record *copy = r ? lum_record_clone(r) : NULL;
        cJSON *text = r ? lum_record_to_json(r, true) : NULL; /* short enough for all */
        cJSON *lamps = cJSON_GetObjectItemCaseSensitive(text, "lamps"), *given = json_of(cases[i].value);
        if (copy)
            assert_true(lum_lamps_equal(&copy->preset.lamps, &r->preset.lamps));
        assert_int_equal(r ? cJSON_GetArraySize(lamps) : 0, r ? cJSON_GetArraySize(given) : 0);
        cJSON_Delete(given);
        cJSON_Delete(text);
        lum_record_unref(copy);
        lum_record_unref(r);
    }
}

/* Random valid records of every type: to JSON, to text, and back, give the same record and the same text. */
static void encode_and_decode_are_inverse(void **state)
{
    (void)state;
    unsigned kept = 0;
    for (uint64_t seed = 0; seed < 4000; seed++) {
        struct rng rng = {seed};
        int type = (int)rng_below(&rng, LUM_RECORD_TYPE_COUNT);
        const struct lum_fields *t = lum_fields_of(type);
        cJSON *op = minimal_record(type);
        for (size_t i = 0; i < t->n; i++) {
            const struct lum_field *f = &t->fields[i];
            if (rng_below(&rng, 3) == 0 && !lum_field_is_bulk(f) && !f->group && strcmp(f->name, "shape") != 0)
                put(fields_of(op), f->name, random_value(&rng, f));
        }
        struct lum_proto_error err;
        struct lum_record *r = record_of(op, &err);
        cJSON_Delete(op);
        if (!r)
            continue;
        kept++;
        cJSON *json = lum_record_to_json(r, false), *parsed;
        char *text = lum_json_print(json, NULL);
        parsed = lum_json_parse(text, strlen(text), &err);
        struct lum_record *again = parsed ? record_of(parsed, &err) : NULL;
        if (!again || !records_equal(r, again))
            fail_msg("seed %llu: %s: %s", (unsigned long long)seed, text, again ? "differs" : err.text);
        struct lum_record *clone = lum_record_clone(r);
        assert_true(records_equal(r, clone));
        lum_record_unref(clone);
        lum_record_unref(again);
        lum_record_unref(r);
        cJSON_Delete(json);
        cJSON_Delete(parsed);
        free(text);
    }
    assert_true(kept > 2000); /* the generator must not degenerate into refusals */
}

static void bulk_data_comes_back(void **state)
{
    static const char *const ops[] = {
        "{'op':'add','type':'mesh','id':'x','positions':[0,0.1,0,1e-9,0,0,0,1,0],'indices':[0,1,2],"
        "'normals':[0,0,1,0,0,1,0,0.5,1],'uvs':[0,0,1,0,0.1,1],'tangents':[1,0,0,1,1,0,0,-1,0.1,0,1,1],"
        "'colors':[1,0,0,0,1,0,0.3,0,1],'deforming':true}",
        "{'op':'add','type':'image','id':'x','width':2,'height':1,'pixels':'AQIDBAUGBwg='}",
        "{'op':'add','type':'image','id':'x','width':1,'height':1,'texel':'rgb32f','pixels':'AACAPwAAAEAAAEBA'}",
        "{'op':'add','type':'image','id':'x','asset':'a/b.png'}",
        "{'op':'add','type':'mesh','id':'x','shape':'sphere','segments':[64,32]}",
        "{'op':'add','type':'light','id':'x','kind':'quad','luminance_cd_m2':5,'cct_k':3000}",
    };
    (void)state;
    for (size_t i = 0; i < sizeof ops / sizeof ops[0]; i++) {
        struct lum_proto_error err = {0};
        cJSON *op = json_of(ops[i]);
        struct lum_record *r = record_of(op, &err);
        if (!r)
            fail_msg("%s: %s", ops[i], err.text);
        cJSON *json = lum_record_to_json(r, false);
        struct lum_record *again = record_of(json, &err);
        assert_non_null(again);
        assert_true(records_equal(r, again));
        lum_record_unref(again);
        lum_record_unref(r);
        cJSON_Delete(json);
        cJSON_Delete(op);
    }
}

static void blobs_are_for_importers_only(void **state)
{
    (void)state;
    const float xyz[9] = {0, 0, 0, 1, 0, 0, 0, 1, 0};
    const uint32_t tri[3] = {0, 1, 2};
    const struct lum_blob list[2] = {{(const uint8_t *)xyz, sizeof xyz, NULL},
                                     {(const uint8_t *)tri, sizeof tri, NULL}};
    const struct lum_blobs blobs = {list, 2};
    struct lum_proto_error err;
    struct lum_op op;
    cJSON *json = json_of("{'op':'add','type':'mesh','id':'x','positions':{'blob':0},'indices':{'blob':1}}");
    assert_false(lum_op_from_json(json, NULL, &op, &err));
    assert_true(lum_op_from_json(json, &blobs, &op, &err));
    assert_int_equal(op.record->mesh.positions.n, 9);
    assert_true(op.record->mesh.positions.f32[3] == 1.0f);
    lum_op_finish(&op);
    put(json, "indices", json_of("{'blob':2}"));
    assert_false(lum_op_from_json(json, &blobs, &op, &err));
    put(json, "indices", json_of("{'blob':0.5}"));
    assert_false(lum_op_from_json(json, &blobs, &op, &err));
    put(json, "indices", json_of("[0,1,3]"));
    assert_false(lum_op_from_json(json, &blobs, &op, &err));
    const float bad[9] = {0, 0, 0, NAN, 0, 0, 0, 1, 0};
    const struct lum_blob bad_list[1] = {{(const uint8_t *)bad, sizeof bad, NULL}};
    put(json, "indices", json_of("[0,1,2]"));
    assert_false(lum_op_from_json(json, &(struct lum_blobs){bad_list, 1}, &op, &err));
    assert_string_equal(err.path, "positions/3");
    cJSON_Delete(json);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(minimal_records_are_valid),
        cmocka_unit_test(required_fields),
        cmocka_unit_test(unknown_fields_are_named),
        cmocka_unit_test(wrong_types),
        cmocka_unit_test(limits_of_numbers),
        cmocka_unit_test(lengths_of_texts),
        cmocka_unit_test(assets_stay_below_their_root),
        cmocka_unit_test(lamps_of_presets),
        cmocka_unit_test(encode_and_decode_are_inverse),
        cmocka_unit_test(bulk_data_comes_back),
        cmocka_unit_test(blobs_are_for_importers_only),
    };
    return cmocka_run_group_tests_name("record", tests, NULL, NULL);
}

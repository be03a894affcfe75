/* Every field of every record type, from the tables themselves. */
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

#include "protocol/json.h"
#include "tests/unit/protocol_util.h"

/* The record that an op makes, or NULL. A set of render is applied to a fresh one. */
static struct lum_record *record_of(const cJSON *json, struct lum_proto_error *err)
{
    struct lum_op op;
    struct lum_record *r = NULL;
    if (!lum_op_from_json(json, NULL, &op, err))
        return NULL;
    if (op.kind == LUM_OP_SET) {
        r = lum_record_create(LUM_RECORD_RENDER, "render");
        if (!lum_record_set(r, op.path, op.value, err)) {
            lum_record_unref(r);
            r = NULL;
        }
    } else {
        r = lum_record_ref(op.record);
    }
    lum_op_finish(&op);
    return r;
}

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
            snprintf(want, sizeof want, "did you mean \"%s\"?", lum_fields_of(type)->fields[i].name);
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
                bool empty_bulk = lum_field_is_bulk(f) && cJSON_IsArray(v) && !v->child;
                if (may_be(f, v) || (empty_bulk && f->kind != LUM_FIELD_PIXELS))
                    cJSON_Delete(v);
                else if (f->kind == LUM_FIELD_TEXTURE && cJSON_IsObject(v))
                    expect_refused(type, f, v, "missing_field");
                else if (f->kind == LUM_FIELD_BOX && cJSON_IsObject(v))
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
        "'normals':[0,0,1,0,0,1,0,0.5,1],'uvs':[0,0,1,0,0.1,1],'colors':[1,0,0,0,1,0,0.3,0,1],'deforming':true}",
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
    const struct lum_blob list[2] = {{(const uint8_t *)xyz, sizeof xyz}, {(const uint8_t *)tri, sizeof tri}};
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
    const struct lum_blob bad_list[1] = {{(const uint8_t *)bad, sizeof bad}};
    put(json, "indices", json_of("[0,1,2]"));
    assert_false(lum_op_from_json(json, &(struct lum_blobs){bad_list, 1}, &op, &err));
    assert_string_equal(err.path, "positions/3");
    cJSON_Delete(json);
}

/* ---- rules that span fields ---- */

static void expect(const char *text, const char *app, const char *path)
{
    struct lum_proto_error err = {0};
    cJSON *op = json_of(text);
    struct lum_record *r = record_of(op, &err);
    if ((r != NULL) != (app == NULL))
        fail_msg("%s: %s", text, r ? "accepted" : err.text);
    if (app && (strcmp(err.app, app) != 0 || strcmp(err.path, path) != 0))
        fail_msg("%s: %s at \"%s\": %s", text, err.app, err.path, err.text);
    lum_record_unref(r);
    cJSON_Delete(op);
}

static void photometric_quantities(void **state)
{
    static const struct {
        const char *kind, *natural;
    } kinds[] = {{"point", " flux_lm intensity_cd "},   {"spot", " flux_lm intensity_cd "},
                 {"directional", " illuminance_lx "},   {"quad", " flux_lm luminance_cd_m2 "},
                 {"disc", " flux_lm luminance_cd_m2 "}, {"sphere", " flux_lm luminance_cd_m2 "},
                 {"environment", " luminance_cd_m2 "}};
    static const char *const names[] = {"flux_lm", "intensity_cd", "luminance_cd_m2", "illuminance_lx"};
    (void)state;
    for (size_t k = 0; k < 7; k++) {
        char text[200], path[40];
        snprintf(text, sizeof text, "{'op':'add','type':'light','id':'x','kind':'%s'}", kinds[k].kind);
        sscanf(kinds[k].natural, "%39s", path);
        expect(text, "missing_field", path);
        for (int i = 0; i < 4; i++) {
            snprintf(path, sizeof path, " %s ", names[i]);
            bool natural = strstr(kinds[k].natural, path);
            snprintf(text, sizeof text, "{'op':'add','type':'light','id':'x','kind':'%s','%s':5}", kinds[k].kind,
                     names[i]);
            expect(text, natural ? NULL : "invalid_value", names[i]);
            for (int j = 0; j < 4; j++)
                if (i != j) {
                    snprintf(text, sizeof text, "{'op':'add','type':'light','id':'x','kind':'%s','%s':5,'%s':5}",
                             kinds[k].kind, names[i], names[j]);
                    expect(text, "invalid_value", names[i]);
                }
        }
    }
}

static void rules(void **state)
{
    (void)state;
#define LIGHT "{'op':'add','type':'light','id':'x',"
#define MESH "{'op':'add','type':'mesh','id':'x',"
#define OBJECT "{'op':'add','type':'object','id':'x','mesh':'m','material':'w','transform':"
#define CAMERA "{'op':'add','type':'camera','id':'x','position':[0,0,0],"
    expect(LIGHT "'kind':'quad','flux_lm':1,'u':[1,0,0],'v':[2,0,0]}", "invalid_value", "u");
    expect(LIGHT "'kind':'disc','flux_lm':1,'radius':0}", "invalid_value", "radius");
    expect(LIGHT "'kind':'point','flux_lm':1,'radius':0}", NULL, NULL);
    expect(LIGHT "'kind':'spot','flux_lm':1,'direction':[0,0,0]}", "invalid_value", "direction");
    expect(LIGHT "'kind':'spot','flux_lm':1,'inner_cone_deg':50,'outer_cone_deg':49}", "invalid_value",
           "inner_cone_deg");
    expect(LIGHT "'kind':'spot','flux_lm':1,'inner_cone_deg':49,'outer_cone_deg':49}", NULL, NULL);
    expect(LIGHT "'kind':'point','flux_lm':1,'color':[0,0,0]}", "invalid_value", "color");
    expect(LIGHT "'kind':'point','flux_lm':1,'color':[1,0,0],'cct_k':3000}", "invalid_value", "color");
    expect(LIGHT "'kind':'point','flux_lm':1,'image':'sky'}", "invalid_value", "image");
    expect(MESH "'shape':'box','positions':[0,0,0],'indices':[0,0,0]}", "invalid_value", "shape");
    expect(MESH "'deforming':true}", "invalid_value", "shape");
    expect(MESH "'positions':[0,0,0,1],'indices':[0,0,0]}", "invalid_value", "positions");
    expect(MESH "'positions':[0,0,0],'indices':[0,0,1]}", "invalid_value", "indices");
    expect(MESH "'positions':[0,0,0],'indices':[0,0]}", "invalid_value", "indices");
    expect(MESH "'positions':[0,0,0]}", "invalid_value", "indices");
    expect(MESH "'positions':[0,0,0],'indices':[0,0,0],'uvs':[1]}", "invalid_value", "uvs");
    expect(MESH "'positions':[0,0,0],'indices':[0,0,0],'normals':[1]}", "invalid_value", "normals");
    expect(MESH "'positions':[0,0,0],'indices':[0,0,0],'colors':[1]}", "invalid_value", "colors");
    expect(OBJECT "{'scale':[1,0,1]}}", "invalid_value", "transform");
    expect(OBJECT "[1,0,0,0,0,1,0,0,0,0,1,0,0,0,0,1]}", NULL, NULL);
    expect(OBJECT "[1,0,0,0,0,1,0,0,0,0,1,0,0,0,1,1]}", "invalid_value", "transform");
    expect(OBJECT "[1,0,0,0,0,1,0,0,0,0,0,0,0,0,0,1]}", "invalid_value", "transform");
    expect(OBJECT "{'translate':[1,2,1e10]}}", "invalid_value", "transform/translate/2");
    expect(OBJECT "{'rotate':[1,2,3]}}", "unknown_field", "transform/rotate");
    expect(CAMERA "'target':[0,0,0]}", "invalid_value", "target");
    expect(CAMERA "'target':[0,5,0]}", "invalid_value", "up");
    expect(CAMERA "'target':[0,5,0],'up':[0,0,0]}", "invalid_value", "up");
    expect("{'op':'add','type':'medium','id':'x','box':{'min':[0,0,0],'max':[1,0,1]}}", "invalid_value", "box");
    expect("{'op':'add','type':'medium','id':'x','box':{'min':[0,0,0],'max':[1,1,1]}}", NULL, NULL);
    expect("{'op':'add','type':'image','id':'x'}", "invalid_value", "asset");
    expect("{'op':'add','type':'image','id':'x','width':2,'height':2,'pixels':'AQIDBA=='}", "invalid_value", "pixels");
    expect("{'op':'add','type':'image','id':'x','width':1,'height':1,'pixels':'AQIDB'}", "invalid_value", "pixels");
    expect("{'op':'add','type':'image','id':'x','width':1,'height':1,'texel':'rgb32f','pixels':'AADAfwAAAEAAAEBA'}",
           "invalid_value", "pixels"); /* a NaN */
    for (int n = 1; n <= 16; n++) {
        char text[120];
        bool square = n == 1 || n == 4 || n == 9 || n == 16;
        snprintf(text, sizeof text, "{'op':'set','id':'render','path':'','value':{'shadow_samples':%d}}", n);
        expect(text, square ? NULL : "invalid_value", "shadow_samples");
    }
}

static void malformed_ops(void **state)
{
    static const struct {
        const char *text, *app, *path;
    } cases[] = {
        {"{}", "missing_field", "op"},
        {"{'op':'move','id':'x'}", "invalid_value", "op"},
        {"{'op':1,'id':'x'}", "invalid_value", "op"},
        {"{'op':'remove'}", "missing_field", "id"},
        {"{'op':'remove','id':'a b'}", "invalid_value", "id"},
        {"{'op':'remove','id':'x','path':'/y'}", "unknown_field", "path"},
        {"{'op':'add','id':'x'}", "missing_field", "type"},
        {"{'op':'add','type':'lamp','id':'x'}", "invalid_value", "type"},
        {"{'op':'add','type':'render','id':'x'}", "invalid_value", "type"},
        {"{'op':'add','type':'import','id':'x','asset':'a'}", "invalid_value", "type"},
        {"{'op':'add','type':'medium','id':'x','t_ms':5}", "unknown_field", "t_ms"},
        {"{'op':'set','id':'x','value':1}", "missing_field", "path"},
        {"{'op':'set','id':'x','path':'/y'}", "missing_field", "value"},
        {"{'op':'set','id':'x','path':7,'value':1}", "invalid_value", "path"},
        {"{'op':'set','id':'x','path':'/y','value':1,'type':'light'}", "unknown_field", "type"},
        {"{'op':'import','id':'x'}", "missing_field", "asset"},
        {"{'op':'import','id':'x','asset':'a','type':'mesh'}", "unknown_field", "type"},
    };
    (void)state;
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++)
        expect(cases[i].text, cases[i].app, cases[i].path);
    char text[200], id[LUM_LIMIT_IMPORT_ID_BYTES + 2];
    for (int d = -1; d <= 1; d++) {
        memset(id, 'a', sizeof id);
        id[LUM_LIMIT_IMPORT_ID_BYTES + d] = '\0';
        snprintf(text, sizeof text, "{'op':'import','id':'%s','asset':'a.glb'}", id);
        expect(text, d <= 0 ? NULL : "limit_exceeded", "id");
    }
}

/* ---- set by path ---- */

static void sets(void **state)
{
    static const struct {
        enum lum_record_type type;
        const char *path, *value, *app, *err_path;
    } cases[] = {
        {LUM_RECORD_LIGHT, "/flux_lm", "900", NULL, NULL},
        {LUM_RECORD_LIGHT, "/flux_lm", "-1", "invalid_value", "flux_lm"},
        {LUM_RECORD_LIGHT, "/flux_lmm", "1", "unknown_field", "flux_lmm"},
        {LUM_RECORD_LIGHT, "/flux_lm", "null", "missing_field", "flux_lm"},
        {LUM_RECORD_LIGHT, "/intensity_cd", "5", NULL, NULL},
        {LUM_RECORD_LIGHT, "/illuminance_lx", "5", "invalid_value", "illuminance_lx"},
        {LUM_RECORD_LIGHT, "/position/1", "5", NULL, NULL},
        {LUM_RECORD_LIGHT, "/position/3", "5", "not_found", "path"},
        {LUM_RECORD_LIGHT, "/position/1", "2e9", "invalid_value", "position"},
        {LUM_RECORD_LIGHT, "", "{'kind':'quad','luminance_cd_m2':7,'u':[2,0,0]}", NULL, NULL},
        {LUM_RECORD_LIGHT, "", "{'kind':'quad'}", NULL, NULL}, /* flux suits a quad too */
        {LUM_RECORD_LIGHT, "", "{'kind':'environment'}", "invalid_value", "flux_lm"},
        {LUM_RECORD_LIGHT, "", "7", "invalid_value", "value"},
        {LUM_RECORD_LIGHT, "/", "7", "unknown_field", ""},
        {LUM_RECORD_LIGHT, "flux_lm", "7", "not_found", "path"},
        {LUM_RECORD_LIGHT, "/flux_lm/x", "7", "not_found", "path"},
        {LUM_RECORD_LIGHT, "/id", "'y'", "unknown_field", "id"},
        {LUM_RECORD_LIGHT, "/type", "'y'", "unknown_field", "type"},
        {LUM_RECORD_OBJECT, "/transform/translate", "[1,2,3]", NULL, NULL},
        {LUM_RECORD_OBJECT, "/transform/translate/2", "3", NULL, NULL},
        {LUM_RECORD_OBJECT, "/transform/translate/2/0", "3", "not_found", "transform/path"},
        {LUM_RECORD_OBJECT, "/transform/moved", "3", "unknown_field", "transform/moved"},
        {LUM_RECORD_OBJECT, "/transform/scale/0", "0", "invalid_value", "transform"},
        {LUM_RECORD_OBJECT, "/transform", "[1,0,0,0,0,1,0,0,0,0,1,0,0,0,0,1]", NULL, NULL},
        {LUM_RECORD_MATERIAL, "/base_color_texture", "{'image':'i','scale':[2,2]}", NULL, NULL},
        {LUM_RECORD_MATERIAL, "/base_color_texture/scale", "[2,2]", "not_found", "path"},
        {LUM_RECORD_MESH, "/positions/0", "3", "not_found", "path"},
        {LUM_RECORD_MESH, "/positions", "[0,0,0,1,0,0,0,2,0]", NULL, NULL},
        {LUM_RECORD_MESH, "/positions", "[0,0,0]", "invalid_value", "indices"},
        {LUM_RECORD_MESH, "/positions", "{'blob':0}", "invalid_value", "positions"},
        {LUM_RECORD_RENDER, "/exposure_ev", "null", NULL, NULL},
        {LUM_RECORD_RENDER, "/exposure_ev", "31", "invalid_value", "exposure_ev"},
        {LUM_RECORD_MEDIUM, "/box/min", "[0,0,0]", "not_found", "path"},
    };
    (void)state;
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        struct lum_proto_error err = {0};
        cJSON *op = minimal_record(cases[i].type), *value = json_of(cases[i].value);
        struct lum_record *r = record_of(op, &err);
        bool ok = lum_record_set(r, cases[i].path, value, &err);
        if (ok != (cases[i].app == NULL))
            fail_msg("%s = %s: %s", cases[i].path, cases[i].value, ok ? "accepted" : err.text);
        if (!ok && (strcmp(err.app, cases[i].app) || strncmp(err.path, cases[i].err_path, strlen(cases[i].err_path))))
            fail_msg("%s = %s: %s at \"%s\": %s", cases[i].path, cases[i].value, err.app, err.path, err.text);
        lum_record_unref(r);
        cJSON_Delete(op);
        cJSON_Delete(value);
    }
}

static void one_photometric_quantity_replaces_another(void **state)
{
    (void)state;
    cJSON *op = minimal_record(LUM_RECORD_LIGHT), *five = cJSON_CreateNumber(5), *warm = cJSON_CreateNumber(2700);
    struct lum_record *r = record_of(op, NULL);
    assert_true(lum_record_set(r, "/intensity_cd", five, NULL));
    assert_true(r->light.intensity_cd.set && !r->light.flux_lm.set);
    assert_true(lum_record_set(r, "/cct_k", warm, NULL));
    cJSON *red = json_of("[1,0,0]");
    assert_true(lum_record_set(r, "/color", red, NULL));
    assert_true(!r->light.cct_k.set && r->light.color[1] == 0.0);
    cJSON_Delete(red);
    cJSON_Delete(warm);
    cJSON_Delete(five);
    cJSON_Delete(op);
    lum_record_unref(r);
}

/* Euler angles: about X first, then Y, then Z. */
static void rotation_order(void **state)
{
    (void)state;
    struct lum_record_transform t = {.rotate_deg = {90, 90, 0}, .scale = {1, 2, 1}, .translate = {1, 2, 3}};
    double m[3][4];
    lum_record_transform_affine(&t, m);
    /* the unit y axis: scaled to 2y, X turns it to 2z, Y turns 2z to 2x, then moved */
    const double want[3] = {2 + 1, 0 + 2, 0 + 3};
    for (int i = 0; i < 3; i++)
        assert_true(fabs(m[i][1] + m[i][3] - want[i]) < 1e-12); /* cos 90 deg is 6e-17, not 0 */
}

/* ---- .jsonl ---- */

static bool read_jsonl(const char *text, struct lum_ops *ops, struct lum_proto_error *err)
{
    memset(ops, 0, sizeof *ops);
    memset(err, 0, sizeof *err);
    return lum_ops_from_jsonl(text, strlen(text), ops, err);
}

static void jsonl(void **state)
{
    struct lum_ops ops;
    struct lum_proto_error err;
    (void)state;
    assert_true(read_jsonl("\n# a comment\n{\"lumend\":1,\"kind\":\"scene\",\"title\":\"t\"}\r\n  \n"
                           "{\"op\":\"remove\",\"id\":\"a\"}\n{\"op\":\"remove\",\"id\":\"b\"}",
                           &ops, &err));
    assert_int_equal(ops.n, 2);
    assert_null(ops.t_ms);
    lum_ops_finish(&ops);
    assert_true(read_jsonl("{\"lumend\":1,\"kind\":\"replay\"}\n{\"t_ms\":0,\"op\":\"remove\",\"id\":\"a\"}\n"
                           "{\"t_ms\":33.5,\"op\":\"set\",\"id\":\"b\",\"path\":\"/on\",\"value\":true}\n",
                           &ops, &err));
    assert_true(ops.n == 2 && ops.t_ms[1] == 33.5);
    lum_ops_finish(&ops);
    assert_true(read_jsonl("{\"lumend\":1,\"kind\":\"scene\"}", &ops, &err));
    lum_ops_finish(&ops);
    static const struct {
        const char *text, *line;
    } bad[] = {
        {"", "the first line"},
        {"{\"op\":\"remove\",\"id\":\"a\"}", "line 1:"},
        {"{\"lumend\":2,\"kind\":\"scene\"}", "line 1:"},
        {"{\"lumend\":1,\"kind\":\"film\"}", "line 1:"},
        {"{\"lumend\":1,\"kind\":\"scene\",\"tilte\":\"x\"}", "line 1:"},
        {"{\"lumend\":1,\"kind\":\"scene\"}\n\n{\"op\":\"remove\"}", "line 3:"},
        {"{\"lumend\":1,\"kind\":\"scene\"}\n{\"op\":\"remove\",\"id\":\"a\",\"t_ms\":1}", "line 2:"},
        {"{\"lumend\":1,\"kind\":\"replay\"}\n{\"op\":\"remove\",\"id\":\"a\"}", "line 2:"},
        {"{\"lumend\":1,\"kind\":\"replay\"}\n{\"op\":\"remove\",\"id\":\"a\",\"t_ms\":-1}", "line 2:"},
        {"{\"lumend\":1,\"kind\":\"replay\"}\n{\"op\":\"remove\",\"id\":\"a\",\"t_ms\":5}\n"
         "{\"op\":\"remove\",\"id\":\"a\",\"t_ms\":4}",
         "line 3:"},
        {"{\"lumend\":1,\"kind\":\"scene\"}\n{\"op\":\"remove\",\"id\":\"a\"", "line 2:"},
        {"{\"lumend\":1,\"kind\":\"scene\"}\n[]", "line 2:"},
    };
    for (size_t i = 0; i < sizeof bad / sizeof bad[0]; i++) {
        if (read_jsonl(bad[i].text, &ops, &err))
            fail_msg("accepted %s", bad[i].text);
        if (!strstr(err.text, bad[i].line))
            fail_msg("%s: %s", bad[i].text, err.text);
    }
}

static void ops_per_message(void **state)
{
    (void)state;
    for (int d = -1; d <= 1; d++) {
        cJSON *array = cJSON_CreateArray();
        for (int i = 0; i < (int)LUM_LIMIT_OPS_PER_MESSAGE + d; i++)
            lum_json_add(array, NULL, json_of("{'op':'remove','id':'a'}"));
        struct lum_ops ops;
        struct lum_proto_error err;
        bool ok = lum_ops_from_json(array, &ops, &err);
        assert_int_equal(ok, d <= 0);
        if (ok)
            lum_ops_finish(&ops);
        cJSON_Delete(array);
    }
    struct lum_proto_error err;
    struct lum_ops ops;
    cJSON *array = json_of("[{'op':'remove','id':'a'},{'op':'remove','id':'b'},{'op':'add','type':'light','id':'c','"
                           "kind':'point','flux_lm':-1}]");
    assert_false(lum_ops_from_json(array, &ops, &err));
    assert_string_equal(err.path, "ops/2/flux_lm");
    assert_true(err.has_range && err.min == 0.0 && err.max == 1e12);
    cJSON_Delete(array);
    array = json_of("[]");
    assert_false(lum_ops_from_json(array, &ops, &err));
    cJSON_Delete(array);
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
        cmocka_unit_test(encode_and_decode_are_inverse),
        cmocka_unit_test(bulk_data_comes_back),
        cmocka_unit_test(blobs_are_for_importers_only),
        cmocka_unit_test(photometric_quantities),
        cmocka_unit_test(rules),
        cmocka_unit_test(malformed_ops),
        cmocka_unit_test(sets),
        cmocka_unit_test(one_photometric_quantity_replaces_another),
        cmocka_unit_test(rotation_order),
        cmocka_unit_test(jsonl),
        cmocka_unit_test(ops_per_message),
    };
    return cmocka_run_group_tests_name("record", tests, NULL, NULL);
}

#include "tests/unit/protocol_util.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cjson/cJSON.h>

#include "protocol/json/json.h"

struct cJSON *json_of(const char *text)
{
    size_t n = strlen(text);
    char *copy = malloc(n + 1);
    for (size_t i = 0; i <= n; i++)
        copy[i] = text[i];
    for (size_t i = 0; i < n; i++)
        if (copy[i] == '\'')
            copy[i] = '"';
    struct lum_proto_error err = {0};
    cJSON *json = lum_json_parse(copy, n, &err);
    if (!json) {
        fprintf(stderr, "the test's own JSON is wrong: %s\n%s\n", err.text, copy);
        abort();
    }
    free(copy);
    return json;
}

struct cJSON *minimal_record(enum lum_record_type type)
{
    static const char *const texts[LUM_RECORD_TYPE_COUNT] = {
        [LUM_RECORD_MESH] = "{'op':'add','type':'mesh','id':'x','positions':[0,0,0,1,0,0,0,1,0],'indices':[0,1,2]}",
        [LUM_RECORD_IMAGE] = "{'op':'add','type':'image','id':'x','width':1,'height':1,'pixels':'AQIDBA=='}",
        [LUM_RECORD_MATERIAL] = "{'op':'add','type':'material','id':'x'}",
        [LUM_RECORD_OBJECT] = "{'op':'add','type':'object','id':'x','mesh':'m','material':'w'}",
        [LUM_RECORD_LIGHT] = "{'op':'add','type':'light','id':'x','kind':'point','flux_lm':800}",
        [LUM_RECORD_MEDIUM] = "{'op':'add','type':'medium','id':'x'}",
        [LUM_RECORD_CAMERA] = "{'op':'add','type':'camera','id':'x','position':[0,1,5],'target':[0,1,0]}",
        [LUM_RECORD_SENSOR] = "{'op':'add','type':'sensor','id':'x','kind':'point','position':[0,1,0]}",
        [LUM_RECORD_PATCH] = "{'op':'add','type':'patch','id':'x','target':'lamp'}",
        [LUM_RECORD_PRESET] = "{'op':'add','type':'preset','id':'x','lamps':[{'id':'lamp','flux_lm':5}]}",
        [LUM_RECORD_RENDER] = "{'op':'set','id':'render','path':'','value':{}}",
        [LUM_RECORD_IMPORT] = "{'op':'import','id':'x','asset':'room.glb'}",
    };
    return json_of(texts[type]);
}

uint32_t rng_below(struct rng *r, uint32_t n)
{
    uint64_t z = r->s += 0x9e3779b97f4a7c15u;
    z = (z ^ z >> 30) * 0xbf58476d1ce4e5b9u;
    z = (z ^ z >> 27) * 0x94d049bb133111ebu;
    return (uint32_t)((z ^ z >> 31) % n);
}

double rng_unit(struct rng *r)
{
    return (rng_below(r, 1u << 26) * 134217728.0 + rng_below(r, 1u << 27)) / 9007199254740992.0;
}

static double random_number(struct rng *r, const struct lum_field *f)
{
    bool whole = f->kind == LUM_FIELD_INTEGER || f->kind == LUM_FIELD_U32 || (f->flags & LUM_FIELD_WHOLE);
    switch (rng_below(r, 8)) {
    case 0:
        return f->min;
    case 1:
        return f->max;
    }
    double v = f->min + (f->max - f->min) * rng_unit(r);
    return whole ? (double)(int64_t)v : v;
}

static cJSON *random_word(struct rng *r, const char *words)
{
    char word[32];
    uint32_t n = 1;
    for (const char *p = words; *p; p++)
        n += *p == '|';
    for (uint32_t k = rng_below(r, n); k; k--)
        words = strchr(words, '|') + 1;
    snprintf(word, sizeof word, "%.*s", (int)strcspn(words, "|"), words);
    return cJSON_CreateString(word);
}

static cJSON *random_parts(struct rng *r, const struct lum_fields *parts)
{
    cJSON *object = cJSON_CreateObject();
    for (size_t i = 0; i < parts->n; i++)
        if ((parts->fields[i].flags & LUM_FIELD_REQUIRED) || rng_below(r, 2))
            lum_json_add(object, parts->fields[i].name, random_value(r, &parts->fields[i]));
    return object;
}

struct cJSON *random_value(struct rng *r, const struct lum_field *f)
{
    double v[16];
    switch (f->kind) {
    case LUM_FIELD_NUMBER:
    case LUM_FIELD_INTEGER:
    case LUM_FIELD_U32:
        return cJSON_CreateNumber(random_number(r, f));
    case LUM_FIELD_OPT:
        return rng_below(r, 4) ? cJSON_CreateNumber(random_number(r, f)) : cJSON_CreateNull();
    case LUM_FIELD_BOOL:
        return cJSON_CreateBool((int)rng_below(r, 2));
    case LUM_FIELD_VECTOR:
        for (unsigned i = 0; i < f->n; i++)
            v[i] = random_number(r, f);
        return cJSON_CreateDoubleArray(v, (int)f->n);
    case LUM_FIELD_CHOICE:
        return random_word(r, f->text);
    case LUM_FIELD_NAME:
        return random_word(r, "path|whitted|sphere");
    case LUM_FIELD_TEXT:
    case LUM_FIELD_ASSET:
        return random_word(r, "a.png|dir/b.hdr|Room 2.glb");
    case LUM_FIELD_ID:
    case LUM_FIELD_REF:
        return random_word(r, "m|w|group:1|Lamp_2/b.c-d");
    case LUM_FIELD_TRANSFORM:
    case LUM_FIELD_TEXTURE:
    case LUM_FIELD_BOX:
    case LUM_FIELD_PARTS:
        return random_parts(r, lum_field_parts(f));
    case LUM_FIELD_FLOATS:
    case LUM_FIELD_INDICES:
    case LUM_FIELD_PIXELS:
    case LUM_FIELD_WEB:
    case LUM_FIELD_LAMPS:
        break;
    }
    return NULL;
}

bool records_equal(const struct lum_record *a, const struct lum_record *b)
{
    const struct lum_fields *t = lum_fields_of(a->type);
    if (a->type != b->type || strcmp(a->id, b->id) != 0)
        return false;
    for (size_t i = 0; i < t->n; i++)
        if (!lum_field_equal(&t->fields[i], lum_record_body(a), lum_record_body(b))) {
            fprintf(stderr, "%s differs in %s\n", a->id, t->fields[i].name);
            return false;
        }
    return true;
}

char *document_text(const struct lum_document *doc)
{
    cJSON *json = lum_document_to_json(doc, false);
    char *text = json ? lum_json_print(json, NULL) : NULL;
    cJSON_Delete(json);
    return text;
}

bool apply_text(struct lum_document *doc, const char *user, const char *ops, struct lum_proto_error *err)
{
    cJSON *json = json_of(ops);
    struct lum_ops list = {0};
    struct lum_changes changes = {0};
    bool ok = lum_ops_from_json(json, &list, err) && lum_document_apply(doc, user, &list, NULL, 0, &changes, err);
    lum_changes_finish(&changes);
    lum_ops_finish(&list);
    cJSON_Delete(json);
    return ok;
}

struct wholeness {
    const struct lum_document *doc;
    bool ok;
};

static bool ref_is_whole(void *user, enum lum_record_type type, const char *id, const char *path)
{
    struct wholeness *w = user;
    const struct lum_record *r = lum_document_find(w->doc, id);
    (void)path;
    w->ok = w->ok && r && r->type == type;
    return w->ok;
}

static void record_is_whole(void *user, const struct lum_record *r)
{
    struct wholeness *w = user;
    lum_record_each_ref(r, ref_is_whole, w);
    const struct lum_record *import = r->origin[0] ? lum_document_find(w->doc, r->origin) : NULL;
    w->ok = w->ok && (!r->origin[0] || (import && import->type == LUM_RECORD_IMPORT)) && lum_record_validate(r, NULL);
}

bool document_whole(const struct lum_document *doc)
{
    struct wholeness w = {doc, true};
    return lum_document_each(doc, record_is_whole, &w) && w.ok;
}

struct lum_record *record_of(const cJSON *json, struct lum_proto_error *err)
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

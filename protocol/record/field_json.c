/* Field values from and to JSON; arrays in bulk are in field_bulk.c. */
#include "protocol/record/field.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#include <cjson/cJSON.h>

#include "protocol/json/json.h"

static bool wrong(const struct lum_field *f, struct lum_proto_error *err, const char *wanted)
{
    return lum_proto_fail(err, LUM_PROTO_BAD_PARAMS, "invalid_value", f->name, "%s must be %s", f->name, wanted);
}

/* ---- reading ---- */

static bool in_range(const struct lum_field *f, const cJSON *json)
{
    return cJSON_IsNumber(json) && json->valuedouble >= f->min && json->valuedouble <= f->max;
}

static bool read_number(const struct lum_field *f, double *ret, const cJSON *json, struct lum_proto_error *err)
{
    if (!in_range(f, json))
        return lum_proto_fail_range(err, f->name, f->min, f->max);
    bool whole = f->kind == LUM_FIELD_INTEGER || f->kind == LUM_FIELD_U32;
    if (whole && json->valuedouble != floor(json->valuedouble))
        return wrong(f, err, "an integer");
    *ret = json->valuedouble;
    return true;
}

static bool read_vector(const struct lum_field *f, double *ret, const cJSON *json, struct lum_proto_error *err)
{
    char text[64];
    unsigned i = 0;
    if (!cJSON_IsArray(json) || cJSON_GetArraySize(json) != (int)f->n) {
        snprintf(text, sizeof text, "an array of %u numbers", f->n);
        return wrong(f, err, text);
    }
    for (const cJSON *c = json->child; c; c = c->next, i++) {
        snprintf(text, sizeof text, "%s/%u", f->name, i);
        if (!in_range(f, c))
            return lum_proto_fail_range(err, text, f->min, f->max);
        if ((f->flags & LUM_FIELD_WHOLE) && c->valuedouble != floor(c->valuedouble))
            return lum_proto_fail(err, LUM_PROTO_BAD_PARAMS, "invalid_value", text, "%s must be an integer", text);
        ret[i] = c->valuedouble;
    }
    return true;
}

static bool is_word_of(const char *words, const char *s)
{
    size_t n = strlen(s);
    for (const char *w = words; n && *w;) {
        size_t length = strcspn(w, "|");
        if (length == n && memcmp(w, s, n) == 0)
            return true;
        w += length + (w[length] == '|');
    }
    return false;
}

/* A relative path that stays below its root; the server walks it without following links on top of this. */
static bool is_asset(const char *s)
{
    if (s[0] == '/' || strchr(s, '\\'))
        return false;
    for (const char *p = s; *p; p++)
        if ((unsigned char)*p < 0x20)
            return false;
    for (const char *part = s;; part++) {
        size_t n = strcspn(part, "/");
        if (n == 0 || (n == 1 && part[0] == '.') || (n == 2 && part[0] == '.' && part[1] == '.'))
            return false;
        part += n;
        if (*part == '\0')
            return true;
    }
}

static bool read_text(const struct lum_field *f, char *ret, const cJSON *json, struct lum_proto_error *err)
{
    static const char name_charset[] = "abcdefghijklmnopqrstuvwxyz0123456789_-";
    const char *s = cJSON_IsString(json) ? json->valuestring : NULL;
    size_t n = s ? strlen(s) : 0;
    bool fits = s && n < f->n;
    if (f->kind == LUM_FIELD_CHOICE && !(fits && is_word_of(f->text, s)))
        return lum_proto_fail(err, LUM_PROTO_BAD_PARAMS, "invalid_value", f->name, "%s must be one of %s", f->name,
                              f->text);
    if (f->kind == LUM_FIELD_NAME && !(fits && strspn(s, name_charset) == n))
        return wrong(f, err, "a short name of a-z 0-9 _ -");
    if (f->kind == LUM_FIELD_ASSET && !(fits && is_asset(s)))
        return wrong(f, err, "a relative path below the asset root, at most 255 bytes, without ..");
    if ((f->kind == LUM_FIELD_ID || f->kind == LUM_FIELD_REF) && !(fits && lum_id_valid(s)))
        return wrong(f, err, "an id: 1 to 64 of the characters A-Z a-z 0-9 _ . : / -");
    memset(ret, 0, f->n);
    memcpy(ret, s, n);
    return true;
}

/* The members of an object into the parts of a texture, transform or box, which has been reset. */
static bool read_parts(const struct lum_field *f, void *base, const cJSON *json, struct lum_proto_error *err)
{
    const struct lum_fields *parts = lum_field_parts(f);
    if (!cJSON_IsObject(json))
        return wrong(f, err,
                     f->kind == LUM_FIELD_TRANSFORM ? "16 numbers or an object"
                     : f->kind == LUM_FIELD_PARTS   ? "an object"
                                                    : "an object or null");
    for (const cJSON *m = json->child; m; m = m->next) {
        const struct lum_field *part = lum_fields_find(parts, m->string);
        if (!part) {
            lum_fields_unknown(parts, m->string, err);
            return lum_proto_prefix(err, f->name);
        }
        if (!lum_field_read(part, base, m, NULL, err))
            return lum_proto_prefix(err, f->name);
    }
    for (size_t i = 0; i < parts->n; i++) {
        const char *name = parts->fields[i].name;
        if ((parts->fields[i].flags & LUM_FIELD_REQUIRED) && !cJSON_GetObjectItemCaseSensitive(json, name)) {
            lum_proto_fail(err, LUM_PROTO_BAD_PARAMS, "missing_field", name, "%s/%s is missing", f->name, name);
            return lum_proto_prefix(err, f->name);
        }
    }
    return true;
}

static bool read_transform(const struct lum_field *f, struct lum_record_transform *t, const cJSON *json,
                           struct lum_proto_error *err)
{
    static const struct lum_field matrix = {
        .name = "transform", .kind = LUM_FIELD_VECTOR, .n = 16, .min = -LUM_LIMIT_COORD_M, .max = LUM_LIMIT_COORD_M};
    if (!cJSON_IsArray(json))
        return read_parts(f, t, json, err);
    t->is_matrix = true;
    return read_vector(&matrix, t->matrix, json, err);
}

static bool nullable(const struct lum_field *f)
{
    switch (f->kind) {
    case LUM_FIELD_OPT:
    case LUM_FIELD_ASSET:
    case LUM_FIELD_ID:
    case LUM_FIELD_REF:
    case LUM_FIELD_TEXTURE:
    case LUM_FIELD_BOX:
    case LUM_FIELD_FLOATS:
    case LUM_FIELD_INDICES:
    case LUM_FIELD_PIXELS:
        return !(f->flags & LUM_FIELD_REQUIRED);
    case LUM_FIELD_VECTOR:
        return f->flags & LUM_FIELD_NULLABLE;
    default:
        return false;
    }
}

bool lum_field_read(const struct lum_field *f, void *base, const cJSON *json, const struct lum_blobs *blobs,
                    struct lum_proto_error *err)
{
    void *p = (char *)base + f->offset;
    if (cJSON_IsNull(json) && nullable(f)) {
        lum_field_reset(f, base);
        return true;
    }
    switch (f->kind) {
    case LUM_FIELD_NUMBER:
    case LUM_FIELD_INTEGER:
        return read_number(f, p, json, err);
    case LUM_FIELD_U32: {
        double v;
        if (!read_number(f, &v, json, err))
            return false;
        *(uint32_t *)p = (uint32_t)v;
        return true;
    }
    case LUM_FIELD_OPT:
        ((struct lum_opt *)p)->set = true;
        return read_number(f, &((struct lum_opt *)p)->value, json, err);
    case LUM_FIELD_BOOL:
        *(bool *)p = cJSON_IsTrue(json);
        return cJSON_IsBool(json) || wrong(f, err, "true or false");
    case LUM_FIELD_VECTOR:
        if (!read_vector(f, p, json, err))
            return false;
        return !(nullable(f) && lum_field_is_null(f, base)) || wrong(f, err, "null, or not all 0");
    case LUM_FIELD_CHOICE:
    case LUM_FIELD_NAME:
    case LUM_FIELD_ASSET:
    case LUM_FIELD_ID:
    case LUM_FIELD_REF:
        return read_text(f, p, json, err);
    case LUM_FIELD_FLOATS:
    case LUM_FIELD_INDICES:
    case LUM_FIELD_PIXELS:
        return lum_field_read_bulk(f, base, json, blobs, err);
    case LUM_FIELD_TRANSFORM:
        lum_field_reset(f, base);
        return read_transform(f, p, json, err);
    case LUM_FIELD_TEXTURE:
    case LUM_FIELD_PARTS:
        lum_field_reset(f, base);
        return read_parts(f, p, json, err);
    case LUM_FIELD_BOX:
        lum_field_reset(f, base);
        ((struct lum_record_box *)p)->set = true;
        return read_parts(f, p, json, err);
    }
    return false;
}

bool lum_field_take(const struct lum_field *f, void *base, struct lum_json_reader *r)
{
    const cJSON *m = f->kind == LUM_FIELD_OPT ? lum_json_any_member(r, f->name) : lum_json_member(r, f->name);
    if (!m)
        return false;
    return lum_field_read(f, base, m, NULL, r->err) || lum_json_fail(r);
}

/* ---- writing ---- */

static cJSON *write_parts(const struct lum_fields *parts, const void *base)
{
    cJSON *object = cJSON_CreateObject();
    for (size_t i = 0; object && i < parts->n; i++)
        if (!lum_json_add(object, parts->fields[i].name, lum_field_write(&parts->fields[i], base))) {
            cJSON_Delete(object);
            return NULL;
        }
    return object;
}

static cJSON *write_transform(const struct lum_record_transform *t)
{
    return t->is_matrix ? cJSON_CreateDoubleArray(t->matrix, 16) : write_parts(&lum_transform_fields, t);
}

struct cJSON *lum_field_write(const struct lum_field *f, const void *base)
{
    const void *p = (const char *)base + f->offset;
    if (lum_field_is_null(f, base))
        return cJSON_CreateNull();
    switch (f->kind) {
    case LUM_FIELD_NUMBER:
    case LUM_FIELD_INTEGER:
        return cJSON_CreateNumber(*(const double *)p);
    case LUM_FIELD_U32:
        return cJSON_CreateNumber(*(const uint32_t *)p);
    case LUM_FIELD_OPT:
        return cJSON_CreateNumber(((const struct lum_opt *)p)->value);
    case LUM_FIELD_BOOL:
        return cJSON_CreateBool(*(const bool *)p);
    case LUM_FIELD_VECTOR:
        return cJSON_CreateDoubleArray(p, (int)f->n);
    case LUM_FIELD_CHOICE:
    case LUM_FIELD_NAME:
    case LUM_FIELD_ASSET:
    case LUM_FIELD_ID:
    case LUM_FIELD_REF:
        return cJSON_CreateString(p);
    case LUM_FIELD_FLOATS:
    case LUM_FIELD_INDICES:
    case LUM_FIELD_PIXELS:
        return lum_field_write_bulk(f, base);
    case LUM_FIELD_TRANSFORM:
        return write_transform(p);
    case LUM_FIELD_TEXTURE:
    case LUM_FIELD_BOX:
    case LUM_FIELD_PARTS:
        return write_parts(lum_field_parts(f), p);
    }
    return NULL;
}

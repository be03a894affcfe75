/* Field values from and to JSON; arrays in bulk are in field_bulk.c. */
#include "protocol/record/field.h"

#include <string.h>

#include <cjson/cJSON.h>

#include "protocol/json/json.h"

static bool wrong(const struct lum_field *f, struct lum_proto_error *err, const char *wanted)
{
    return lum_proto_fail(err, LUM_PROTO_BAD_PARAMS, "invalid_value", f->name, "%s must be %s", f->name, wanted);
}

/* ---- reading ---- */

static struct lum_json_range range_of(const struct lum_field *f)
{
    bool whole = f->kind == LUM_FIELD_INTEGER || f->kind == LUM_FIELD_U32 || f->flags & LUM_FIELD_WHOLE;
    return (struct lum_json_range){f->name, f->min, f->max, whole};
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

static bool is_one_line(const char *s)
{
    for (; *s; s++)
        if ((unsigned char)*s < 0x20)
            return false;
    return true;
}

/* A string of the field's own alphabet. */
static bool read_text(const struct lum_field *f, char *ret, const cJSON *json, struct lum_proto_error *err)
{
    static const char name_charset[] = "abcdefghijklmnopqrstuvwxyz0123456789_-";
    const char *s = cJSON_IsString(json) ? json->valuestring : NULL;
    size_t n = s ? strlen(s) : 0;
    bool fits = s && n < f->n;
    unsigned word;
    if (f->kind == LUM_FIELD_CHOICE && !lum_json_to_choice(json, f->name, f->text, &word, err))
        return false;
    if (f->kind == LUM_FIELD_NAME && !(fits && strspn(s, name_charset) == n))
        return wrong(f, err, "a short name of a-z 0-9 _ -");
    if (f->kind == LUM_FIELD_ASSET && !(fits && is_asset(s)))
        return wrong(f, err, "a relative path below the asset root, at most 255 bytes, without ..");
    if (f->kind == LUM_FIELD_TEXT && !(fits && is_one_line(s)))
        return wrong(f, err, "one line of text, at most 127 bytes");
    memset(ret, 0, f->n);
    memcpy(ret, s, n);
    return true;
}

bool lum_field_read_members(const struct lum_field *f, const struct lum_fields *parts, void *base, const cJSON *json,
                            const struct lum_blobs *blobs, struct lum_proto_error *err)
{
    if (!cJSON_IsObject(json))
        return wrong(f, err,
                     f->kind == LUM_FIELD_TRANSFORM                             ? "16 numbers or an object"
                     : f->kind == LUM_FIELD_PARTS || f->kind == LUM_FIELD_LAMPS ? "an object"
                                                                                : "an object or null");
    for (const cJSON *m = json->child; m; m = m->next) {
        const struct lum_field *part = lum_fields_find(parts, m->string);
        if (!part) {
            lum_fields_unknown(parts, m->string, err);
            return lum_proto_prefix(err, f->name);
        }
        if (!lum_field_read(part, base, m, blobs, err))
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

/* Of a texture, transform or box. */
static bool read_parts(const struct lum_field *f, void *base, const cJSON *json, struct lum_proto_error *err)
{
    return lum_field_read_members(f, lum_field_parts(f), base, json, NULL, err);
}

static bool read_web(const struct lum_field *f, struct lum_record_web **ret_web, const cJSON *json,
                     const struct lum_blobs *blobs, struct lum_proto_error *err)
{
    struct lum_record_web *web = lum_record_web_create();
    if (!web)
        return lum_proto_fail_memory(err);
    if (lum_field_read_members(f, &lum_web_fields, web, json, blobs, err)) {
        if (lum_record_web_validate(web, err)) {
            *ret_web = web;
            return true;
        }
        lum_proto_prefix(err, f->name);
    }
    lum_record_web_unref(web);
    return false;
}

static bool read_transform(const struct lum_field *f, struct lum_record_transform *t, const cJSON *json,
                           struct lum_proto_error *err)
{
    static const struct lum_json_range matrix = {"transform", -LUM_LIMIT_COORD_M, LUM_LIMIT_COORD_M, false};
    if (!cJSON_IsArray(json))
        return read_parts(f, t, json, err);
    t->is_matrix = true;
    return lum_json_to_numbers(json, &matrix, 16, t->matrix, err);
}

static bool nullable(const struct lum_field *f)
{
    switch (f->kind) {
    case LUM_FIELD_OPT:
    case LUM_FIELD_TEXT:
    case LUM_FIELD_ASSET:
    case LUM_FIELD_ID:
    case LUM_FIELD_REF:
    case LUM_FIELD_TEXTURE:
    case LUM_FIELD_BOX:
    case LUM_FIELD_FLOATS:
    case LUM_FIELD_INDICES:
    case LUM_FIELD_PIXELS:
    case LUM_FIELD_WEB:
    case LUM_FIELD_LAMPS:
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
    const struct lum_json_range range = range_of(f);
    if (cJSON_IsNull(json) && nullable(f)) {
        lum_field_reset(f, base);
        return true;
    }
    switch (f->kind) {
    case LUM_FIELD_NUMBER:
    case LUM_FIELD_INTEGER:
        return lum_json_to_number(json, &range, p, err);
    case LUM_FIELD_U32: {
        double v;
        if (!lum_json_to_number(json, &range, &v, err))
            return false;
        *(uint32_t *)p = (uint32_t)v;
        return true;
    }
    case LUM_FIELD_OPT:
        ((struct lum_opt *)p)->set = true;
        return lum_json_to_number(json, &range, &((struct lum_opt *)p)->value, err);
    case LUM_FIELD_BOOL:
        return lum_json_to_bool(json, f->name, p, err);
    case LUM_FIELD_VECTOR:
        return lum_json_to_numbers(json, &range, f->n, p, err) &&
               (!(nullable(f) && lum_field_is_null(f, base)) || wrong(f, err, "null, or not all 0"));
    case LUM_FIELD_CHOICE:
    case LUM_FIELD_NAME:
    case LUM_FIELD_TEXT:
    case LUM_FIELD_ASSET:
        return read_text(f, p, json, err);
    case LUM_FIELD_ID:
    case LUM_FIELD_REF:
        return lum_json_to_id(json, f->name, p, err);
    case LUM_FIELD_FLOATS:
    case LUM_FIELD_INDICES:
    case LUM_FIELD_PIXELS:
        return lum_field_read_bulk(f, base, json, blobs, err);
    case LUM_FIELD_WEB:
        lum_field_reset(f, base);
        return read_web(f, p, json, blobs, err);
    case LUM_FIELD_LAMPS:
        lum_field_reset(f, base);
        return lum_lamps_read(f, p, json, err);
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
    case LUM_FIELD_TEXT:
    case LUM_FIELD_ASSET:
    case LUM_FIELD_ID:
    case LUM_FIELD_REF:
        return cJSON_CreateString(p);
    case LUM_FIELD_FLOATS:
    case LUM_FIELD_INDICES:
    case LUM_FIELD_PIXELS:
        return lum_field_write_bulk(f, base);
    case LUM_FIELD_WEB:
        return write_parts(&lum_web_fields, *(struct lum_record_web *const *)p);
    case LUM_FIELD_LAMPS:
        return lum_lamps_write(p);
    case LUM_FIELD_TRANSFORM:
        return write_transform(p);
    case LUM_FIELD_TEXTURE:
    case LUM_FIELD_BOX:
    case LUM_FIELD_PARTS:
        return write_parts(lum_field_parts(f), p);
    }
    return NULL;
}

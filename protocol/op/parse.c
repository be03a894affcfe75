/* Ops from messages and from .jsonl texts. */
#include "protocol/op/op.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cjson/cJSON.h>

#include "protocol/json/json.h"
#include "protocol/op/op_json.h"

#define REPLAY_MAX_MS 1e9 /* eleven days */

bool lum_op_member(const char *name)
{
    return strcmp(name, "op") == 0 || strcmp(name, "type") == 0 || strcmp(name, "id") == 0 || strcmp(name, "t_ms") == 0;
}

void lum_op_finish(struct lum_op *op)
{
    if (!op)
        return;
    lum_record_unref(op->record);
    cJSON_Delete(op->value);
    memset(op, 0, sizeof *op);
}

/* ---- one op ---- */

static bool parse_add(struct lum_json_reader *r, const struct lum_blobs *blobs, struct lum_op *op)
{
    unsigned type;
    if (!lum_json_require(r, "type") || !lum_json_choice(r, "type", LUM_RECORD_ADDED, &type))
        return false;
    static const enum lum_record_type types[] = {
        LUM_RECORD_MESH,   LUM_RECORD_IMAGE,  LUM_RECORD_MATERIAL, LUM_RECORD_OBJECT, LUM_RECORD_LIGHT,
        LUM_RECORD_MEDIUM, LUM_RECORD_CAMERA, LUM_RECORD_SENSOR,   LUM_RECORD_PATCH,  LUM_RECORD_PRESET};
    return lum_op_record_from_json(r->object, types[type], op->id, blobs, &op->record, r->err);
}

static bool parse_import(struct lum_json_reader *r, struct lum_op *op)
{
    /* children are named ID/NAME, and their names need room too */
    if (strlen(op->id) > LUM_LIMIT_IMPORT_ID_BYTES)
        return lum_proto_fail(r->err, LUM_PROTO_BAD_PARAMS, "limit_exceeded", "id",
                              "the id of an import may have %d bytes: it begins the ids of what it brings",
                              LUM_LIMIT_IMPORT_ID_BYTES);
    if (lum_json_member(r, "type"))
        return lum_proto_fail(r->err, LUM_PROTO_BAD_PARAMS, "unknown_field", "type", "an import has no type");
    return lum_op_record_from_json(r->object, LUM_RECORD_IMPORT, op->id, NULL, &op->record, r->err);
}

static bool parse_set(struct lum_json_reader *r, struct lum_op *op)
{
    const cJSON *value = r->object ? cJSON_GetObjectItemCaseSensitive(r->object, "value") : NULL;
    lum_json_member(r, "value");
    if (!lum_json_require(r, "path") || !lum_json_string(r, "path", op->path, sizeof op->path))
        return false;
    if (!value)
        return lum_proto_fail(r->err, LUM_PROTO_BAD_PARAMS, "missing_field", "value", "value is missing");
    if (!lum_json_end(r))
        return false;
    op->value = cJSON_Duplicate(value, true);
    return op->value || lum_proto_fail_memory(r->err);
}

/* t_ms was read by the caller, or is refused as a field nobody asked for. */
static bool parse_op(const cJSON *json, const struct lum_blobs *blobs, bool timed, struct lum_op *ret_op,
                     struct lum_proto_error *err)
{
    static const enum lum_op_kind kinds[] = {LUM_OP_ADD, LUM_OP_SET, LUM_OP_REMOVE, LUM_OP_IMPORT};
    struct lum_json_reader r;
    struct lum_op op = {0};
    unsigned kind;
    lum_json_begin(&r, json, "", err);
    if (!lum_json_require(&r, "op") || !lum_json_choice(&r, "op", "add|set|remove|import", &kind) ||
        !lum_json_require(&r, "id") || !lum_json_id(&r, "id", op.id))
        return false;
    if (lum_json_member(&r, "t_ms") && !timed)
        return lum_proto_fail(err, LUM_PROTO_BAD_PARAMS, "unknown_field", "t_ms", "only a replay has t_ms");
    op.kind = kinds[kind];
    bool ok = op.kind == LUM_OP_ADD      ? parse_add(&r, blobs, &op)
              : op.kind == LUM_OP_SET    ? parse_set(&r, &op)
              : op.kind == LUM_OP_IMPORT ? parse_import(&r, &op)
                                         : lum_json_end(&r);
    if (ok)
        *ret_op = op;
    else
        lum_op_finish(&op);
    return ok;
}

bool lum_op_from_json(const struct cJSON *json, const struct lum_blobs *blobs, struct lum_op *ret_op,
                      struct lum_proto_error *err)
{
    if (!cJSON_IsObject(json))
        return lum_proto_fail(err, LUM_PROTO_BAD_PARAMS, "invalid_value", "", "an op must be an object");
    return parse_op(json, blobs, false, ret_op, err);
}

/* ---- lists ---- */

void lum_ops_finish(struct lum_ops *ops)
{
    if (!ops)
        return;
    for (size_t i = 0; i < ops->n; i++)
        lum_op_finish(&ops->ops[i]);
    free(ops->ops);
    free(ops->t_ms);
    free(ops->lines);
    memset(ops, 0, sizeof *ops);
}

static bool read_ops(const cJSON *array, size_t max, struct lum_ops *ret_ops, struct lum_proto_error *err)
{
    struct lum_ops ops = {0};
    if (!cJSON_IsArray(array))
        return lum_proto_fail(err, LUM_PROTO_BAD_PARAMS, "invalid_value", "ops", "ops must be an array");
    size_t n = 0;
    for (const cJSON *c = array->child; c; c = c->next)
        n++;
    if (n < 1 || n > max)
        return lum_proto_fail(err, LUM_PROTO_BAD_PARAMS, "limit_exceeded", "ops", "ops must hold 1 to %zu ops", max);
    ops.ops = calloc(n, sizeof *ops.ops);
    if (!ops.ops)
        return lum_proto_fail_memory(err);
    for (const cJSON *c = array->child; c; c = c->next, ops.n++)
        if (!lum_op_from_json(c, NULL, &ops.ops[ops.n], err)) {
            char prefix[32];
            snprintf(prefix, sizeof prefix, "ops/%zu", ops.n);
            lum_ops_finish(&ops);
            return lum_proto_prefix(err, prefix);
        }
    *ret_ops = ops;
    return true;
}

bool lum_ops_from_json(const struct cJSON *array, struct lum_ops *ret_ops, struct lum_proto_error *err)
{
    return read_ops(array, LUM_LIMIT_OPS_PER_MESSAGE, ret_ops, err);
}

bool lum_ops_from_stored(const struct cJSON *array, struct lum_ops *ret_ops, struct lum_proto_error *err)
{
    return read_ops(array, LUM_LIMIT_STORED_TOKENS, ret_ops, err);
}

/* ---- .jsonl ---- */

struct jsonl {
    struct lum_ops ops;
    size_t capacity;
    uint32_t line;
    bool replay;
    struct lum_proto_error *err;
};

static bool parse_header(struct jsonl *f, const cJSON *json)
{
    struct lum_json_reader r;
    uint32_t version;
    unsigned kind;
    char text[LUM_LIMIT_STRING_BYTES];
    lum_json_begin(&r, json, "", f->err);
    if (!lum_json_require(&r, "lumend") || !lum_json_u32(&r, "lumend", 1, 1, &version) ||
        !lum_json_require(&r, "kind") || !lum_json_choice(&r, "kind", "scene|replay", &kind))
        return false;
    lum_json_string(&r, "title", text, sizeof text);
    lum_json_string(&r, "note", text, sizeof text);
    lum_json_string(&r, "scene", text, sizeof text);
    f->replay = kind == 1;
    return lum_json_end(&r);
}

static bool grow(struct jsonl *f)
{
    if (f->ops.n < f->capacity)
        return true;
    size_t capacity = f->capacity ? 2 * f->capacity : 64;
    struct lum_op *ops = realloc(f->ops.ops, capacity * sizeof *ops);
    if (!ops)
        return lum_proto_fail_memory(f->err);
    f->ops.ops = ops;
    uint32_t *lines = realloc(f->ops.lines, capacity * sizeof *lines);
    if (!lines)
        return lum_proto_fail_memory(f->err);
    f->ops.lines = lines;
    if (f->replay) {
        double *t_ms = realloc(f->ops.t_ms, capacity * sizeof *t_ms);
        if (!t_ms)
            return lum_proto_fail_memory(f->err);
        f->ops.t_ms = t_ms;
    }
    f->capacity = capacity;
    return true;
}

static bool parse_line_op(struct jsonl *f, const cJSON *json)
{
    if (!cJSON_IsObject(json))
        return lum_proto_fail(f->err, LUM_PROTO_BAD_PARAMS, "invalid_value", "", "an op must be an object");
    if (!grow(f))
        return false;
    size_t n = f->ops.n;
    if (f->replay) {
        struct lum_json_reader r;
        double since = n ? f->ops.t_ms[n - 1] : 0.0;
        lum_json_begin(&r, json, "", f->err);
        if (!lum_json_require(&r, "t_ms") || !lum_json_number(&r, "t_ms", since, REPLAY_MAX_MS, &f->ops.t_ms[n]))
            return false;
    }
    if (!parse_op(json, NULL, f->replay, &f->ops.ops[n], f->err))
        return false;
    f->ops.lines[n] = f->line;
    f->ops.n++;
    return true;
}

static bool parse_line(struct jsonl *f, const char *line, size_t n_bytes, bool first)
{
    cJSON *json = lum_json_parse_stored(line, n_bytes, f->err);
    bool ok = json && (first ? parse_header(f, json) : parse_line_op(f, json));
    cJSON_Delete(json);
    return ok;
}

/* Puts "line 12: " before the error's text. */
static void name_line(struct lum_proto_error *err, size_t line)
{
    if (!err)
        return;
    char text[sizeof err->text];
    memcpy(text, err->text, sizeof text);
    int n = snprintf(err->text, sizeof err->text, "line %zu: ", line);
    snprintf(err->text + n, sizeof err->text - (size_t)n, "%.*s", (int)(sizeof err->text - 1 - (size_t)n), text);
}

void lum_ops_name_line(const struct lum_ops *ops, struct lum_proto_error *err)
{
    size_t i;
    int n = 0;
    if (!err || !ops->lines || sscanf(err->path, "ops/%zu%n", &i, &n) != 1 || i >= ops->n)
        return;
    n += err->path[n] == '/';
    memmove(err->path, err->path + n, strlen(err->path + n) + 1);
    name_line(err, ops->lines[i]);
}

static bool is_blank(const char *line, size_t n)
{
    size_t i = 0;
    while (i < n && (line[i] == ' ' || line[i] == '\t' || line[i] == '\r'))
        i++;
    return i == n || line[i] == '#';
}

bool lum_ops_from_jsonl(const char *text, size_t n_bytes, struct lum_ops *ret_ops, struct lum_proto_error *err)
{
    struct jsonl f = {.err = err};
    bool first = true;
    if (n_bytes > LUM_LIMIT_SCENE_BYTES)
        return lum_proto_fail(err, LUM_PROTO_BAD_PARAMS, "limit_exceeded", "", "more than %u bytes",
                              LUM_LIMIT_SCENE_BYTES);
    for (size_t at = 0; at < n_bytes;) {
        const char *end = memchr(text + at, '\n', n_bytes - at);
        size_t n = end ? (size_t)(end - (text + at)) : n_bytes - at;
        f.line++;
        if (!is_blank(text + at, n)) {
            if (!parse_line(&f, text + at, n, first)) {
                name_line(err, f.line);
                lum_ops_finish(&f.ops);
                return false;
            }
            first = false;
        }
        at += n + 1;
    }
    if (first)
        return lum_proto_fail(err, LUM_PROTO_BAD_PARAMS, "missing_field", "lumend",
                              "the first line must be {\"lumend\":1,\"kind\":\"scene\"} or \"replay\"");
    *ret_ops = f.ops;
    return true;
}

/* Ops from JSON, records to JSON, and single fields by path. */
#include "protocol/op/op.h"

#include <stdlib.h>
#include <string.h>
#include <strings.h>

#include <cjson/cJSON.h>

#include "protocol/json/json.h"
#include "protocol/op/op_json.h"
#include "protocol/record/field.h"

/* ---- fields by name ---- */

/* Setting one field of a group sets the others to their default. */
static void clear_group(struct lum_record *r, const struct lum_field *f)
{
    const struct lum_fields *t = lum_fields_of(r->type);
    for (size_t i = 0; f->group && i < t->n; i++)
        if (&t->fields[i] != f && t->fields[i].group == f->group)
            lum_field_reset(&t->fields[i], lum_record_body(r));
}

/* True when an earlier member of the object gave another field of the same group. */
static const char *group_rival(const struct lum_fields *t, const struct lum_field *f, const cJSON *object)
{
    for (size_t i = 0; f->group && i < t->n; i++) {
        const struct lum_field *o = &t->fields[i];
        const cJSON *m = o != f && o->group == f->group ? cJSON_GetObjectItemCaseSensitive(object, o->name) : NULL;
        if (m && !cJSON_IsNull(m))
            return o->name;
    }
    return NULL;
}

/* Members of json into r, but for those that name the op itself. */
static bool read_members(struct lum_record *r, const cJSON *json, bool is_op, const struct lum_blobs *blobs,
                         struct lum_proto_error *err)
{
    const struct lum_fields *t = lum_fields_of(r->type);
    for (const cJSON *m = json->child; m; m = m->next) {
        if (is_op && lum_op_member(m->string))
            continue;
        const struct lum_field *f = lum_fields_find(t, m->string);
        if (!f)
            return lum_fields_unknown(t, m->string, err);
        const char *rival = cJSON_IsNull(m) ? NULL : group_rival(t, f, json);
        if (rival)
            return lum_proto_fail(err, LUM_PROTO_BAD_PARAMS, "invalid_value", f->name, "%s and %s exclude each other",
                                  f->name, rival);
        if (!cJSON_IsNull(m))
            clear_group(r, f);
        if (!lum_field_read(f, lum_record_body(r), m, blobs, err))
            return false;
    }
    return true;
}

static bool check_required(const struct lum_record *r, const cJSON *json, struct lum_proto_error *err)
{
    const struct lum_fields *t = lum_fields_of(r->type);
    for (size_t i = 0; i < t->n; i++) {
        const char *name = t->fields[i].name;
        if ((t->fields[i].flags & LUM_FIELD_REQUIRED) && !cJSON_GetObjectItemCaseSensitive(json, name))
            return lum_proto_fail(err, LUM_PROTO_BAD_PARAMS, "missing_field", name, "%s is missing", name);
    }
    return true;
}

bool lum_op_record_from_json(const struct cJSON *json, enum lum_record_type type, const char *id,
                             const struct lum_blobs *blobs, struct lum_record **ret_record, struct lum_proto_error *err)
{
    struct lum_record *r = lum_record_create(type, id);
    if (!r)
        return lum_proto_fail_memory(err);
    if (!check_required(r, json, err) || !read_members(r, json, true, blobs, err) || !lum_record_validate(r, err)) {
        lum_record_unref(r);
        return false;
    }
    *ret_record = r;
    return true;
}

/* ---- set by path ---- */

static bool bad_path(struct lum_proto_error *err, const char *path, const char *text)
{
    return lum_proto_fail(err, LUM_PROTO_BAD_PARAMS, "not_found", "path", "path \"%s\": %s", path, text);
}

/* "/1" of a vector. */
static bool set_element(const struct lum_field *f, double *v, const char *index, const cJSON *value,
                        struct lum_proto_error *err)
{
    if (index[0] < '0' || index[0] > '9' || index[1] != '\0' || (unsigned)(index[0] - '0') >= f->n)
        return bad_path(err, index, "no such element");
    struct lum_field element = *f;
    element.kind = (f->flags & LUM_FIELD_WHOLE) ? LUM_FIELD_INTEGER : LUM_FIELD_NUMBER;
    element.offset = 0;
    return lum_field_read(&element, &v[index[0] - '0'], value, NULL, err);
}

/* path: what follows the field's own name: "" or "/part" or "/part/1" or "/1". At most two levels deep. */
static bool set_below(const struct lum_field *f, void *base, const char *path, const cJSON *value,
                      struct lum_proto_error *err)
{
    void *p = (char *)base + f->offset;
    const struct lum_fields *parts = lum_field_parts(f);
    if (path[0] == '\0')
        return lum_field_read(f, base, value, NULL, err);
    path++;
    if (f->kind == LUM_FIELD_VECTOR && !lum_field_is_null(f, base))
        return set_element(f, p, path, value, err);
    if (lum_field_is_null(f, base) && (parts || f->kind == LUM_FIELD_VECTOR))
        return bad_path(err, f->name, "is null: set it whole");
    if (!parts)
        return bad_path(err, f->name, "has no parts that can be set alone");
    if (f->kind == LUM_FIELD_TRANSFORM && ((struct lum_record_transform *)p)->is_matrix)
        return bad_path(err, f->name, "is a matrix: set it whole");
    char name[LUM_LIMIT_PATH_BYTES + 1];
    size_t n = strcspn(path, "/");
    memcpy(name, path, n);
    name[n] = '\0';
    const struct lum_field *part = lum_fields_find(parts, name);
    if (!part)
        return lum_fields_unknown(parts, name, err) || lum_proto_prefix(err, f->name);
    return set_below(part, p, path + n, value, err) || lum_proto_prefix(err, f->name);
}

static bool set_path(struct lum_record *r, const char *path, const cJSON *value, struct lum_proto_error *err)
{
    const struct lum_fields *t = lum_fields_of(r->type);
    if (path[0] == '\0') {
        if (!cJSON_IsObject(value))
            return lum_proto_fail(err, LUM_PROTO_BAD_PARAMS, "invalid_value", "value",
                                  "value must be an object when path is empty");
        return read_members(r, value, false, NULL, err);
    }
    if (path[0] != '/' || strlen(path) > LUM_LIMIT_PATH_BYTES)
        return bad_path(err, path, "must be /field or /field/part");
    char name[LUM_LIMIT_PATH_BYTES + 1];
    size_t n = strcspn(path + 1, "/");
    memcpy(name, path + 1, n);
    name[n] = '\0';
    const struct lum_field *f = lum_fields_find(t, name);
    if (!f)
        return lum_fields_unknown(t, name, err);
    if (!cJSON_IsNull(value))
        clear_group(r, f);
    return set_below(f, lum_record_body(r), path + 1 + n, value, err);
}

bool lum_record_set(struct lum_record *record, const char *path, const struct cJSON *value, struct lum_proto_error *err)
{
    return set_path(record, path, value, err) && lum_record_validate(record, err);
}

/* ---- records to JSON ---- */

static bool is_default(const struct lum_field *f, const struct lum_record *r, const struct lum_record *fresh)
{
    return lum_field_equal(f, lum_record_body(r), lum_record_body(fresh));
}

/* How bulk data is written: as JSON; or as counts; or beside it, as blobs. */
struct bulk_form {
    bool elided;
    struct lum_blobs_out *blobs; /* NULL: not this way */
};

/* A field of a group is left out when another one of the group stands in for it: so do pixels and webs read from an
 * asset, or the asset where these are kept. */
static bool stands_aside(const struct lum_field *f, const struct lum_record *r, const struct lum_record *fresh,
                         const struct bulk_form *form)
{
    const struct lum_fields *t = lum_fields_of(r->type);
    if (f->kind == LUM_FIELD_PIXELS)
        return r->image.asset[0] != '\0' && !form->blobs;
    if (f->kind == LUM_FIELD_WEB)
        return r->light.asset[0] != '\0' && !form->blobs;
    if (r->type == LUM_RECORD_IMAGE && f->kind == LUM_FIELD_ASSET && form->blobs)
        return r->image.pixels != NULL;
    if (r->type == LUM_RECORD_LIGHT && f->kind == LUM_FIELD_ASSET && form->blobs)
        return r->light.web != NULL;
    if (!f->group || !is_default(f, r, fresh))
        return false;
    for (size_t i = 0; i < t->n; i++)
        if (t->fields[i].group == f->group && !is_default(&t->fields[i], r, fresh))
            return true;
    return false;
}

static bool write_elided(cJSON *object, const struct lum_field *f, const struct lum_record *r)
{
    const void *p = (const char *)lum_record_body(r) + f->offset;
    if (f->kind == LUM_FIELD_INDICES)
        return lum_json_add_number(object, "n_triangles", (double)(((const struct lum_indices *)p)->n / 3));
    if (f->flags & LUM_FIELD_DOUBLE)
        return lum_json_add_number(object, "n_vertices", (double)(((const struct lum_floats *)p)->n / 3));
    return true;
}

static bool write_field(cJSON *object, const struct lum_field *f, const struct lum_record *r,
                        const struct bulk_form *form)
{
    bool bulk = lum_field_is_long(f);
    if (bulk && form->elided)
        return write_elided(object, f, r);
    return lum_json_add(object, f->name,
                        bulk && form->blobs ? lum_field_write_blob(f, lum_record_body(r), form->blobs)
                                            : lum_field_write(f, lum_record_body(r)));
}

/* All fields that are not null into object. False when memory is short. */
static bool write_fields(struct cJSON *object, const struct lum_record *r, const struct bulk_form *form)
{
    const struct lum_fields *t = lum_fields_of(r->type);
    struct lum_record *fresh = lum_record_create(r->type, r->id);
    bool ok = fresh != NULL;
    for (size_t i = 0; i < t->n && ok; i++) {
        const struct lum_field *f = &t->fields[i];
        if (!lum_field_is_null(f, lum_record_body(r)) && !stands_aside(f, r, fresh, form))
            ok = write_field(object, f, r, form);
    }
    lum_record_unref(fresh);
    return ok;
}

/* The render record always exists, so that it is set, not added. */
static cJSON *render_to_json(const struct lum_record *r)
{
    cJSON *op = cJSON_CreateObject(), *value = cJSON_CreateObject();
    bool ok = op && value && lum_json_add_string(op, "op", "set") && lum_json_add_string(op, "id", r->id) &&
              lum_json_add_string(op, "path", "") && write_fields(value, r, &(struct bulk_form){0});
    if (!ok) {
        cJSON_Delete(value);
        value = NULL;
    }
    if (lum_json_add(op, "value", value))
        return op;
    cJSON_Delete(op);
    return NULL;
}

static cJSON *record_to_json(const struct lum_record *r, const struct bulk_form *form)
{
    if (r->type == LUM_RECORD_RENDER)
        return render_to_json(r);
    cJSON *op = cJSON_CreateObject();
    bool import = r->type == LUM_RECORD_IMPORT;
    bool ok = lum_json_add_string(op, "op", import ? "import" : "add") &&
              (import || lum_json_add_string(op, "type", lum_record_type_names[r->type])) &&
              lum_json_add_string(op, "id", r->id) && write_fields(op, r, form);
    if (ok)
        return op;
    cJSON_Delete(op);
    return NULL;
}

struct cJSON *lum_record_to_json(const struct lum_record *r, bool elide_bulk)
{
    return record_to_json(r, &(struct bulk_form){.elided = elide_bulk});
}

struct cJSON *lum_record_to_blobs(const struct lum_record *r, struct lum_blobs_out *ret_blobs)
{
    ret_blobs->n = 0;
    return record_to_json(r, &(struct bulk_form){.blobs = ret_blobs});
}

struct cJSON *lum_op_to_json(const struct lum_op *op)
{
    if (op->kind == LUM_OP_ADD || op->kind == LUM_OP_IMPORT)
        return lum_record_to_json(op->record, false);
    cJSON *json = cJSON_CreateObject();
    bool set = op->kind == LUM_OP_SET;
    bool ok = lum_json_add_string(json, "op", set ? "set" : "remove") && lum_json_add_string(json, "id", op->id) &&
              (!set || (lum_json_add_string(json, "path", op->path) &&
                        lum_json_add(json, "value", cJSON_Duplicate(op->value, true))));
    if (ok)
        return json;
    cJSON_Delete(json);
    return NULL;
}

bool lum_is_web_file(const char *name)
{
    static const char *const ends[] = {".ies", ".ldt", ".eul", ".pho"};
    size_t n = strlen(name);
    for (size_t k = 0; k < sizeof ends / sizeof ends[0]; k++)
        if (n > 4 && n <= LUM_LIMIT_ASSET_BYTES && strcasecmp(name + n - 4, ends[k]) == 0)
            return true;
    return false;
}

const char *lum_op_web_file(const struct lum_op *op)
{
    if (op->kind == LUM_OP_ADD)
        return op->record->type == LUM_RECORD_LIGHT && op->record->light.asset[0] ? op->record->light.asset : NULL;
    const cJSON *value = op->kind != LUM_OP_SET            ? NULL
                         : strcmp(op->path, "/asset") == 0 ? op->value
                         : op->path[0] == '\0'             ? cJSON_GetObjectItemCaseSensitive(op->value, "asset")
                                                           : NULL;
    const char *s = cJSON_GetStringValue(value);
    return s && lum_is_web_file(s) ? s : NULL;
}

/* The document, and changes of it, as ops. */
#include "protocol/document/internal.h"

#include <stdlib.h>
#include <string.h>

#include <cjson/cJSON.h>

#include "protocol/document/import_transform.h"
#include "protocol/json/json.h"
#include "protocol/op/op_json.h"
#include "protocol/record/field.h"

/* ---- one record ---- */

static cJSON *remove_op(const char *id)
{
    cJSON *op = cJSON_CreateObject();
    if (lum_json_add_string(op, "op", "remove") && lum_json_add_string(op, "id", id))
        return op;
    cJSON_Delete(op);
    return NULL;
}

static cJSON *set_op(const char *id, cJSON *value)
{
    cJSON *op = cJSON_CreateObject();
    cJSON *only = value && value->child && !value->child->next ? value->child : NULL;
    char path[LUM_LIMIT_PATH_BYTES + 1] = "";
    if (only) {
        path[0] = '/';
        strncat(path, only->string, LUM_LIMIT_PATH_BYTES - 1);
        cJSON_DetachItemViaPointer(value, only);
        cJSON_Delete(value);
        value = only;
    }
    bool ok = lum_json_add(op, "value", value);
    if (ok && lum_json_add_string(op, "op", "set") && lum_json_add_string(op, "id", id) &&
        lum_json_add_string(op, "path", path))
        return op;
    cJSON_Delete(op);
    return NULL;
}

/* True when another field of f's group changed to something: setting that one resets f. */
static bool follows(const struct lum_fields *t, const struct lum_field *f, const void *a, const void *b,
                    const void *fresh)
{
    for (size_t i = 0; f->group && i < t->n; i++) {
        const struct lum_field *o = &t->fields[i];
        if (o != f && o->group == f->group && !lum_field_equal(o, a, b) && !lum_field_equal(o, b, fresh))
            return true;
    }
    return false;
}

/* The fields of b that differ from a. What another field of the group put back to its default is null, so that a mirror
 * need not know the groups; bulk data appears as null when it is elided. */
static cJSON *difference(const struct lum_record *a, const struct lum_record *b, bool elide_bulk)
{
    const struct lum_fields *t = lum_fields_of(b->type);
    const void *p = lum_record_body(a), *q = lum_record_body(b);
    struct lum_record *fresh = lum_record_create(b->type, b->id);
    cJSON *value = cJSON_CreateObject();
    bool ok = fresh && value;
    for (size_t i = 0; i < t->n && ok; i++) {
        const struct lum_field *f = &t->fields[i];
        bool reset = follows(t, f, p, q, lum_record_body(fresh)), bulk = lum_field_is_bulk(f);
        if (lum_field_equal(f, p, q) || (reset && bulk)) /* such pixels come from the asset that replaced them */
            continue;
        ok = lum_json_add(value, f->name, reset || (bulk && elide_bulk) ? cJSON_CreateNull() : lum_field_write(f, q));
    }
    lum_record_unref(fresh);
    if (ok)
        return value;
    cJSON_Delete(value);
    return NULL;
}

/* Adds a set op when the two differ. */
static bool add_difference(cJSON *ops, const struct lum_record *a, const struct lum_record *b, bool elide_bulk)
{
    cJSON *value = difference(a, b, elide_bulk);
    if (value && !value->child) {
        cJSON_Delete(value);
        return true;
    }
    return value && lum_json_add(ops, NULL, set_op(b->id, value));
}

/* ---- the document ---- */

/* For people: every record as it is now, with the import that made it. */
static bool add_expanded(cJSON *ops, const struct lum_record *r)
{
    cJSON *op = lum_record_to_json(r, true);
    if (op && r->origin[0] && !lum_json_add_string(op, "origin", r->origin)) {
        cJSON_Delete(op);
        return false;
    }
    return lum_json_add(ops, NULL, op);
}

/* What happened since to what an import made: sets first, because they may end the use of what is removed. */
static bool add_edits(cJSON *ops, const struct lum_document *doc, const struct lum_record_import *import)
{
    bool ok = true;
    for (size_t i = 0; i < import->n_made && ok; i++) {
        const struct lum_record *now = lum_document_find(doc, import->made[i]->id);
        if (!now || now == import->made[i] || now->type != import->made[i]->type)
            continue;
        struct lum_record *placed = lum_import_apply_transform(&import->transform, import->made[i], NULL);
        ok = placed && add_difference(ops, placed, now, false);
        lum_record_unref(placed);
    }
    return ok;
}

static bool add_removals(cJSON *ops, const struct lum_document *doc, const struct lum_record_import *import)
{
    for (int rank = lum_record_rank(LUM_RECORD_SENSOR); rank > 0; rank--)
        for (size_t i = 0; i < import->n_made; i++) {
            const struct lum_record *made = import->made[i];
            if (lum_record_rank(made->type) == rank && !lum_document_find(doc, made->id) &&
                !lum_json_add(ops, NULL, remove_op(made->id)))
                return false;
        }
    return true;
}

/* Last, for they name a camera; without one that is gone, which nobody could set again. */
static bool add_settings(cJSON *ops, const struct lum_document *doc)
{
    struct lum_record *r = lum_record_clone(lum_document_find(doc, "render"));
    const struct lum_record *camera = r ? lum_document_find(doc, r->render.camera) : NULL;
    if (r && (!camera || camera->type != LUM_RECORD_CAMERA))
        r->render.camera[0] = '\0';
    bool ok = r && lum_json_add(ops, NULL, lum_record_to_json(r, false));
    lum_record_unref(r);
    return ok;
}

static bool add_replayable(cJSON *ops, const struct lum_document *doc, const struct lum_record **records, size_t n)
{
    bool ok = true;
    for (size_t i = 0; i < n && ok; i++)
        if (!records[i]->origin[0] && records[i]->type != LUM_RECORD_RENDER)
            ok = lum_json_add(ops, NULL, lum_record_to_json(records[i], false));
    for (size_t i = 0; i < n && ok; i++)
        if (records[i]->type == LUM_RECORD_IMPORT)
            ok = add_edits(ops, doc, &records[i]->import);
    for (size_t i = 0; i < n && ok; i++)
        if (records[i]->type == LUM_RECORD_IMPORT)
            ok = add_removals(ops, doc, &records[i]->import);
    return ok && add_settings(ops, doc);
}

struct cJSON *lum_document_to_json(const struct lum_document *doc, bool expand)
{
    const struct lum_record **records;
    if (!lum_table_sorted(&doc->table, &records))
        return NULL;
    size_t n = doc->table.n;
    cJSON *ops = cJSON_CreateArray();
    bool ok = ops != NULL;
    if (expand)
        for (size_t i = 0; i < n && ok; i++)
            ok = add_expanded(ops, records[i]);
    else
        ok = ok && add_replayable(ops, doc, records, n);
    free(records);
    if (!ok) {
        cJSON_Delete(ops);
        return NULL;
    }
    cJSON *json = cJSON_CreateObject();
    if (lum_json_add(json, "ops", ops))
        return json;
    cJSON_Delete(json);
    return NULL;
}

/* ---- changes ---- */

/* The imports among the changes, by id. */
struct news {
    const struct lum_change **imports;
    size_t n_imports;
};

static const struct lum_record *subject(const struct lum_change *c)
{
    return c->after ? c->after : c->before;
}

static int by_id(const void *a, const void *b)
{
    return strcmp(subject(*(const struct lum_change *const *)a)->id, subject(*(const struct lum_change *const *)b)->id);
}

static int origin_and_id(const void *origin, const void *import)
{
    return strcmp(origin, subject(*(const struct lum_change *const *)import)->id);
}

static bool news_init(struct news *n, const struct lum_changes *c)
{
    *n = (struct news){.imports = calloc(c->n ? c->n : 1, sizeof(*n->imports))};
    for (size_t i = 0; i < c->n && n->imports; i++)
        if (subject(&c->changes[i])->type == LUM_RECORD_IMPORT)
            n->imports[n->n_imports++] = &c->changes[i];
    if (n->n_imports)
        qsort(n->imports, n->n_imports, sizeof(*n->imports), by_id);
    return n->imports != NULL;
}

/* True when the import that made the record comes, goes or is changed along with it: the import's op stands for both.
 */
static bool import_does(const struct news *n, const struct lum_change *c)
{
    const struct lum_change *const *o =
        bsearch(subject(c)->origin, n->imports, n->n_imports, sizeof(*n->imports), origin_and_id);
    return o && !(*o)->before == !c->before && !(*o)->after == !c->after;
}

/* Objects go where their import goes; a model may have thousands of them, and a drag thirty steps a second. */
static bool moved_by_import(const struct news *n, const struct lum_change *c)
{
    if (c->after->type != LUM_RECORD_OBJECT || !import_does(n, c))
        return false;
    const struct lum_fields *t = lum_fields_of(LUM_RECORD_OBJECT);
    for (size_t i = 0; i < t->n; i++)
        if (t->fields[i].kind != LUM_FIELD_TRANSFORM &&
            !lum_field_equal(&t->fields[i], lum_record_body(c->before), lum_record_body(c->after)))
            return false;
    return true;
}

static bool add_change(cJSON *ops, const struct news *n, const struct lum_change *c)
{
    if (c->before && c->after)
        return moved_by_import(n, c) || add_difference(ops, c->before, c->after, true);
    if (import_does(n, c))
        return true;
    return c->after ? add_expanded(ops, c->after) : lum_json_add(ops, NULL, remove_op(c->before->id));
}

struct cJSON *lum_changes_to_json(const struct lum_changes *c)
{
    struct news n;
    cJSON *ops = cJSON_CreateArray();
    bool ok = news_init(&n, c) && ops;
    for (size_t i = 0; i < c->n && ok; i++)
        ok = add_change(ops, &n, &c->changes[i]);
    free(n.imports);
    if (ok)
        return ops;
    cJSON_Delete(ops);
    return NULL;
}

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
        bool reset = follows(t, f, p, q, lum_record_body(fresh)), bulk = lum_field_is_long(f);
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

/* ---- the document in parts ---- */

struct part_list {
    struct lum_document_part *parts;
    size_t n, capacity;
};

static bool push(struct part_list *l, struct lum_document_part part)
{
    if (l->n == l->capacity) {
        size_t capacity = l->capacity ? 2 * l->capacity : 64;
        struct lum_document_part *more = realloc(l->parts, capacity * sizeof *more);
        if (!more)
            return false;
        l->parts = more;
        l->capacity = capacity;
    }
    l->parts[l->n++] = part;
    return true;
}

/* What happened since to what an import made: sets first, because they may end the use of what is removed. */
static bool list_edits(struct part_list *l, const struct lum_document *doc, const struct lum_record *import)
{
    for (size_t i = 0; i < import->import.n_made; i++) {
        const struct lum_record *made = import->import.made[i], *now = lum_document_find(doc, made->id);
        if (now && now != made && now->type == made->type &&
            !push(l, (struct lum_document_part){LUM_PART_EDIT, now, made, import}))
            return false;
    }
    return true;
}

static bool list_removals(struct part_list *l, const struct lum_document *doc, const struct lum_record *import)
{
    for (int rank = lum_record_rank(LUM_RECORD_PRESET); rank > 0; rank--)
        for (size_t i = 0; i < import->import.n_made; i++) {
            const struct lum_record *made = import->import.made[i];
            if (lum_record_rank(made->type) == rank && !lum_document_find(doc, made->id) &&
                !push(l, (struct lum_document_part){LUM_PART_REMOVAL, made, NULL, NULL}))
                return false;
        }
    return true;
}

/* But those of what is gone, which nobody could add again. */
static bool list_patches(struct part_list *l, const struct lum_document *doc, const struct lum_record **records,
                         size_t n)
{
    size_t n_patches = doc->table.n_of_type[LUM_RECORD_PATCH], at = 0;
    struct lum_target *targets = n_patches ? calloc(n_patches, sizeof *targets) : NULL;
    bool ok = targets || n_patches == 0;
    for (size_t i = 0; i < n && ok; i++)
        if (records[i]->type == LUM_RECORD_PATCH)
            targets[at++].patch = records[i];
    lum_targets_find(doc, targets, at);
    for (size_t i = 0; i < at && ok; i++)
        if (targets[i].there)
            ok = push(l, (struct lum_document_part){LUM_PART_RECORD, targets[i].patch, NULL, NULL});
    free(targets);
    return ok;
}

/* Patches and settings last, for they name what may have been edited, and a camera. */
static bool list_replayable(struct part_list *l, const struct lum_document *doc, const struct lum_record **records,
                            size_t n)
{
    bool ok = true;
    for (size_t i = 0; i < n && ok; i++)
        if (!records[i]->origin[0] && records[i]->type != LUM_RECORD_RENDER && records[i]->type != LUM_RECORD_PATCH)
            ok = push(l, (struct lum_document_part){LUM_PART_RECORD, records[i], NULL, NULL});
    for (size_t i = 0; i < n && ok; i++)
        if (records[i]->type == LUM_RECORD_IMPORT)
            ok = list_edits(l, doc, records[i]);
    for (size_t i = 0; i < n && ok; i++)
        if (records[i]->type == LUM_RECORD_IMPORT)
            ok = list_removals(l, doc, records[i]);
    ok = ok && list_patches(l, doc, records, n);
    const struct lum_record *render = lum_document_find(doc, "render"),
                            *camera = lum_document_find(doc, render->render.camera);
    return ok && push(l, (struct lum_document_part){LUM_PART_SETTINGS, render, camera, NULL});
}

bool lum_document_parts(const struct lum_document *doc, bool expand, struct lum_document_part **ret_parts,
                        size_t *ret_n)
{
    const struct lum_record **records;
    if (!lum_table_sorted(&doc->table, &records))
        return false;
    struct part_list l = {0};
    bool ok = true;
    for (size_t i = 0; expand && ok && i < doc->table.records.n; i++)
        ok = push(&l, (struct lum_document_part){LUM_PART_EXPANDED, records[i], NULL, NULL});
    ok = ok && (expand || list_replayable(&l, doc, records, doc->table.records.n));
    free(records);
    if (!ok) {
        free(l.parts);
        return false;
    }
    *ret_parts = l.parts;
    *ret_n = l.n;
    return true;
}

/* For people: a record as it is now, with the import that made it. */
static bool add_expanded(cJSON *ops, const struct lum_record *r)
{
    cJSON *op = lum_record_to_json(r, true);
    if (op && r->origin[0] && !lum_json_add_string(op, "origin", r->origin)) {
        cJSON_Delete(op);
        return false;
    }
    return lum_json_add(ops, NULL, op);
}

static bool add_edit(cJSON *ops, const struct lum_document_part *p)
{
    struct lum_record *made = (struct lum_record *)(uintptr_t)p->other; /* at most referred to once more */
    struct lum_record *placed = lum_import_apply_transform(&p->import->import.transform, made, NULL);
    bool ok = placed && add_difference(ops, placed, p->record, false);
    lum_record_unref(placed);
    return ok;
}

/* Without a camera that is gone, which nobody could set again. */
static bool add_settings(cJSON *ops, const struct lum_document_part *p)
{
    struct lum_record *r = lum_record_clone(p->record);
    if (r && (!p->other || p->other->type != LUM_RECORD_CAMERA))
        r->render.camera[0] = '\0';
    bool ok = r && lum_json_add(ops, NULL, lum_record_to_json(r, false));
    lum_record_unref(r);
    return ok;
}

bool lum_document_part_write(const struct lum_document_part *p, struct cJSON *ops)
{
    switch (p->kind) {
    case LUM_PART_EXPANDED:
        return add_expanded(ops, p->record);
    case LUM_PART_RECORD:
        return lum_json_add(ops, NULL, lum_record_to_json(p->record, false));
    case LUM_PART_EDIT:
        return add_edit(ops, p);
    case LUM_PART_REMOVAL:
        return lum_json_add(ops, NULL, remove_op(p->record->id));
    case LUM_PART_SETTINGS:
        return add_settings(ops, p);
    }
    return false;
}

struct cJSON *lum_document_to_json(const struct lum_document *doc, bool expand)
{
    struct lum_document_part *parts;
    size_t n;
    if (!lum_document_parts(doc, expand, &parts, &n))
        return NULL;
    cJSON *json = cJSON_CreateObject(), *ops = cJSON_CreateArray();
    bool ok = ops != NULL;
    for (size_t i = 0; i < n && ok; i++)
        ok = lum_document_part_write(&parts[i], ops);
    free(parts);
    ok = lum_json_add(json, "ops", ops) && ok;
    if (ok)
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

/* Design: an op is checked and applied at once, in the order given, so that a list of ops means the same whether it
 * comes as one transaction or as several. All or nothing comes from the log of steps, which can be taken back without
 * allocating. What leaves is the net effect, coalesced by id and sorted, so that 240 drags in a message cost one put.
 */
#include "protocol/document/internal.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "protocol/base/nearest.h"
#include "protocol/document/import_transform.h"

void lum_changes_finish(struct lum_changes *c)
{
    if (!c)
        return;
    for (size_t i = 0; i < c->n; i++) {
        lum_record_unref(c->changes[i].before);
        lum_record_unref(c->changes[i].after);
    }
    free(c->changes);
    *c = (struct lum_changes){0};
}

struct lum_document *lum_document_create(void)
{
    struct lum_document *doc = calloc(1, sizeof *doc);
    struct lum_record *render = lum_record_create(LUM_RECORD_RENDER, "render");
    if (!doc || !render)
        goto fail;
    lum_table_init(&doc->table);
    if (!lum_table_reserve(&doc->table, 1))
        goto fail;
    lum_table_change(&doc->table, NULL, render);
    lum_record_unref(render);
    return doc;
fail:
    lum_record_unref(render);
    free(doc);
    return NULL;
}

void lum_document_destroy(struct lum_document *doc)
{
    if (!doc)
        return;
    lum_history_finish(doc);
    lum_past_finish(&doc->past);
    lum_table_finish(&doc->table);
    free(doc);
}

uint64_t lum_document_rev(const struct lum_document *doc)
{
    return doc->rev;
}

const struct lum_record *lum_document_find(const struct lum_document *doc, const char *id)
{
    return lum_table_find(&doc->table, id);
}

/* "; there are a, b, ...", in the order of ids. */
static void list_some(const struct lum_table *t, enum lum_record_type type, char *ret_text, size_t size)
{
    const char *last = "";
    size_t at = 0;
    for (size_t n = 0; n < t->n_of_type[type]; n++) {
        const char *next = NULL;
        for (size_t i = 0; i < t->records.capacity; i++) {
            const struct lum_record *r = lum_table_at(t, i);
            if (r && r->type == type && strcmp(r->id, last) > 0 && (!next || strcmp(r->id, next) < 0))
                next = r->id;
        }
        bool fits = next && at + strlen(next) + sizeof "; there are , ..." <= size && n < 2 * LUM_NEAREST_MAX;
        at += (size_t)snprintf(ret_text + at, size - at, "%s%s", n == 0 ? "; there are " : ", ", fits ? next : "...");
        if (!fits)
            return;
        last = next;
    }
}

void lum_document_nearest(const struct lum_document *doc, enum lum_record_type type, const char *id, char *ret_text,
                          size_t size)
{
    struct lum_nearest near = {.given = id};
    for (size_t i = 0; i < doc->table.records.capacity; i++) {
        const struct lum_record *r = lum_table_at(&doc->table, i);
        if (r && (r->type == type || type == LUM_RECORD_TYPE_COUNT))
            lum_nearest_offer(&near, r->id);
    }
    lum_nearest_text(&near, ret_text, size);
    if (near.n == 0 && type != LUM_RECORD_TYPE_COUNT)
        list_some(&doc->table, type, ret_text, size);
}

size_t lum_document_count(const struct lum_document *doc, enum lum_record_type type)
{
    return type == LUM_RECORD_TYPE_COUNT ? doc->table.records.n : doc->table.n_of_type[type];
}

bool lum_document_each(const struct lum_document *doc, void (*fn)(void *user, const struct lum_record *r), void *user)
{
    const struct lum_record **records;
    if (!lum_table_sorted(&doc->table, &records))
        return false;
    for (size_t i = 0; i < doc->table.records.n; i++)
        fn(user, records[i]);
    free(records);
    return true;
}

/* ---- ids below imports ---- */

/* "room/lamp" is below "room". */
static bool is_below(const char *id, const char *import_id)
{
    size_t n = strlen(import_id);
    return strncmp(id, import_id, n) == 0 && id[n] == '/';
}

/* Ids below an existing import are its own: a rebuilt scene imports first and adds after. */
static bool check_free(const struct lum_txn *t, const char *id)
{
    const struct lum_table *table = &t->doc->table;
    if (lum_table_find(table, id))
        return lum_proto_fail(t->err, LUM_PROTO_APPLICATION, "conflict", "id", "\"%s\" exists", id);
    lum_id prefix;
    for (size_t i = 0; id[i]; i++) {
        prefix[i] = '\0';
        const struct lum_record *r = id[i] == '/' ? lum_table_find(table, prefix) : NULL;
        if (r && r->type == LUM_RECORD_IMPORT)
            return lum_proto_fail(t->err, LUM_PROTO_APPLICATION, "conflict", "id",
                                  "\"%s\": ids below \"%s\" belong to that import", id, prefix);
        prefix[i] = id[i];
    }
    return true;
}

/* ---- ops ---- */

/* What an import made goes where its new transform puts it. */
static bool move_children(struct lum_txn *t, const struct lum_record *before, const struct lum_record *after)
{
    struct lum_import_move move = {&before->import.transform, &after->import.transform};
    bool ok = true;
    for (size_t i = 0; i < after->import.n_made && ok; i++) {
        struct lum_record *local = after->import.made[i];
        struct lum_record *now = lum_table_find(&t->doc->table, local->id);
        if (!now || now->type != local->type)
            continue;
        struct lum_record *moved = lum_import_reapply_transform(&move, local, now, t->err);
        ok = moved && (moved == now || lum_txn_step(t, now, moved));
        lum_record_unref(moved);
    }
    return ok;
}

/* A run of sets of one import, of which a drag has many, moves what it made once, at its end. */
static bool settle_import(struct lum_txn *t)
{
    struct lum_record *before = t->moving;
    if (!before)
        return true;
    const struct lum_record *after = lum_table_find(&t->doc->table, before->id);
    t->n_moved += after->import.n_made;
    bool ok = t->n_moved <= LUM_LIMIT_MOVED || t->doc->replays ||
              lum_proto_fail(t->err, LUM_PROTO_APPLICATION, "limit_exceeded", "id",
                             "the sets of \"%s\" and of imports before it would move %zu records, and one transaction "
                             "may move %u: let sets of one import follow each other, or send them apart",
                             after->id, t->n_moved, LUM_LIMIT_MOVED);
    ok = ok && move_children(t, before, after);
    t->moving = NULL;
    lum_record_unref(before);
    return ok;
}

static bool step_set(struct lum_txn *t, struct lum_record *before, struct lum_record *after)
{
    if (before->type != LUM_RECORD_IMPORT)
        return lum_txn_step(t, before, after);
    if (strcmp(before->import.asset, after->import.asset) != 0)
        return lum_proto_fail(t->err, LUM_PROTO_APPLICATION, "unsupported", "asset",
                              "an import can be moved, but its asset stays: remove it and import the other one");
    if (!t->moving)
        t->moving = lum_record_ref(before);
    return lum_txn_step(t, before, after);
}

static bool fail_unknown(const struct lum_txn *t, const char *id)
{
    char near[sizeof t->err->text / 2];
    lum_document_nearest(t->doc, LUM_RECORD_TYPE_COUNT, id, near, sizeof near);
    return lum_proto_fail(t->err, LUM_PROTO_APPLICATION, "not_found", "id", "there is no \"%s\"%s", id, near);
}

/* What was read from the asset that the op sets. */
static void take_web(struct lum_record *after, const struct lum_op *op)
{
    const struct lum_record *read = op->record;
    if (read && after->type == LUM_RECORD_LIGHT && strcmp(after->light.asset, read->light.asset) == 0) {
        lum_record_web_unref(after->light.web);
        after->light.web = lum_record_web_ref(read->light.web);
    }
}

static bool apply_set(struct lum_txn *t, const struct lum_op *op)
{
    struct lum_record *before = lum_table_find(&t->doc->table, op->id);
    if (!before)
        return fail_unknown(t, op->id);
    lum_record_ref(before);
    struct lum_record *after = lum_record_clone(before);
    bool ok = after ? lum_record_set(after, op->path, op->value, t->err) : lum_proto_fail_memory(t->err);
    if (ok) {
        take_web(after, op);
        ok = step_set(t, before, after);
    }
    lum_record_unref(before);
    lum_record_unref(after);
    return ok;
}

static const struct lum_import_children *children_of(const struct lum_import_children *children, size_t n,
                                                     const char *id)
{
    for (size_t i = 0; i < n; i++)
        if (strcmp(children[i].import_id, id) == 0)
            return &children[i];
    return NULL;
}

static bool any_below(const struct lum_table *table, const char *id)
{
    for (size_t i = 0; i < table->records.capacity; i++)
        if (lum_table_at(table, i) && is_below(lum_table_at(table, i)->id, id))
            return true;
    return false;
}

/* A copy of the import record that remembers what it made. */
static struct lum_record *import_record(const struct lum_op *op, const struct lum_import_children *made)
{
    struct lum_record *import = lum_record_clone(op->record);
    if (!import)
        return NULL;
    import->import.made = lum_bulk_create(made->n * sizeof(*import->import.made));
    if (!import->import.made) {
        lum_record_unref(import);
        return NULL;
    }
    for (; import->import.n_made < made->n; import->import.n_made++) {
        struct lum_record *child = made->records[import->import.n_made];
        memcpy(child->origin, op->id, sizeof child->origin);
        import->import.made[import->import.n_made] = lum_record_ref(child);
    }
    return import;
}

static bool add_child(struct lum_txn *t, const struct lum_record *import, struct lum_record *local)
{
    if (!is_below(local->id, import->id) || lum_table_find(&t->doc->table, local->id))
        return lum_proto_fail(t->err, LUM_PROTO_APPLICATION, "conflict", "id",
                              "the import brought \"%s\", which is outside its name or there twice", local->id);
    struct lum_record *placed = lum_import_apply_transform(&import->import.transform, local, t->err);
    bool ok = placed && lum_txn_step(t, NULL, placed);
    lum_record_unref(placed);
    return ok;
}

static bool apply_import(struct lum_txn *t, const struct lum_op *op, const struct lum_import_children *made)
{
    if (!check_free(t, op->id))
        return false;
    if (any_below(&t->doc->table, op->id))
        return lum_proto_fail(t->err, LUM_PROTO_APPLICATION, "conflict", "id",
                              "ids below \"%s\" are taken: import under another id", op->id);
    if (!made)
        return lum_proto_fail(t->err, LUM_PROTO_APPLICATION, "unsupported", "id",
                              "imports are not available here: the file may hold no import op");
    struct lum_record *import = import_record(op, made);
    if (!import)
        return lum_proto_fail_memory(t->err);
    bool ok = lum_txn_step(t, NULL, import);
    for (size_t i = 0; i < made->n && ok; i++)
        ok = add_child(t, import, made->records[i]);
    lum_record_unref(import);
    return ok;
}

/* What the import made goes first, in an order in which nothing is in use any more. */
static bool remove_children(struct lum_txn *t, const char *import_id)
{
    const struct lum_record **records;
    size_t n = t->doc->table.records.n;
    if (!lum_table_sorted(&t->doc->table, &records))
        return lum_proto_fail_memory(t->err);
    bool ok = true;
    for (size_t i = n; i-- > 0 && ok;)
        if (strcmp(records[i]->origin, import_id) == 0)
            ok = lum_txn_step(t, (struct lum_record *)(uintptr_t)records[i], NULL);
    free(records);
    return ok;
}

static bool apply_remove(struct lum_txn *t, const struct lum_op *op)
{
    struct lum_record *r = lum_table_find(&t->doc->table, op->id);
    if (!r)
        return fail_unknown(t, op->id);
    if (r->type == LUM_RECORD_RENDER)
        return lum_proto_fail(t->err, LUM_PROTO_APPLICATION, "in_use", "id", "\"render\" always exists");
    if (r->type == LUM_RECORD_IMPORT && !remove_children(t, r->id))
        return false;
    return lum_txn_step(t, r, NULL);
}

static const char *home_camera(const struct lum_document *doc)
{
    return lum_table_find(&doc->table, "render")->render.camera;
}

/* The settings may name a camera that is gone, or one that comes later in the same transaction; what is set to one that
 * is not there is a slip. */
static bool check_home_camera(const struct lum_txn *t)
{
    const char *id = home_camera(t->doc);
    const struct lum_record *camera = lum_table_find(&t->doc->table, id);
    if (!id[0] || (camera && camera->type == LUM_RECORD_CAMERA))
        return true;
    char near[sizeof t->err->text / 2];
    lum_document_nearest(t->doc, LUM_RECORD_CAMERA, id, near, sizeof near);
    return lum_proto_fail(t->err, LUM_PROTO_APPLICATION, "not_found", "camera",
                          "camera of \"render\": there is no camera \"%s\"%s", id, near);
}

static bool check_targets(const struct lum_txn *t, const struct lum_ops *ops, size_t *ret_at)
{
    const struct lum_record *patch;
    if (lum_targets_check(t, &patch))
        return true;
    for (size_t i = 0; patch && i < ops->n; i++)
        if (strcmp(ops->ops[i].id, patch->id) == 0)
            *ret_at = i;
    return false;
}

static bool apply_op(struct lum_txn *t, const struct lum_op *op, const struct lum_import_children *children,
                     size_t n_children)
{
    if (op->kind == LUM_OP_ADD)
        return check_free(t, op->id) && lum_txn_step(t, NULL, op->record);
    if (op->kind == LUM_OP_SET)
        return apply_set(t, op);
    if (op->kind == LUM_OP_REMOVE)
        return apply_remove(t, op);
    return apply_import(t, op, children_of(children, n_children, op->id));
}

/* False: *ret_at is the op that is at fault; of an import that moves, the last that set it. */
static bool apply_ops(struct lum_txn *t, const struct lum_ops *ops, const struct lum_import_children *children,
                      size_t n_children, size_t *ret_at)
{
    size_t named_at = ops->n;
    lum_id home;
    for (size_t i = 0; i < ops->n; i++) {
        const struct lum_op *op = &ops->ops[i];
        bool goes_on = t->moving && op->kind == LUM_OP_SET && strcmp(op->id, t->moving->id) == 0;
        if (!goes_on && !settle_import(t))
            return false;
        *ret_at = i;
        memcpy(home, home_camera(t->doc), sizeof home);
        if (!apply_op(t, op, children, n_children))
            return false;
        if (strcmp(home, home_camera(t->doc)) != 0)
            named_at = i;
    }
    if (!settle_import(t))
        return false;
    *ret_at = named_at;
    return (named_at == ops->n || check_home_camera(t)) && check_targets(t, ops, ret_at);
}

bool lum_document_apply(struct lum_document *doc, const char *user, const struct lum_ops *ops,
                        const struct lum_import_children *children, size_t n_children, struct lum_changes *ret_changes,
                        struct lum_proto_error *err)
{
    struct lum_txn t = {.doc = doc, .err = err};
    struct lum_changes changes;
    size_t at = 0;
    lum_history_settle(doc);
    if (!apply_ops(&t, ops, children, n_children, &at)) {
        char prefix[32];
        snprintf(prefix, sizeof prefix, "ops/%zu", at);
        lum_proto_prefix(err, prefix);
        lum_txn_rollback(&t);
        return false;
    }
    if (!lum_txn_end(&t, &changes))
        return false;
    doc->rev++;
    if (!lum_history_note(doc, user, ops->undo_group, &changes)) {
        lum_document_rollback(doc, &changes);
        lum_changes_finish(&changes);
        return lum_proto_fail_memory(err);
    }
    lum_past_note(doc, &(struct lum_past_edit){user, ops->undo_group, LUM_PAST_APPLY, 0}, &changes);
    *ret_changes = changes;
    return true;
}

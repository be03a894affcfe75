/* Undo and redo, by field.
 *
 * A history entry keeps the net changes of one transaction. Taking it back compares, field by field, what stands now
 * with what the transaction left: fields that it did not touch may have been edited by others, fields that it did touch
 * may not. Two people can so work on one light and each undo their own. */
#include "protocol/document/internal.h"

#include <stdio.h>
#include <string.h>

#include "protocol/record/field.h"

/* ---- taking back ---- */

static bool conflict(struct lum_txn *t, const char *id, const char *field, const char *what)
{
    return lum_proto_fail(t->err, LUM_PROTO_APPLICATION, "conflict", field ? field : "id", "\"%s\"%s%s %s", id,
                          field ? " " : "", field ? field : "", what);
}

/* A copy of now in which the fields that differ between from and to have the values of to. */
static struct lum_record *merge(struct lum_txn *t, const struct lum_record *now, const struct lum_record *from,
                                const struct lum_record *to)
{
    const struct lum_fields *fields = lum_fields_of(now->type);
    struct lum_record *merged = lum_record_clone(now);
    if (!merged) {
        lum_proto_fail_memory(t->err);
        return NULL;
    }
    for (size_t i = 0; i < fields->n; i++) {
        const struct lum_field *f = &fields->fields[i];
        if (lum_field_equal(f, lum_record_body(from), lum_record_body(to)))
            continue;
        if (!lum_field_equal(f, lum_record_body(now), lum_record_body(from))) {
            conflict(t, now->id, f->name, "was changed by somebody else since");
            goto fail;
        }
        lum_field_reset(f, lum_record_body(merged));
        lum_field_copy(f, lum_record_body(merged), lum_record_body(to));
    }
    if (lum_record_validate(merged, t->err))
        return merged;
    conflict(t, now->id, NULL, "was changed by somebody else since");
fail:
    lum_record_unref(merged);
    return NULL;
}

static bool change_back(struct lum_txn *t, struct lum_record *now, struct lum_record *from, struct lum_record *to)
{
    if (!now || now->type != from->type)
        return conflict(t, from->id, NULL, "was removed by somebody else since");
    struct lum_record *merged = now == from ? lum_record_ref(to) : merge(t, now, from, to);
    bool ok = merged && lum_txn_step(t, now, merged);
    lum_record_unref(merged);
    return ok;
}

static bool add_back(struct lum_txn *t, struct lum_record *now, struct lum_record *to)
{
    if (now)
        return conflict(t, to->id, NULL, "was added by somebody else since");
    const struct lum_record *origin = lum_document_find(t->doc, to->origin);
    if (to->origin[0] && (!origin || origin->type != LUM_RECORD_IMPORT))
        return conflict(t, to->id, NULL, "belongs to an import that was removed since");
    return lum_txn_step(t, NULL, to);
}

static bool remove_back(struct lum_txn *t, struct lum_record *now, const struct lum_record *from)
{
    if (!now)
        return conflict(t, from->id, NULL, "was removed by somebody else since");
    if (now != from) {
        const struct lum_fields *fields = lum_fields_of(from->type);
        bool same = now->type == from->type;
        for (size_t i = 0; i < fields->n && same; i++)
            same = lum_field_equal(&fields->fields[i], lum_record_body(now), lum_record_body(from));
        if (!same)
            return conflict(t, from->id, NULL, "was changed by somebody else since");
    }
    return lum_txn_step(t, now, NULL);
}

/* Leads one record from the state `from` to the state `to`. */
static bool lead(struct lum_txn *t, struct lum_record *from, struct lum_record *to)
{
    struct lum_record *now = lum_table_find(&t->doc->table, from ? from->id : to->id);
    if (from && to)
        return change_back(t, now, from, to);
    return to ? add_back(t, now, to) : remove_back(t, now, from);
}

static bool is_conflict(const struct lum_proto_error *e)
{
    return e->code == LUM_PROTO_APPLICATION;
}

/* Leads the document along the entry at the head of one of the history's lists. An entry that conflicts is dropped, so
 * that the next try reaches what came before it. */
static bool walk(struct lum_document *doc, struct lum_history *h, enum lum_action action,
                 struct lum_changes *ret_changes, struct lum_proto_error *err)
{
    bool undo = action == LUM_ACTION_UNDO;
    struct lum_history_entry **list = undo ? &h->undo : &h->redo;
    const struct lum_changes *c = &(*list)->changes;
    struct lum_proto_error local;
    struct lum_txn t = {.doc = doc, .err = &local};
    bool ok = true;
    for (size_t i = 0; i < c->n && ok; i++) {
        const struct lum_change *change = &c->changes[undo ? c->n - 1 - i : i];
        ok = undo ? lead(&t, change->after, change->before) : lead(&t, change->before, change->after);
    }
    if (!ok)
        lum_txn_rollback(&t);
    if (!ok || !lum_txn_end(&t, ret_changes)) {
        if (is_conflict(&local)) {
            lum_history_drop(h, list);
            snprintf(local.app, sizeof local.app, "conflict");
        }
        if (err)
            *err = local;
        return false;
    }
    doc->rev++;
    doc->last = (struct lum_last_action){action, h, *list};
    lum_past_note(doc, &(struct lum_past_edit){h->user, "", undo ? LUM_PAST_UNDO : LUM_PAST_REDO, 0}, ret_changes);
    return true;
}

uint64_t lum_document_next_undo(struct lum_document *doc, const char *user, bool redo)
{
    lum_history_settle(doc);
    const struct lum_history *h = lum_history_find(doc, user);
    const struct lum_history_entry *e = h ? redo ? h->redo : h->undo : NULL;
    return e ? e->rev : 0;
}

bool lum_document_undo(struct lum_document *doc, const char *user, struct lum_changes *ret_changes,
                       struct lum_proto_error *err)
{
    lum_history_settle(doc);
    struct lum_history *h = lum_history_find(doc, user);
    if (!h || !h->undo)
        return lum_proto_fail(err, LUM_PROTO_APPLICATION, "not_found", "", "there is nothing to undo");
    return walk(doc, h, LUM_ACTION_UNDO, ret_changes, err);
}

bool lum_document_redo(struct lum_document *doc, const char *user, struct lum_changes *ret_changes,
                       struct lum_proto_error *err)
{
    lum_history_settle(doc);
    struct lum_history *h = lum_history_find(doc, user);
    if (!h || !h->redo)
        return lum_proto_fail(err, LUM_PROTO_APPLICATION, "not_found", "", "there is nothing to redo");
    return walk(doc, h, LUM_ACTION_REDO, ret_changes, err);
}

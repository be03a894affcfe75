/* Undo and redo, per user, by field.
 *
 * A history entry keeps the net changes of one transaction. Taking it back compares, field by field, what stands now
 * with what the transaction left: fields that it did not touch may have been edited by others, fields that it did touch
 * may not. Two people can so work on one light and each undo their own. */
#include "protocol/document/internal.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "protocol/record/field.h"

/* ---- lists ---- */

static void entry_destroy(struct lum_history_entry *e)
{
    lum_changes_finish(&e->changes);
    free(e);
}

static void list_free(struct lum_history_entry **list)
{
    while (*list) {
        struct lum_history_entry *e = *list;
        *list = e->next;
        entry_destroy(e);
    }
}

static void move_head(struct lum_history_entry **from, struct lum_history_entry **to)
{
    struct lum_history_entry *e = *from;
    *from = e->next;
    e->next = *to;
    *to = e;
}

/* Forgets the oldest beyond the limits; the newest stays whatever its size. */
static void trim(struct lum_history_entry *list)
{
    size_t n = 1;
    unsigned long long n_bytes = list ? list->n_bytes : 0;
    for (struct lum_history_entry *e = list; e; e = e->next) {
        n_bytes += e->next ? e->next->n_bytes : 0;
        if (e->next && (++n > LUM_LIMIT_UNDO || n_bytes > LUM_LIMIT_UNDO_BYTES)) {
            list_free(&e->next);
            return;
        }
    }
}

size_t lum_history_bulk_bytes(const struct lum_record *r)
{
    if (r && r->type == LUM_RECORD_MESH) {
        const struct lum_record_mesh *m = &r->mesh;
        return 8 * m->positions.n + 4 * (m->normals.n + m->uvs.n + m->colors.n + m->indices.n);
    }
    if (r && r->type == LUM_RECORD_LIGHT)
        return lum_record_web_bytes(r->light.web);
    return r && r->type == LUM_RECORD_IMAGE ? r->image.n_bytes : 0;
}

/* ---- groups: the steps of one drag are one entry ---- */

/* The change of c that left `record`, from the place *inout_at on, which goes along: both lists are in one order, so
 * that asking for all records of one is one walk through the other. */
static struct lum_change *change_that_left(const struct lum_changes *c, size_t *inout_at,
                                           const struct lum_record *record)
{
    for (; record && *inout_at < c->n; ++*inout_at) {
        struct lum_change *change = &c->changes[*inout_at];
        if (change->after == record)
            return change;
        if (!change->after || lum_record_order(change->after, record) >= 0)
            return NULL;
    }
    return NULL;
}

/* True when `next` goes on exactly where `e` stopped: each of its changes starts from a record that e left, so nobody
 * else was there in between (records are immutable: the same pointer is the same state). */
static bool continues(const struct lum_history_entry *e, const struct lum_history_entry *next)
{
    if (!e || !next->group[0] || strcmp(e->group, next->group) != 0)
        return false;
    for (size_t i = 0, at = 0; i < next->changes.n; i++) {
        const struct lum_change *c = &next->changes.changes[i];
        if (!c->after || !change_that_left(&e->changes, &at, c->before))
            return false;
    }
    return true;
}

/* e then leads from its own start to where `next` ended. Allocates nothing; next is freed. */
static void absorb(struct lum_history_entry *e, struct lum_history_entry *next)
{
    for (size_t i = 0, at = 0; i < next->changes.n; i++) {
        struct lum_change *step = &next->changes.changes[i], *whole = change_that_left(&e->changes, &at, step->before);
        struct lum_record *left = whole->after;
        e->n_bytes += lum_history_bulk_bytes(step->after) - lum_history_bulk_bytes(left);
        whole->after = step->after;
        step->after = left; /* freed with next */
    }
    e->rev = next->rev;
    entry_destroy(next);
}

/* ---- histories ---- */

static void history_destroy(struct lum_history *h)
{
    list_free(&h->undo);
    list_free(&h->redo);
    free(h);
}

void lum_history_settle(struct lum_document *doc)
{
    struct lum_last_action p = doc->last;
    doc->last = (struct lum_last_action){0};
    switch (p.action) {
    case LUM_ACTION_APPLY:
        list_free(&p.history->redo);
        if (continues(p.history->undo, p.entry)) {
            absorb(p.history->undo, p.entry);
            trim(p.history->undo);
            break;
        }
        p.entry->next = p.history->undo;
        p.history->undo = p.entry;
        trim(p.history->undo);
        break;
    case LUM_ACTION_UNDO:
        move_head(&p.history->undo, &p.history->redo);
        break;
    case LUM_ACTION_REDO:
        move_head(&p.history->redo, &p.history->undo);
        break;
    case LUM_ACTION_NONE:
        break;
    }
}

void lum_history_finish(struct lum_document *doc)
{
    lum_history_settle(doc);
    while (doc->histories) {
        struct lum_history *h = doc->histories;
        doc->histories = h->next;
        history_destroy(h);
    }
}

/* The user's history, moved to the front; NULL when there is none. */
static struct lum_history *find_history(struct lum_document *doc, const char *user)
{
    for (struct lum_history **link = &doc->histories; *link; link = &(*link)->next) {
        struct lum_history *h = *link;
        if (strcmp(h->user, user) != 0)
            continue;
        *link = h->next;
        h->next = doc->histories;
        doc->histories = h;
        return h;
    }
    return NULL;
}

void lum_document_forget_user(struct lum_document *doc, const char *user)
{
    lum_history_settle(doc);
    struct lum_history *h = find_history(doc, user);
    if (!h)
        return;
    doc->histories = h->next;
    history_destroy(h);
}

/* Forgets who was idle longest. Only while nothing is pending, because that may point here. */
static void limit_histories(struct lum_document *doc)
{
    size_t n = 0;
    for (struct lum_history **link = &doc->histories; *link;) {
        struct lum_history *h = *link;
        if (n++ < LUM_LIMIT_UNDO_USERS) {
            link = &h->next;
            continue;
        }
        *link = h->next;
        history_destroy(h);
    }
}

static struct lum_history *make_history(struct lum_document *doc, const char *user)
{
    struct lum_history *h = find_history(doc, user);
    if (h)
        return h;
    h = calloc(1, sizeof *h);
    if (!h)
        return NULL;
    snprintf(h->user, sizeof h->user, "%s", user);
    h->next = doc->histories;
    doc->histories = h;
    limit_histories(doc);
    return h;
}

bool lum_history_note(struct lum_document *doc, const char *user, const char *group, const struct lum_changes *changes)
{
    struct lum_history *h = make_history(doc, user);
    struct lum_history_entry *e = h ? calloc(1, sizeof *e) : NULL;
    if (!e)
        return false;
    e->changes.changes = calloc(changes->n ? changes->n : 1, sizeof *e->changes.changes);
    if (!e->changes.changes) {
        free(e);
        return false;
    }
    e->changes.n = changes->n;
    snprintf(e->group, sizeof e->group, "%s", group);
    e->rev = doc->rev;
    for (size_t i = 0; i < changes->n; i++) {
        const struct lum_change *c = &changes->changes[i];
        e->changes.changes[i] = (struct lum_change){c->before ? lum_record_ref(c->before) : NULL,
                                                    c->after ? lum_record_ref(c->after) : NULL};
        e->n_bytes += lum_history_bulk_bytes(c->before) + lum_history_bulk_bytes(c->after);
    }
    doc->last = (struct lum_last_action){LUM_ACTION_APPLY, h, e};
    return true;
}

void lum_document_rollback(struct lum_document *doc, const struct lum_changes *changes)
{
    for (size_t i = changes->n; i-- > 0;)
        lum_table_change(&doc->table, changes->changes[i].after, changes->changes[i].before);
    doc->rev--;
    if (doc->last.action == LUM_ACTION_APPLY)
        entry_destroy(doc->last.entry);
    doc->last = (struct lum_last_action){0};
}

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
    const struct lum_table_slot *slot = lum_table_find(&t->doc->table, from ? from->id : to->id);
    struct lum_record *now = slot ? slot->record : NULL;
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
            struct lum_history_entry *dropped = *list;
            *list = dropped->next;
            entry_destroy(dropped);
            snprintf(local.app, sizeof local.app, "conflict");
        }
        if (err)
            *err = local;
        return false;
    }
    doc->rev++;
    doc->last = (struct lum_last_action){action, h, *list};
    return true;
}

uint64_t lum_document_next_undo(struct lum_document *doc, const char *user, bool redo)
{
    lum_history_settle(doc);
    const struct lum_history *h = find_history(doc, user);
    const struct lum_history_entry *e = h ? redo ? h->redo : h->undo : NULL;
    return e ? e->rev : 0;
}

bool lum_document_undo(struct lum_document *doc, const char *user, struct lum_changes *ret_changes,
                       struct lum_proto_error *err)
{
    lum_history_settle(doc);
    struct lum_history *h = find_history(doc, user);
    if (!h || !h->undo)
        return lum_proto_fail(err, LUM_PROTO_APPLICATION, "not_found", "", "there is nothing to undo");
    return walk(doc, h, LUM_ACTION_UNDO, ret_changes, err);
}

bool lum_document_redo(struct lum_document *doc, const char *user, struct lum_changes *ret_changes,
                       struct lum_proto_error *err)
{
    lum_history_settle(doc);
    struct lum_history *h = find_history(doc, user);
    if (!h || !h->redo)
        return lum_proto_fail(err, LUM_PROTO_APPLICATION, "not_found", "", "there is nothing to redo");
    return walk(doc, h, LUM_ACTION_REDO, ret_changes, err);
}

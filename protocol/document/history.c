/* Who may undo what: steps per user, drags joined, and how much is kept. */
#include "protocol/document/internal.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* ---- steps ---- */

bool lum_changes_copy(const struct lum_changes *from, struct lum_changes *ret)
{
    struct lum_changes c = {.changes = calloc(from->n ? from->n : 1, sizeof *c.changes), .n = from->n};
    if (!c.changes)
        return false;
    for (size_t i = 0; i < c.n; i++) {
        const struct lum_change *f = &from->changes[i];
        c.changes[i] = (struct lum_change){f->before ? lum_record_ref(f->before) : NULL,
                                           f->after ? lum_record_ref(f->after) : NULL};
    }
    *ret = c;
    return true;
}

struct lum_history_entry *lum_history_entry_create(struct lum_history *h, const struct lum_changes *changes,
                                                   const char *group, uint64_t rev)
{
    struct lum_history_entry *e = calloc(1, sizeof *e);
    if (!e)
        return NULL;
    if (!lum_changes_copy(changes, &e->changes) || !lum_held_add(&h->held, &e->changes)) {
        lum_changes_finish(&e->changes);
        free(e);
        return NULL;
    }
    snprintf(e->group, sizeof e->group, "%s", group);
    e->rev = rev;
    return e;
}

static void entry_destroy(struct lum_history *h, struct lum_history_entry *e)
{
    lum_held_drop(&h->held, &e->changes);
    lum_changes_finish(&e->changes);
    free(e);
}

/* ---- lists ---- */

void lum_history_push(struct lum_history_entry **list, struct lum_history_entry *e)
{
    e->next = *list;
    *list = e;
}

void lum_history_drop(struct lum_history *h, struct lum_history_entry **link)
{
    struct lum_history_entry *e = *link;
    *link = e->next;
    entry_destroy(h, e);
}

static void drop_all(struct lum_history *h, struct lum_history_entry **list)
{
    while (*list)
        lum_history_drop(h, list);
}

static void move_head(struct lum_history_entry **from, struct lum_history_entry **to)
{
    struct lum_history_entry *e = *from;
    *from = e->next;
    e->next = *to;
    *to = e;
}

/* ---- limits ---- */

static struct lum_history_entry **oldest(struct lum_history_entry **list)
{
    while (*list && (*list)->next)
        list = &(*list)->next;
    return list;
}

/* What the user would miss least, but for `keep`; a link to NULL: there is nothing. */
static struct lum_history_entry **least_missed(struct lum_history *h, const struct lum_history_entry *keep)
{
    struct lum_history_entry **undo = oldest(&h->undo);
    return *undo && *undo != keep ? undo : oldest(&h->redo);
}

/* Of those that hold on to more than their share, and not to `keep` alone, the one with most. NULL: there is none. */
static struct lum_history *largest(struct lum_document *doc, unsigned long long share,
                                   const struct lum_history_entry *keep)
{
    struct lum_history *most = NULL;
    for (struct lum_history *h = doc->histories; h; h = h->next) {
        bool more = !most || h->held.n_bytes > most->held.n_bytes ||
                    (h->held.n_bytes == most->held.n_bytes && strcmp(h->user, most->user) < 0);
        if (h->held.n_bytes > share && more && *least_missed(h, keep))
            most = h;
    }
    return most;
}

/* All histories together are limited. Where they are too large, each user has a share, and who has more forgets the
 * oldest steps; the newest step of all, `keep`, stays whatever its size. */
static void limit_bytes(struct lum_document *doc, const struct lum_history_entry *keep)
{
    unsigned long long all = 0, n = 0;
    for (const struct lum_history *h = doc->histories; h; h = h->next) {
        all += h->held.n_bytes;
        n += h->held.n_bytes > 0;
    }
    while (all > LUM_LIMIT_UNDO_BYTES) {
        struct lum_history *h = largest(doc, LUM_LIMIT_UNDO_BYTES / n, keep);
        if (!h)
            return;
        while (all > LUM_LIMIT_UNDO_BYTES && h->held.n_bytes > LUM_LIMIT_UNDO_BYTES / n && *least_missed(h, keep)) {
            all -= h->held.n_bytes;
            lum_history_drop(h, least_missed(h, keep));
            all += h->held.n_bytes;
        }
    }
}

static void limit_steps(struct lum_history *h)
{
    struct lum_history_entry **link = &h->undo;
    for (size_t n = 0; *link && n < LUM_LIMIT_UNDO; n++)
        link = &(*link)->next;
    drop_all(h, link);
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
static void absorb(struct lum_history *h, struct lum_history_entry *e, struct lum_history_entry *next)
{
    for (size_t i = 0, at = 0; i < next->changes.n; i++) {
        struct lum_change *step = &next->changes.changes[i], *whole = change_that_left(&e->changes, &at, step->before);
        struct lum_record *left = whole->after;
        whole->after = step->after;
        step->after = left; /* freed with next */
    }
    e->rev = next->rev;
    entry_destroy(h, next);
}

/* ---- histories ---- */

static void history_destroy(struct lum_history *h)
{
    drop_all(h, &h->undo);
    drop_all(h, &h->redo);
    lum_held_finish(&h->held);
    free(h);
}

static void settle_apply(struct lum_document *doc, struct lum_history *h, struct lum_history_entry *e)
{
    if (!h)
        return;
    drop_all(h, &h->redo);
    if (continues(h->undo, e))
        absorb(h, h->undo, e);
    else
        lum_history_push(&h->undo, e);
    limit_steps(h);
    limit_bytes(doc, h->undo);
}

void lum_history_settle(struct lum_document *doc)
{
    struct lum_last_action p = doc->last;
    doc->last = (struct lum_last_action){0};
    switch (p.action) {
    case LUM_ACTION_APPLY:
        settle_apply(doc, p.history, p.entry);
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

struct lum_history *lum_history_find(struct lum_document *doc, const char *user)
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
    struct lum_history *h = lum_history_find(doc, user);
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
    struct lum_history *h = lum_history_find(doc, user);
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
    bool server = user[0] == '(';
    struct lum_history *h = server ? NULL : make_history(doc, user);
    struct lum_history_entry *e = h ? lum_history_entry_create(h, changes, group, doc->rev) : NULL;
    if (!server && !e)
        return false;
    doc->last = (struct lum_last_action){LUM_ACTION_APPLY, h, e};
    return true;
}

void lum_document_rollback(struct lum_document *doc, const struct lum_changes *changes)
{
    for (size_t i = changes->n; i-- > 0;)
        lum_table_change(&doc->table, changes->changes[i].after, changes->changes[i].before);
    doc->rev--;
    lum_past_take_back(doc, changes);
    if (doc->last.action == LUM_ACTION_APPLY && doc->last.history)
        entry_destroy(doc->last.history, doc->last.entry);
    doc->last = (struct lum_last_action){0};
}

#include "protocol/document/state.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "protocol/document/internal.h"
#include "protocol/record/field.h"

void lum_document_state_drop_histories(struct lum_document_state *s)
{
    for (size_t i = 0; i < s->n_histories; i++) {
        struct lum_history_state *h = &s->histories[i];
        for (size_t k = 0; k < h->n_undo + h->n_redo; k++)
            lum_changes_finish(&h->steps[k].changes);
        free(h->steps);
    }
    free(s->histories);
    s->histories = NULL;
    s->n_histories = 0;
    lum_past_state_finish(&s->past);
}

void lum_document_state_finish(struct lum_document_state *s)
{
    for (size_t i = 0; i < s->n_records; i++)
        lum_record_unref(s->records[i]);
    free(s->records);
    lum_document_state_drop_histories(s);
    *s = (struct lum_document_state){0};
}

/* ---- out of the document ---- */

static size_t length(const struct lum_history_entry *list)
{
    size_t n = 0;
    for (; list; list = list->next)
        n++;
    return n;
}

static bool take_list(const struct lum_history_entry *list, struct lum_history_state *h, size_t *n)
{
    for (; list; list = list->next, ++*n) {
        struct lum_step_state *s = &h->steps[h->n_undo + h->n_redo];
        if (!lum_changes_copy(&list->changes, &s->changes))
            return false;
        memcpy(s->group, list->group, sizeof s->group);
        s->rev = list->rev;
    }
    return true;
}

static bool take_history(const struct lum_history *from, struct lum_history_state *h)
{
    size_t n = length(from->undo) + length(from->redo);
    memcpy(h->user, from->user, sizeof h->user);
    h->steps = calloc(n ? n : 1, sizeof *h->steps);
    return h->steps && take_list(from->undo, h, &h->n_undo) && take_list(from->redo, h, &h->n_redo);
}

static bool take_histories(const struct lum_document *doc, struct lum_document_state *s)
{
    size_t n = 0;
    for (const struct lum_history *h = doc->histories; h; h = h->next)
        n++;
    s->histories = calloc(n ? n : 1, sizeof *s->histories);
    bool ok = s->histories != NULL;
    for (const struct lum_history *h = doc->histories; h && ok; h = h->next)
        ok = take_history(h, &s->histories[s->n_histories++]);
    return ok;
}

bool lum_document_take_state(struct lum_document *doc, struct lum_document_state *ret_state)
{
    lum_history_settle(doc);
    const struct lum_table *t = &doc->table;
    struct lum_document_state s = {.rev = doc->rev, .records = calloc(t->records.n, sizeof(*s.records))};
    if (!s.records || !take_histories(doc, &s) || !lum_past_take_state(doc, &s.past)) {
        lum_document_state_finish(&s);
        return false;
    }
    for (size_t i = 0; i < t->records.capacity; i++)
        if (lum_table_at(t, i))
            s.records[s.n_records++] = lum_record_ref(lum_table_at(t, i));
    *ret_state = s;
    return true;
}

/* ---- into a document ---- */

struct finder {
    const struct lum_document *doc;
    const char *missing;
};

static bool is_there(void *user, enum lum_record_type type, const char *id, const char *path)
{
    struct finder *f = user;
    (void)path;
    const struct lum_record *r = lum_document_find(f->doc, id);
    if (r && r->type == type)
        return true;
    f->missing = id;
    return false;
}

static const char *why_not(const struct lum_document *doc, const struct lum_record *r, char text[160])
{
    struct finder f = {.doc = doc};
    const struct lum_record *origin = lum_document_find(doc, r->origin);
    const size_t *n = doc->table.n_of_type;
    if (lum_document_find(doc, r->id))
        return "stands there twice";
    if (r->origin[0] && (!origin || origin->type != LUM_RECORD_IMPORT))
        return "its import is lost";
    if ((r->type == LUM_RECORD_LIGHT && n[LUM_RECORD_LIGHT] >= LUM_LIMIT_LIGHTS) ||
        (r->type == LUM_RECORD_MEDIUM && n[LUM_RECORD_MEDIUM] >= LUM_LIMIT_MEDIA) ||
        (r->type == LUM_RECORD_SENSOR && n[LUM_RECORD_SENSOR] >= LUM_LIMIT_SENSORS) ||
        (r->type == LUM_RECORD_PRESET && n[LUM_RECORD_PRESET] >= LUM_LIMIT_PRESETS) ||
        (r->type == LUM_RECORD_PATCH && n[LUM_RECORD_PATCH] >= LUM_LIMIT_PATCHES) ||
        doc->table.records.n >= LUM_LIMIT_RECORDS)
        return "a scene may not have so many";
    if (lum_record_each_ref(r, is_there, &f))
        return NULL;
    snprintf(text, 160, "\"%.64s\", which it refers to, is lost", f.missing);
    return text;
}

static int by_order(const void *a, const void *b)
{
    return lum_record_order(*(struct lum_record *const *)a, *(struct lum_record *const *)b);
}

static bool put_records(struct lum_document *doc, const struct lum_document_state *s,
                        void (*left_out)(void *user, const char *id, const char *why), void *user)
{
    struct lum_record **sorted = calloc(s->n_records ? s->n_records : 1, sizeof(*sorted));
    char text[160];
    if (!sorted || !lum_table_reserve(&doc->table, s->n_records)) {
        free(sorted);
        return false;
    }
    if (s->n_records)
        memcpy(sorted, s->records, s->n_records * sizeof *sorted);
    qsort(sorted, s->n_records, sizeof(*sorted), by_order);
    for (size_t i = 0; i < s->n_records; i++) {
        struct lum_record *r = sorted[i];
        if (r->type == LUM_RECORD_RENDER) { /* always exists already */
            lum_table_change(&doc->table, lum_document_find(doc, "render"), r);
            continue;
        }
        const char *why = why_not(doc, r, text);
        if (why)
            left_out(user, r->id, why);
        else
            lum_table_change(&doc->table, NULL, r);
    }
    free(sorted);
    return true;
}

/* Newest first, so that the last comes in first. */
static bool put_steps(struct lum_history *h, struct lum_history_entry **list, const struct lum_step_state *steps,
                      size_t n)
{
    while (n-- > 0) {
        struct lum_history_entry *e = lum_history_entry_create(h, &steps[n].changes, steps[n].group, steps[n].rev);
        if (!e)
            return false;
        lum_history_push(list, e);
    }
    return true;
}

static bool put_histories(struct lum_document *doc, const struct lum_document_state *s)
{
    struct lum_history **link = &doc->histories;
    for (size_t i = 0; i < s->n_histories && i < LUM_LIMIT_UNDO_USERS; i++) {
        const struct lum_history_state *from = &s->histories[i];
        struct lum_history *h = *link = calloc(1, sizeof *h);
        if (!h)
            return false;
        link = &h->next;
        memcpy(h->user, from->user, sizeof h->user);
        if (!put_steps(h, &h->undo, from->steps, from->n_undo) ||
            !put_steps(h, &h->redo, from->steps + from->n_undo, from->n_redo))
            return false;
    }
    return true;
}

struct lum_document *lum_document_from_state(const struct lum_document_state *s,
                                             void (*left_out)(void *user, const char *id, const char *why), void *user)
{
    struct lum_document *doc = lum_document_create();
    if (doc && put_records(doc, s, left_out, user) && put_histories(doc, s) && lum_past_put_state(doc, &s->past)) {
        doc->rev = s->rev;
        return doc;
    }
    lum_document_destroy(doc);
    return NULL;
}

void lum_document_replay(struct lum_document *doc, bool on)
{
    doc->replays = on;
}

void lum_document_raise_rev(struct lum_document *doc, uint64_t rev)
{
    if (rev > doc->rev)
        doc->rev = rev;
}

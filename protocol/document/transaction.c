/* Steps of a transaction, and their net effect. */
#include "protocol/document/internal.h"

#include <stdlib.h>
#include <string.h>

#include "protocol/record/field.h"

/* ---- checks ---- */

struct ref_check {
    const struct lum_txn *txn;
    const struct lum_record *record;
};

static bool ref_exists(void *user, enum lum_record_type type, const char *id, const char *path)
{
    const struct ref_check *c = user;
    const struct lum_record *r = lum_table_find(&c->txn->doc->table, id);
    if (r && r->type == type)
        return true;
    char near[sizeof c->txn->err->text / 3];
    lum_document_nearest(c->txn->doc, type, id, near, sizeof near);
    return lum_proto_fail(c->txn->err, LUM_PROTO_APPLICATION, "not_found", path, "\"%s\": there is no %s \"%s\"%s",
                          c->record->id, lum_record_type_names[type], id, near);
}

static bool names(void *user, enum lum_record_type type, const char *id, const char *path)
{
    (void)type;
    (void)path;
    return strcmp(user, id) != 0; /* false stops: found */
}

static bool fail_in_use(const struct lum_txn *t, const struct lum_record *r)
{
    const struct lum_table *table = &t->doc->table;
    for (size_t i = 0; i < table->records.capacity; i++) {
        const struct lum_record *user = lum_table_at(table, i);
        if (user && !lum_record_each_ref(user, names, (char *)(uintptr_t)r->id))
            return lum_proto_fail(t->err, LUM_PROTO_APPLICATION, "in_use", "id", "\"%s\" is used by %s \"%s\"", r->id,
                                  lum_record_type_names[user->type], user->id);
    }
    return false;
}

static bool check_limits(const struct lum_txn *t, const struct lum_record *r)
{
    const struct lum_table *table = &t->doc->table;
    if (table->records.n >= LUM_LIMIT_RECORDS)
        return lum_proto_fail(t->err, LUM_PROTO_APPLICATION, "limit_exceeded", "id", "a scene may have %u records",
                              LUM_LIMIT_RECORDS);
    if (r->type == LUM_RECORD_LIGHT && table->n_of_type[LUM_RECORD_LIGHT] >= LUM_LIMIT_LIGHTS)
        return lum_proto_fail(t->err, LUM_PROTO_APPLICATION, "limit_exceeded", "id", "a scene may have %u lights",
                              LUM_LIMIT_LIGHTS);
    if (r->type == LUM_RECORD_MEDIUM && table->n_of_type[LUM_RECORD_MEDIUM] >= LUM_LIMIT_MEDIA)
        return lum_proto_fail(t->err, LUM_PROTO_APPLICATION, "limit_exceeded", "id", "a scene may have %u media",
                              LUM_LIMIT_MEDIA);
    if (r->type == LUM_RECORD_SENSOR && table->n_of_type[LUM_RECORD_SENSOR] >= LUM_LIMIT_SENSORS)
        return lum_proto_fail(t->err, LUM_PROTO_APPLICATION, "limit_exceeded", "id", "a scene may have %u sensors",
                              LUM_LIMIT_SENSORS);
    if (r->type == LUM_RECORD_PATCH && table->n_of_type[LUM_RECORD_PATCH] >= LUM_LIMIT_PATCHES)
        return lum_proto_fail(t->err, LUM_PROTO_APPLICATION, "limit_exceeded", "id", "a scene may have %u patches",
                              LUM_LIMIT_PATCHES);
    if (r->type == LUM_RECORD_PRESET && table->n_of_type[LUM_RECORD_PRESET] >= LUM_LIMIT_PRESETS)
        return lum_proto_fail(t->err, LUM_PROTO_APPLICATION, "limit_exceeded", "id", "a scene may have %u presets",
                              LUM_LIMIT_PRESETS);
    return true;
}

/* What an import made goes before it. */
static bool check_empty(const struct lum_txn *t, const struct lum_record *import)
{
    const struct lum_table *table = &t->doc->table;
    for (size_t i = 0; i < table->records.capacity; i++) {
        const struct lum_record *r = lum_table_at(table, i);
        if (r && strcmp(r->origin, import->id) == 0)
            return lum_proto_fail(t->err, LUM_PROTO_APPLICATION, "in_use", "id", "\"%s\" has \"%s\" still", import->id,
                                  r->id);
    }
    return true;
}

/* ---- the log: one step for each id that was named ---- */

static bool step_is(const void *step, const void *id)
{
    return strcmp(((const struct lum_step *)step)->id, id) == 0;
}

static void note_step(struct lum_txn *t, struct lum_step *s)
{
    lum_hash_insert(&t->by_id, lum_table_hash(&t->doc->table, s->id), s);
}

/* The log moves, and what finds its steps with it. False: memory is short, and nothing is changed. */
static bool grow_log(struct lum_txn *t)
{
    if (t->n < t->capacity)
        return true;
    size_t capacity = t->capacity ? 2 * t->capacity : 8;
    struct lum_step *log = calloc(capacity, sizeof *log);
    struct lum_hash by_id = {0};
    if (!log || !lum_hash_reserve(&by_id, capacity)) {
        free(log);
        return false;
    }
    if (t->n)
        memcpy(log, t->log, t->n * sizeof *log);
    free(t->log);
    lum_hash_finish(&t->by_id);
    t->log = log;
    t->capacity = capacity;
    t->by_id = by_id;
    for (size_t i = 0; i < t->n; i++)
        note_step(t, &t->log[i]);
    return true;
}

/* The step of the id, which leads from `before` to `before` when it is new. There is room. */
static struct lum_step *step_of(struct lum_txn *t, const char *id, struct lum_record *before)
{
    struct lum_hash_slot *slot = lum_hash_find(&t->by_id, lum_table_hash(&t->doc->table, id), step_is, id);
    if (slot)
        return slot->item;
    struct lum_step *s = &t->log[t->n++];
    memcpy(s->id, id, sizeof s->id);
    s->change = (struct lum_change){before ? lum_record_ref(before) : NULL, before ? lum_record_ref(before) : NULL};
    note_step(t, s);
    return s;
}

bool lum_txn_step(struct lum_txn *t, struct lum_record *before, struct lum_record *after)
{
    struct lum_table *table = &t->doc->table;
    struct ref_check check = {t, after};
    if (after && !before && !check_limits(t, after))
        return false;
    if (after && !lum_record_each_ref(after, ref_exists, &check))
        return false;
    if (!after && lum_table_is_used(table, before->id))
        return fail_in_use(t, before);
    if (!after && before->type == LUM_RECORD_IMPORT && !check_empty(t, before))
        return false;
    if (!grow_log(t) || (!before && !lum_table_reserve(table, 1)))
        return lum_proto_fail_memory(t->err);
    struct lum_step *s = step_of(t, before ? before->id : after->id, before);
    lum_table_change(table, before, after);
    lum_record_unref(s->change.after); /* which is before */
    s->change.after = after ? lum_record_ref(after) : NULL;
    return true;
}

static void finish_step(struct lum_step *s)
{
    lum_record_unref(s->change.before);
    lum_record_unref(s->change.after);
}

static void free_log(struct lum_txn *t)
{
    for (size_t i = 0; i < t->n; i++)
        finish_step(&t->log[i]);
    free(t->log);
    lum_hash_finish(&t->by_id);
    lum_record_unref(t->moving);
    t->log = NULL;
    t->moving = NULL;
    t->n = t->capacity = 0;
}

/* ---- net effect ---- */

static const struct lum_record *subject(const struct lum_change *c)
{
    return c->after ? c->after : c->before;
}

/* Puts in dependency order, then removals in the opposite order. Of changes, or of steps, which begin with one. */
static int by_dependency(const void *a, const void *b)
{
    const struct lum_change *p = a, *q = b;
    if (!p->after != !q->after)
        return !p->after - !q->after;
    int d = lum_record_order(subject(p), subject(q));
    return p->after ? d : -d;
}

void lum_changes_sort(struct lum_changes *c)
{
    if (c->n)
        qsort(c->changes, c->n, sizeof *c->changes, by_dependency);
}

/* Leaves the steps that lead somewhere, in an order that can be walked, or gone back. */
static void sort_log(struct lum_txn *t)
{
    size_t n = 0;
    for (size_t i = 0; i < t->n; i++) {
        if (t->log[i].change.before == t->log[i].change.after)
            finish_step(&t->log[i]);
        else
            t->log[n++] = t->log[i];
    }
    t->n = n;
    if (n)
        qsort(t->log, n, sizeof *t->log, by_dependency);
}

void lum_txn_rollback(struct lum_txn *t)
{
    sort_log(t);
    for (size_t i = t->n; i-- > 0;)
        lum_table_change(&t->doc->table, t->log[i].change.after, t->log[i].change.before);
    free_log(t);
}

static bool check_types(const struct lum_txn *t)
{
    for (size_t i = 0; i < t->n; i++) {
        const struct lum_record *before = t->log[i].change.before, *after = t->log[i].change.after;
        if (before && after && before->type != after->type)
            return lum_proto_fail(t->err, LUM_PROTO_APPLICATION, "conflict", "id",
                                  "\"%s\" cannot turn from a %s into a %s in one transaction", before->id,
                                  lum_record_type_names[before->type], lum_record_type_names[after->type]);
    }
    return true;
}

bool lum_txn_end(struct lum_txn *t, struct lum_changes *ret_changes)
{
    sort_log(t);
    struct lum_changes net = {calloc(t->n ? t->n : 1, sizeof *net.changes), t->n};
    if (!net.changes || !check_types(t)) {
        if (!net.changes)
            lum_proto_fail_memory(t->err);
        free(net.changes);
        lum_txn_rollback(t);
        return false;
    }
    for (size_t i = 0; i < t->n; i++)
        net.changes[i] = t->log[i].change;
    t->n = 0; /* its references went over */
    free_log(t);
    *ret_changes = net;
    return true;
}

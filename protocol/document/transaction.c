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
    const struct lum_table_slot *slot = lum_table_find(&c->txn->doc->table, id);
    if (slot && slot->record->type == type)
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
    for (size_t i = 0; i < table->capacity; i++) {
        const struct lum_record *user = table->slots[i].record;
        if (user && !lum_record_each_ref(user, names, (char *)(uintptr_t)r->id))
            return lum_proto_fail(t->err, LUM_PROTO_APPLICATION, "in_use", "id", "\"%s\" is used by %s \"%s\"", r->id,
                                  lum_record_type_names[user->type], user->id);
    }
    return false;
}

static bool check_limits(const struct lum_txn *t, const struct lum_record *r)
{
    const struct lum_table *table = &t->doc->table;
    if (table->n >= LUM_LIMIT_RECORDS)
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
    return true;
}

/* What an import made goes before it. */
static bool check_empty(const struct lum_txn *t, const struct lum_record *import)
{
    const struct lum_table *table = &t->doc->table;
    for (size_t i = 0; i < table->capacity; i++) {
        const struct lum_record *r = table->slots[i].record;
        if (r && strcmp(r->origin, import->id) == 0)
            return lum_proto_fail(t->err, LUM_PROTO_APPLICATION, "in_use", "id", "\"%s\" has \"%s\" still", import->id,
                                  r->id);
    }
    return true;
}

/* ---- steps ---- */

static bool grow_log(struct lum_txn *t)
{
    if (t->n < t->capacity)
        return true;
    size_t capacity = t->capacity ? 2 * t->capacity : 8;
    struct lum_change *log = realloc(t->log, capacity * sizeof *log);
    if (!log)
        return false;
    t->log = log;
    t->capacity = capacity;
    return true;
}

bool lum_txn_step(struct lum_txn *t, struct lum_record *before, struct lum_record *after)
{
    struct lum_table *table = &t->doc->table;
    struct ref_check check = {t, after};
    if (after && !before && !check_limits(t, after))
        return false;
    if (after && !lum_record_each_ref(after, ref_exists, &check))
        return false;
    if (!after && lum_table_find(table, before->id)->n_users > 0)
        return fail_in_use(t, before);
    if (!after && before->type == LUM_RECORD_IMPORT && !check_empty(t, before))
        return false;
    if (!grow_log(t) || (!before && !lum_table_reserve(table, 1)))
        return lum_proto_fail_memory(t->err);
    t->log[t->n++] = (struct lum_change){before ? lum_record_ref(before) : NULL, after ? lum_record_ref(after) : NULL};
    lum_table_change(table, before, after);
    return true;
}

static void free_log(struct lum_txn *t)
{
    struct lum_changes log = {t->log, t->n};
    lum_changes_finish(&log);
    t->log = NULL;
    t->n = t->capacity = 0;
}

void lum_txn_rollback(struct lum_txn *t)
{
    for (size_t i = t->n; i-- > 0;)
        lum_table_change(&t->doc->table, t->log[i].after, t->log[i].before);
    free_log(t);
}

/* ---- net effect ---- */

static const struct lum_record *subject(const struct lum_change *c)
{
    return c->after ? c->after : c->before;
}

static int by_id_and_time(const void *a, const void *b)
{
    const struct lum_change *p = *(const struct lum_change *const *)a, *q = *(const struct lum_change *const *)b;
    int d = strcmp(subject(p)->id, subject(q)->id);
    return d ? d : (p > q) - (p < q);
}

/* Puts in dependency order, then removals in the opposite order. */
static int by_dependency(const void *a, const void *b)
{
    const struct lum_change *p = a, *q = b;
    if (!p->after != !q->after)
        return !p->after - !q->after;
    int d = lum_record_rank(subject(p)->type) - lum_record_rank(subject(q)->type);
    d = d ? d : strcmp(subject(p)->id, subject(q)->id);
    return p->after ? d : -d;
}

/* One run of changes of one id becomes one change, or none. */
static bool put_net(struct lum_txn *t, struct lum_changes *net, struct lum_record *before, struct lum_record *after)
{
    if (before == after)
        return true;
    if (before && after && before->type != after->type)
        return lum_proto_fail(t->err, LUM_PROTO_APPLICATION, "conflict", "id",
                              "\"%s\" cannot turn from a %s into a %s in one transaction", before->id,
                              lum_record_type_names[before->type], lum_record_type_names[after->type]);
    net->changes[net->n++] =
        (struct lum_change){before ? lum_record_ref(before) : NULL, after ? lum_record_ref(after) : NULL};
    return true;
}

static bool coalesce(struct lum_txn *t, const struct lum_change **order, struct lum_changes *net)
{
    bool ok = true;
    for (size_t i = 0; i < t->n; i++)
        order[i] = &t->log[i];
    qsort(order, t->n, sizeof(*order), by_id_and_time);
    for (size_t i = 0, end; i < t->n && ok; i = end) {
        for (end = i + 1; end < t->n && strcmp(subject(order[end])->id, subject(order[i])->id) == 0;)
            end++;
        ok = put_net(t, net, order[i]->before, order[end - 1]->after);
    }
    qsort(net->changes, net->n, sizeof *net->changes, by_dependency);
    return ok;
}

bool lum_txn_end(struct lum_txn *t, struct lum_changes *ret_changes)
{
    size_t n = t->n ? t->n : 1;
    const struct lum_change **order = calloc(n, sizeof(*order));
    struct lum_changes net = {calloc(n, sizeof *net.changes), 0};
    bool ok = order && net.changes ? coalesce(t, order, &net) : lum_proto_fail_memory(t->err);
    free(order);
    if (!ok) {
        lum_changes_finish(&net);
        lum_txn_rollback(t);
        return false;
    }
    free_log(t);
    *ret_changes = net;
    return true;
}

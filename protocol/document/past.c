#include "protocol/document/past.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "protocol/document/internal.h"

static struct lum_moment *at(const struct lum_past *p, size_t i)
{
    return i == 0 ? (struct lum_moment *)(uintptr_t)&p->first : p->steps[i - 1];
}

static struct lum_moment *newest(const struct lum_past *p)
{
    return at(p, p->n);
}

/* ---- sums of changes ---- */

struct summand {
    struct lum_change change; /* owned references */
    const char *id;           /* of a record that one of the parts holds */
};
struct sum {
    struct summand *all;
    size_t n;
    struct lum_hash by_id;
};

static bool summand_is(const void *item, const void *id)
{
    return strcmp(((const struct summand *)item)->id, id) == 0;
}

static struct lum_record *keep(struct lum_record *r)
{
    return r ? lum_record_ref(r) : NULL;
}

static void add_change(struct sum *s, const struct lum_table *table, const struct lum_change *c)
{
    const char *id = (c->after ? c->after : c->before)->id;
    uint64_t hash = lum_table_hash(table, id);
    struct lum_hash_slot *slot = lum_hash_find(&s->by_id, hash, summand_is, id);
    if (!slot) {
        struct summand *new = &s->all[s->n++];
        *new = (struct summand){{keep(c->before), keep(c->after)}, id};
        lum_hash_insert(&s->by_id, hash, new);
        return;
    }
    struct summand *known = slot->item;
    struct lum_record *was = known->change.after;
    known->change.after = keep(c->after);
    lum_record_unref(was);
}

/* Of each id the first state and the last, as far as they differ; back: the other way round. */
static bool end_sum(struct sum *s, bool back, struct lum_changes *ret)
{
    struct lum_changes c = {.changes = calloc(s->n ? s->n : 1, sizeof *c.changes)};
    for (size_t i = 0; i < s->n; i++) {
        struct lum_change one = s->all[i].change;
        if (c.changes && one.before != one.after) {
            c.changes[c.n++] = back ? (struct lum_change){one.after, one.before} : one;
            continue;
        }
        lum_record_unref(one.before);
        lum_record_unref(one.after);
    }
    free(s->all);
    lum_hash_finish(&s->by_id);
    if (c.changes)
        lum_changes_sort(&c);
    *ret = c;
    return c.changes != NULL;
}

/* What the parts do, one after the other. False: memory is short. */
static bool sum_of(const struct lum_table *table, const struct lum_changes *const *parts, size_t n_parts, bool back,
                   struct lum_changes *ret)
{
    struct sum s = {0};
    size_t n = 0;
    for (size_t i = 0; i < n_parts; i++)
        n += parts[i]->n;
    s.all = calloc(n ? n : 1, sizeof *s.all);
    if (!s.all || !lum_hash_reserve(&s.by_id, n)) {
        free(s.all);
        return false;
    }
    for (size_t i = 0; i < n_parts; i++)
        for (size_t k = 0; k < parts[i]->n; k++)
            add_change(&s, table, &parts[i]->changes[k]);
    return end_sum(&s, back, ret);
}

/* ---- moments ---- */

static void moment_destroy(struct lum_past *p, struct lum_moment *m)
{
    lum_held_drop(&p->held, &m->changes);
    lum_changes_finish(&m->changes);
    free(m);
}

void lum_past_finish(struct lum_past *p)
{
    for (size_t i = 0; i < p->n; i++) {
        lum_changes_finish(&p->steps[i]->changes);
        free(p->steps[i]);
    }
    free(p->steps);
    lum_held_finish(&p->held);
    *p = (struct lum_past){0};
}

void lum_document_begin_past(struct lum_document *doc)
{
    int64_t now_ms = doc->past.now_ms;
    lum_past_finish(&doc->past);
    doc->past = (struct lum_past){
        .kept = true, .now_ms = now_ms, .first = {.rev = doc->rev, .at_ms = now_ms, .n_edits = 1, .n_joined = 1}};
}

void lum_document_set_time(struct lum_document *doc, int64_t at_ms)
{
    doc->past.now_ms = at_ms;
}

size_t lum_document_n_moments(const struct lum_document *doc)
{
    return doc->past.kept ? doc->past.n + 1 : 0;
}

const struct lum_moment *lum_document_moment(const struct lum_document *doc, size_t i)
{
    return at(&doc->past, i);
}

/* The changes of m become these, which pass over. False: memory is short, they are freed, and m is as it was. */
static bool exchange(struct lum_past *p, struct lum_moment *m, struct lum_changes *changes)
{
    if (!lum_held_add(&p->held, changes)) {
        lum_changes_finish(changes);
        return false;
    }
    lum_held_drop(&p->held, &m->changes);
    lum_changes_finish(&m->changes);
    m->changes = *changes;
    m->by_id = false;
    return true;
}

/* ---- joining ---- */

static const char *id_of(const struct lum_change *c)
{
    return (c->after ? c->after : c->before)->id;
}

static int by_id(const void *a, const void *b)
{
    return strcmp(id_of(a), id_of(b));
}

static void sort_by_id(struct lum_moment *m)
{
    if (!m->by_id && m->changes.n)
        qsort(m->changes.changes, m->changes.n, sizeof *m->changes.changes, by_id);
    m->by_id = true;
}

/* Where the id stands among the first n, or would. */
static size_t place_of(const struct lum_change *sorted, size_t n, const char *id)
{
    size_t low = 0;
    while (low < n) {
        size_t middle = low + (n - low) / 2;
        if (strcmp(id_of(&sorted[middle]), id) < 0)
            low = middle + 1;
        else
            n = middle;
    }
    return low;
}

/* What `two` does comes after what `one` does, in the place of one: both are sorted by id, and so is the sum. Costs
 * what two has, and moving the bytes of one: the oldest moment may have all records of a scene, and each new one joins
 * its neighbours. *ret_gone: the references that neither needs any more. False: memory is short, and both are as they
 * were. */
static bool fold(struct lum_changes *one, struct lum_changes *two, struct lum_changes *ret_gone)
{
    struct lum_changes gone = {.changes = calloc(2 * two->n + 1, sizeof *gone.changes)};
    struct lum_change *all = gone.changes ? realloc(one->changes, (one->n + two->n + 1) * sizeof *all) : NULL;
    if (!all) {
        free(gone.changes);
        return false;
    }
    size_t end = one->n, n = one->n + two->n,
           top = n; /* from behind: those below end wait, those from top on are done */
    for (size_t k = two->n; k-- > 0;) {
        struct lum_change c = two->changes[k];
        size_t at = place_of(all, end, id_of(&c));
        bool known = at < end && strcmp(id_of(&all[at]), id_of(&c)) == 0;
        size_t n_behind = end - at - known;
        if (known) {
            gone.changes[gone.n++] = (struct lum_change){all[at].after, c.before};
            c.before = all[at].before;
        }
        top -= n_behind;
        memmove(&all[top], &all[at + known], n_behind * sizeof *all);
        end = at;
        if (known && c.before == c.after)
            gone.changes[gone.n++] = c;
        else
            all[--top] = c;
    }
    memmove(&all[end], &all[top], (n - top) * sizeof *all);
    free(two->changes);
    *one = (struct lum_changes){all, end + n - top};
    *two = (struct lum_changes){0};
    *ret_gone = gone;
    return true;
}

/* The second step then leads from before the first, which is gone. */
static bool join(struct lum_document *doc, size_t i)
{
    struct lum_past *p = &doc->past;
    struct lum_moment *one = p->steps[i], *two = p->steps[i + 1];
    struct lum_changes gone;
    sort_by_id(one);
    sort_by_id(two);
    if (!fold(&one->changes, &two->changes, &gone))
        return false;
    lum_held_drop(&p->held, &gone); /* it has as many as the two have less, and the step that is no more */
    lum_changes_finish(&gone);
    two->changes = one->changes;
    two->n_edits += one->n_edits;
    two->n_joined += one->n_joined;
    if (strcmp(one->user, two->user) != 0)
        two->user[0] = '\0';
    two->did = LUM_PAST_APPLY;
    free(one);
    memmove(p->steps + i, p->steps + i + 1, (--p->n - i) * sizeof(struct lum_moment *));
    return true;
}

/* What stood before the second moment is not known any more. */
static void forget_oldest(struct lum_past *p)
{
    struct lum_moment *second = p->steps[0];
    p->first = *second;
    p->first.changes = (struct lum_changes){0};
    moment_destroy(p, second);
    memmove(p->steps, p->steps + 1, --p->n * sizeof(struct lum_moment *));
}

static void limit(struct lum_document *doc)
{
    struct lum_past *p = &doc->past;
    while (p->n > LUM_LIMIT_PAST_STEPS) {
        size_t i = 0;
        while (i + 2 < p->n && p->steps[i]->name[0]) /* named are fewer than steps */
            i++;
        if (!join(doc, i))
            forget_oldest(p);
    }
    while (p->n > 1 && p->held.n_bytes > LUM_LIMIT_PAST_BYTES)
        forget_oldest(p);
}

void lum_document_thin_past(struct lum_document *doc)
{
    struct lum_past *p = &doc->past;
    for (size_t i = 0; i + 1 < p->n;)
        if (p->steps[i]->name[0])
            i++;
        else if (!join(doc, i))
            return; /* without memory there are more of them */
}

/* A drag goes on: it is the same moment, a little later. */
static bool goes_on(const struct lum_past *p, const struct lum_moment *next)
{
    const struct lum_moment *last = newest(p);
    return p->n > 0 && next->group[0] && !last->name[0] && last->did == next->did &&
           strcmp(last->group, next->group) == 0 && strcmp(last->user, next->user) == 0;
}

static bool go_on(struct lum_document *doc, const struct lum_moment *next, const struct lum_changes *changes)
{
    struct lum_moment *last = newest(&doc->past);
    const struct lum_changes *parts[] = {&last->changes, changes};
    struct lum_changes both;
    if (!sum_of(&doc->table, parts, 2, false, &both) || !exchange(&doc->past, last, &both))
        return false;
    last->rev = next->rev;
    last->at_ms = next->at_ms;
    last->n_edits++;
    return true;
}

/* Takes the moment, and its changes, over. False: memory is short. */
static bool push(struct lum_past *p, const struct lum_moment *m)
{
    struct lum_moment *own = malloc(sizeof *own);
    if (p->n == p->capacity) {
        size_t capacity = p->capacity ? 2 * p->capacity : 16;
        void *grown = realloc(p->steps, capacity * sizeof(struct lum_moment *));
        p->capacity = grown ? capacity : p->capacity;
        p->steps = grown ? grown : p->steps;
    }
    if (!own || p->n == p->capacity || !lum_held_add(&p->held, &m->changes)) {
        free(own);
        return false;
    }
    *own = *m;
    p->steps[p->n++] = own;
    return true;
}

void lum_past_note(struct lum_document *doc, const struct lum_past_edit *edit, const struct lum_changes *changes)
{
    struct lum_past *p = &doc->past;
    struct lum_moment m = {
        .rev = doc->rev, .at_ms = p->now_ms, .to = edit->to, .n_edits = 1, .n_joined = 1, .did = edit->did};
    if (!p->kept)
        return;
    snprintf(m.user, sizeof m.user, "%s", edit->user);
    snprintf(m.group, sizeof m.group, "%s", edit->group);
    bool noted = goes_on(p, &m) ? go_on(doc, &m, changes) : lum_changes_copy(changes, &m.changes) && push(p, &m);
    if (noted) {
        limit(doc);
        return;
    }
    lum_changes_finish(&m.changes);
    lum_document_begin_past(doc); /* without this step none before it could be reached */
}

void lum_past_take_back(struct lum_document *doc, const struct lum_changes *changes)
{
    struct lum_past *p = &doc->past;
    struct lum_moment *last = newest(p);
    if (!p->kept || last->rev <= doc->rev)
        return;
    if (p->n == 0) { /* what stood before was forgotten: it is now again, and is the first */
        lum_document_begin_past(doc);
        return;
    }
    struct lum_changes inverse, rest;
    const struct lum_changes *one = changes, *parts[] = {&last->changes, &inverse};
    last->rev = doc->rev;
    if (--last->n_edits == 0) {
        p->n--;
        moment_destroy(p, last);
        return;
    }
    if (!sum_of(&doc->table, &one, 1, true, &inverse)) {
        lum_document_begin_past(doc);
        return;
    }
    if (!sum_of(&doc->table, parts, 2, false, &rest) || !exchange(p, last, &rest))
        lum_document_begin_past(doc);
    lum_changes_finish(&inverse);
}

/* ---- going there ---- */

/* The moment of that revision; SIZE_MAX: none is kept. Revisions above the last edit are those of edits that were taken
 * back: what stood then is what stands now. */
static size_t find(const struct lum_document *doc, uint64_t rev, struct lum_proto_error *err)
{
    const struct lum_past *p = &doc->past;
    if (p->kept && rev >= newest(p)->rev && rev <= doc->rev)
        return p->n;
    size_t i = p->kept ? p->n : 0;
    while (i > 0 && at(p, i)->rev > rev)
        i--;
    if (p->kept && at(p, i)->rev == rev)
        return i;
    lum_proto_fail(err, LUM_PROTO_APPLICATION, "not_found", "scene_rev",
                   "what stood at revision %llu is not kept: the nearest moment is revision %llu",
                   (unsigned long long)rev, (unsigned long long)(p->kept ? at(p, i)->rev : doc->rev));
    return SIZE_MAX;
}

bool lum_document_changes_to(const struct lum_document *doc, uint64_t rev, struct lum_changes *ret_changes,
                             struct lum_proto_error *err)
{
    const struct lum_past *p = &doc->past;
    size_t i = find(doc, rev, err);
    if (i == SIZE_MAX)
        return false;
    size_t n = p->n - i;
    const struct lum_changes **parts = calloc(n ? n : 1, sizeof(const struct lum_changes *));
    for (size_t k = 0; parts && k < n; k++)
        parts[k] = &p->steps[i + k]->changes;
    bool ok = parts && sum_of(&doc->table, parts, n, true, ret_changes);
    free(parts);
    return ok || lum_proto_fail_memory(err);
}

static bool lead(struct lum_txn *t, const struct lum_change *c)
{
    const char *id = (c->before ? c->before : c->after)->id;
    struct lum_record *now = lum_table_find(&t->doc->table, id);
    if (now == c->before)
        return lum_txn_step(t, now, c->after);
    return lum_proto_fail(t->err, LUM_PROTO_APPLICATION, "conflict", "scene_rev",
                          "what became of \"%s\" since then is not known any more", id);
}

bool lum_document_revert(struct lum_document *doc, const char *user, uint64_t rev, struct lum_changes *ret_changes,
                         struct lum_proto_error *err)
{
    struct lum_txn t = {.doc = doc, .err = err};
    struct lum_changes way, changes;
    lum_history_settle(doc);
    if (!lum_document_changes_to(doc, rev, &way, err))
        return false;
    bool ok = way.n > 0 || lum_proto_fail(err, LUM_PROTO_APPLICATION, "conflict", "scene_rev",
                                          "the scene is as it was at revision %llu", (unsigned long long)rev);
    for (size_t i = 0; i < way.n && ok; i++)
        ok = lead(&t, &way.changes[i]);
    lum_changes_finish(&way);
    if (!ok)
        lum_txn_rollback(&t);
    if (!ok || !lum_txn_end(&t, &changes))
        return false;
    doc->rev++;
    if (!lum_history_note(doc, user, "", &changes)) {
        lum_document_rollback(doc, &changes);
        lum_changes_finish(&changes);
        return lum_proto_fail_memory(err);
    }
    lum_past_note(doc, &(struct lum_past_edit){user, "", LUM_PAST_REVERT, rev}, &changes);
    *ret_changes = changes;
    return true;
}

/* ---- names ---- */

bool lum_document_name_moment(struct lum_document *doc, const char *user, uint64_t rev, const char *name,
                              struct lum_moment_name *ret_was, struct lum_proto_error *err)
{
    const struct lum_past *p = &doc->past;
    size_t i = find(doc, rev, err), n_named = 0;
    if (i == SIZE_MAX)
        return false;
    struct lum_moment *m = at(p, i);
    for (size_t k = 0; k <= p->n; k++)
        n_named += at(p, k) != m && at(p, k)->name[0];
    if (name[0] && n_named >= LUM_LIMIT_MOMENTS)
        return lum_proto_fail(err, LUM_PROTO_APPLICATION, "limit_exceeded", "name",
                              "%u moments have names: take one away that nobody needs", LUM_LIMIT_MOMENTS);
    if (ret_was) {
        ret_was->rev = m->rev;
        memcpy(ret_was->name, m->name, sizeof ret_was->name);
        memcpy(ret_was->by, m->named_by, sizeof ret_was->by);
    }
    snprintf(m->name, sizeof m->name, "%s", name);
    snprintf(m->named_by, sizeof m->named_by, "%s", name[0] ? user : "");
    return true;
}

bool lum_document_name_back(struct lum_document *doc, const struct lum_moment_name *was)
{
    struct lum_past *p = &doc->past;
    for (size_t i = 0; i < lum_document_n_moments(doc); i++) {
        struct lum_moment *m = at(p, i);
        if (m->rev != was->rev)
            continue;
        memcpy(m->name, was->name, sizeof m->name);
        memcpy(m->named_by, was->by, sizeof m->named_by);
        return true;
    }
    return false;
}

/* ---- kept, and read again ---- */

void lum_past_state_finish(struct lum_past_state *s)
{
    for (size_t i = 0; i < s->n; i++)
        lum_changes_finish(&s->moments[i].changes);
    free(s->moments);
    *s = (struct lum_past_state){0};
}

bool lum_past_take_state(const struct lum_document *doc, struct lum_past_state *ret)
{
    size_t n = lum_document_n_moments(doc);
    struct lum_past_state s = {.moments = n ? calloc(n, sizeof *s.moments) : NULL};
    for (; s.n < n; s.n++) {
        const struct lum_moment *m = s.moments ? at(&doc->past, s.n) : NULL;
        if (!m) {
            lum_past_state_finish(&s);
            return false;
        }
        s.moments[s.n] = *m;
        s.moments[s.n].changes = (struct lum_changes){0};
        if (!lum_changes_copy(&m->changes, &s.moments[s.n].changes)) {
            lum_past_state_finish(&s);
            return false;
        }
    }
    *ret = s;
    return true;
}

bool lum_past_put_state(struct lum_document *doc, const struct lum_past_state *s)
{
    if (s->n == 0)
        return true;
    lum_document_begin_past(doc);
    doc->past.first = s->moments[0];
    doc->past.first.changes = (struct lum_changes){0};
    for (size_t i = 1; i < s->n; i++) {
        struct lum_moment m = s->moments[i];
        m.changes = (struct lum_changes){0};
        if (!lum_changes_copy(&s->moments[i].changes, &m.changes) || !push(&doc->past, &m)) {
            lum_changes_finish(&m.changes);
            return false;
        }
    }
    return true;
}

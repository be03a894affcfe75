#include "server/director/timeline_get.h"

#include <stdlib.h>
#include <string.h>

#include <cjson/cJSON.h>

#include "protocol/json/json.h"
#include "protocol/record/field.h"
#include "server/director/internal.h"

#define TOLD_MAX 4u /* changes of a step: a line of text */

/* ---- what a step did; NULL: memory is short ---- */

static cJSON *whole(cJSON *o, bool ok)
{
    if (ok)
        return o;
    cJSON_Delete(o);
    return NULL;
}

/* The first field that differs, NULL: none does. Of a record that became one of another type: that. */
static const char *field_of(const struct lum_change *c)
{
    const struct lum_fields *fields = lum_fields_of(c->after->type);
    if (c->before->type != c->after->type)
        return "type";
    for (size_t i = 0; i < fields->n; i++)
        if (!lum_field_equal(&fields->fields[i], lum_record_body(c->before), lum_record_body(c->after)))
            return fields->fields[i].name;
    return NULL;
}

/* ["set","key","flux_lm"], ["add","lamp","light"], ["remove","lamp","light"] */
static cJSON *change_json(const struct lum_change *c)
{
    const struct lum_record *r = c->after ? c->after : c->before;
    const char *field = c->before && c->after ? field_of(c) : NULL;
    cJSON *o = cJSON_CreateArray();
    bool ok = lum_json_add(o, NULL, cJSON_CreateString(!c->before ? "add" : c->after ? "set" : "remove"));
    ok = ok && lum_json_add(o, NULL, cJSON_CreateString(r->id));
    ok = ok && lum_json_add(o, NULL, cJSON_CreateString(field ? field : lum_record_type_names[r->type]));
    return whole(o, ok);
}

/* What an import brought is left to it, unless there is nothing else. */
static cJSON *changes_json(const struct lum_changes *changes)
{
    cJSON *list = cJSON_CreateArray();
    bool ok = list;
    size_t n = 0;
    for (int children = 0; children < 2 && n == 0; children++)
        for (size_t i = 0; i < changes->n && n < TOLD_MAX && ok; i++) {
            const struct lum_change *c = &changes->changes[i];
            if (!(c->after ? c->after : c->before)->origin[0] == !children) {
                ok = lum_json_add(list, NULL, change_json(c));
                n++;
            }
        }
    return whole(list, ok);
}

static bool add_step(cJSON *o, const struct lum_moment *m)
{
    static const char *const did[] = {"apply", "undo", "redo", "revert"};
    return lum_json_add_string(o, "did", did[m->did]) && lum_json_add_string(o, "user", m->user) &&
           (m->did != LUM_PAST_REVERT || lum_json_add_number(o, "to", (double)m->to)) &&
           (m->n_joined <= 1 || lum_json_add_number(o, "joined", m->n_joined)) &&
           lum_json_add(o, "changes", changes_json(&m->changes)) &&
           lum_json_add_number(o, "n_changes", (double)m->changes.n);
}

static cJSON *moment_json(const struct lum_moment *m, bool first)
{
    cJSON *o = cJSON_CreateObject();
    bool ok =
        lum_json_add_number(o, "scene_rev", (double)m->rev) &&
        (m->at_ms <= 0 || lum_json_add_number(o, "at_ms", (double)m->at_ms)) &&
        (!m->name[0] || (lum_json_add_string(o, "name", m->name) && lum_json_add_string(o, "named_by", m->named_by))) &&
        (first || add_step(o, m));
    return whole(o, ok);
}

/* ---- moments that were told ---- */

static void forget(struct lum_director_timeline_gets *g)
{
    for (size_t i = 0; i < g->n; i++)
        free(g->moments[i].text);
    free(g->moments);
    g->moments = NULL;
    g->n = 0;
}

static struct lum_told_moment untold(const struct lum_moment *m, bool first)
{
    struct lum_told_moment t = {.rev = m->rev,
                                .to = m->to,
                                .at_ms = m->at_ms,
                                .n_edits = m->n_edits,
                                .n_joined = m->n_joined,
                                .n_changes = m->changes.n,
                                .first = first};
    memcpy(t.name, m->name, sizeof t.name);
    memcpy(t.named_by, m->named_by, sizeof t.named_by);
    return t;
}

static bool says_the_same(const struct lum_told_moment *a, const struct lum_told_moment *b)
{
    return a->rev == b->rev && a->to == b->to && a->at_ms == b->at_ms && a->n_edits == b->n_edits &&
           a->n_joined == b->n_joined && a->n_changes == b->n_changes && a->first == b->first &&
           strcmp(a->name, b->name) == 0 && strcmp(a->named_by, b->named_by) == 0;
}

/* The moments of the document as it is now, with the text of those that are as they were. False: memory is short. */
static bool look_at_moments(struct lum_director_timeline_gets *g, const struct lum_document *doc)
{
    size_t n = lum_document_n_moments(doc), old = 0;
    struct lum_told_moment *now = calloc(n ? n : 1, sizeof *now);
    if (!now)
        return false;
    for (size_t i = 0; i < n; i++) {
        now[i] = untold(lum_document_moment(doc, i), i == 0);
        while (old < g->n && g->moments[old].rev < now[i].rev)
            old++;
        struct lum_told_moment *was = old < g->n && says_the_same(&g->moments[old], &now[i]) ? &g->moments[old] : NULL;
        if (was) {
            now[i].text = was->text;
            now[i].n_text = was->n_text;
            was->text = NULL;
        }
    }
    forget(g);
    g->moments = now;
    g->n = n;
    return true;
}

/* Of those that are asked for. *ret_whole: all are written. False: memory is short. */
static bool write_slice(struct lum_director *d, uint64_t since_rev, double slice_ns, bool *ret_whole)
{
    struct lum_director_timeline_gets *g = &d->timeline_gets;
    int64_t from = lum_clock_ns();
    size_t n_written = 0; /* one at least, or it would never end */
    *ret_whole = false;
    for (size_t i = 0; i < g->n; i++) {
        struct lum_told_moment *t = &g->moments[i];
        if (t->rev < since_rev || t->text)
            continue;
        if (n_written++ && (double)(lum_clock_ns() - from) > slice_ns)
            return true;
        cJSON *json = moment_json(lum_document_moment(d->world.doc, i), t->first);
        t->text = json ? lum_json_print(json, &t->n_text) : NULL;
        cJSON_Delete(json);
        if (!t->text)
            return false;
    }
    *ret_whole = true;
    return true;
}

/* [{..},{..}]; NULL: memory is short. */
static char *join_moments(const struct lum_director_timeline_gets *g, uint64_t since_rev)
{
    size_t n = sizeof "[]", at = 0;
    for (size_t i = 0; i < g->n; i++)
        n += g->moments[i].rev >= since_rev ? g->moments[i].n_text + 1 : 0;
    char *text = malloc(n);
    if (!text)
        return NULL;
    text[at++] = '[';
    for (size_t i = 0; i < g->n; i++) {
        const struct lum_told_moment *t = &g->moments[i];
        if (t->rev < since_rev)
            continue;
        if (at > 1)
            text[at++] = ',';
        memcpy(text + at, t->text, t->n_text);
        at += t->n_text;
    }
    text[at++] = ']';
    text[at] = '\0';
    return text;
}

static cJSON *result_json(const struct lum_director *d, uint64_t since_rev)
{
    const struct lum_document *doc = d->world.doc;
    char *moments = join_moments(&d->timeline_gets, since_rev);
    cJSON *o = cJSON_CreateObject();
    bool ok = moments && lum_json_add(o, "moments", cJSON_CreateRaw(moments)) &&
              lum_json_add_number(o, "first_rev", (double)lum_document_moment(doc, 0)->rev) &&
              lum_json_add_number(o, "scene_rev", (double)lum_document_rev(doc));
    free(moments);
    return whole(o, ok);
}

/* ---- requests ---- */

enum lum_need lum_director_timeline_gets_need(const struct lum_director *d)
{
    return d->timeline_gets.waiting ? LUM_NEED_AWAITED : LUM_NEED_NOTHING;
}

void lum_director_write_timeline(struct lum_director *d, double slice_ns)
{
    struct lum_director_timeline_gets *g = &d->timeline_gets;
    struct lum_request *q = g->waiting;
    bool all, ok = look_at_moments(g, d->world.doc) && write_slice(d, q->rev, slice_ns, &all);
    if (ok && !all)
        return;
    cJSON *result = ok ? result_json(d, q->rev) : NULL;
    if (result) {
        lum_director_reply(d, q, result);
    } else {
        struct lum_proto_error err;
        lum_proto_fail_memory(&err);
        lum_director_refuse(d, q, &err);
    }
    g->waiting = q->next;
    lum_request_destroy(q);
}

void lum_director_drop_timeline_gets(struct lum_director *d, struct lum_session_ref session)
{
    for (struct lum_request **at = &d->timeline_gets.waiting, *q; (q = *at);) {
        if (!lum_session_same(q->session, session)) {
            at = &q->next;
            continue;
        }
        *at = q->next;
        lum_request_destroy(q);
    }
}

void lum_director_drop_all_timeline_gets(struct lum_director *d)
{
    while (d->timeline_gets.waiting)
        lum_director_drop_timeline_gets(d, d->timeline_gets.waiting->session);
    forget(&d->timeline_gets);
}

static bool read_get(struct lum_json_reader *r, struct lum_request *q)
{
    lum_json_u64(r, "since_rev", &q->rev);
    return lum_json_end(r);
}

static bool enqueue(struct lum_director *d, struct lum_request *q, struct lum_proto_error *err)
{
    struct lum_request **end = &d->timeline_gets.waiting;
    uint32_t n = 0;
    for (; *end; end = &(*end)->next)
        n += lum_session_same((*end)->session, q->session);
    if (n >= LUM_LIMIT_TIMELINE_GETS_WAITING)
        return lum_proto_fail(err, LUM_PROTO_APPLICATION, "busy", "",
                              "%u requests of this session for what was wait already; ask again when one is answered",
                              n);
    q->next = NULL;
    *end = q;
    return true;
}

const struct lum_request_type lum_request_timeline_get = {.name = "timeline.get", .read = read_get, .enqueue = enqueue};

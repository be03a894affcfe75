/* What was, for people: which edits led to now, by whom and when, and names of moments. How views show one:
 * view_moment.h; how the scene goes back to one: scene.revert, an edit. */
#include "server/director/internal.h"

#include <stdio.h>
#include <string.h>

#include <cjson/cJSON.h>

#include "protocol/json/json.h"
#include "protocol/record/field.h"
#include "server/director/read_request.h"
#include "server/director/saving.h"
#include "server/project/store.h"

#define TOLD_MAX 4u /* changes of a step: a line of text */

/* ---- what a step did ---- */

/* The first field that differs, NULL: none does. */
static const char *field_of(const struct lum_change *c)
{
    const struct lum_fields *fields = lum_fields_of(c->after->type);
    if (c->before->type != c->after->type)
        return NULL;
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
    lum_json_add(o, NULL, cJSON_CreateString(!c->before ? "add" : c->after ? "set" : "remove"));
    lum_json_add(o, NULL, cJSON_CreateString(r->id));
    lum_json_add(o, NULL, cJSON_CreateString(field ? field : lum_record_type_names[r->type]));
    return o;
}

/* What an import brought is left to it, unless there is nothing else. */
static cJSON *changes_json(const struct lum_changes *changes)
{
    cJSON *list = cJSON_CreateArray();
    size_t n = 0;
    for (int children = 0; children < 2 && n == 0; children++)
        for (size_t i = 0; i < changes->n && n < TOLD_MAX; i++) {
            const struct lum_change *c = &changes->changes[i];
            if (!(c->after ? c->after : c->before)->origin[0] == !children) {
                lum_json_add(list, NULL, change_json(c));
                n++;
            }
        }
    return list;
}

static cJSON *moment_json(const struct lum_moment *m, bool first)
{
    static const char *const did[] = {"apply", "undo", "redo", "revert"};
    cJSON *o = cJSON_CreateObject();
    lum_json_add_number(o, "scene_rev", (double)m->rev);
    if (m->at_ms > 0)
        lum_json_add_number(o, "at_ms", (double)m->at_ms);
    if (m->name[0]) {
        lum_json_add_string(o, "name", m->name);
        lum_json_add_string(o, "named_by", m->named_by);
    }
    if (first)
        return o;
    lum_json_add_string(o, "did", did[m->did]);
    lum_json_add_string(o, "user", m->user);
    if (m->did == LUM_PAST_REVERT)
        lum_json_add_number(o, "to", (double)m->to);
    if (m->n_joined > 1)
        lum_json_add_number(o, "joined", m->n_joined);
    lum_json_add(o, "changes", changes_json(&m->changes));
    lum_json_add_number(o, "n_changes", (double)m->changes.n);
    return o;
}

/* ---- timeline.get ---- */

static bool read_get(struct lum_json_reader *r, struct lum_request *q)
{
    lum_json_u64(r, "since_rev", &q->rev);
    return lum_json_end(r);
}

static void get(struct lum_director *d, const struct lum_request *q)
{
    const struct lum_document *doc = d->world.doc;
    cJSON *result = cJSON_CreateObject(), *moments = cJSON_CreateArray();
    for (size_t i = 0; i < lum_document_n_moments(doc); i++) {
        const struct lum_moment *m = lum_document_moment(doc, i);
        if (m->rev >= q->rev)
            lum_json_add(moments, NULL, moment_json(m, i == 0));
    }
    lum_json_add(result, "moments", moments);
    lum_json_add_number(result, "first_rev", (double)lum_document_moment(doc, 0)->rev);
    lum_json_add_number(result, "scene_rev", (double)lum_document_rev(doc));
    lum_director_reply(d, q, result);
}

const struct lum_request_type lum_request_timeline_get = {.name = "timeline.get", .read = read_get, .answer = get};

/* ---- timeline.name ---- */

static bool read_name(struct lum_json_reader *r, struct lum_request *q)
{
    bool ok = lum_json_require(r, "scene_rev") && lum_json_u64(r, "scene_rev", &q->rev) &&
              lum_json_require(r, "name") && lum_json_string(r, "name", q->name, sizeof q->name) && lum_json_end(r);
    if (!ok || !q->name[0] || lum_project_name_shows(q->name))
        return ok;
    lum_proto_fail(r->err, LUM_PROTO_BAD_PARAMS, "invalid_value", "name",
                   "name must be 1 to %u bytes of text that can be seen, without a space before or after it, or empty",
                   LUM_LIMIT_MOMENT_NAME_BYTES);
    return lum_json_fail(r);
}

static void name(struct lum_director *d, const struct lum_request *q)
{
    struct lum_proto_error err;
    struct lum_moment_name was;
    if (!lum_director_may_edit(d, &err) ||
        !lum_document_name_moment(d->world.doc, q->user, q->rev, q->name, &was, &err)) {
        lum_director_refuse(d, q, &err);
        return;
    }
    uint64_t seq = lum_director_note_name(d, q, &was);
    lum_director_reply_edit(d, q, cJSON_CreateObject(), seq);
    lum_director_tell_name(d, was.rev, q->name, q->user);
}

const struct lum_request_type lum_request_timeline_name = {.name = "timeline.name", .read = read_name, .answer = name};

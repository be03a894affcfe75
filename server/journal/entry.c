#include "server/journal/entry.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cjson/cJSON.h>

#include "protocol/json/json.h"

static const char *const kinds[] = {"apply", "undo", "redo", "drop", "redrop", "forget", "revert", "name"};

struct lum_entry *lum_entry_create(enum lum_entry_kind kind, const char *user)
{
    struct lum_entry *e = lum_calloc(1, sizeof *e);
    if (!e)
        return NULL;
    e->kind = kind;
    snprintf(e->user, sizeof e->user, "%s", user);
    return e;
}

void lum_entry_destroy(struct lum_entry *e)
{
    if (!e)
        return;
    cJSON_Delete(e->ops);
    free(e->content);
    lum_free(e);
}

void lum_entries_destroy(struct lum_entry *e)
{
    for (struct lum_entry *next; e; e = next) {
        next = e->next;
        lum_entry_destroy(e);
    }
}

static bool add_content(cJSON *json, const struct lum_entry *e)
{
    cJSON *o = cJSON_CreateArray(); /* of pairs: ids of two ops may be the same where one removes what another made */
    bool ok = o != NULL;
    for (size_t i = 0; i < e->n_content && ok; i++)
        ok = lum_json_add(o, NULL, cJSON_CreateString(e->content[i].id)) &&
             lum_json_add(o, NULL, cJSON_CreateString(e->content[i].sha));
    return lum_json_add(json, "content", o) && ok;
}

static bool add_apply(cJSON *json, struct lum_entry *e)
{
    cJSON *ops = e->ops;
    e->ops = NULL;
    return lum_json_add(json, "ops", ops) &&
           (!e->undo_group[0] || lum_json_add_string(json, "undo_group", e->undo_group)) &&
           (e->n_content == 0 || add_content(json, e));
}

struct cJSON *lum_entry_to_json(struct lum_entry *e)
{
    cJSON *json = cJSON_CreateObject();
    bool ok = lum_json_add_string(json, "do", kinds[e->kind]) && lum_json_add_string(json, "user", e->user) &&
              (!e->op_id[0] || lum_json_add_string(json, "op_id", e->op_id));
    if (ok && e->kind == LUM_ENTRY_APPLY)
        ok = add_apply(json, e);
    else if (ok && e->kind != LUM_ENTRY_FORGET)
        ok = lum_json_add_number(json, "of", (double)e->of);
    ok = ok && (e->kind != LUM_ENTRY_NAME || lum_json_add_string(json, "name", e->name)) &&
         lum_json_add_number(json, "at", (double)e->at_ms);
    if (ok)
        return json;
    cJSON_Delete(json);
    return NULL;
}

/* ---- doing it again ---- */

/* The entry as it was read. */
struct reading {
    const struct lum_replay *replay;
    unsigned kind;
    char user[LUM_LIMIT_ID_BYTES + 1];
    double of, at_ms;
    lum_id op_id, undo_group;
    char name[LUM_LIMIT_MOMENT_NAME_BYTES + 1];
    struct lum_ops ops;
    struct lum_import_children *children; /* of import ops, in op order */
    struct lum_record_list *lists;        /* the same, owned */
    size_t n_children;
};

static bool refused(const char *text, char why[256])
{
    snprintf(why, 256, "%s", text);
    return false;
}

/* The pair of the i-th op that needs content. */
static const char *content_of(const cJSON *content, size_t i, const char *id)
{
    const cJSON *name = cJSON_GetArrayItem(content, (int)(2 * i));
    const char *sha = cJSON_GetStringValue(name ? name->next : NULL), *text = cJSON_GetStringValue(name);
    return sha && text && strcmp(text, id) == 0 && lum_sha_is(sha) ? sha : NULL;
}

static bool load(const struct reading *e, const char *sha, struct lum_record_list *ret, char why[256])
{
    struct lum_error err;
    if (lum_content_read(e->replay->content, sha, e->replay->damage, ret, &err)) {
        lum_damage_unread(e->replay->damage, &err);
        return refused(err.text, why);
    }
    for (size_t i = 0; i < ret->n; i++)
        if (!ret->records[i]) {
            lum_record_list_finish(ret);
            return refused("its content is damaged", why);
        }
    if (ret->n > 0)
        lum_kept_add(e->replay->kept, ret->records[0], ret->n, sha);
    return true;
}

/* The image of an add, or the light of an add or a set, as its file made it. */
static bool fill_record(struct lum_op *op, struct lum_record_list *list, char why[256])
{
    struct lum_record *r = list->n == 1 ? list->records[0] : NULL;
    enum lum_record_type type = lum_op_web_file(op) ? LUM_RECORD_LIGHT : LUM_RECORD_IMAGE;
    bool ok = r && r->type == type && strcmp(r->id, op->id) == 0 && (type == LUM_RECORD_IMAGE || r->light.web);
    if (ok) {
        lum_record_unref(op->record);
        op->record = lum_record_ref(r);
    }
    lum_record_list_finish(list);
    return ok || refused("its content is no such image or light", why);
}

static bool load_content(struct reading *e, const cJSON *content, char why[256])
{
    size_t n = 0;
    e->children = calloc(e->ops.n, sizeof *e->children);
    e->lists = calloc(e->ops.n, sizeof *e->lists);
    if (!e->children || !e->lists) {
        lum_damage_no_memory(e->replay->damage);
        return refused("memory is short", why);
    }
    for (size_t i = 0; i < e->ops.n; i++) {
        struct lum_op *op = &e->ops.ops[i];
        struct lum_record_list list;
        bool image = op->kind == LUM_OP_ADD && op->record->type == LUM_RECORD_IMAGE && op->record->image.asset[0];
        bool alone = image || lum_op_web_file(op);
        if (op->kind != LUM_OP_IMPORT && !alone)
            continue;
        const char *sha = content_of(content, n++, op->id);
        if (!sha)
            return refused("it does not name its content", why);
        if (!load(e, sha, &list, why) || (alone && !fill_record(op, &list, why)))
            return false;
        if (alone)
            continue;
        e->lists[e->n_children] = list;
        struct lum_import_children *c = &e->children[e->n_children++];
        *c = (struct lum_import_children){.records = list.records, .n = list.n};
        memcpy(c->import_id, op->id, sizeof c->import_id);
    }
    return true;
}

static bool read_apply(struct reading *e, struct lum_json_reader *r, char why[256])
{
    struct lum_proto_error *err = r->err;
    lum_json_id(r, "undo_group", e->undo_group);
    const cJSON *ops = lum_json_member(r, "ops"), *content = lum_json_member(r, "content");
    if (!lum_json_end(r) || !lum_ops_from_stored(ops, &e->ops, err))
        return refused(err->text, why);
    memcpy(e->ops.undo_group, e->undo_group, sizeof e->undo_group);
    return load_content(e, content, why);
}

static bool read_entry(struct reading *e, const cJSON *json, struct lum_proto_error *err, char why[256])
{
    struct lum_json_reader r;
    lum_json_begin(&r, json, "", err);
    if (!lum_json_require(&r, "do") ||
        !lum_json_choice(&r, "do", "apply|undo|redo|drop|redrop|forget|revert|name", &e->kind) ||
        !lum_json_require(&r, "user") || !lum_json_string(&r, "user", e->user, sizeof e->user))
        return refused(err->text, why);
    if (e->kind != LUM_ENTRY_FORGET)
        lum_json_id(&r, "op_id", e->op_id);
    lum_json_number(&r, "at", 0, 0x1p53, &e->at_ms);
    if (e->kind == LUM_ENTRY_NAME)
        lum_json_string(&r, "name", e->name, sizeof e->name);
    if (e->kind == LUM_ENTRY_APPLY)
        return read_apply(e, &r, why);
    if (e->kind != LUM_ENTRY_FORGET && lum_json_require(&r, "of"))
        lum_json_number(&r, "of", 0, 0x1p53, &e->of);
    return lum_json_end(&r) || refused(err->text, why);
}

/* The step is told by its revision: after a loss the next one may be another. A drop of what is not there is done. */
static bool walk(struct reading *e, struct lum_changes *changes, struct lum_proto_error *err, char why[256])
{
    struct lum_document *doc = e->replay->doc;
    bool redo = e->kind == LUM_ENTRY_REDO || e->kind == LUM_ENTRY_REDROP;
    bool drop = e->kind == LUM_ENTRY_DROP || e->kind == LUM_ENTRY_REDROP;
    if (lum_document_next_undo(doc, e->user, redo) != (uint64_t)e->of)
        return drop || refused("the step that it takes back is lost", why);
    bool done = redo ? lum_document_redo(doc, e->user, changes, err) : lum_document_undo(doc, e->user, changes, err);
    if (done && drop) /* what was in its way is lost: the step is still there, and stays */
        lum_document_rollback(doc, changes);
    return done || drop || refused(err->text, why);
}

static bool do_again(struct reading *e, struct lum_proto_error *err, char why[256])
{
    struct lum_document *doc = e->replay->doc;
    struct lum_changes changes = {0};
    bool ok = true;
    lum_document_set_time(doc, (int64_t)e->at_ms);
    if (e->kind == LUM_ENTRY_REVERT)
        ok = lum_document_revert(doc, e->user, (uint64_t)e->of, &changes, err) || refused(err->text, why);
    else if (e->kind == LUM_ENTRY_NAME)
        ok = lum_document_name_moment(doc, e->user, (uint64_t)e->of, e->name, NULL, err) || refused(err->text, why);
    else if (e->kind == LUM_ENTRY_FORGET)
        lum_document_forget_user(doc, e->user);
    else if (e->kind == LUM_ENTRY_APPLY)
        ok = lum_document_apply(doc, e->user, &e->ops, e->children, e->n_children, &changes, err) ||
             refused(err->text, why);
    else
        ok = walk(e, &changes, err, why);
    lum_changes_finish(&changes);
    return ok;
}

/* It makes a revision. */
static bool edits(const struct reading *e)
{
    return e->kind <= LUM_ENTRY_REDO || e->kind == LUM_ENTRY_REVERT;
}

/* One that is dropped was refused. */
static void note(const struct reading *e, uint64_t rev)
{
    struct lum_done done = {.scene_rev = edits(e) ? rev : 0};
    snprintf(done.op_id, sizeof done.op_id, "%s", e->op_id);
    if (e->kind == LUM_ENTRY_FORGET)
        (void)lum_done_forget(e->replay->done, e->user);
    else if (done.op_id[0] && !lum_done_reserve(e->replay->done, e->user))
        lum_damage_no_memory(e->replay->damage);
    else
        lum_done_note(*e->replay->done, e->user, &done);
}

bool lum_entry_replay(const struct lum_replay *replay, const struct lum_block *f, char ret_why[256])
{
    struct reading e = {.replay = replay};
    struct lum_proto_error err = {0};
    bool ok = read_entry(&e, f->json, &err, ret_why);
    if (ok && edits(&e) && f->rev > 0)
        lum_document_raise_rev(replay->doc, f->rev - 1); /* revisions of what is lost are not given again */
    ok = ok && do_again(&e, &err, ret_why);
    if (ok)
        note(&e, f->rev);
    lum_damage_note(replay->damage, &err);
    lum_document_raise_rev(replay->doc, f->rev);
    for (size_t i = 0; i < e.n_children; i++)
        lum_record_list_finish(&e.lists[i]);
    free(e.lists);
    free(e.children);
    lum_ops_finish(&e.ops);
    return ok;
}

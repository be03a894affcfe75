/* The director and the journal.
 *
 * The order of an edit: applied in memory, published (frames show it), its entry submitted; its reply, scene.changed
 * and whatever is said after them wait in the outbox until the entry is durable (lum_director_take_outbox). So nobody
 * is told of an edit that a crash could take, and nothing but messages waits: passes and frames go on.
 *
 * If the journal fails, edits that are not durable are taken back: their replies become refusals, and since others may
 * see them in pictures, the taking back is a new revision, announced like any edit. Until the journal can write again
 * edits are refused. Names of moments go the same way, but for revisions: they make none. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include <cjson/cJSON.h>

#include "protocol/json/json.h"
#include "protocol/message/rpc.h"
#include "server/base/log.h"
#include "server/director/audit.h"
#include "server/director/saving.h"
#include "server/world/luminaires.h"

/* ---- start ---- */

static void wake_net(void *user)
{
    struct lum_director *d = user;
    d->config.wake_net(d->config.wake_user);
}

static void wake_director(void *user)
{
    lum_director_ring(user);
}

enum lum_status lum_director_open_state(struct lum_director *d, bool *ret_loaded, struct lum_error *err)
{
    struct lum_document *doc = NULL;
    *ret_loaded = false;
    if (!d->config.state_dir)
        return LUM_OK;
    const struct lum_journal_config config = {
        .dir = d->config.state_dir,
        .durability = d->config.durability,
        .compact_bytes = d->config.snapshot_bytes,
        .disk = d->config.state_disk,
        .log = d->config.log,
        .saved = wake_net,
        .attention = wake_director,
        .user = d,
    };
    enum lum_status st = lum_journal_open(&config, &d->journal, &doc, err);
    if (st || !doc)
        return st;
    d->repeats = lum_journal_take_done(d->journal);
    if (d->config.scene_asked)
        lum_log(&d->config.log, LUM_LOG_WARNING, "main",
                "%.200s has a scene already, which is served; %.60s is left aside: it is for an empty folder",
                d->config.state_dir, d->config.scene);
    *ret_loaded = true;
    return lum_world_restore(&d->world, doc, err);
}

/* With what is known of edits. False: memory is short. */
static bool take_state(struct lum_director *d, struct lum_document_state *ret_state)
{
    struct lum_done_user *done;
    if (!lum_done_copy(d->repeats, &done))
        return false;
    lum_journal_give_done(d->journal, done);
    return lum_document_take_state(d->world.doc, ret_state);
}

enum lum_status lum_director_start_saving(struct lum_director *d, struct lum_error *err)
{
    struct lum_document_state state;
    if (!d->journal)
        return LUM_OK;
    if (!take_state(d, &state))
        return lum_fail(err, LUM_ERR_NOMEM, "state", "no memory to save the scene");
    return lum_journal_start(d->journal, &state, err);
}

static void copy_state(struct lum_director *d, const struct lum_request *q)
{
    struct lum_document_state state = {0};
    q->give(q->give_user, &state, lum_document_take_state(d->world.doc, &state));
}

const struct lum_request_type lum_request_copy_state = {.answer = copy_state};

/* ---- entries ---- */

bool lum_director_may_edit(struct lum_director *d, struct lum_proto_error *err)
{
    struct lum_error e;
    enum lum_status st = d->journal ? lum_journal_accepts(d->journal, &e) : LUM_OK;
    return !st || lum_proto_fail(err, LUM_PROTO_APPLICATION, st == LUM_ERR_LIMIT ? "busy" : "io", "", "%s", e.text);
}

void lum_director_set_time(struct lum_director *d, struct lum_entry *entry)
{
    struct timespec now;
    timespec_get(&now, TIME_UTC);
    int64_t at_ms = (int64_t)now.tv_sec * 1000 + now.tv_nsec / 1000000;
    lum_document_set_time(d->world.doc, at_ms);
    if (entry)
        entry->at_ms = at_ms;
}

/* As they came, or from what was read of them. */
static struct cJSON *take_ops(struct lum_request *q)
{
    cJSON *ops = q->ops_json;
    q->ops_json = NULL;
    if (ops)
        return ops;
    ops = cJSON_CreateArray();
    bool ok = ops != NULL;
    for (size_t i = 0; i < q->ops.n && ok; i++)
        ok = lum_json_add(ops, NULL, lum_op_to_json(&q->ops.ops[i]));
    if (ok)
        return ops;
    cJSON_Delete(ops);
    return NULL;
}

bool lum_director_make_entry(struct lum_director *d, struct lum_request *q, struct lum_entry **inout_entry)
{
    if (!d->journal)
        return true;
    struct lum_entry *e = *inout_entry;
    enum lum_entry_kind kind = q->type == &lum_request_scene_undo     ? LUM_ENTRY_UNDO
                               : q->type == &lum_request_scene_redo   ? LUM_ENTRY_REDO
                               : q->type == &lum_request_scene_revert ? LUM_ENTRY_REVERT
                                                                      : LUM_ENTRY_APPLY;
    if (!e)
        e = lum_entry_create(kind, q->user);
    *inout_entry = e;
    if (e)
        memcpy(e->op_id, q->op_id, sizeof e->op_id);
    if (!e || kind != LUM_ENTRY_APPLY)
        return e != NULL;
    memcpy(e->undo_group, q->ops.undo_group, sizeof e->undo_group);
    e->n_bytes = q->n_bytes;
    e->ops = take_ops(q);
    return e->ops != NULL;
}

/* What the importer made of one op that needs it: a list of records. */
static bool store_one(struct lum_director *d, struct lum_import_job *job, size_t i, size_t *n_imports,
                      struct lum_proto_error *err)
{
    const struct lum_op *op = &job->request->ops.ops[i];
    struct lum_entry_content *c = &job->entry->content[job->entry->n_content];
    bool image = op->kind == LUM_OP_ADD && op->record->type == LUM_RECORD_IMAGE && op->record->image.asset[0];
    bool alone = image || lum_op_web_file(op); /* one record, which the op has by now */
    struct lum_error e;
    enum lum_status st = LUM_OK;
    if (op->kind != LUM_OP_IMPORT && !alone)
        return true;
    if (alone) {
        st = lum_journal_store(d->journal, &op->record, 1, c->sha, &e);
    } else {
        const struct lum_import_children *made = &job->expansion.children[(*n_imports)++];
        st = lum_journal_store(d->journal, made->records, made->n, c->sha, &e);
    }
    if (st)
        return lum_proto_fail(err, LUM_PROTO_APPLICATION, "io", "ops", "the import cannot be saved: %.200s", e.text);
    memcpy(c->id, op->id, sizeof c->id);
    job->entry->n_content++;
    return true;
}

bool lum_director_store_imports(struct lum_director *d, struct lum_import_job *job, struct lum_proto_error *err)
{
    const struct lum_ops *ops = &job->request->ops;
    size_t n_imports = 0;
    bool ok = true;
    if (!d->journal)
        return true;
    job->entry = lum_entry_create(LUM_ENTRY_APPLY, job->request->user);
    if (!job->entry || !(job->entry->content = calloc(ops->n, sizeof *job->entry->content)))
        return lum_proto_fail_memory(err);
    for (size_t i = 0; i < ops->n && ok; i++)
        ok = store_one(d, job, i, &n_imports, err);
    return ok;
}

static void submit(struct lum_director *d, struct lum_entry *e, uint64_t rev, uint64_t *ret_seq)
{
    *ret_seq = lum_journal_submit(d->journal, e, rev);
    if (d->config.durability != LUM_DURABILITY_COMMIT)
        return;
    pthread_mutex_lock(&d->lock);
    d->submitted_seq = *ret_seq;
    pthread_mutex_unlock(&d->lock);
}

void lum_director_submit(struct lum_director *d, struct lum_staged_edit *p)
{
    struct lum_entry *e = p->entry;
    p->entry = NULL;
    if (e)
        submit(d, e, p->scene_rev, &p->seq);
}

void lum_director_note(struct lum_director *d, enum lum_entry_kind kind, const char *user, const char *op_id,
                       uint64_t of)
{
    struct lum_entry *e = d->journal ? lum_entry_create(kind, user) : NULL;
    uint64_t seq;
    if (!e)
        return;
    snprintf(e->op_id, sizeof e->op_id, "%s", op_id);
    e->of = of;
    submit(d, e, lum_document_rev(d->world.doc), &seq);
}

uint64_t lum_director_note_name(struct lum_director *d, const struct lum_request *q, const struct lum_moment_name *was)
{
    struct lum_entry *e = d->journal ? lum_entry_create(LUM_ENTRY_NAME, q->user) : NULL;
    struct lum_staged_edit *p = e ? lum_calloc(1, sizeof *p) : NULL;
    if (!p) {
        lum_entry_destroy(e);
        lum_director_save_histories(d);
        return 0;
    }
    e->of = was->rev;
    memcpy(e->name, q->name, sizeof e->name); /* it is not longer */
    lum_director_set_time(d, e);
    *p =
        (struct lum_staged_edit){.entry = e, .scene_rev = lum_document_rev(d->world.doc), .is_name = true, .was = *was};
    lum_director_submit(d, p);
    uint64_t seq = p->seq;
    lum_director_keep_unsaved(d, p);
    return seq;
}

void lum_director_tell_name(struct lum_director *d, uint64_t rev, const char *name, const char *user)
{
    cJSON *params = cJSON_CreateObject();
    lum_json_add_number(params, "scene_rev", (double)rev);
    lum_json_add_string(params, "name", name);
    lum_json_add_string(params, "user", user);
    lum_director_send(d, LUM_OUT_BROADCAST, (struct lum_session_ref){0},
                      lum_rpc_notification("timeline.named", params));
}

void lum_director_save_histories(struct lum_director *d)
{
    if (d->journal)
        lum_journal_want_state(d->journal);
}

/* ---- until they are durable ---- */

void lum_director_keep_unsaved(struct lum_director *d, struct lum_staged_edit *p)
{
    if (!d->journal || d->config.durability != LUM_DURABILITY_COMMIT) {
        lum_director_free_edit(p);
        return;
    }
    lum_request_destroy(p->request);
    lum_expansion_finish(&p->expansion);
    p->request = NULL;
    p->next = NULL;
    *d->unsaved_tail = p;
    d->unsaved_tail = &p->next;
}

static void forget_durable(struct lum_director *d)
{
    uint64_t durable = lum_journal_acknowledged(d->journal);
    while (d->unsaved && d->unsaved->seq <= durable) {
        struct lum_staged_edit *p = d->unsaved;
        d->unsaved = p->next;
        lum_director_free_edit(p);
    }
    if (!d->unsaved)
        d->unsaved_tail = &d->unsaved;
}

/* The changes the other way round, borrowed, as ops. */
static struct cJSON *inverse_ops(const struct lum_changes *c)
{
    struct lum_changes inverse = {.changes = calloc(c->n ? c->n : 1, sizeof *inverse.changes), .n = c->n};
    for (size_t i = 0; i < c->n && inverse.changes; i++)
        inverse.changes[i] = (struct lum_change){c->changes[c->n - 1 - i].after, c->changes[c->n - 1 - i].before};
    cJSON *ops = inverse.changes ? lum_changes_to_json(&inverse) : NULL;
    free(inverse.changes);
    return ops;
}

/* emits: what changed of objects that shine, or NULL; taken over. */
static void announce_inverse(struct lum_director *d, const struct lum_staged_edit *p, uint64_t rev, cJSON *emits)
{
    cJSON *changed = cJSON_CreateObject();
    lum_json_add_number(changed, "scene_rev", (double)rev);
    lum_json_add_string(changed, "op_id", "");
    lum_json_add_string(changed, "user", "(server)");
    lum_json_add(changed, "ops", inverse_ops(&p->changes));
    if (emits)
        lum_json_add(changed, "emits", emits);
    lum_director_send_changed(d, rev, changed);
}

/* Newest first. */
static struct lum_staged_edit *reversed(struct lum_staged_edit *list)
{
    struct lum_staged_edit *out = NULL;
    for (struct lum_staged_edit *next; list; list = next) {
        next = list->next;
        list->next = out;
        out = list;
    }
    return out;
}

/* Takes all of them back, newest first, and publishes. The revision goes on, one for each edit. Returns what changed of
 * objects that shine. */
static cJSON *roll_back(struct lum_director *d, const struct lum_staged_edit *newest_first)
{
    struct lum_error e;
    uint64_t rev = lum_document_rev(d->world.doc);
    bool edits = false;
    for (const struct lum_staged_edit *p = newest_first; p; p = p->next) {
        if (p->is_name) {
            lum_document_name_back(d->world.doc, &p->was);
            continue;
        }
        lum_world_rollback(&d->world, &p->changes);
        rev++;
        edits = true;
    }
    if (!edits)
        return NULL;
    const struct lum_snapshot *was = lum_snapshot_ref(d->world.snapshot);
    lum_document_raise_rev(d->world.doc, rev);
    if (lum_world_commit(&d->world, &e))
        lum_log(&d->config.log, LUM_LOG_ERROR, "director", "edits that were taken back still show: %s", e.text);
    lum_director_follow_desk(d);
    atomic_store(&d->scene_rev, rev);
    lum_director_count_scene(d);
    cJSON *emits = lum_luminaires_changes(was, d->world.snapshot);
    lum_snapshot_unref(was);
    return emits;
}

/* Revisions of edits go on from `rev`, and the last of them has `emits` (taken over): it is as after all. */
static void tell_lost(struct lum_director *d, struct lum_staged_edit *lost, uint64_t rev, cJSON *emits)
{
    for (struct lum_staged_edit *p = lost, *next; p; p = next) {
        next = p->next;
        if (p->is_name) {
            lum_director_tell_name(d, p->was.rev, p->was.name, "(server)");
        } else {
            bool last = ++rev == lum_document_rev(d->world.doc);
            lum_director_audit_lost(d, p, rev);
            announce_inverse(d, p, rev, last ? emits : NULL);
        }
        lum_director_free_edit(p);
    }
}

static void take_back_lost(struct lum_director *d, uint64_t durable, const char *why)
{
    struct lum_proto_error err;
    forget_durable(d);
    if (d->config.durability == LUM_DURABILITY_COMMIT)
        lum_done_lose(d->repeats, durable);
    struct lum_staged_edit *lost = reversed(d->unsaved);
    uint64_t rev = lum_document_rev(d->world.doc);
    d->unsaved = NULL;
    d->unsaved_tail = &d->unsaved;
    cJSON *emits = lost ? roll_back(d, lost) : NULL;
    lum_proto_fail(&err, LUM_PROTO_APPLICATION, "io", "", "the edit could not be saved, and is taken back: %.180s",
                   why);
    lum_director_refuse_lost(d, durable, &err);
    tell_lost(d, lost, rev, emits);
    if (lum_document_rev(d->world.doc) != rev)
        lum_director_refresh_views(d, lum_clock_ns());
}

void lum_director_turn_saving(struct lum_director *d)
{
    uint64_t durable;
    char why[256];
    struct lum_document_state state;
    if (!d->journal)
        return;
    if (lum_journal_failed(d->journal, &durable, why))
        take_back_lost(d, durable, why);
    forget_durable(d);
    if (lum_journal_wants_state(d->journal) && take_state(d, &state))
        lum_journal_give_state(d->journal, &state);
}

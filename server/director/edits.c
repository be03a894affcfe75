/* The director's edits: applied at once, imported on threads, committed together. */
#define _GNU_SOURCE /* pthread_setname_np */
#include "server/director/internal.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cjson/cJSON.h>

#include "protocol/json/json.h"
#include "protocol/message/rpc.h"
#include "server/base/log.h"
#include "server/director/audit.h"
#include "server/director/read_request.h"
#include "server/director/repeats.h"
#include "server/director/saving.h"
#include "server/world/apply.h"
#include "server/world/luminaires.h"
#include "server/world/photometry.h"

#define PROGRESS_EVERY_NS 100000000ll /* of the same stage: a bar that moves evenly to the eye */
#define STAGE_EVERY_NS 10000000ll     /* of a new stage: a child gone wrong must not flood a session */

static void count(struct lum_director *d, uint64_t *counter)
{
    pthread_mutex_lock(&d->lock);
    ++*counter;
    pthread_mutex_unlock(&d->lock);
}

void lum_director_refuse_edit(struct lum_director *d, struct lum_request *q, const struct lum_proto_error *err)
{
    lum_director_refuse(d, q, err);
    lum_request_destroy(q);
    count(d, &d->metrics.edits_refused);
}

/* ---- edits ---- */

static bool change_world(struct lum_director *d, const struct lum_request *q, const struct lum_expansion *e,
                         struct lum_changes *ret_changes, struct lum_proto_error *err)
{
    if (q->type == &lum_request_scene_undo)
        return lum_world_undo(&d->world, q->user, ret_changes, err);
    if (q->type == &lum_request_scene_redo)
        return lum_world_redo(&d->world, q->user, ret_changes, err);
    if (q->type == &lum_request_scene_revert)
        return lum_world_revert(&d->world, q->user, q->rev, ret_changes, err);
    return lum_world_apply(&d->world, &(struct lum_edit){q->user, &q->ops, e->children, e->n}, ret_changes, err);
}

/* The step that an undo or a redo is about to take; 0: none, or no such request. */
static uint64_t next_step(struct lum_director *d, const struct lum_request *q)
{
    bool undo = q->type == &lum_request_scene_undo, redo = q->type == &lum_request_scene_redo;
    return undo || redo ? lum_document_next_undo(d->world.doc, q->user, redo) : 0;
}

/* A conflict makes the step be forgotten: the journal has to know, after all edits before. It also keeps the op_id of
 * what was refused, if only because there was no step: sent again after a start it would take one that came later. */
static void note_refused_step(struct lum_director *d, const struct lum_request *q, uint64_t of)
{
    if (q->type != &lum_request_scene_undo && q->type != &lum_request_scene_redo)
        return;
    lum_repeats_note_refused(d, q);
    if (!q->op_id[0] && next_step(d, q) == of)
        return;
    lum_director_commit(d);
    lum_director_note(d, q->type == &lum_request_scene_redo ? LUM_ENTRY_REDROP : LUM_ENTRY_DROP, q->user, q->op_id, of);
}

/* Takes the request, the expansion and the entry (NULL: none yet) over. */
static void apply(struct lum_director *d, struct lum_request *q, struct lum_expansion *expansion,
                  struct lum_entry *entry)
{
    struct lum_proto_error err;
    struct lum_staged_edit *p = lum_calloc(1, sizeof *p);
    uint64_t of = next_step(d, q);
    if (!p || !lum_director_make_entry(d, q, &entry)) {
        lum_proto_fail_memory(&err);
        goto refused;
    }
    if (!lum_director_may_edit(d, &err))
        goto refused;
    if (!lum_repeats_reserve(d, q)) {
        lum_proto_fail_memory(&err);
        goto refused;
    }
    if (q->has_base_rev && q->base_rev != lum_document_rev(d->world.doc)) {
        lum_proto_fail(&err, LUM_PROTO_APPLICATION, "rev_conflict", "base_rev",
                       "the scene is at revision %llu, not %llu", (unsigned long long)lum_document_rev(d->world.doc),
                       (unsigned long long)q->base_rev);
        goto refused;
    }
    lum_director_set_time(d, entry);
    if (!change_world(d, q, expansion, &p->changes, &err)) {
        note_refused_step(d, q, of);
        goto refused;
    }
    if (entry)
        entry->of = q->type == &lum_request_scene_revert ? q->rev : of;
    p->entry = entry;
    p->request = q;
    p->expansion = *expansion;
    p->scene_rev = lum_document_rev(d->world.doc);
    p->next = d->staged;
    d->staged = p;
    return;
refused:
    lum_free(p);
    lum_entry_destroy(entry);
    lum_expansion_finish(expansion);
    lum_director_refuse_edit(d, q, &err);
}

static void start_import(struct lum_director *d, struct lum_request *q)
{
    struct lum_proto_error err;
    struct lum_import_job **last = &d->jobs, *job = NULL;
    uint32_t n = 0;
    for (; *last; n++)
        last = &(*last)->next;
    if (n == LUM_LIMIT_IMPORTS_WAITING)
        lum_proto_fail(&err, LUM_PROTO_APPLICATION, "busy", "ops", "%u imports wait already; try again", n);
    else if (!(job = lum_calloc(1, sizeof *job)))
        lum_proto_fail_memory(&err);
    if (!job) {
        lum_director_refuse_edit(d, q, &err);
        return;
    }
    job->director = d;
    job->request = q;
    *last = job;
}

/* True: the edit was done, or is under way, and q is taken over. */
static bool answer_repeat(struct lum_director *d, struct lum_request *q)
{
    if (!q->repeat)
        return false;
    lum_director_commit(d); /* what is staged is known then */
    if (lum_repeats_answer(d, q)) {
        lum_request_destroy(q);
        return true;
    }
    for (struct lum_import_job *job = d->jobs; job; job = job->next) {
        if (strcmp(job->request->user, q->user) != 0 || strcmp(job->request->op_id, q->op_id) != 0)
            continue;
        lum_request_destroy(job->again);
        job->again = q;
        return true;
    }
    return false;
}

void lum_director_edit(struct lum_director *d, struct lum_request *q, struct lum_expansion *warnings)
{
    if (answer_repeat(d, q))
        lum_expansion_finish(warnings);
    else
        apply(d, q, warnings, NULL);
}

static void edit(struct lum_director *d, struct lum_request *q)
{
    struct lum_expansion none = {0};
    if (answer_repeat(d, q))
        return;
    if (q->type == &lum_request_scene_apply && lum_ops_need_import(&q->ops)) {
        struct lum_proto_error err;
        if ((d->config.assets_dir || d->config.uploads_dir) && lum_director_may_edit(d, &err)) {
            start_import(d, q);
            return;
        }
        if (!d->config.assets_dir && !d->config.uploads_dir)
            lum_proto_fail(&err, LUM_PROTO_APPLICATION, "unsupported", "ops",
                           "this server has no folder of model files: start it with --assets DIR");
        lum_director_refuse_edit(d, q, &err);
        return;
    }
    apply(d, q, &none, NULL);
}

void lum_director_read_op_id(struct lum_json_reader *r, struct lum_request *q)
{
    lum_json_id(r, "op_id", q->op_id);
    lum_json_bool(r, "repeat", &q->repeat);
    if (q->repeat)
        lum_json_require(r, "op_id");
}

static bool read_step(struct lum_json_reader *r, struct lum_request *q)
{
    lum_director_read_op_id(r, q);
    return lum_json_end(r);
}

static bool read_scene_revert(struct lum_json_reader *r, struct lum_request *q)
{
    lum_director_read_op_id(r, q);
    return lum_json_require(r, "scene_rev") && lum_json_u64(r, "scene_rev", &q->rev) && lum_json_end(r);
}

static bool read_scene_apply(struct lum_json_reader *r, struct lum_request *q)
{
    lum_id undo_group = "";
    lum_director_read_op_id(r, q);
    lum_json_id(r, "undo_group", undo_group);
    q->has_base_rev = lum_json_u64(r, "base_rev", &q->base_rev);
    bool has_ops = lum_json_require(r, "ops");
    const struct cJSON *ops = lum_json_member(r, "ops");
    if (!lum_json_end(r) || !has_ops || !lum_ops_from_json(ops, &q->ops, r->err))
        return false;
    memcpy(q->ops.undo_group, undo_group, sizeof undo_group);
    return true;
}

const struct lum_request_type lum_request_scene_apply = {
    .name = "scene.apply", .read = read_scene_apply, .take = edit, .edits = true};

const struct lum_request_type lum_request_scene_undo = {
    .name = "scene.undo", .read = read_step, .take = edit, .edits = true};

const struct lum_request_type lum_request_scene_redo = {
    .name = "scene.redo", .read = read_step, .take = edit, .edits = true};

const struct lum_request_type lum_request_scene_revert = {
    .name = "scene.revert", .read = read_scene_revert, .take = edit, .edits = true};

/* ---- imports ---- */

static void tell_progress(void *user, const char *id, const char *stage, double fraction)
{
    struct lum_import_job *job = user;
    int64_t now = lum_clock_ns();
    bool same_stage = strncmp(job->told_stage, stage, sizeof job->told_stage - 1) == 0;
    if (now - job->told_ns < (same_stage ? PROGRESS_EVERY_NS : STAGE_EVERY_NS))
        return;
    job->told_ns = now;
    snprintf(job->told_stage, sizeof job->told_stage, "%s", stage);
    cJSON *params = cJSON_CreateObject();
    lum_json_add_string(params, "id", id);
    lum_json_add_string(params, "stage", stage);
    lum_json_add_number(params, "fraction", fraction);
    lum_director_send_news(job->director, job->request->session, lum_rpc_notification("import.progress", params));
}

static void *import_main(void *arg)
{
    struct lum_import_job *job = arg;
    struct lum_director *d = job->director;
    pthread_setname_np(pthread_self(), "lum-import");
    struct lum_import_config config = {
        .importer = d->config.importer,
        .assets_dir = d->config.assets_dir,
        .uploads_dir = d->config.uploads_dir,
        .log = d->config.log,
        .admit = lum_totals_admit,
        .admit_user = &job->guard,
    };
    struct lum_expand_context context = {&config, tell_progress, job, &d->stop_imports};
    job->ok = lum_ops_expand(&context, &job->request->ops, &job->expansion, &job->error);
    if (job->ok && !lum_director_store_imports(d, job, &job->error)) {
        job->ok = false;
        lum_expansion_finish(&job->expansion);
    }
    atomic_store_explicit(&job->done, true, memory_order_release);
    lum_director_ring(d);
    return NULL;
}

/* Whoever asked first has gone: the answer is for the one who asked again. */
static void answer_who_came_back(struct lum_import_job *job)
{
    struct lum_request *q = job->request, *again = job->again;
    if (!again)
        return;
    char *rpc_id = q->rpc_id;
    q->rpc_id = again->rpc_id;
    again->rpc_id = rpc_id;
    q->session = again->session;
    lum_request_destroy(again);
    job->again = NULL;
}

static void finish_import(struct lum_director *d, struct lum_import_job *job)
{
    pthread_join(job->thread, NULL);
    answer_who_came_back(job);
    count(d, job->ok ? &d->metrics.imports : &d->metrics.imports_failed);
    if (job->ok) {
        apply(d, job->request, &job->expansion, job->entry);
    } else {
        lum_entry_destroy(job->entry);
        lum_log(&d->config.log, LUM_LOG_WARNING, "import", "%s: %s", job->error.path, job->error.text);
        lum_director_refuse_edit(d, job->request, &job->error);
    }
    lum_free(job);
}

/* No thread to be had: with one running, the job waits for its end; else nothing would wake the director for it. */
static void put_off_or_refuse(struct lum_director *d, uint32_t n_running)
{
    struct lum_import_job *job = d->jobs;
    if (n_running > 0)
        return;
    d->jobs = job->next;
    answer_who_came_back(job);
    lum_proto_fail(&job->error, LUM_PROTO_APPLICATION, "busy", "ops", "no thread for the import; try again");
    lum_director_refuse_edit(d, job->request, &job->error);
    lum_free(job);
}

void lum_director_turn_imports(struct lum_director *d)
{
    uint32_t n_running = 0;
    for (struct lum_import_job **at = &d->jobs; *at;) {
        struct lum_import_job *job = *at;
        if (job->started && atomic_load_explicit(&job->done, memory_order_acquire)) {
            *at = job->next;
            finish_import(d, job);
            continue;
        }
        n_running += job->started;
        at = &job->next;
    }
    for (struct lum_import_job *job = d->jobs; job && n_running < LUM_LIMIT_IMPORTS_AT_ONCE; job = job->next) {
        if (job->started)
            continue;
        job->guard = lum_totals_guard_of(&d->world.totals, &d->world.limits, d->world.doc, &job->request->ops);
        job->started = pthread_create(&job->thread, NULL, import_main, job) == 0;
        if (!job->started) {
            put_off_or_refuse(d, n_running);
            return;
        }
        n_running++;
    }
}

void lum_director_drop_imports(struct lum_director *d)
{
    atomic_store(&d->stop_imports, true);
    for (struct lum_import_job *job = d->jobs, *next; job; job = next) {
        next = job->next;
        if (job->started)
            pthread_join(job->thread, NULL);
        lum_expansion_finish(&job->expansion);
        lum_entry_destroy(job->entry);
        lum_request_destroy(job->request);
        lum_request_destroy(job->again);
        lum_free(job);
    }
    d->jobs = NULL;
}

/* ---- commit ---- */

void lum_director_free_edit(struct lum_staged_edit *p)
{
    lum_entry_destroy(p->entry);
    lum_changes_finish(&p->changes);
    lum_expansion_finish(&p->expansion);
    lum_request_destroy(p->request);
    lum_free(p);
}

/* Publishes. While that fails (memory, the ray tracer) the newest edit is taken back and refused, until the rest can be
 * shown. */
static bool publish_scene(struct lum_director *d)
{
    struct lum_error e;
    while (d->staged && lum_world_commit(&d->world, &e)) {
        struct lum_staged_edit *p = d->staged;
        struct lum_proto_error err;
        lum_log(&d->config.log, LUM_LOG_ERROR, "director", "an edit could not be shown and is taken back: %s", e.text);
        lum_apply_error(&e, "", &err);
        d->staged = p->next;
        lum_world_rollback(&d->world, &p->changes);
        lum_director_refuse(d, p->request, &err);
        count(d, &d->metrics.edits_refused);
        lum_director_free_edit(p);
        lum_director_save_histories(d); /* they remember it */
    }
    return d->staged != NULL;
}

/* emits: what changed of objects that shine, or NULL; taken over. */
static void announce(struct lum_director *d, const struct lum_staged_edit *p, cJSON *emits)
{
    cJSON *result = cJSON_CreateObject();
    lum_json_add_number(result, "scene_rev", (double)p->scene_rev);
    if (p->expansion.n_warnings > 0) {
        cJSON *warnings = cJSON_CreateArray();
        for (size_t i = 0; i < p->expansion.n_warnings; i++)
            lum_json_add(warnings, NULL, cJSON_CreateString(p->expansion.warnings[i]));
        lum_json_add(result, "warnings", warnings);
    }
    lum_director_reply_edit(d, p->request, result, p->seq);
    cJSON *changed = cJSON_CreateObject();
    lum_json_add_number(changed, "scene_rev", (double)p->scene_rev);
    lum_json_add_string(changed, "op_id", p->request->op_id);
    lum_json_add_string(changed, "user", p->request->user);
    cJSON *ops = lum_changes_to_json(&p->changes);
    lum_photometry_describe_lights(d->world.doc, ops);
    lum_json_add(changed, "ops", ops);
    if (emits)
        lum_json_add(changed, "emits", emits);
    lum_director_send_changed(d, p->scene_rev, changed);
    count(d, &d->metrics.edits);
}

void lum_director_count_scene(struct lum_director *d)
{
    pthread_mutex_lock(&d->lock);
    d->metrics.triangles = d->world.snapshot->n_triangles;
    d->metrics.lights = d->world.snapshot->lights.n_lights;
    pthread_mutex_unlock(&d->lock);
}

void lum_director_commit(struct lum_director *d)
{
    if (!d->staged || lum_director_stopping(d)) /* at the end edits go unanswered, as other requests do */
        return;
    const struct lum_snapshot *was = d->world.snapshot ? lum_snapshot_ref(d->world.snapshot) : NULL;
    bool published = publish_scene(d);
    cJSON *emits = published ? lum_luminaires_changes(was, d->world.snapshot) : NULL;
    lum_snapshot_unref(was);
    if (!published)
        return;
    lum_director_follow_desk(d);
    atomic_store(&d->scene_rev, lum_document_rev(d->world.doc));
    lum_director_count_scene(d); /* before the replies: who got one reads numbers of its own edit */
    struct lum_staged_edit *oldest_first = NULL;
    int64_t received_ns = 0;
    while (d->staged) {
        struct lum_staged_edit *p = d->staged;
        d->staged = p->next;
        p->next = oldest_first;
        oldest_first = p;
        received_ns = p->request->received_ns > received_ns ? p->request->received_ns : received_ns;
    }
    while (oldest_first) {
        struct lum_staged_edit *p = oldest_first;
        oldest_first = p->next;
        lum_director_submit(d, p);
        lum_director_audit(d, p);
        lum_repeats_note(d, p->request, p->scene_rev, p->seq);
        announce(d, p, oldest_first ? NULL : emits); /* with the newest edit: they are as after all of them */
        lum_director_keep_unsaved(d, p);
    }
    lum_director_refresh_views(d, received_ns);
}

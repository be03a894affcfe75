#define _GNU_SOURCE /* pthread_setname_np */
#include "server/director/exports.h"

#include <stdlib.h>
#include <string.h>

#include "protocol/document/state.h"
#include "protocol/json/json.h"
#include "server/director/internal.h"
#include "server/director/read_request.h"
#include "server/export/export.h"

struct lum_export_job {
    struct lum_export_job *next;
    struct lum_director *director;
    struct lum_request *request;     /* owned */
    struct lum_document_state state; /* of its turn */
    bool gone;                       /* nobody waits for the answer */
    _Atomic bool cancel;
    /* written by its thread, read after done */
    uint8_t *bytes; /* malloc; NULL: error says why */
    size_t n_bytes;
    struct lum_error error;
    /* director thread */
    pthread_t thread;
    bool started;
    _Atomic bool done;
};

/* ---- the thread of a job: reads records, and touches nothing but the job and the bell ---- */

static enum lum_status write_file(struct lum_export_job *job, struct lum_error *err)
{
    const struct lum_export_source source = {job->state.records, job->state.n_records, LUM_LIMIT_EXPORT_BYTES,
                                             &job->cancel};
    struct lum_glb *glb = NULL;
    enum lum_status status = lum_export_scene(&source, &glb, err);
    if (status)
        return status;
    job->n_bytes = (size_t)lum_glb_size(glb);
    job->bytes = malloc(job->n_bytes);
    if (job->bytes)
        lum_glb_copy(glb, job->bytes);
    else
        status = lum_fail(err, LUM_ERR_NOMEM, "", "no memory for a glTF file of %zu MiB", job->n_bytes >> 20);
    lum_glb_destroy(glb);
    return status;
}

static void *job_main(void *arg)
{
    struct lum_export_job *job = arg;
    pthread_setname_np(pthread_self(), "lum-export");
    (void)write_file(job, &job->error); /* job->bytes tells */
    atomic_store_explicit(&job->done, true, memory_order_release);
    lum_director_ring(job->director);
    return NULL;
}

/* ---- the queue ---- */

static void free_job(struct lum_export_job *job)
{
    lum_document_state_finish(&job->state);
    lum_request_destroy(job->request);
    free(job->bytes);
    lum_free(job);
}

static void refuse(struct lum_director *d, const struct lum_export_job *job)
{
    struct lum_proto_error err;
    bool short_of = job->error.status == LUM_ERR_LIMIT || job->error.status == LUM_ERR_NOMEM;
    lum_proto_fail(&err, short_of ? LUM_PROTO_APPLICATION : LUM_PROTO_INTERNAL,
                   short_of ? "limit_exceeded" : "internal", "", "%s", job->error.text);
    lum_director_refuse(d, job->request, &err);
}

/* The first job is over. */
static void finish(struct lum_director *d)
{
    struct lum_export_job *job = d->exports.jobs;
    if (job->started)
        pthread_join(job->thread, NULL);
    if (!job->gone && job->bytes) {
        lum_director_reply_file(d, job->request, job->bytes, job->n_bytes, job->state.rev);
        job->bytes = NULL;
    } else if (!job->gone) {
        refuse(d, job);
    }
    d->exports.jobs = job->next;
    free_job(job);
}

static bool start(struct lum_director *d, struct lum_export_job *job)
{
    if (!lum_document_take_state(d->world.doc, &job->state)) {
        (void)lum_fail(&job->error, LUM_ERR_NOMEM, "", "no memory for the scene's records");
        return false;
    }
    lum_document_state_drop_histories(&job->state);
    job->started = pthread_create(&job->thread, NULL, job_main, job) == 0;
    if (!job->started)
        (void)lum_fail(&job->error, LUM_ERR_NOMEM, "", "no thread to write the file; try again");
    return job->started;
}

void lum_director_turn_exports(struct lum_director *d)
{
    struct lum_export_job *job = d->exports.jobs;
    if (job && job->started && atomic_load_explicit(&job->done, memory_order_acquire))
        finish(d);
    while ((job = d->exports.jobs) && !job->started && !start(d, job))
        finish(d);
}

void lum_director_drop_exports(struct lum_director *d, struct lum_session_ref session)
{
    for (struct lum_export_job **at = &d->exports.jobs, *job; (job = *at);) {
        bool theirs = lum_session_same(job->request->session, session);
        if (!theirs || job->started) {
            job->gone = job->gone || theirs;
            if (job->gone)
                atomic_store_explicit(&job->cancel, true, memory_order_relaxed);
            at = &job->next;
            continue;
        }
        *at = job->next;
        free_job(job);
    }
}

void lum_director_drop_all_exports(struct lum_director *d)
{
    for (struct lum_export_job *job = d->exports.jobs, *next; job; job = next) {
        next = job->next;
        atomic_store_explicit(&job->cancel, true, memory_order_relaxed);
        if (job->started)
            pthread_join(job->thread, NULL);
        free_job(job);
    }
    d->exports.jobs = NULL;
}

static bool enqueue(struct lum_director *d, struct lum_request *q, struct lum_proto_error *err)
{
    struct lum_export_job **end = &d->exports.jobs;
    for (; *end; end = &(*end)->next)
        if (lum_session_same((*end)->request->session, q->session))
            return lum_proto_fail(err, LUM_PROTO_APPLICATION, "busy", "",
                                  "a file of this session is being written; ask again when it is answered");
    struct lum_export_job *job = lum_calloc(1, sizeof *job);
    if (!job)
        return lum_proto_fail_memory(err);
    job->director = d;
    job->request = q;
    *end = job;
    return true;
}

static bool read_export(struct lum_json_reader *r, struct lum_request *q)
{
    (void)q;
    return lum_json_end(r);
}

const struct lum_request_type lum_request_scene_export = {
    .name = "scene.export", .read = read_export, .enqueue = enqueue};

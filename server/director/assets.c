#define _GNU_SOURCE /* pthread_setname_np */
#include "server/director/assets.h"

#include <string.h>

#include <cjson/cJSON.h>

#include "protocol/json/json.h"
#include "server/director/internal.h"
#include "server/director/read_request.h"
#include "server/import/asset_list.h"
#include "server/world/photometry.h"

struct lum_asset_job {
    struct lum_asset_job *next;
    struct lum_director *director;
    struct lum_request *request; /* owned */
    bool gone;                   /* nobody waits for the answer */
    /* written by its thread, read after done */
    cJSON *result; /* NULL: error says why */
    struct lum_proto_error error;
    /* director thread */
    pthread_t thread;
    bool started;
    _Atomic bool done;
};

/* ---- the thread of a job: reads files, and touches nothing but the job and the bell ---- */

static cJSON *list_json(const struct lum_asset_list *list)
{
    cJSON *o = cJSON_CreateObject(), *assets = cJSON_CreateArray();
    for (size_t i = 0; i < list->n; i++) {
        cJSON *a = cJSON_CreateObject();
        lum_json_add_string(a, "asset", list->entries[i].name);
        lum_json_add_number(a, "bytes", (double)list->entries[i].n_bytes);
        lum_json_add(assets, NULL, a);
    }
    lum_json_add(o, "assets", assets);
    lum_json_add_bool(o, "whole", list->whole);
    return o;
}

static cJSON *list(const struct lum_director *d, const struct lum_request *q, struct lum_proto_error *err)
{
    struct lum_asset_list found;
    enum lum_status status = lum_asset_list(d->config.assets_dir, d->config.uploads_dir, lum_is_web_file, q->match,
                                            &d->stop_imports, &found);
    if (status == LUM_ERR_NOMEM)
        lum_proto_fail_memory(err);
    else if (status)
        lum_proto_fail(err, LUM_PROTO_APPLICATION, "io", "", "the asset folder cannot be read");
    if (status)
        return NULL;
    cJSON *o = list_json(&found);
    lum_asset_list_finish(&found);
    return o;
}

static cJSON *describe(const struct lum_record_web *web, const struct lum_import_result *result)
{
    cJSON *o = lum_photometry_describe(web, true, true), *warnings = cJSON_CreateArray();
    for (size_t i = 0; i < result->n_warnings; i++)
        lum_json_add(warnings, NULL, cJSON_CreateString(result->warnings[i]));
    if (o)
        lum_json_add(o, "warnings", warnings);
    else
        cJSON_Delete(warnings);
    return o;
}

static cJSON *photometry(const struct lum_director *d, const struct lum_request *q, struct lum_proto_error *err)
{
    struct lum_import_config config = {.importer = d->config.importer,
                                       .assets_dir = d->config.assets_dir,
                                       .uploads_dir = d->config.uploads_dir,
                                       .log = d->config.log};
    struct lum_import_result result = {0};
    struct lum_record *light = lum_record_create(LUM_RECORD_LIGHT, "lamp"), *read = NULL;
    cJSON *o = NULL;
    if (!light) {
        lum_proto_fail_memory(err);
        return NULL;
    }
    memcpy(light->light.asset, q->asset, sizeof q->asset);
    if (lum_import_web(&config, light, &d->stop_imports, &read, &result, err)) {
        o = describe(read->light.web, &result);
        if (!o)
            lum_proto_fail_memory(err);
    }
    lum_record_unref(read);
    lum_record_unref(light);
    lum_import_result_finish(&result);
    return o;
}

static void *job_main(void *arg)
{
    struct lum_asset_job *job = arg;
    const struct lum_request *q = job->request;
    pthread_setname_np(pthread_self(), "lum-assets");
    job->result = q->type == &lum_request_asset_list ? list(job->director, q, &job->error)
                                                     : photometry(job->director, q, &job->error);
    atomic_store_explicit(&job->done, true, memory_order_release);
    lum_director_ring(job->director);
    return NULL;
}

/* ---- the queue ---- */

static void free_job(struct lum_asset_job *job)
{
    cJSON_Delete(job->result);
    lum_request_destroy(job->request);
    lum_free(job);
}

/* The first job is over. */
static void finish(struct lum_director *d)
{
    struct lum_asset_job *job = d->assets.jobs;
    if (job->started)
        pthread_join(job->thread, NULL);
    if (!job->gone && job->result) {
        lum_director_reply(d, job->request, job->result);
        job->result = NULL;
    } else if (!job->gone) {
        lum_director_refuse(d, job->request, &job->error);
    }
    d->assets.jobs = job->next;
    free_job(job);
}

void lum_director_turn_assets(struct lum_director *d)
{
    struct lum_asset_job *job = d->assets.jobs;
    if (job && job->started && atomic_load_explicit(&job->done, memory_order_acquire))
        finish(d);
    while ((job = d->assets.jobs) && !job->started) {
        job->started = pthread_create(&job->thread, NULL, job_main, job) == 0;
        if (job->started)
            return;
        lum_proto_fail(&job->error, LUM_PROTO_APPLICATION, "busy", "", "no thread to read the file; try again");
        finish(d);
    }
}

void lum_director_drop_assets(struct lum_director *d, struct lum_session_ref session)
{
    for (struct lum_asset_job **at = &d->assets.jobs, *job; (job = *at);) {
        bool theirs = lum_session_same(job->request->session, session);
        if (!theirs || job->started) {
            job->gone = job->gone || theirs;
            at = &job->next;
            continue;
        }
        *at = job->next;
        free_job(job);
    }
}

void lum_director_drop_all_assets(struct lum_director *d)
{
    for (struct lum_asset_job *job = d->assets.jobs, *next; job; job = next) {
        next = job->next;
        if (job->started)
            pthread_join(job->thread, NULL);
        free_job(job);
    }
    d->assets.jobs = NULL;
}

static bool enqueue(struct lum_director *d, struct lum_request *q, struct lum_proto_error *err)
{
    struct lum_asset_job **end = &d->assets.jobs;
    uint32_t n = 0;
    if (!d->config.assets_dir && !d->config.uploads_dir)
        return lum_proto_fail(err, LUM_PROTO_APPLICATION, "unsupported", "",
                              "this server has no folder of assets: start it with --assets DIR");
    for (; *end; end = &(*end)->next)
        n += lum_session_same((*end)->request->session, q->session);
    if (n >= LUM_LIMIT_ASSETS_WAITING)
        return lum_proto_fail(err, LUM_PROTO_APPLICATION, "busy", "",
                              "%u questions of this session about assets wait already; ask again when one is answered",
                              n);
    struct lum_asset_job *job = lum_calloc(1, sizeof *job);
    if (!job)
        return lum_proto_fail_memory(err);
    job->director = d;
    job->request = q;
    *end = job;
    return true;
}

static bool read_list(struct lum_json_reader *r, struct lum_request *q)
{
    unsigned kind;
    lum_json_string(r, "match", q->match, sizeof q->match);
    return lum_json_require(r, "kind") && lum_json_choice(r, "kind", "photometry", &kind) && lum_json_end(r);
}

const struct lum_request_type lum_request_asset_list = {.name = "asset.list", .read = read_list, .enqueue = enqueue};

static bool read_photometry(struct lum_json_reader *r, struct lum_request *q)
{
    if (!lum_json_require(r, "asset") || !lum_json_string(r, "asset", q->asset, sizeof q->asset) || !lum_json_end(r))
        return false;
    if (lum_is_web_file(q->asset))
        return true;
    return lum_proto_fail(r->err, LUM_PROTO_BAD_PARAMS, "invalid_value", "asset",
                          "asset must end in .ies, .ldt, .eul or .pho");
}

const struct lum_request_type lum_request_asset_photometry = {
    .name = "asset.photometry", .read = read_photometry, .enqueue = enqueue};

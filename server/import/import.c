#define _GNU_SOURCE
#include "server/import/import.h"

#include <limits.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include <cjson/cJSON.h>

#include "protocol/json/json.h"
#include "protocol/op/op.h"
#include "server/base/web_desc.h"
#include "server/import/asset.h"
#include "server/import/child.h"

/* Turns the child's chunks into records. */
struct collector {
    const struct lum_import_config *config;
    struct lum_import_result result;
    size_t records_cap;
    struct lum_blob blobs[LUM_BLOBS_MAX];
    size_t n_blobs;
    const char *prefix; /* what every id must begin with; "": any */
    void (*progress)(void *user, const char *stage, double fraction);
    void *user;
};

static void drop_blobs(struct collector *c)
{
    for (size_t i = 0; i < c->n_blobs; i++)
        lum_bulk_unref(c->blobs[i].bulk);
    c->n_blobs = 0;
}

void lum_import_result_finish(struct lum_import_result *r)
{
    for (size_t i = 0; i < r->n_records; i++)
        lum_record_unref(r->records[i]);
    free(r->records);
    free(r->warnings);
    cJSON_Delete(r->settings);
    memset(r, 0, sizeof *r);
}

static bool no_memory(struct lum_proto_error *err)
{
    return lum_proto_fail(err, LUM_PROTO_APPLICATION, "limit_exceeded", "asset", "out of memory for the import");
}

static bool keep_record(struct collector *c, struct lum_record *record, struct lum_proto_error *err)
{
    if (c->result.n_records == c->records_cap) {
        size_t cap = c->records_cap ? c->records_cap * 2 : 64;
        struct lum_record **grown = realloc(c->result.records, cap * sizeof *grown);
        if (!grown)
            return no_memory(err);
        c->result.records = grown;
        c->records_cap = cap;
    }
    c->result.records[c->result.n_records++] = record;
    return true;
}

/* The importer reads hostile files, so what it says is checked like what a client says. */
static bool take_op(struct collector *c, const uint8_t *text, size_t n, struct lum_proto_error *err)
{
    struct lum_blobs blobs = {c->blobs, c->n_blobs};
    struct lum_op op = {0};
    struct cJSON *json = lum_json_parse((const char *)text, n, err);
    bool ok = json && lum_op_from_json(json, &blobs, &op, err);
    drop_blobs(c);
    if (!ok) { /* the path names a field of a record that the caller never wrote */
        const cJSON *id = cJSON_GetObjectItemCaseSensitive(json, "id");
        struct lum_proto_error why = *err;
        lum_proto_fail(err, LUM_PROTO_APPLICATION, "import_failed", "asset", "%.64s: %.160s",
                       cJSON_IsString(id) ? id->valuestring : "the importer's output is damaged", why.text);
        cJSON_Delete(json);
        return false;
    }
    cJSON_Delete(json);
    if (op.kind != LUM_OP_ADD || strncmp(op.id, c->prefix, strlen(c->prefix)) != 0)
        ok = lum_proto_fail(err, LUM_PROTO_APPLICATION, "import_failed", "asset", "the importer's output is damaged");
    if (ok && c->result.n_records >= LUM_LIMIT_RECORDS)
        ok = lum_proto_fail(err, LUM_PROTO_APPLICATION, "limit_exceeded", "asset", "more than %u parts",
                            LUM_LIMIT_RECORDS);
    if (ok && c->config->admit)
        ok = c->config->admit(c->config->admit_user, op.record, err);
    if (ok && keep_record(c, op.record, err))
        op.record = NULL;
    else
        ok = false;
    lum_op_finish(&op);
    return ok;
}

static bool take_warning(struct collector *c, const uint8_t *text, size_t n, struct lum_proto_error *err)
{
    struct lum_import_result *r = &c->result;
    if (r->n_warnings >= LUM_LIMIT_IMPORT_WARNINGS)
        return true;
    void *grown = realloc(r->warnings, (r->n_warnings + 1) * sizeof r->warnings[0]);
    if (!grown)
        return no_memory(err);
    r->warnings = grown;
    char *to = r->warnings[r->n_warnings++];
    size_t i = 0;
    for (; i < n && i + 1 < sizeof r->warnings[0]; i++)
        to[i] = text[i] < 0x20 || text[i] > 0x7e ? '?'
                                                 : (char)text[i]; /* names from a file: no control characters in logs */
    to[i] = 0;
    return true;
}

static bool take_progress(struct collector *c, const uint8_t *text, size_t n, struct lum_proto_error *err)
{
    struct lum_json_reader r;
    char stage[32];
    double fraction;
    struct cJSON *json = lum_json_parse((const char *)text, n, err);
    lum_json_begin(&r, json, "", err);
    bool ok = json && lum_json_string(&r, "stage", stage, sizeof stage) &&
              lum_json_number(&r, "fraction", 0.0, 1.0, &fraction) && lum_json_end(&r);
    if (ok && c->progress)
        c->progress(c->user, stage, fraction);
    cJSON_Delete(json);
    return ok ||
           lum_proto_fail(err, LUM_PROTO_APPLICATION, "import_failed", "asset", "the importer's output is damaged");
}

static bool take_settings(struct collector *c, const uint8_t *text, size_t n, struct lum_proto_error *err)
{
    cJSON_Delete(c->result.settings);
    c->result.settings = lum_json_parse((const char *)text, n, err);
    return cJSON_IsObject(c->result.settings) ||
           lum_proto_fail(err, LUM_PROTO_APPLICATION, "import_failed", "asset", "the importer's output is damaged");
}

static bool take_chunk(void *user, enum lum_import_chunk kind, uint8_t *bytes, size_t n, struct lum_proto_error *err)
{
    struct collector *c = user;
    switch (kind) {
    case LUM_CHUNK_BLOB:
        if (c->n_blobs == LUM_BLOBS_MAX)
            return lum_proto_fail(err, LUM_PROTO_APPLICATION, "import_failed", "asset",
                                  "the importer's output is damaged");
        c->blobs[c->n_blobs++] = (struct lum_blob){bytes, n, bytes};
        return true;
    case LUM_CHUNK_OP:
        return take_op(c, bytes, n, err);
    case LUM_CHUNK_WARNING:
        return take_warning(c, bytes, n, err);
    case LUM_CHUNK_PROGRESS:
        return take_progress(c, bytes, n, err);
    case LUM_CHUNK_SETTINGS:
        return take_settings(c, bytes, n, err);
    default:
        return true;
    }
}

/* lumend-import beside the running program, unless the configuration names another. */
static const char *find_importer(const struct lum_import_config *config, char path[PATH_MAX])
{
    if (config->importer)
        return config->importer;
    ssize_t n = readlink("/proc/self/exe", path, PATH_MAX - 1);
    if (n <= 0)
        return "lumend-import";
    path[n] = 0;
    char *slash = strrchr(path, '/');
    snprintf(slash + 1, PATH_MAX - (size_t)(slash + 1 - path), "lumend-import");
    return path;
}

static bool run_importer(const struct lum_import_config *config, struct lum_import_run *run, struct collector *c,
                         struct lum_proto_error *err)
{
    char path[PATH_MAX];
    c->config = config;
    run->importer = find_importer(config, path);
    run->assets_dir = config->uploads_dir && lum_asset_is_upload(run->asset) ? config->uploads_dir : config->assets_dir;
    run->cpu_s = config->cpu_s ? config->cpu_s : LUM_LIMIT_IMPORT_CPU_S;
    run->log = &config->log;
    run->chunk = take_chunk;
    run->user = c;
    bool ok = lum_import_run(run, err);
    drop_blobs(c);
    return ok;
}

/* ---- models and images ---- */

bool lum_import_model(const struct lum_import_config *config, const struct lum_record *import,
                      void (*progress)(void *user, const char *stage, double fraction), void *user,
                      const _Atomic bool *cancel, struct lum_import_result *ret_result, struct lum_proto_error *err)
{
    lum_id prefix;
    if (snprintf(prefix, sizeof prefix, "%s/", import->id) >= (int)sizeof prefix)
        return lum_proto_fail(err, LUM_PROTO_BAD_PARAMS, "limit_exceeded", "id", "the import's id is too long");
    struct collector c = {.prefix = prefix, .progress = progress, .user = user};
    struct lum_import_run run = {.kind = "model", .asset = import->import.asset, .id = import->id, .cancel = cancel};
    if (!run_importer(config, &run, &c, err)) {
        lum_import_result_finish(&c.result);
        return false;
    }
    for (size_t i = 0; i < c.result.n_records; i++)
        memcpy(c.result.records[i]->origin, import->id, sizeof import->id);
    *ret_result = c.result;
    return true;
}

bool lum_import_image(const struct lum_import_config *config, const struct lum_record *image,
                      const _Atomic bool *cancel, struct lum_record **ret_image, struct lum_proto_error *err)
{
    struct collector c = {.prefix = image->id};
    struct lum_import_run run = {.kind = "image", .asset = image->image.asset, .id = image->id, .cancel = cancel};
    bool ok = run_importer(config, &run, &c, err);
    if (ok && (c.result.n_records != 1 || c.result.records[0]->type != LUM_RECORD_IMAGE ||
               strcmp(c.result.records[0]->id, image->id) != 0 || !c.result.records[0]->image.pixels))
        ok = lum_proto_fail(err, LUM_PROTO_APPLICATION, "import_failed", "asset", "the importer's output is damaged");
    if (ok) {
        struct lum_record *r = lum_record_ref(c.result.records[0]);
        memcpy(r->origin, image->origin, sizeof r->origin);
        memcpy(r->image.asset, image->image.asset, sizeof r->image.asset);
        /* 8-bit pixels are what the record says they are: a normal map is linear */
        if (strcmp(r->image.texel, "rgb32f") != 0 && strcmp(image->image.texel, "linear8") == 0)
            memcpy(r->image.texel, image->image.texel, sizeof r->image.texel);
        *ret_image = r;
    }
    lum_import_result_finish(&c.result);
    return ok;
}

/* ---- photometric files ---- */

static void log_web(const struct lum_log *log, const char *asset, const struct lum_record_web *file)
{
    struct lum_web_desc d = lum_web_desc_of(file);
    struct lum_web *web = NULL;
    char rated[48] = "", watts[48] = "";
    if (lum_web_create(&d, &web, NULL))
        return;
    if (file->rated_lm.set)
        snprintf(rated, sizeof rated, ", lamps rated for %.1f lm", file->rated_lm.value);
    if (file->watts.set)
        snprintf(watts, sizeof watts, ", %.1f W", file->watts.value);
    lum_log(log, 2, "import", "%s: %.1f lm by its intensities%s%s", asset, web->flux_sr * web->peak_cd, rated, watts);
    lum_web_unref(web);
}

bool lum_import_web(const struct lum_import_config *config, const struct lum_record *light, const _Atomic bool *cancel,
                    struct lum_record **ret_light, struct lum_import_result *ret_result, struct lum_proto_error *err)
{
    struct collector c = {.prefix = light->id};
    struct lum_import_run run = {.kind = "web", .asset = light->light.asset, .id = light->id, .cancel = cancel};
    struct lum_record *r = NULL;
    bool ok = run_importer(config, &run, &c, err);
    if (ok && (c.result.n_records != 1 || c.result.records[0]->type != LUM_RECORD_LIGHT ||
               strcmp(c.result.records[0]->id, light->id) != 0 || !c.result.records[0]->light.web))
        ok = lum_proto_fail(err, LUM_PROTO_APPLICATION, "import_failed", "asset", "the importer's output is damaged");
    if (ok && !(r = lum_record_clone(light)))
        ok = no_memory(err);
    if (ok) {
        r->light.web = lum_record_web_ref(c.result.records[0]->light.web);
        log_web(&config->log, light->light.asset, r->light.web);
        *ret_light = r;
        lum_record_unref(c.result.records[0]);
        c.result.n_records = 0;
        *ret_result = c.result;
        return true;
    }
    lum_import_result_finish(&c.result);
    return false;
}

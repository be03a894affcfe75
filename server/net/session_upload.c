/* A session announces files that it will send. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cjson/cJSON.h>

#include "protocol/json/json.h"
#include "protocol/message/rpc.h"
#include "server/net/session_internal.h"
#include "server/net/uploads.h"

static bool read_file(const cJSON *json, const char *prefix, struct lum_upload_file *f, struct lum_proto_error *err)
{
    struct lum_json_reader r;
    char path[48];
    if (!cJSON_IsObject(json))
        return lum_proto_fail(err, LUM_PROTO_BAD_PARAMS, "invalid_value", prefix, "%s must be an object", prefix);
    lum_json_begin(&r, json, prefix, err);
    if (!lum_json_require(&r, "name") || !lum_json_require(&r, "bytes") ||
        !lum_json_string(&r, "name", f->name, sizeof f->name) || !lum_json_u64(&r, "bytes", &f->n_bytes) ||
        !lum_json_end(&r))
        return false;
    snprintf(path, sizeof path, "%s/name", prefix);
    return lum_upload_name_is(f->name) ||
           lum_proto_fail(
               err, LUM_PROTO_BAD_PARAMS, "invalid_value", path,
               "name must be that of a file, or of one in a folder: no part of it empty or with a dot before "
               "it, no backslash");
}

static int by_name(const void *a, const void *b)
{
    return strcmp(((const struct lum_upload_file *)a)->name, ((const struct lum_upload_file *)b)->name);
}

static bool no_two_alike(const struct lum_upload_file *files, size_t n, struct lum_proto_error *err)
{
    struct lum_upload_file *sorted = malloc(n * sizeof *sorted);
    if (!sorted)
        return lum_proto_fail_memory(err);
    memcpy(sorted, files, n * sizeof *sorted);
    qsort(sorted, n, sizeof *sorted, by_name);
    const struct lum_upload_file *twice = NULL;
    for (size_t i = 1; i < n && !twice; i++)
        twice = by_name(&sorted[i - 1], &sorted[i]) == 0 ? &sorted[i] : NULL;
    bool ok = !twice || lum_proto_fail(err, LUM_PROTO_BAD_PARAMS, "invalid_value", "files",
                                       "two files have the name \"%.100s\"", twice->name);
    free(sorted);
    return ok;
}

static bool check_bytes(const struct lum_session *s, const struct lum_upload_file *files, size_t n,
                        uint64_t *ret_n_bytes, struct lum_proto_error *err)
{
    uint64_t n_bytes = 0; /* below LUM_LIMIT_UPLOAD_FILES 2^53 */
    for (size_t i = 0; i < n; i++)
        n_bytes += files[i].n_bytes;
    *ret_n_bytes = n_bytes;
    if (n_bytes == 0)
        return lum_proto_fail(err, LUM_PROTO_BAD_PARAMS, "invalid_value", "files", "there is nothing in these files");
    if (n_bytes > LUM_LIMIT_UPLOAD_BYTES)
        return lum_proto_fail(err, LUM_PROTO_APPLICATION, "limit_exceeded", "files",
                              "at most %u MiB can be sent together", LUM_LIMIT_UPLOAD_BYTES >> 20);
    if (s->n_announced + n_bytes > LUM_LIMIT_UPLOAD_SESSION_BYTES)
        return lum_proto_fail(err, LUM_PROTO_APPLICATION, "limit_exceeded", "files", "a session can send %u MiB in all",
                              LUM_LIMIT_UPLOAD_SESSION_BYTES >> 20);
    return true;
}

/* From malloc; NULL: err says why. */
static struct lum_upload_file *read_files(const struct lum_rpc *rpc, size_t *ret_n, struct lum_proto_error *err)
{
    struct lum_json_reader r;
    lum_json_begin(&r, rpc->params, "", err);
    const cJSON *list = lum_json_require(&r, "files") ? lum_json_member(&r, "files") : NULL;
    if (!list || !lum_json_end(&r))
        return NULL;
    int n = cJSON_IsArray(list) ? cJSON_GetArraySize(list) : 0;
    if (n < 1 || n > (int)LUM_LIMIT_UPLOAD_FILES) {
        lum_proto_fail(err, LUM_PROTO_BAD_PARAMS, "invalid_value", "files", "files must be a list of 1 to %u files",
                       LUM_LIMIT_UPLOAD_FILES);
        return NULL;
    }
    struct lum_upload_file *files = calloc((size_t)n, sizeof *files);
    bool ok = files != NULL || lum_proto_fail_memory(err);
    size_t i = 0;
    for (const cJSON *json = list->child; json && ok; json = json->next, i++) {
        char prefix[24];
        snprintf(prefix, sizeof prefix, "files/%zu", i);
        ok = read_file(json, prefix, &files[i], err);
    }
    if (ok && no_two_alike(files, (size_t)n, err)) {
        *ret_n = (size_t)n;
        return files;
    }
    free(files);
    return NULL;
}

struct cJSON *lum_session_announce(struct lum_session *s, const struct lum_rpc *rpc, struct lum_proto_error *err)
{
    char put[sizeof LUM_UPLOAD_FOLDER + 1 + LUM_UPLOAD_TICKET_BYTES] = LUM_UPLOAD_FOLDER "/";
    size_t n;
    uint64_t n_bytes;
    struct lum_upload_file *files = read_files(rpc, &n, err);
    bool ok = files && check_bytes(s, files, n, &n_bytes, err) && lum_session_has_scene(s, err);
    struct lum_uploads *uploads = ok ? lum_project_uploads(s->project) : NULL;
    if (ok && !uploads)
        ok = lum_proto_fail(err, LUM_PROTO_APPLICATION, "unsupported", "", "this server takes no files");
    if (ok)
        ok = lum_uploads_announce(uploads, s->ref, s->user, files, n, put + sizeof LUM_UPLOAD_FOLDER, err);
    if (!ok) {
        free(files);
        return NULL;
    }
    cJSON *result = cJSON_CreateObject();
    if (lum_json_add_string(result, "put", put)) {
        s->n_announced += n_bytes;
        return result;
    }
    lum_uploads_drop(uploads, s->ref); /* nobody will know its ticket */
    cJSON_Delete(result);
    lum_proto_fail_memory(err);
    return NULL;
}

#define _GNU_SOURCE
#include "server/importer/to_jsonl.h"

#include <limits.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cjson/cJSON.h>

#include "protocol/json/json.h"
#include "protocol/op/op.h"
#include "server/import/import.h"

static void print_log(void *user, int level, const char *component, const char *text)
{
    (void)user;
    (void)level;
    fprintf(stderr, "%s: %s\n", component, text);
}

static bool print_record(const struct lum_record *r)
{
    struct cJSON *json = lum_record_to_json(r, false);
    char *text = json ? lum_json_print(json, NULL) : NULL;
    bool ok = text && puts(text) >= 0;
    free(text);
    cJSON_Delete(json);
    return ok;
}

static bool print_result(const struct lum_import_result *r)
{
    for (size_t i = 0; i < r->n_warnings; i++)
        fprintf(stderr, "warning: %s\n", r->warnings[i]);
    bool ok = puts("{\"lumend\":1,\"kind\":\"scene\"}") >= 0;
    for (size_t i = 0; i < r->n_records && ok; i++)
        ok = print_record(r->records[i]);
    return ok && fflush(stdout) == 0;
}

int lum_to_jsonl(const char *path)
{
    char dir[PATH_MAX];
    const char *slash = strrchr(path, '/');
    const char *name = slash ? slash + 1 : path;
    snprintf(dir, sizeof dir, "%.*s", slash ? (int)(slash - path) + 1 : 1, slash ? path : ".");
    struct lum_record *import = lum_record_create(LUM_RECORD_IMPORT, "model");
    if (!import)
        return 1;
    snprintf(import->import.asset, sizeof import->import.asset, "%s", name);
    struct lum_import_config config = {.importer = "/proc/self/exe", .assets_dir = dir, .log = {print_log, NULL}};
    struct lum_import_result result = {0};
    struct lum_proto_error err = {0};
    bool ok = lum_import_model(&config, import, NULL, NULL, NULL, &result, &err);
    if (!ok)
        fprintf(stderr, "%s\n", err.text);
    else if (!(ok = print_result(&result)))
        fputs("the scene could not be written\n", stderr);
    lum_import_result_finish(&result);
    lum_record_unref(import);
    return ok ? 0 : 1;
}

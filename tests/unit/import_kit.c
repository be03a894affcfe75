#define _GNU_SOURCE
#include "tests/unit/import_kit.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

#include <cmocka.h>

void kit_open(struct kit *k)
{
    memset(k, 0, sizeof *k);
    snprintf(k->dir, sizeof k->dir, "/tmp/lumend-import-XXXXXX");
    assert_non_null(mkdtemp(k->dir));
    k->config = (struct lum_import_config){.importer = LUMEND_IMPORT, .assets_dir = k->dir};
}

void kit_close(struct kit *k)
{
    char command[128];
    lum_import_result_finish(&k->result);
    snprintf(command, sizeof command, "rm -rf '%s'", k->dir);
    assert_int_equal(system(command), 0);
}

void kit_write(const struct kit *k, const char *name, const void *bytes, size_t n)
{
    char path[256];
    snprintf(path, sizeof path, "%s/%s", k->dir, name);
    FILE *f = fopen(path, "wb");
    assert_non_null(f);
    assert_int_equal(fwrite(bytes, 1, n, f), n);
    assert_int_equal(fclose(f), 0);
}

void kit_write_text(const struct kit *k, const char *name, const char *text)
{
    kit_write(k, name, text, strlen(text));
}

bool kit_import(struct kit *k, const char *name)
{
    struct lum_record *import = lum_record_create(LUM_RECORD_IMPORT, "m");
    assert_non_null(import);
    snprintf(import->import.asset, sizeof import->import.asset, "%s", name);
    lum_import_result_finish(&k->result);
    bool ok = lum_import_model(&k->config, import, NULL, NULL, NULL, &k->result, &k->err);
    lum_record_unref(import);
    return ok;
}

bool kit_import_gltf(struct kit *k, const char *json, const void *buffer, size_t n)
{
    kit_write_text(k, "a.gltf", json);
    kit_write(k, "b.bin", buffer, n);
    bool ok = kit_import(k, "a.gltf");
    if (!ok)
        print_message("import: %s\n", k->err.text);
    return ok;
}

const struct lum_record *kit_find(const struct kit *k, const char *id)
{
    for (size_t i = 0; i < k->result.n_records; i++)
        if (strcmp(k->result.records[i]->id, id) == 0)
            return k->result.records[i];
    for (size_t i = 0; i < k->result.n_records; i++)
        print_message("there is: %s\n", k->result.records[i]->id);
    fail_msg("no record %s", id);
    return NULL;
}

size_t kit_count(const struct kit *k, enum lum_record_type type)
{
    size_t n = 0;
    for (size_t i = 0; i < k->result.n_records; i++)
        n += k->result.records[i]->type == type;
    return n;
}

const struct lum_record *kit_only(const struct kit *k, enum lum_record_type type)
{
    assert_int_equal(kit_count(k, type), 1);
    for (size_t i = 0; i < k->result.n_records; i++)
        if (k->result.records[i]->type == type)
            return k->result.records[i];
    return NULL;
}

bool kit_warned(const struct kit *k, const char *part)
{
    for (size_t i = 0; i < k->result.n_warnings; i++)
        if (strstr(k->result.warnings[i], part))
            return true;
    return false;
}

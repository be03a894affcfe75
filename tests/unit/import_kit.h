/* Small model files written by tests, and what importing them gives. */
#ifndef LUM_TESTS_UNIT_IMPORT_KIT_H
#define LUM_TESTS_UNIT_IMPORT_KIT_H

#include "server/import/import.h"

/* A directory of its own for each test, removed with all it holds. */
struct kit {
    char dir[64];
    struct lum_import_config config;
    struct lum_import_result result; /* of the last successful kit_import */
    struct lum_proto_error err;      /* of the last failed one */
};
void kit_open(struct kit *k);
void kit_close(struct kit *k);

void kit_write(const struct kit *k, const char *name, const void *bytes, size_t n);
void kit_write_text(const struct kit *k, const char *name, const char *text);

/* Imports `name` with id "m". */
bool kit_import(struct kit *k, const char *name);
/* The same from glTF text, whose buffer "b.bin" holds n bytes. */
bool kit_import_gltf(struct kit *k, const char *json, const void *buffer, size_t n);

/* Asserts that it is there. */
const struct lum_record *kit_find(const struct kit *k, const char *id);
size_t kit_count(const struct kit *k, enum lum_record_type type);
/* The only record of its type. */
const struct lum_record *kit_only(const struct kit *k, enum lum_record_type type);
bool kit_warned(const struct kit *k, const char *part);

#endif

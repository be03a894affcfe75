/* Reading the JSON of a glTF file, which may be hostile.
 *
 * Errors are sticky: the first failure is kept in g->error with the place it was found at, later reads return harmless
 * defaults, and each step ends with `return lum_gltf_ok(g)`. Every number from the file passes one of the getters
 * below, which check type, finiteness and range. Numbers that only shape the look (colours, roughness) are clamped with
 * a warning; numbers that address memory are refused. */
#ifndef LUM_SERVER_IMPORTER_GLTF_JSON_H
#define LUM_SERVER_IMPORTER_GLTF_JSON_H

#include "server/importer/gltf.h"

void lum_gltf_at(struct lum_gltf *g, enum lum_gltf_kind kind, uint32_t index);
bool lum_gltf_ok(const struct lum_gltf *g);
/* Keeps the first error; the text is prefixed by "accessors[3]: ". Returns false. */
bool lum_gltf_fail(struct lum_gltf *g, enum lum_status status, const char *fmt, ...) LUM_PRINTF(3, 4);
/* The error becomes a warning that names what is not used, at that place. False: memory is short, and it stays. */
bool lum_gltf_go_on_without(struct lum_gltf *g, const char *what, enum lum_gltf_kind kind, uint32_t index);
void lum_gltf_warn(struct lum_gltf *g, const char *fmt, ...) LUM_PRINTF(2, 3);

const cJSON *lum_gltf_item(const struct lum_gltf *g, enum lum_gltf_kind kind, uint32_t index);
const cJSON *lum_gltf_object(struct lum_gltf *g, const cJSON *o, const char *key); /* NULL: absent, or refused */
const cJSON *lum_gltf_list(struct lum_gltf *g, const cJSON *o, const char *key);
const cJSON *lum_gltf_extension(struct lum_gltf *g, const cJSON *o, const char *name);
const char *lum_gltf_string(struct lum_gltf *g, const cJSON *o, const char *key); /* NULL: absent */
bool lum_gltf_bool(struct lum_gltf *g, const cJSON *o, const char *key, bool absent);
/* A whole number 0..max. */
uint64_t lum_gltf_uint(struct lum_gltf *g, const cJSON *o, const char *key, uint64_t absent, uint64_t max);
/* An index into an array of the file; LUM_GLTF_NONE: absent. */
uint32_t lum_gltf_index(struct lum_gltf *g, const cJSON *o, const char *key, enum lum_gltf_kind kind);
bool lum_gltf_index_value(struct lum_gltf *g, const cJSON *value, const char *key, enum lum_gltf_kind kind,
                          uint32_t *ret_index);
double lum_gltf_number(struct lum_gltf *g, const cJSON *o, const char *key, double absent);
double lum_gltf_clamped(struct lum_gltf *g, const cJSON *o, const char *key, double absent, const double range[2]);
/* Exactly n finite numbers; false: absent (values untouched) or refused. */
bool lum_gltf_numbers(struct lum_gltf *g, const cJSON *o, const char *key, double *values, uint32_t n);
/* The same, for a vector that looks: each value clamped. */
void lum_gltf_clamped_numbers(struct lum_gltf *g, const cJSON *o, const char *key, double *values, uint32_t n,
                              const double range[2]);

#endif

/* Shared by the protocol tests: JSON with single quotes, minimal records, random values from the field tables. */
#ifndef LUM_TESTS_PROTOCOL_UTIL_H
#define LUM_TESTS_PROTOCOL_UTIL_H

#include "protocol/document/document.h"
#include "protocol/record/field.h"

struct cJSON;

/* Parses text in which ' stands for ". Exits with a message when it is not JSON: the test is wrong then. */
struct cJSON *json_of(const char *text);
/* An add (or import, or set of render) with the required fields alone. */
struct cJSON *minimal_record(enum lum_record_type type);

/* splitmix64: deterministic, printed by the failing test as its seed. */
struct rng {
    uint64_t s;
};
uint32_t rng_below(struct rng *r, uint32_t n);
double rng_unit(struct rng *r);
/* A value that the field accepts on its own; NULL for bulk fields. */
struct cJSON *random_value(struct rng *r, const struct lum_field *f);

/* The record that an op makes, or NULL. A set of render is applied to a fresh one. */
struct lum_record *record_of(const struct cJSON *json, struct lum_proto_error *err);
bool records_equal(const struct lum_record *a, const struct lum_record *b);
/* Text of the whole document as scene.get gives it; the caller frees it. */
char *document_text(const struct lum_document *doc);
/* Applies ops given as JSON text (single quotes). */
bool apply_text(struct lum_document *doc, const char *user, const char *ops, struct lum_proto_error *err);
/* Every reference names a record of its type, every origin an import. */
bool document_whole(const struct lum_document *doc);

#endif

/* JSON text in and out, and typed reading of small objects.
 *
 * Everything here is total over arbitrary bytes. A text is scanned before it is parsed: UTF-8, size, depth, number of
 * values and the number grammar are checked first, so that the parser never meets what it reads loosely (NaN, 01,
 * "\u0000"), never recurses deep, and never allocates more than the limits allow. No globals. */
#ifndef LUM_PROTOCOL_JSON_JSON_H
#define LUM_PROTOCOL_JSON_JSON_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "protocol/base/error.h"
#include "protocol/base/value.h"

struct cJSON;

/* One JSON value. Refuses what limits.h caps, numbers that are not finite in double, and repeated members. The caller
 * frees it with cJSON_Delete. NULL: err says why (LUM_PROTO_PARSE, or "limit_exceeded"). */
struct cJSON *lum_json_parse(const char *text, size_t n_bytes, struct lum_proto_error *err);
/* The same of a line of a file, which may be longer: LUM_LIMIT_STORED_BYTES, LUM_LIMIT_STORED_TOKENS. */
struct cJSON *lum_json_parse_stored(const char *text, size_t n_bytes, struct lum_proto_error *err);

/* Compact text; every number reads back to the same double. Not finite prints as null. The caller frees it. *ret_bytes
 * (may be NULL) is its length. NULL when memory is short. */
char *lum_json_print(const struct cJSON *json, size_t *ret_bytes);

/* About what it takes in memory: each value is an allocation, and so is each text. 0 of NULL. */
size_t lum_json_bytes(const struct cJSON *json);

/* Adds an owned item to an object or (key NULL) an array; false, with the item freed, when it is NULL or memory is
 * short. Keys are copied. */
bool lum_json_add(struct cJSON *parent, const char *key, struct cJSON *item);
bool lum_json_add_number(struct cJSON *object, const char *key, double v);
bool lum_json_add_string(struct cJSON *object, const char *key, const char *s);
bool lum_json_add_bool(struct cJSON *object, const char *key, bool v);

/* ---- values: what they must be, or err says so of `name` ---- */
struct lum_json_range {
    const char *name;
    double min, max;
    bool whole;
};
bool lum_json_to_number(const struct cJSON *json, const struct lum_json_range *range, double *ret,
                        struct lum_proto_error *err);
bool lum_json_to_numbers(const struct cJSON *json, const struct lum_json_range *range, unsigned n, double *ret,
                         struct lum_proto_error *err);
bool lum_json_to_bool(const struct cJSON *json, const char *name, bool *ret, struct lum_proto_error *err);
bool lum_json_to_id(const struct cJSON *json, const char *name, lum_id ret, struct lum_proto_error *err);
/* One word of "jpeg|png|webp"; *ret is its index in the list. */
bool lum_json_to_choice(const struct cJSON *json, const char *name, const char *choices, unsigned *ret,
                        struct lum_proto_error *err);

/* ---- reading an object member by member ----
 *
 *   struct lum_json_reader r;
 *   lum_json_begin(&r, params, "", err);
 *   view->has_quality = lum_json_u32(&r, "quality", 1, 100, &quality);
 *   view->has_size = lum_json_numbers(&r, "size", 2, 1, 4096, size);
 *   return lum_json_end(&r);
 *
 * Each reading function is true when the member is there and right; only then it writes its result. The first wrong
 * member fills err and makes every later call false. lum_json_end refuses members that nobody asked for, by name. */
struct lum_json_reader {
    const struct cJSON *object; /* NULL: as if empty */
    struct lum_proto_error *err;
    const char *prefix; /* path of the object, "" at the top; borrowed */
    const char *asked[LUM_LIMIT_JSON_MEMBERS];
    unsigned n_asked;
    bool failed;
};
void lum_json_begin(struct lum_json_reader *r, const struct cJSON *object, const char *prefix,
                    struct lum_proto_error *err);
bool lum_json_end(struct lum_json_reader *r);

/* Fails the reader for its caller, who has filled err with the member's own path. Returns false. */
bool lum_json_fail(struct lum_json_reader *r);

/* The member, or NULL; null included. */
const struct cJSON *lum_json_any_member(struct lum_json_reader *r, const char *key);
/* The member, or NULL. JSON null counts as absent. */
const struct cJSON *lum_json_member(struct lum_json_reader *r, const char *key);
/* Fails with "missing_field" when the member is absent. */
bool lum_json_require(struct lum_json_reader *r, const char *key);

bool lum_json_number(struct lum_json_reader *r, const char *key, double min, double max, double *ret);
bool lum_json_u32(struct lum_json_reader *r, const char *key, uint32_t min, uint32_t max, uint32_t *ret);
bool lum_json_u64(struct lum_json_reader *r, const char *key, uint64_t *ret); /* 0 .. 2^53 */
bool lum_json_numbers(struct lum_json_reader *r, const char *key, unsigned n, double min, double max, double *ret);
bool lum_json_bool(struct lum_json_reader *r, const char *key, bool *ret);
/* At most n_ret - 1 bytes, which do not hold a 0. */
bool lum_json_string(struct lum_json_reader *r, const char *key, char *ret, size_t n_ret);
bool lum_json_id(struct lum_json_reader *r, const char *key, lum_id ret);
/* One word of "jpeg|png|webp"; *ret is its index in the list. */
bool lum_json_choice(struct lum_json_reader *r, const char *key, const char *choices, unsigned *ret);
/* An object member, as a reader of its own: begin it with this, end it with lum_json_end and pass its result on. */
bool lum_json_object(struct lum_json_reader *r, const char *key, struct lum_json_reader *ret_sub);

#endif

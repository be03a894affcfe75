/* Reading values, and objects member by member. */
#include "protocol/json/json.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#include <cjson/cJSON.h>

#include "protocol/base/nearest.h"

/* ---- values ---- */

static bool wrong(struct lum_proto_error *err, const char *name, const char *wanted)
{
    return lum_proto_fail(err, LUM_PROTO_BAD_PARAMS, "invalid_value", name, "%s must be %s", name, wanted);
}

bool lum_json_to_number(const struct cJSON *m, const struct lum_json_range *range, double *ret,
                        struct lum_proto_error *err)
{
    if (!cJSON_IsNumber(m) || !(m->valuedouble >= range->min && m->valuedouble <= range->max))
        return lum_proto_fail_range(err, range->name, range->min, range->max);
    if (range->whole && m->valuedouble != floor(m->valuedouble))
        return wrong(err, range->name, "an integer");
    *ret = m->valuedouble;
    return true;
}

bool lum_json_to_numbers(const struct cJSON *m, const struct lum_json_range *range, unsigned n, double *ret,
                         struct lum_proto_error *err)
{
    char text[64];
    unsigned i = 0;
    if (!cJSON_IsArray(m) || cJSON_GetArraySize(m) != (int)n) {
        snprintf(text, sizeof text, "an array of %u numbers", n);
        return wrong(err, range->name, text);
    }
    for (const cJSON *c = m->child; c; c = c->next, i++) {
        snprintf(text, sizeof text, "%s/%u", range->name, i);
        const struct lum_json_range one = {text, range->min, range->max, range->whole};
        double ignored;
        if (!lum_json_to_number(c, &one, &ignored, err))
            return false;
    }
    for (const cJSON *c = m->child; c; c = c->next)
        *ret++ = c->valuedouble;
    return true;
}

bool lum_json_to_bool(const struct cJSON *m, const char *name, bool *ret, struct lum_proto_error *err)
{
    if (!cJSON_IsBool(m))
        return wrong(err, name, "true or false");
    *ret = cJSON_IsTrue(m);
    return true;
}

bool lum_json_to_id(const struct cJSON *m, const char *name, lum_id ret, struct lum_proto_error *err)
{
    if (!cJSON_IsString(m) || !lum_id_valid(m->valuestring))
        return wrong(err, name, "an id: 1 to 64 of the characters A-Z a-z 0-9 _ . : / -");
    memset(ret, 0, sizeof(lum_id));
    memcpy(ret, m->valuestring, strlen(m->valuestring));
    return true;
}

bool lum_json_to_choice(const struct cJSON *m, const char *name, const char *choices, unsigned *ret,
                        struct lum_proto_error *err)
{
    unsigned i = 0;
    size_t n = cJSON_IsString(m) ? strlen(m->valuestring) : 0;
    for (const char *word = choices; n && *word; i++) {
        size_t length = strcspn(word, "|");
        if (length == n && memcmp(word, m->valuestring, n) == 0) {
            *ret = i;
            return true;
        }
        word += length + (word[length] == '|');
    }
    return lum_proto_fail(err, LUM_PROTO_BAD_PARAMS, "invalid_value", name, "%s must be one of %s", name, choices);
}

/* ---- members ---- */

void lum_json_begin(struct lum_json_reader *r, const struct cJSON *object, const char *prefix,
                    struct lum_proto_error *err)
{
    memset(r, 0, sizeof *r);
    r->object = object;
    r->prefix = prefix;
    r->err = err;
    if (object && !cJSON_IsObject(object)) {
        lum_proto_fail(err, LUM_PROTO_BAD_PARAMS, "invalid_value", prefix, "%s must be an object",
                       prefix[0] ? prefix : "this");
        r->failed = true;
    }
}

bool lum_json_fail(struct lum_json_reader *r)
{
    r->failed = true;
    return lum_proto_prefix(r->err, r->prefix);
}

const struct cJSON *lum_json_any_member(struct lum_json_reader *r, const char *key)
{
    if (r->n_asked < LUM_LIMIT_JSON_MEMBERS)
        r->asked[r->n_asked++] = key;
    return r->failed || !r->object ? NULL : cJSON_GetObjectItemCaseSensitive(r->object, key);
}

const struct cJSON *lum_json_member(struct lum_json_reader *r, const char *key)
{
    const cJSON *m = lum_json_any_member(r, key);
    return m && !cJSON_IsNull(m) ? m : NULL;
}

bool lum_json_require(struct lum_json_reader *r, const char *key)
{
    if (lum_json_member(r, key))
        return true;
    if (r->failed)
        return false;
    lum_proto_fail(r->err, LUM_PROTO_BAD_PARAMS, "missing_field", key, "%s is missing", key);
    return lum_json_fail(r);
}

bool lum_json_end(struct lum_json_reader *r)
{
    if (r->failed)
        return false;
    for (const cJSON *m = r->object ? r->object->child : NULL; m; m = m->next) {
        bool known = false;
        for (unsigned i = 0; i < r->n_asked && !known; i++)
            known = strcmp(m->string, r->asked[i]) == 0;
        if (known)
            continue;
        struct lum_nearest near = {.given = m->string};
        char meant[sizeof r->err->text / 2];
        for (unsigned i = 0; i < r->n_asked; i++)
            lum_nearest_offer(&near, r->asked[i]);
        lum_nearest_text(&near, meant, sizeof meant);
        lum_proto_fail(r->err, LUM_PROTO_BAD_PARAMS, "unknown_field", m->string, "unknown field \"%.64s\"%s", m->string,
                       meant);
        return lum_json_fail(r);
    }
    return true;
}

bool lum_json_number(struct lum_json_reader *r, const char *key, double min, double max, double *ret)
{
    const cJSON *m = lum_json_member(r, key);
    return m &&
           (lum_json_to_number(m, &(struct lum_json_range){key, min, max, false}, ret, r->err) || lum_json_fail(r));
}

/* An integer that double holds exactly. */
static bool read_integer(struct lum_json_reader *r, const char *key, double min, double max, double *ret)
{
    const cJSON *m = lum_json_member(r, key);
    return m && (lum_json_to_number(m, &(struct lum_json_range){key, min, max, true}, ret, r->err) || lum_json_fail(r));
}

bool lum_json_u32(struct lum_json_reader *r, const char *key, uint32_t min, uint32_t max, uint32_t *ret)
{
    double v = 0.0; /* GCC does not see that a reader which went well has written it */
    if (!read_integer(r, key, min, max, &v))
        return false;
    *ret = (uint32_t)v;
    return true;
}

bool lum_json_u64(struct lum_json_reader *r, const char *key, uint64_t *ret)
{
    double v = 0.0;
    if (!read_integer(r, key, 0, 9007199254740992.0, &v))
        return false;
    *ret = (uint64_t)v;
    return true;
}

bool lum_json_numbers(struct lum_json_reader *r, const char *key, unsigned n, double min, double max, double *ret)
{
    const cJSON *m = lum_json_member(r, key);
    const struct lum_json_range range = {key, min, max, false};
    return m && (lum_json_to_numbers(m, &range, n, ret, r->err) || lum_json_fail(r));
}

bool lum_json_bool(struct lum_json_reader *r, const char *key, bool *ret)
{
    const cJSON *m = lum_json_member(r, key);
    return m && (lum_json_to_bool(m, key, ret, r->err) || lum_json_fail(r));
}

bool lum_json_string(struct lum_json_reader *r, const char *key, char *ret, size_t n_ret)
{
    const cJSON *m = lum_json_member(r, key);
    if (!m)
        return false;
    if (cJSON_IsString(m) && strlen(m->valuestring) < n_ret) {
        memcpy(ret, m->valuestring, strlen(m->valuestring) + 1);
        return true;
    }
    char wanted[64];
    snprintf(wanted, sizeof wanted, "a string of at most %zu bytes", n_ret - 1);
    wrong(r->err, key, wanted);
    return lum_json_fail(r);
}

bool lum_json_id(struct lum_json_reader *r, const char *key, lum_id ret)
{
    const cJSON *m = lum_json_member(r, key);
    return m && (lum_json_to_id(m, key, ret, r->err) || lum_json_fail(r));
}

bool lum_json_choice(struct lum_json_reader *r, const char *key, const char *choices, unsigned *ret)
{
    const cJSON *m = lum_json_member(r, key);
    return m && (lum_json_to_choice(m, key, choices, ret, r->err) || lum_json_fail(r));
}

bool lum_json_object(struct lum_json_reader *r, const char *key, struct lum_json_reader *ret_sub)
{
    const cJSON *m = lum_json_member(r, key);
    if (!m)
        return false;
    if (!cJSON_IsObject(m)) {
        wrong(r->err, key, "an object");
        return lum_json_fail(r);
    }
    lum_json_begin(ret_sub, m, key, r->err);
    return true;
}

#include "protocol/json/json.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cjson/cJSON.h>

#include "protocol/base/utf8.h"
#include "protocol/json/scan.h"

/* ---- text to tree ---- */

static bool check_members(const cJSON *object, struct lum_proto_error *err)
{
    unsigned n = 0;
    for (const cJSON *a = object->child; a; a = a->next) {
        if (++n > LUM_LIMIT_JSON_MEMBERS)
            return lum_proto_fail(err, LUM_PROTO_BAD_REQUEST, "limit_exceeded", "", "more than %u members in an object",
                                  LUM_LIMIT_JSON_MEMBERS);
        for (const cJSON *b = object->child; b != a; b = b->next)
            if (strcmp(a->string, b->string) == 0)
                return lum_proto_fail(err, LUM_PROTO_BAD_REQUEST, "invalid_value", "", "\"%.64s\" is given twice",
                                      a->string);
    }
    return true;
}

/* Recursion is bounded by LUM_LIMIT_JSON_DEPTH. */
static bool check_tree(const cJSON *json, struct lum_proto_error *err)
{
    if (cJSON_IsNumber(json) && !isfinite(json->valuedouble))
        return lum_proto_fail(err, LUM_PROTO_BAD_REQUEST, "invalid_value", "", "a number is too large for a double");
    if (cJSON_IsObject(json) && !check_members(json, err))
        return false;
    for (const cJSON *c = json->child; c; c = c->next)
        if (!check_tree(c, err))
            return lum_proto_prefix(err, c->string ? c->string : "");
    return true;
}

static cJSON *parse(const char *text, size_t n_bytes, bool stored, struct lum_proto_error *err)
{
    if (!lum_json_scan(text, n_bytes, stored, err))
        return NULL;
    const char *end = NULL;
    cJSON *json = n_bytes ? cJSON_ParseWithLengthOpts(text, n_bytes, &end, false) : NULL;
    if (!json) {
        lum_proto_fail(err, LUM_PROTO_PARSE, "invalid_value", "", "not JSON: cannot be parsed at byte %zu",
                       end ? (size_t)(end - text) : (size_t)0);
        return NULL;
    }
    while (end < text + n_bytes && (*end == ' ' || *end == '\t' || *end == '\n' || *end == '\r'))
        end++;
    if (end != text + n_bytes) {
        lum_proto_fail(err, LUM_PROTO_PARSE, "invalid_value", "", "not JSON: text after the end at byte %zu",
                       (size_t)(end - text));
        goto fail;
    }
    if (!check_tree(json, err))
        goto fail;
    return json;
fail:
    cJSON_Delete(json);
    return NULL;
}

struct cJSON *lum_json_parse(const char *text, size_t n_bytes, struct lum_proto_error *err)
{
    return parse(text, n_bytes, false, err);
}

struct cJSON *lum_json_parse_stored(const char *text, size_t n_bytes, struct lum_proto_error *err)
{
    return parse(text, n_bytes, true, err);
}

/* ---- tree to text ---- */

struct text {
    char *s;
    size_t n, capacity;
    bool failed; /* sticky: memory was short */
};

static void put(struct text *t, const char *s, size_t n)
{
    if (t->failed)
        return;
    if (t->capacity - t->n <= n) {
        size_t capacity = t->capacity ? t->capacity : 256;
        while (capacity - t->n <= n)
            capacity *= 2;
        char *grown = realloc(t->s, capacity);
        if (!grown) {
            t->failed = true;
            return;
        }
        t->s = grown;
        t->capacity = capacity;
    }
    memcpy(t->s + t->n, s, n);
    t->n += n;
    t->s[t->n] = '\0';
}

static void put_number(struct text *t, double v)
{
    char s[40] = "null";
    if (isfinite(v))
        for (int digits = 15; digits <= 17; digits++) { /* 17 always suffice for a double */
            snprintf(s, sizeof s, "%.*g", digits, v);
            if (strtod(s, NULL) == v)
                break;
        }
    put(t, s, strlen(s));
}

/* Length of the run at s that needs no escape. */
static size_t plain_length(const char *s, const char *end)
{
    size_t n = 0;
    while (s + n < end && (unsigned char)s[n] >= 0x20 && s[n] != '"' && s[n] != '\\') {
        size_t length = lum_utf8_length((const uint8_t *)s + n, (const uint8_t *)end);
        if (length == 0)
            break;
        n += length;
    }
    return n;
}

/* What is not UTF-8 becomes U+FFFD: names cut to a buffer's size may end within a character, and a WebSocket text that
 * is not UTF-8 would cost the connection. */
static void put_string(struct text *t, const char *s)
{
    const char *end = s + strlen(s);
    put(t, "\"", 1);
    for (;;) {
        size_t plain = plain_length(s, end);
        put(t, s, plain);
        s += plain;
        if (s == end)
            break;
        char escape[8];
        int n = *s == '"' || *s == '\\'    ? snprintf(escape, sizeof escape, "\\%c", *s)
                : (unsigned char)*s < 0x20 ? snprintf(escape, sizeof escape, "\\u%04x", (unsigned)*s)
                                           : snprintf(escape, sizeof escape, "\\ufffd");
        put(t, escape, (size_t)n);
        s++;
    }
    put(t, "\"", 1);
}

/* Recursion is bounded by the depth of trees that this program makes or lum_json_parse let in. */
static void put_value(struct text *t, const cJSON *json)
{
    if (cJSON_IsNumber(json))
        put_number(t, json->valuedouble);
    else if (cJSON_IsString(json))
        put_string(t, json->valuestring);
    else if (cJSON_IsRaw(json))
        put(t, json->valuestring, strlen(json->valuestring));
    else if (cJSON_IsBool(json))
        put(t, cJSON_IsTrue(json) ? "true" : "false", cJSON_IsTrue(json) ? 4 : 5);
    else if (!cJSON_IsArray(json) && !cJSON_IsObject(json))
        put(t, "null", 4);
    else {
        bool object = cJSON_IsObject(json);
        put(t, object ? "{" : "[", 1);
        for (const cJSON *c = json->child; c; c = c->next) {
            if (object) {
                put_string(t, c->string);
                put(t, ":", 1);
            }
            put_value(t, c);
            if (c->next)
                put(t, ",", 1);
        }
        put(t, object ? "}" : "]", 1);
    }
}

char *lum_json_print(const struct cJSON *json, size_t *ret_bytes)
{
    struct text t = {0};
    put_value(&t, json);
    if (t.failed) {
        free(t.s);
        return NULL;
    }
    if (ret_bytes)
        *ret_bytes = t.n;
    return t.s;
}

#define ALLOCATION_BYTES 16u /* what malloc adds, with what it rounds up */

static size_t text_bytes(const char *s)
{
    return s ? strlen(s) + 1 + ALLOCATION_BYTES : 0;
}

size_t lum_json_bytes(const struct cJSON *json)
{
    if (!json)
        return 0;
    size_t n = sizeof *json + ALLOCATION_BYTES + text_bytes(json->valuestring) + text_bytes(json->string);
    for (const cJSON *c = json->child; c; c = c->next)
        n += lum_json_bytes(c); /* as deep as the parser lets it be */
    return n;
}

/* ---- building ---- */

bool lum_json_add(struct cJSON *parent, const char *key, struct cJSON *item)
{
    if (item && parent && (key ? cJSON_AddItemToObject(parent, key, item) : cJSON_AddItemToArray(parent, item)))
        return true;
    cJSON_Delete(item);
    return false;
}

bool lum_json_add_number(struct cJSON *object, const char *key, double v)
{
    return lum_json_add(object, key, cJSON_CreateNumber(v));
}

bool lum_json_add_string(struct cJSON *object, const char *key, const char *s)
{
    return lum_json_add(object, key, cJSON_CreateString(s));
}

bool lum_json_add_bool(struct cJSON *object, const char *key, bool v)
{
    return lum_json_add(object, key, cJSON_CreateBool(v));
}

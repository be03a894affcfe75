#include "protocol/message/rpc.h"

#include <math.h>
#include <stdio.h>
#include <string.h>
#include <stdlib.h>

#include <cjson/cJSON.h>

#include "protocol/json/json.h"

#define ID_MAX 9007199254740992.0 /* 2^53: larger integers would not come back as they were sent */

/* A string or an integer; anything else cannot be matched to a reply by every client. */
static bool read_id(const cJSON *root, char **ret_id, struct lum_proto_error *err)
{
    const cJSON *id = cJSON_GetObjectItemCaseSensitive(root, "id");
    if (!id)
        return true;
    bool number = cJSON_IsNumber(id) && fabs(id->valuedouble) <= ID_MAX && floor(id->valuedouble) == id->valuedouble;
    bool string = cJSON_IsString(id) && strlen(id->valuestring) <= LUM_LIMIT_ID_BYTES;
    if (!number && !string)
        return lum_proto_fail(err, LUM_PROTO_BAD_REQUEST, "invalid_value", "id",
                              "id must be an integer or a string of at most %d bytes", LUM_LIMIT_ID_BYTES);
    *ret_id = lum_json_print(id, NULL);
    return *ret_id || lum_proto_fail_memory(err);
}

static bool check_envelope(const cJSON *root, struct lum_rpc *rpc, struct lum_proto_error *err)
{
    static const char *const known[] = {"jsonrpc", "id", "method", "params"};
    const cJSON *version = cJSON_GetObjectItemCaseSensitive(root, "jsonrpc");
    const cJSON *method = cJSON_GetObjectItemCaseSensitive(root, "method");
    const cJSON *params = cJSON_GetObjectItemCaseSensitive(root, "params");
    if (!cJSON_IsString(version) || strcmp(version->valuestring, "2.0") != 0)
        return lum_proto_fail(err, LUM_PROTO_BAD_REQUEST, "invalid_value", "jsonrpc", "jsonrpc must be \"2.0\"");
    if (!cJSON_IsString(method) || strlen(method->valuestring) > LUM_LIMIT_ID_BYTES)
        return lum_proto_fail(err, LUM_PROTO_BAD_REQUEST, method ? "invalid_value" : "missing_field", "method",
                              "method must be a string of at most %d bytes", LUM_LIMIT_ID_BYTES);
    if (params && !cJSON_IsObject(params))
        return lum_proto_fail(err, LUM_PROTO_BAD_PARAMS, "invalid_value", "params", "params must be an object");
    for (const cJSON *m = root->child; m; m = m->next) {
        bool found = false;
        for (size_t i = 0; i < sizeof known / sizeof known[0]; i++)
            found = found || strcmp(m->string, known[i]) == 0;
        if (!found)
            return lum_proto_fail(err, LUM_PROTO_BAD_REQUEST, "unknown_field", m->string, "unknown field \"%.64s\"",
                                  m->string);
    }
    rpc->method = method->valuestring;
    rpc->params = params;
    return true;
}

bool lum_rpc_parse(const char *text, size_t n_bytes, struct lum_rpc *ret_rpc, struct lum_proto_error *err)
{
    memset(ret_rpc, 0, sizeof *ret_rpc);
    cJSON *root = lum_json_parse(text, n_bytes, err);
    if (!root)
        return false;
    if (!cJSON_IsObject(root)) {
        lum_proto_fail(err, LUM_PROTO_BAD_REQUEST, "unsupported", "", "%s",
                       cJSON_IsArray(root) ? "batches are not supported: send one object per message"
                                           : "a message must be an object");
        goto fail;
    }
    if (!read_id(root, &ret_rpc->id, err) || !check_envelope(root, ret_rpc, err))
        goto fail;
    ret_rpc->root = root;
    return true;
fail:
    cJSON_Delete(root);
    return false;
}

/* Past the string that begins there, or at the end. */
static size_t skip_string(const char *text, size_t n, size_t i)
{
    for (i++; i < n && text[i] != '"'; i++)
        i += text[i] == '\\';
    return i < n ? i + 1 : n;
}

static size_t skip_space(const char *text, size_t n, size_t i)
{
    while (i < n && (text[i] == ' ' || text[i] == '\t' || text[i] == '\n' || text[i] == '\r'))
        i++;
    return i;
}

/* The value that begins there. */
static char *copy_id(const char *text, size_t n, size_t from)
{
    char value[6 * LUM_LIMIT_ID_BYTES + 16]; /* each byte of a string may be escaped */
    struct lum_proto_error err;
    char *id = NULL;
    size_t to = from;
    if (from < n && text[from] == '"')
        to = skip_string(text, n, from);
    else
        while (to < n && text[to] && strchr("+-.0123456789eE", text[to]))
            to++;
    int n_value = to - from < sizeof value - 8
                      ? snprintf(value, sizeof value, "{\"id\":%.*s}", (int)(to - from), text + from)
                      : 0;
    cJSON *root = n_value > 0 ? lum_json_parse(value, (size_t)n_value, &err) : NULL;
    if (root)
        (void)read_id(root, &id, &err);
    cJSON_Delete(root);
    return id;
}

char *lum_rpc_scan_id(const char *text, size_t n)
{
    size_t depth = 0;
    for (size_t i = 0; i < n;) {
        char c = text[i];
        if (c != '"') {
            depth += c == '{' || c == '[';
            depth -= (c == '}' || c == ']') && depth > 0;
            i++;
            continue;
        }
        size_t end = skip_string(text, n, i), colon = skip_space(text, n, end);
        bool found =
            depth == 1 && end - i == 4 && memcmp(text + i, "\"id\"", 4) == 0 && colon < n && text[colon] == ':';
        if (found)
            return copy_id(text, n, skip_space(text, n, colon + 1));
        i = end;
    }
    return NULL;
}

void lum_rpc_finish(struct lum_rpc *rpc)
{
    if (!rpc)
        return;
    free(rpc->id);
    cJSON_Delete(rpc->root);
    memset(rpc, 0, sizeof *rpc);
}

/* ---- texts ---- */

static cJSON *envelope(void)
{
    cJSON *root = cJSON_CreateObject();
    if (!lum_json_add_string(root, "jsonrpc", "2.0")) {
        cJSON_Delete(root);
        return NULL;
    }
    return root;
}

/* Prints and frees root; ok false: something could not be added. */
static char *print(cJSON *root, bool ok)
{
    char *text = ok ? lum_json_print(root, NULL) : NULL;
    cJSON_Delete(root);
    return text;
}

char *lum_rpc_result(const char *id, struct cJSON *result)
{
    cJSON *root = envelope();
    bool ok = lum_json_add(root, "result", result);
    ok = ok && lum_json_add(root, "id", cJSON_CreateRaw(id));
    return print(root, ok);
}

static cJSON *error_data(const struct lum_proto_error *err)
{
    cJSON *data = cJSON_CreateObject();
    bool ok = lum_json_add_string(data, "code", err->app);
    ok = ok && (!err->path[0] || lum_json_add_string(data, "path", err->path));
    if (err->has_range)
        ok = ok && lum_json_add_number(data, "min", err->min) && lum_json_add_number(data, "max", err->max);
    if (ok)
        return data;
    cJSON_Delete(data);
    return NULL;
}

char *lum_rpc_error(const char *id, const struct lum_proto_error *err)
{
    cJSON *error = cJSON_CreateObject();
    bool ok = lum_json_add_number(error, "code", err->code);
    ok = ok && lum_json_add_string(error, "message", err->text) && lum_json_add(error, "data", error_data(err));
    if (!ok) {
        cJSON_Delete(error);
        error = NULL;
    }
    cJSON *root = envelope();
    ok = lum_json_add(root, "error", error);
    ok = ok && lum_json_add(root, "id", id ? cJSON_CreateRaw(id) : cJSON_CreateNull());
    return print(root, ok);
}

char *lum_rpc_notification(const char *method, struct cJSON *params)
{
    cJSON *root = envelope();
    bool ok = lum_json_add(root, "params", params);
    ok = ok && lum_json_add_string(root, "method", method);
    return print(root, ok);
}

char *lum_rpc_request(uint64_t id, const char *method, struct cJSON *params)
{
    cJSON *root = envelope();
    bool ok = lum_json_add(root, "params", params);
    ok = ok && lum_json_add_string(root, "method", method) && lum_json_add_number(root, "id", (double)id);
    return print(root, ok);
}

/* ---- client side ---- */

bool lum_rpc_parse_incoming(const char *text, size_t n_bytes, struct lum_rpc_incoming *ret_in,
                            struct lum_proto_error *err)
{
    cJSON *root = lum_json_parse(text, n_bytes, err);
    if (!root)
        return false;
    const cJSON *id = cJSON_GetObjectItemCaseSensitive(root, "id");
    const cJSON *method = cJSON_GetObjectItemCaseSensitive(root, "method");
    bool has_id = cJSON_IsNumber(id) && id->valuedouble >= 1 && id->valuedouble <= ID_MAX;
    *ret_in = (struct lum_rpc_incoming){
        .root = root,
        .id = has_id ? (uint64_t)id->valuedouble : 0,
        .method = cJSON_IsString(method) ? method->valuestring : NULL,
        .result = cJSON_GetObjectItemCaseSensitive(root, "result"),
        .error = cJSON_GetObjectItemCaseSensitive(root, "error"),
        .params = cJSON_GetObjectItemCaseSensitive(root, "params"),
    };
    return true;
}

void lum_rpc_incoming_finish(struct lum_rpc_incoming *in)
{
    if (!in)
        return;
    cJSON_Delete(in->root);
    memset(in, 0, sizeof *in);
}

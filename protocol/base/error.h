/* Errors as the wire shows them: JSON-RPC codes and stable application codes. */
#ifndef LUM_PROTOCOL_BASE_ERROR_H
#define LUM_PROTOCOL_BASE_ERROR_H

#include <stdbool.h>

enum lum_proto_code {
    LUM_PROTO_OK = 0,
    LUM_PROTO_PARSE = -32700,
    LUM_PROTO_BAD_REQUEST = -32600,
    LUM_PROTO_NO_METHOD = -32601,
    LUM_PROTO_BAD_PARAMS = -32602,
    LUM_PROTO_INTERNAL = -32603,
    LUM_PROTO_APPLICATION = -32000, /* data.code says which */
};

struct lum_proto_error {
    enum lum_proto_code code;
    char app[32];   /* data.code: "invalid_value" "unknown_field" "missing_field" "not_found" "conflict" "in_use"
                       "rev_conflict" "limit_exceeded" "not_authorised" "unsupported" "import_failed" "busy" "io" */
    char path[128]; /* data.path: "ops/3/flux_lm" */
    bool has_range;
    double min, max; /* data.min, data.max */
    char text[256];  /* message: one sentence for a person */
};

bool lum_proto_fail(struct lum_proto_error *err, enum lum_proto_code code, const char *app, const char *path,
                    const char *fmt, ...) __attribute__((format(printf, 5, 6)));                  /* returns false */
bool lum_proto_fail_range(struct lum_proto_error *err, const char *path, double min, double max); /* returns false */
bool lum_proto_fail_memory(struct lum_proto_error *err);                                          /* returns false */
/* Puts "prefix/" before err->path, for callers that know where the failing part stands. Returns false. */
bool lum_proto_prefix(struct lum_proto_error *err, const char *prefix);

#endif

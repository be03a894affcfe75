#include "protocol/base/error.h"

#include <stdarg.h>
#include <stdio.h>
#include <string.h>

bool lum_proto_fail(struct lum_proto_error *err, enum lum_proto_code code, const char *app, const char *path,
                    const char *fmt, ...)
{
    if (!err)
        return false;
    memset(err, 0, sizeof *err);
    err->code = code;
    snprintf(err->app, sizeof err->app, "%s", app ? app : "");
    snprintf(err->path, sizeof err->path, "%s", path ? path : "");
    va_list args;
    va_start(args, fmt);
    vsnprintf(err->text, sizeof err->text, fmt, args);
    va_end(args);
    return false;
}

bool lum_proto_fail_range(struct lum_proto_error *err, const char *path, double min, double max)
{
    lum_proto_fail(err, LUM_PROTO_BAD_PARAMS, "invalid_value", path, "%s must be a number from %g to %g",
                   path ? path : "value", min, max);
    if (err) {
        err->has_range = true;
        err->min = min;
        err->max = max;
    }
    return false;
}

bool lum_proto_fail_memory(struct lum_proto_error *err)
{
    return lum_proto_fail(err, LUM_PROTO_INTERNAL, "limit_exceeded", "", "out of memory");
}

bool lum_proto_prefix(struct lum_proto_error *err, const char *prefix)
{
    if (!err || prefix[0] == '\0')
        return false;
    char rest[sizeof err->path];
    memcpy(rest, err->path, sizeof rest);
    size_t room = sizeof err->path;
    int n = snprintf(err->path, room, "%s", prefix);
    if (n > 0 && (size_t)n < room && rest[0] != '\0')
        snprintf(err->path + n, room - (size_t)n, "/%.*s", (int)(room - 1 - (size_t)n), rest);
    return false;
}

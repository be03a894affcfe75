#include "protocol/error.h"

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

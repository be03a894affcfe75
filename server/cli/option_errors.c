#include "server/cli/option_errors.h"

#include <stdio.h>
#include <string.h>

#include "core/method/method.h"
#include "protocol/base/limits.h"
#include "protocol/base/nearest.h"
#include "server/base/suggest.h"

bool lum_option_is_whole(char **argv, const char *name)
{
    const char *arg = argv[optind - 1];
    if (arg == optarg) /* "--spp 3"; in "--spp=3" the value is a part of it */
        arg = argv[optind - 2];
    return strncmp(arg, "--", 2) == 0 && strlen(name) == strcspn(arg + 2, "=");
}

enum lum_status lum_option_unknown(const char *arg, const struct option *options, struct lum_error *err)
{
    const char *rest = strncmp(arg, "--", 2) == 0 ? arg + 2 : arg;
    char name[LUM_LIMIT_ID_BYTES + 2]; /* longer ones are near to nothing */
    snprintf(name, sizeof name, "%.*s", (int)strcspn(rest, "="), rest);
    struct lum_nearest near = {.given = name};
    for (const struct option *o = options; o->name; o++)
        lum_nearest_offer(&near, o->name);
    return lum_fail(err, LUM_ERR_INVALID, "", "unknown option '%.60s'%s%s%s", arg, near.n ? ": did you mean --" : "",
                    near.n ? near.names[0] : "", near.n ? "?" : "");
}

enum lum_status lum_option_method(const char *option, const char *name, struct lum_error *err)
{
    if (lum_method_find(name))
        return LUM_OK;
    char near[LUM_NAMES_BYTES];
    lum_names_of_method(name, near);
    return lum_fail(err, LUM_ERR_INVALID, "method", "%s must be a method, not '%.40s'%s", option, name, near);
}

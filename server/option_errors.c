#include "server/option_errors.h"

#include <stdio.h>
#include <string.h>

#include "core/method/method.h"

#define NAME_BYTES 32 /* longer ones are not looked at */

bool lum_option_is_whole(char **argv, const char *name)
{
    const char *arg = argv[optind - 1];
    if (arg == optarg) /* "--spp 3"; in "--spp=3" the value is a part of it */
        arg = argv[optind - 2];
    return strncmp(arg, "--", 2) == 0 && strlen(name) == strcspn(arg + 2, "=");
}

/* How many letters to insert, leave out or replace to make b of a (Levenshtein), one row of the table at a time. */
static size_t distance(const char *a, size_t n_a, const char *b, size_t n_b)
{
    size_t row[NAME_BYTES + 1];
    for (size_t j = 0; j <= n_b; j++)
        row[j] = j;
    for (size_t i = 1; i <= n_a; i++) {
        size_t diagonal = row[0];
        row[0] = i;
        for (size_t j = 1; j <= n_b; j++) {
            size_t replaced = diagonal + (a[i - 1] != b[j - 1]);
            size_t shorter = (row[j] < row[j - 1] ? row[j] : row[j - 1]) + 1;
            diagonal = row[j];
            row[j] = replaced < shorter ? replaced : shorter;
        }
    }
    return row[n_b];
}

/* NULL: none is near. Two letters may be wrong, of short names one. */
static const char *nearest(const char *given, size_t n_given, const struct option *options)
{
    const char *best = NULL;
    size_t least = 3;
    for (const struct option *o = options; n_given <= NAME_BYTES && o->name; o++) {
        size_t n = strlen(o->name), d = n <= NAME_BYTES ? distance(given, n_given, o->name, n) : least;
        if (d < least && 2 * d < n) {
            least = d;
            best = o->name;
        }
    }
    return best;
}

enum lum_status lum_option_unknown(const char *arg, const struct option *options, struct lum_error *err)
{
    const char *name = strncmp(arg, "--", 2) == 0 ? arg + 2 : arg, *meant = nearest(name, strcspn(name, "="), options);
    return lum_fail(err, LUM_ERR_INVALID, "", "unknown option '%.60s'%s%s%s", arg, meant ? ": did you mean --" : "",
                    meant ? meant : "", meant ? "?" : "");
}

enum lum_status lum_option_method(const char *option, const char *name, struct lum_error *err)
{
    if (lum_method_find(name))
        return LUM_OK;
    size_t n;
    const struct lum_method *methods = lum_methods(&n);
    char list[128] = "";
    for (size_t i = 0, used = 0; i < n && used < sizeof list; i++)
        used += (size_t)snprintf(list + used, sizeof list - used, "%s%s", i ? ", " : "", methods[i].name);
    return lum_fail(err, LUM_ERR_INVALID, "method", "%s must be one of %s, not '%.40s'", option, list, name);
}

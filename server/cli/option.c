#include "server/cli/option.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

#include "core/accel/accel.h"
#include "core/method/method.h"
#include "protocol/base/limits.h"
#include "protocol/base/nearest.h"
#include "server/base/suggest.h"

/* ---- reading values ---- */

static enum lum_status read_whole(const struct lum_option_row *row, const char *given, const char *text, double max,
                                  uint32_t *ret, struct lum_error *err)
{
    size_t n = strspn(text, "0123456789");
    double v = n > 0 && text[n] == '\0' ? strtod(text, NULL) : (double)INFINITY;
    if (!(v >= row->min && v <= max))
        return lum_fail(err, LUM_ERR_INVALID, row->name, "%s must be a whole number from %.0f to %.0f, not '%.40s'",
                        given, row->min, max, text);
    *ret = (uint32_t)v;
    return LUM_OK;
}

static enum lum_status read_number(const struct lum_option_row *row, const char *given, const char *text, double *ret,
                                   struct lum_error *err)
{
    char *end;
    double v = strtod(text, &end);
    bool number = end != text && !*end, positive = row->kind == LUM_OPTION_POSITIVE;
    if (positive && !(number && v > 0.0 && isfinite(v)))
        return lum_fail(err, LUM_ERR_INVALID, row->name, "%s must be a number above 0, not '%.40s'", given, text);
    if (!positive && !(number && v >= row->min && v <= row->max))
        return lum_fail(err, LUM_ERR_INVALID, row->name, "%s must be a number from %g to %g, not '%.40s'", given,
                        row->min, row->max, text);
    *ret = v;
    return LUM_OK;
}

enum lum_status lum_option_read(const struct lum_option_row *row, const char *given, const char *text, void *options,
                                struct lum_error *err)
{
    void *at = (char *)options + row->offset;
    switch (row->kind) {
    case LUM_OPTION_TEXT:
        *(const char **)at = text;
        return LUM_OK;
    case LUM_OPTION_SWITCH: {
        uint32_t on = 0;
        enum lum_status status = read_whole(row, given, text, 1.0, &on, err);
        *(bool *)at = on;
        return status;
    }
    case LUM_OPTION_WHOLE:
        return read_whole(row, given, text, row->max, at, err);
    case LUM_OPTION_NUMBER:
    case LUM_OPTION_POSITIVE:
        return read_number(row, given, text, at, err);
    case LUM_OPTION_OTHER:
        break;
    }
    return row->read(row, given, text, options, err);
}

enum lum_status lum_option_read_method(const struct lum_option_row *row, const char *given, const char *text,
                                       void *options, struct lum_error *err)
{
    char near[LUM_SUGGEST_BYTES];
    *(const char **)((char *)options + row->offset) = text;
    if (lum_method_find(text))
        return LUM_OK;
    lum_suggest_method(text, near);
    return lum_fail(err, LUM_ERR_INVALID, row->name, "%s must be a method, not '%.40s'%s", given, text, near);
}

enum lum_status lum_option_read_isa(const struct lum_option_row *row, const char *given, const char *text,
                                    void *options, struct lum_error *err)
{
    *(const char **)((char *)options + row->offset) = text;
    return lum_isa_check(given, text, err);
}

/* ---- the command line ---- */

/* The only option whose value is called so: "port", of --listen HOST:PORT. NULL: there is none, or several. */
static const struct lum_option_row *by_value(const char *word, const struct lum_option_row *rows, size_t n_rows)
{
    static const char capitals[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZ";
    const struct lum_option_row *found = NULL;
    size_t n = strlen(word);
    for (size_t i = 0; i < n_rows; i++)
        for (const char *at = rows[i].arg; at && *at;) {
            size_t n_word = strspn(at, capitals);
            if (n_word == n && n > 1 && strncasecmp(at, word, n) == 0) {
                if (found)
                    return NULL;
                found = &rows[i];
            }
            at += n_word ? n_word : 1;
        }
    return found;
}

/* arg: "--treads=3". Says which of the names was meant, if one is near. */
static enum lum_status unknown(const char *arg, size_t n_name, const struct lum_option_row *rows, size_t n_rows,
                               struct lum_error *err)
{
    char name[LUM_LIMIT_ID_BYTES + 2]; /* longer ones are near to nothing */
    snprintf(name, sizeof name, "%.*s", (int)n_name, arg + 2);
    struct lum_nearest near = {.given = name};
    for (size_t i = 0; i < n_rows; i++) {
        if (n_name > 0 && strncmp(rows[i].name, arg + 2, n_name) == 0)
            return lum_fail(err, LUM_ERR_INVALID, "", "an option is abbreviated: write --%s", rows[i].name);
        lum_nearest_offer(&near, rows[i].name);
    }
    const struct lum_option_row *value = by_value(name, rows, n_rows);
    if (value)
        return lum_fail(err, LUM_ERR_INVALID, "", "unknown option '%.60s': did you mean --%s %s?", arg, value->name,
                        value->arg);
    return lum_fail(err, LUM_ERR_INVALID, "", "unknown option '%.60s'%s%s%s", arg, near.n ? ": did you mean --" : "",
                    near.n ? near.names[0] : "", near.n ? "?" : "");
}

enum lum_status lum_option_parse(int argc, char **argv, const struct lum_option_row *rows, size_t n_rows,
                                 struct lum_option_words *words,
                                 enum lum_status (*take)(void *user, size_t row, const char *text,
                                                         struct lum_error *err),
                                 void *user, struct lum_error *err)
{
    for (int k = 1; k < argc; k++) {
        const char *arg = argv[k];
        if (words && arg[0] != '-') {
            if (words->n < LUM_ARRAY_LEN(words->list))
                words->list[words->n] = arg;
            words->n++;
            continue;
        }
        if (strncmp(arg, "--", 2) != 0)
            return lum_fail(err, LUM_ERR_INVALID, "", "unexpected argument '%.60s'", arg);
        size_t n_name = strcspn(arg + 2, "="), i = 0;
        const char *equals = arg[2 + n_name] ? arg + 2 + n_name : NULL;
        while (i < n_rows && (strlen(rows[i].name) != n_name || strncmp(rows[i].name, arg + 2, n_name) != 0))
            i++;
        if (i == n_rows)
            return unknown(arg, n_name, rows, n_rows, err);
        const struct lum_option_row *row = &rows[i];
        if (!row->arg && equals)
            return lum_fail(err, LUM_ERR_INVALID, row->name, "--%s takes no value", row->name);
        if (row->arg && !equals && k + 1 == argc)
            return lum_fail(err, LUM_ERR_INVALID, row->name, "--%s needs a value: %s", row->name, row->arg);
        const char *text = !row->arg ? "1" : equals ? equals + 1 : argv[++k];
        char given[32];
        snprintf(given, sizeof given, "--%s", row->name);
        enum lum_status status = take ? take(user, i, text, err) : lum_option_read(row, given, text, user, err);
        if (status)
            return status;
    }
    return LUM_OK;
}

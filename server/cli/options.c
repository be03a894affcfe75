#define _GNU_SOURCE
#include "server/cli/options.h"

#include <ctype.h>
#include <errno.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "core/accel/accel.h"
#include "server/cli/option_errors.h"

static const struct option_row {
    const char *name, *arg; /* arg NULL: a switch */
    const char *fallback, *help;
} rows[LUM_OPTION_COUNT] = {
    [LUM_OPTION_SCENE] = {"scene", "NAME|FILE", "cornell",
                          "a built-in scene (see `lumend scenes`) or a .jsonl, .gltf, .glb, .obj file"},
    [LUM_OPTION_LISTEN] = {"listen", "HOST:PORT", "127.0.0.1:9460",
                           "where to accept connections; port 0 picks a free one"},
    [LUM_OPTION_TOKEN_FILE] = {"token-file", "FILE", NULL,
                               "who knows the token in FILE may connect; without it a random one is made and printed"},
    [LUM_OPTION_NO_AUTH] = {"no-auth", NULL, "0", "no token at all; only for a loopback address"},
    [LUM_OPTION_ALLOW_HOST] = {"allow-host", "NAME,...", "",
                               "names by which browsers may reach this server, beside localhost and addresses"},
    [LUM_OPTION_ALLOW_ORIGIN] = {"allow-origin", "URL,...", "",
                                 "pages of other sites that may connect: https://lights.example"},
    [LUM_OPTION_ASSETS] = {"assets", "DIR", NULL, "directory of the model files that clients may import"},
    [LUM_OPTION_IMPORTER] = {"importer", "FILE", NULL, "the lumend-import program; default: beside this one"},
    [LUM_OPTION_METHOD] = {"method", "NAME", NULL, "rendering method (see `lumend methods`); default: the scene's"},
    [LUM_OPTION_THREADS] = {"threads", "N", "0", "rendering threads; 0: one for each processor"},
    [LUM_OPTION_ISA] = {"isa", "NAME", NULL,
                        "instruction set that traces rays: sse2, sse4.2, avx, avx2 or avx512; default: the widest"},
    [LUM_OPTION_DETERMINISTIC] = {"deterministic", NULL, "0",
                                  "the same pixels, bit for bit, whatever the number of threads"},
    [LUM_OPTION_LOG] = {"log", "LEVEL", "info", "error, warning, info or debug; one line an event, on stderr"},
    [LUM_OPTION_HEALTHCHECK] = {"healthcheck", NULL, "0",
                                "asks the server at --listen for its health: exit status 0 or 1"},
    [LUM_OPTION_PRINT_CONFIG] = {"print-config", NULL, "0", "prints these settings and where each comes from"},
};

/* "$LUMEND_TOKEN_FILE": as in a shell. */
static void env_name(const char *name, char *out, size_t size)
{
    int n = snprintf(out, size, "$LUMEND_%s", name);
    for (int i = 0; i < n && (size_t)i < size; i++)
        out[i] = out[i] == '-' ? '_' : (char)toupper((unsigned char)out[i]);
}

static void take_environment(struct lum_options *o)
{
    for (int i = 0; i < LUM_OPTION_COUNT; i++) {
        env_name(rows[i].name, o->given[i], sizeof o->given[i]);
        o->value[i] = getenv(o->given[i] + 1);
        if (o->value[i])
            continue;
        o->value[i] = rows[i].fallback;
        strcpy(o->given[i], "default");
    }
}

static int find_row(const char *name, size_t n)
{
    for (int i = 0; i < LUM_OPTION_COUNT; i++)
        if (strlen(rows[i].name) == n && strncmp(rows[i].name, name, n) == 0)
            return i;
    return -1;
}

static enum lum_status unknown(const char *arg, struct lum_error *err)
{
    struct option names[LUM_OPTION_COUNT + 1] = {0};
    for (int i = 0; i < LUM_OPTION_COUNT; i++)
        names[i].name = rows[i].name;
    return lum_option_unknown(arg, names, err);
}

static enum lum_status take_flags(struct lum_options *o, int argc, char **argv, struct lum_error *err)
{
    for (int k = 1; k < argc; k++) {
        const char *arg = argv[k];
        if (strncmp(arg, "--", 2) != 0)
            return lum_fail(err, LUM_ERR_INVALID, arg, "unexpected argument '%s'", arg);
        const char *name = arg + 2, *equals = strchr(name, '=');
        int i = find_row(name, equals ? (size_t)(equals - name) : strlen(name));
        if (i < 0)
            return unknown(arg, err);
        if (!rows[i].arg && equals)
            return lum_fail(err, LUM_ERR_INVALID, rows[i].name, "--%s takes no value", rows[i].name);
        if (rows[i].arg && !equals && k + 1 == argc)
            return lum_fail(err, LUM_ERR_INVALID, rows[i].name, "--%s needs a value: %s", rows[i].name, rows[i].arg);
        o->value[i] = !rows[i].arg ? "1" : equals ? equals + 1 : argv[++k];
        snprintf(o->given[i], sizeof o->given[i], "--%s", rows[i].name);
    }
    return LUM_OK;
}

static enum lum_status read_number(const struct lum_options *o, enum lum_option i, long max, long *ret,
                                   struct lum_error *err)
{
    char *end;
    const char *text = o->value[i];
    errno = 0;
    long value = strtol(text, &end, 10);
    if (!isdigit((unsigned char)*text) || *end || errno || value > max)
        return lum_fail(err, LUM_ERR_INVALID, rows[i].name, "%s must be a number from 0 to %ld, not '%.60s'",
                        o->given[i], max, text);
    *ret = value;
    return LUM_OK;
}

static enum lum_status read_switch(const struct lum_options *o, enum lum_option i, bool *ret, struct lum_error *err)
{
    long value = 0;
    enum lum_status status = read_number(o, i, 1, &value, err);
    if (!status)
        *ret = value;
    return status;
}

static enum lum_status check(struct lum_options *o, struct lum_error *err)
{
    enum lum_status status;
    long threads = 0;
    if ((status = read_switch(o, LUM_OPTION_NO_AUTH, &o->no_auth, err)) ||
        (status = read_switch(o, LUM_OPTION_DETERMINISTIC, &o->deterministic, err)) ||
        (status = read_switch(o, LUM_OPTION_HEALTHCHECK, &o->healthcheck, err)) ||
        (status = read_switch(o, LUM_OPTION_PRINT_CONFIG, &o->print_config, err)) ||
        (status = read_number(o, LUM_OPTION_THREADS, 1024, &threads, err)) ||
        (status = lum_address_parse(o->given[LUM_OPTION_LISTEN], o->value[LUM_OPTION_LISTEN], &o->listen, err)))
        return status;
    o->threads = (uint32_t)threads;
    if (!lum_log_level_parse(o->value[LUM_OPTION_LOG], &o->log_level))
        return lum_fail(err, LUM_ERR_INVALID, "log", "%s must be error, warning, info or debug, not '%.60s'",
                        o->given[LUM_OPTION_LOG], o->value[LUM_OPTION_LOG]);
    if (o->no_auth && o->value[LUM_OPTION_TOKEN_FILE])
        return lum_fail(err, LUM_ERR_INVALID, "no-auth", "%s and %s exclude each other", o->given[LUM_OPTION_NO_AUTH],
                        o->given[LUM_OPTION_TOKEN_FILE]);
    if (o->no_auth && !o->listen.loopback)
        return lum_fail(err, LUM_ERR_INVALID, "no-auth",
                        "%s is refused on %s: anyone in reach could use this server; give --token-file",
                        o->given[LUM_OPTION_NO_AUTH], o->listen.host);
    const char *method = o->value[LUM_OPTION_METHOD], *isa = o->value[LUM_OPTION_ISA];
    if (isa && (status = lum_isa_check(o->given[LUM_OPTION_ISA], isa, err)))
        return status;
    return method ? lum_option_method(o->given[LUM_OPTION_METHOD], method, err) : LUM_OK;
}

enum lum_status lum_options_parse(int argc, char **argv, struct lum_options *ret_options, struct lum_error *err)
{
    struct lum_options o = {0};
    take_environment(&o);
    enum lum_status status = take_flags(&o, argc, argv, err);
    if (!status)
        status = check(&o, err);
    if (!status)
        *ret_options = o;
    return status;
}

static bool is_known_variable(const char *variable, size_t n)
{
    static const char replay[] = "LUMEND_TOKEN"; /* of lumend-replay */
    char name[64];
    if (n == sizeof replay - 1 && memcmp(variable, replay, n) == 0)
        return true;
    for (int i = 0; i < LUM_OPTION_COUNT; i++) {
        env_name(rows[i].name, name, sizeof name);
        if (strlen(name + 1) == n && memcmp(name + 1, variable, n) == 0)
            return true;
    }
    return false;
}

void lum_options_warn(const struct lum_log *log)
{
    for (char **v = environ; v && *v; v++) {
        size_t n = strcspn(*v, "=");
        if (strncmp(*v, "LUMEND_", 7) == 0 && !is_known_variable(*v, n))
            lum_log(log, LUM_LOG_WARNING, "main", "the environment variable %.*s means nothing to lumend",
                    n < 80 ? (int)n : 80, *v);
    }
}

void lum_options_help(FILE *out)
{
    char left[64];
    for (int i = 0; i < LUM_OPTION_COUNT; i++) {
        snprintf(left, sizeof left, "--%s%s%s", rows[i].name, rows[i].arg ? " " : "", rows[i].arg ? rows[i].arg : "");
        bool show = rows[i].arg && rows[i].fallback && *rows[i].fallback;
        fprintf(out, "  %-24s %s%s%s%s\n", left, rows[i].help, show ? " [" : "", show ? rows[i].fallback : "",
                show ? "]" : "");
    }
}

void lum_options_print(const struct lum_options *o, FILE *out)
{
    for (int i = 0; i < LUM_OPTION_COUNT; i++)
        if (i != LUM_OPTION_HEALTHCHECK && i != LUM_OPTION_PRINT_CONFIG)
            fprintf(out, "%-14s %-20s %s\n", rows[i].name, o->value[i] && *o->value[i] ? o->value[i] : "-",
                    o->given[i]);
}

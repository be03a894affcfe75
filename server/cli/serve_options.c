#define _GNU_SOURCE
#include "server/cli/serve_options.h"

#include <arpa/inet.h>
#include <ctype.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "protocol/base/limits.h"
#include "server/cli/help.h"
#include "server/cli/option.h"

static enum lum_status read_listen(const struct lum_option_row *row, const char *given, const char *text, void *options,
                                   struct lum_error *err)
{
    (void)row;
    return lum_address_parse(given, text, &((struct lum_serve_options *)options)->listen, err);
}

static enum lum_status read_desk(const struct lum_option_row *row, const char *given, const char *text, void *options,
                                 struct lum_error *err)
{
    struct lum_serve_options *o = options;
    struct lum_address *to = &o->desk[strcmp(row->name, "artnet") == 0 ? LUM_DESK_ARTNET : LUM_DESK_SACN];
    enum lum_status status = lum_address_parse(given, text, to, err);
    if (!status && to->ipv6)
        return lum_fail(err, LUM_ERR_INVALID, row->name, "%s needs an IPv4 address, not '%.60s'", given, text);
    return status;
}

static enum lum_status read_join(const struct lum_option_row *row, const char *given, const char *text, void *options,
                                 struct lum_error *err)
{
    struct in_addr address;
    ((struct lum_serve_options *)options)->sacn_join = text;
    if (inet_pton(AF_INET, text, &address) == 1)
        return LUM_OK;
    return lum_fail(err, LUM_ERR_INVALID, row->name, "%s needs the IPv4 address of an interface, not '%.60s'", given,
                    text);
}

static enum lum_status read_log(const struct lum_option_row *row, const char *given, const char *text, void *options,
                                struct lum_error *err)
{
    if (lum_log_level_parse(text, &((struct lum_serve_options *)options)->log))
        return LUM_OK;
    return lum_fail(err, LUM_ERR_INVALID, row->name, "%s must be error, warning, info or debug, not '%.60s'", given,
                    text);
}

static enum lum_status read_durability(const struct lum_option_row *row, const char *given, const char *text,
                                       void *options, struct lum_error *err)
{
    for (unsigned i = 0; i < LUM_ARRAY_LEN(lum_durability_names); i++)
        if (strcmp(text, lum_durability_names[i]) == 0) {
            ((struct lum_serve_options *)options)->durability = (enum lum_durability)i;
            return LUM_OK;
        }
    return lum_fail(err, LUM_ERR_INVALID, row->name, "%s must be commit or interval, not '%.60s'", given, text);
}

#define AT(m) .offset = offsetof(struct lum_serve_options, m)
#define TEXT(m) .kind = LUM_OPTION_TEXT, AT(m)
#define SWITCH(m) .fallback = "0", .kind = LUM_OPTION_SWITCH, AT(m)
#define OTHER(f) .kind = LUM_OPTION_OTHER, .read = f

/* clang-format off */
static const struct lum_option_row rows[LUM_SERVE_COUNT] = {
    [LUM_SERVE_SCENE] = {"scene", "NAME|FILE", .fallback = "cornell", TEXT(scene),
        .help = "a built-in scene (see `lumend scenes`), a model (glTF, GLB, OBJ, FBX and others), or a .jsonl file"},
    [LUM_SERVE_LISTEN] = {"listen", "HOST:PORT", .fallback = "127.0.0.1:9460", OTHER(read_listen),
        .help = "where to accept connections; port 0 picks a free one"},
    [LUM_SERVE_TOKEN_FILE] = {"token-file", "FILE", TEXT(token_file),
        .help = "who knows the token in FILE may connect; only its owner may read FILE (chmod 600). Without\n"
                "it a random one is made and printed"},
    [LUM_SERVE_TOKENS] = {"tokens", "FILE", TEXT(tokens),
        .help = "people with a token each: a line NAME ROLE sha256:HASH [LAST DAY] for each, which\n"
                "`lumend token` makes (see there what roles may do); chmod 600. SIGHUP reads it again, and\n"
                "ends the sessions of who is gone or changed. Without --token-file nobody else may connect"},
    [LUM_SERVE_NO_AUTH] = {"no-auth", SWITCH(no_auth), .help = "no token at all; only for a loopback address"},
    [LUM_SERVE_TLS_CERT] = {"tls-cert", "FILE", TEXT(tls_cert),
        .help = "speaks https and wss, and nothing else, with the certificate in FILE (PEM: it first, then those up\n"
                "to its root). SIGHUP reads it and its key again, for new connections"},
    [LUM_SERVE_TLS_KEY] = {"tls-key", "FILE", TEXT(tls_key),
        .help = "its key (PEM, without a passphrase); chmod 600, or 640 where FILE is root's"},
    [LUM_SERVE_ALLOW_HOST] = {"allow-host", "NAME,...", .fallback = "", TEXT(allow_host),
        .help = "names by which browsers may reach this server, beside localhost and addresses"},
    [LUM_SERVE_ALLOW_ORIGIN] = {"allow-origin", "URL,...", .fallback = "", TEXT(allow_origin),
        .help = "pages of other sites that may connect: https://lights.example"},
    [LUM_SERVE_SACN] = {"sacn", "ADDRESS:UDP", OTHER(read_desk),
        .help = "listens to lighting desks that speak sACN (E1.31) there: 127.0.0.1:5568, or 0.0.0.0:5568 for\n"
                "all who can reach it. Nobody is asked for a password. Default: to none"},
    [LUM_SERVE_SACN_JOIN] = {"sacn-join", "ADDRESS", OTHER(read_join),
        .help = "joins the multicast groups of patched universes on the interface with this address"},
    [LUM_SERVE_ARTNET] = {"artnet", "ADDRESS:UDP", OTHER(read_desk),
        .help = "the same for Art-Net: 127.0.0.1:6454"},
    [LUM_SERVE_ASSETS] = {"assets", "DIR", TEXT(assets),
        .help = "directory of the model files that clients may import"},
    [LUM_SERVE_UPLOAD_MIB] = {"upload-mib", "N", .fallback = "4096", .kind = LUM_OPTION_WHOLE,
        AT(upload_mib), .max = 1048576,
        .help = "of files that who may edit sends from a browser, kept in DIR of --state, or until the end; 0: no\n"
                "file is taken"},
    [LUM_SERVE_STATE] = {"state", "DIR", TEXT(state),
        .help = "keeps every edit in DIR, and starts with what DIR holds; --scene is for an empty one"},
    [LUM_SERVE_PROJECTS] = {"projects", "DIR", TEXT(projects),
        .help = "keeps many scenes, each in a folder of its own in DIR, as with --state: people make, open, name and\n"
                "delete them in the browser. Not with --state, --scene, --sacn or --artnet"},
    [LUM_SERVE_OPEN_PROJECTS] = {"open-projects", "N", .fallback = "8", .kind = LUM_OPTION_WHOLE, AT(open_projects),
        .min = 1, .max = LUM_LIMIT_PROJECTS_OPEN,
        .help = "projects that may be open at once; beyond, the one that nobody is in for longest is closed"},
    [LUM_SERVE_PROJECTS_MIB] = {"projects-mib", "N", .fallback = "0", .kind = LUM_OPTION_WHOLE, AT(projects_mib),
        .max = 1u << 24,
        .help = "of memory for all open projects, beyond which those that nobody is in are closed, and none is\n"
                "opened; 0: half of the machine's"},
    [LUM_SERVE_CLOSE_UNUSED] = {"close-unused", "S", .fallback = "600", .kind = LUM_OPTION_WHOLE, AT(close_unused_s),
        .min = 1, .max = 1000000,
        .help = "seconds after which a project that nobody is in is closed, and gives its memory back"},
    [LUM_SERVE_DURABILITY] = {"durability", "WHEN", .fallback = "commit", OTHER(read_durability),
        .help = "commit: edits are answered when they are on disk; interval: at once, and a crash or a\n"
                "power cut may take the last second of them"},
    [LUM_SERVE_SNAPSHOT_KIB] = {"snapshot-kib", "N", .fallback = "8192", .kind = LUM_OPTION_WHOLE, AT(snapshot_kib),
        .min = 1, .max = 1048576,
        .help = "of edits in DIR, after which the scene is written anew: fewer, and a start is quicker"},
    [LUM_SERVE_IMPORTER] = {"importer", "FILE", TEXT(importer),
        .help = "the lumend-import program; default: beside this one"},
    [LUM_SERVE_METHOD] = {"method", "NAME", OTHER(lum_option_read_method), AT(method),
        .help = "rendering method (see `lumend methods`); default: the scene's"},
    [LUM_SERVE_THREADS] = {"threads", "N", .fallback = "0", .kind = LUM_OPTION_WHOLE, AT(threads), .max = 1024,
        .help = "rendering threads; 0: one for each processor"},
    [LUM_SERVE_ISA] = {"isa", "NAME", OTHER(lum_option_read_isa), AT(isa),
        .help = "instruction set that traces rays: sse2, sse4.2, avx, avx2 or avx512; default: the widest"},
    [LUM_SERVE_DETERMINISTIC] = {"deterministic", SWITCH(deterministic),
        .help = "the same pixels, bit for bit, whatever the number of threads"},
    [LUM_SERVE_LOG] = {"log", "LEVEL", .fallback = "info", OTHER(read_log),
        .help = "error, warning, info or debug; one line an event, on stderr"},
    [LUM_SERVE_AUDIT] = {"audit", SWITCH(audit),
        .help = "a line of the log for each edit: who, the revision, what was changed; and for who comes\n"
                "and goes. They have the level audit, and none is left out"},
    [LUM_SERVE_HEALTHCHECK] = {"healthcheck", SWITCH(healthcheck),
        .help = "asks the server at --listen for its health: exit status 0 or 1"},
    [LUM_SERVE_PRINT_CONFIG] = {"print-config", SWITCH(print_config),
        .help = "prints these settings and where each comes from"},
};
/* clang-format on */

/* "$LUMEND_TOKEN_FILE": as in a shell. */
static void env_name(const char *name, char *out, size_t size)
{
    int n = snprintf(out, size, "$LUMEND_%s", name);
    for (int i = 0; i < n && (size_t)i < size; i++)
        out[i] = out[i] == '-' ? '_' : (char)toupper((unsigned char)out[i]);
}

static void take_environment(struct lum_serve_options *o)
{
    for (int i = 0; i < LUM_SERVE_COUNT; i++) {
        env_name(rows[i].name, o->given[i], sizeof o->given[i]);
        o->value[i] = getenv(o->given[i] + 1);
        if (o->value[i])
            continue;
        o->value[i] = rows[i].fallback;
        strcpy(o->given[i], "default");
    }
}

static enum lum_status take_flag(void *user, size_t i, const char *text, struct lum_error *err)
{
    struct lum_serve_options *o = user;
    (void)err;
    o->value[i] = text;
    snprintf(o->given[i], sizeof o->given[i], "--%s", rows[i].name);
    return LUM_OK;
}

static enum lum_status check_auth(const struct lum_serve_options *o, struct lum_error *err)
{
    const char *given = o->given[LUM_SERVE_NO_AUTH];
    if (o->no_auth && (o->token_file || o->tokens))
        return lum_fail(err, LUM_ERR_INVALID, "no-auth", "%s and %s exclude each other", given,
                        o->given[o->token_file ? LUM_SERVE_TOKEN_FILE : LUM_SERVE_TOKENS]);
    if (o->no_auth && !o->listen.loopback)
        return lum_fail(err, LUM_ERR_INVALID, "no-auth",
                        "%s is refused on %s: anyone in reach could use this server; give --token-file", given,
                        o->listen.host);
    return LUM_OK;
}

static enum lum_status check_tls(const struct lum_serve_options *o, struct lum_error *err)
{
    if (!o->tls_cert == !o->tls_key)
        return LUM_OK;
    enum lum_serve_option has = o->tls_cert ? LUM_SERVE_TLS_CERT : LUM_SERVE_TLS_KEY;
    return lum_fail(err, LUM_ERR_INVALID, rows[has].name, "%s goes with --%s, which is missing", o->given[has],
                    rows[o->tls_cert ? LUM_SERVE_TLS_KEY : LUM_SERVE_TLS_CERT].name);
}

/* Linux gives datagrams of a group only to sockets that are bound to all addresses, or to the group's. */
static enum lum_status check_desk(const struct lum_serve_options *o, struct lum_error *err)
{
    if (!o->sacn_join || o->desk[LUM_DESK_SACN].any)
        return LUM_OK;
    return lum_fail(err, LUM_ERR_INVALID, "sacn-join", "%s goes with --sacn 0.0.0.0:5568, and with no other address",
                    o->given[LUM_SERVE_SACN_JOIN]);
}

/* A desk speaks to one scene. */
static enum lum_status check_projects(const struct lum_serve_options *o, struct lum_error *err)
{
    static const enum lum_serve_option others[] = {LUM_SERVE_STATE, LUM_SERVE_SCENE, LUM_SERVE_SACN, LUM_SERVE_ARTNET};
    for (size_t i = 0; o->projects && i < LUM_ARRAY_LEN(others); i++)
        if (o->value[others[i]] && *o->value[others[i]] && strcmp(o->given[others[i]], "default") != 0)
            return lum_fail(err, LUM_ERR_INVALID, "projects", "%s and %s exclude each other",
                            o->given[LUM_SERVE_PROJECTS], o->given[others[i]]);
    return LUM_OK;
}

enum lum_status lum_serve_options_parse(int argc, char **argv, struct lum_serve_options *ret_options,
                                        struct lum_error *err)
{
    struct lum_serve_options o = {0};
    take_environment(&o);
    enum lum_status status = lum_option_parse(argc, argv, rows, LUM_SERVE_COUNT, NULL, take_flag, &o, err);
    for (int i = 0; i < LUM_SERVE_COUNT && !status; i++)
        if (o.value[i])
            status = lum_option_read(&rows[i], o.given[i], o.value[i], &o, err);
    if (!status)
        status = check_auth(&o, err);
    if (!status)
        status = check_tls(&o, err);
    if (!status)
        status = check_desk(&o, err);
    if (!status)
        status = check_projects(&o, err);
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
    for (int i = 0; i < LUM_SERVE_COUNT; i++) {
        env_name(rows[i].name, name, sizeof name);
        if (strlen(name + 1) == n && memcmp(name + 1, variable, n) == 0)
            return true;
    }
    return false;
}

void lum_serve_options_warn(const struct lum_log *log)
{
    for (char **v = environ; v && *v; v++) {
        size_t n = strcspn(*v, "=");
        if (strncmp(*v, "LUMEND_", 7) == 0 && !is_known_variable(*v, n))
            lum_log(log, LUM_LOG_WARNING, "main", "the environment variable %.*s means nothing to lumend",
                    n < 80 ? (int)n : 80, *v);
    }
}

void lum_serve_options_help(const struct lum_help *h)
{
    lum_help_options(h, rows, LUM_SERVE_COUNT);
}

void lum_serve_options_print(const struct lum_serve_options *o, FILE *out)
{
    for (int i = 0; i < LUM_SERVE_COUNT; i++)
        if (i != LUM_SERVE_HEALTHCHECK && i != LUM_SERVE_PRINT_CONFIG)
            fprintf(out, "%-14s %-20s %s\n", rows[i].name, o->value[i] && *o->value[i] ? o->value[i] : "-",
                    o->given[i]);
}

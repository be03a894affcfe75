/* Options of `lumend serve`: flags come before environment variables (LUMEND_TOKEN_FILE for --token-file), those before
 * defaults. */
#ifndef LUM_SERVER_CLI_SERVE_OPTIONS_H
#define LUM_SERVER_CLI_SERVE_OPTIONS_H

#include <stdio.h>

#include "core/base/base.h"
#include "server/base/log.h"
#include "server/desk/packet.h"
#include "server/journal/journal.h"
#include "server/net/address.h"

struct lum_help;

enum lum_serve_option {
    LUM_SERVE_SCENE,
    LUM_SERVE_LISTEN,
    LUM_SERVE_TOKEN_FILE,
    LUM_SERVE_TOKENS,
    LUM_SERVE_NO_AUTH,
    LUM_SERVE_TLS_CERT,
    LUM_SERVE_TLS_KEY,
    LUM_SERVE_ALLOW_HOST,
    LUM_SERVE_ALLOW_ORIGIN,
    LUM_SERVE_SACN,
    LUM_SERVE_SACN_JOIN,
    LUM_SERVE_ARTNET,
    LUM_SERVE_ASSETS,
    LUM_SERVE_UPLOAD_MIB,
    LUM_SERVE_STATE,
    LUM_SERVE_PROJECTS,
    LUM_SERVE_OPEN_PROJECTS,
    LUM_SERVE_PROJECTS_MIB,
    LUM_SERVE_CLOSE_UNUSED,
    LUM_SERVE_DURABILITY,
    LUM_SERVE_SNAPSHOT_KIB,
    LUM_SERVE_IMPORTER,
    LUM_SERVE_METHOD,
    LUM_SERVE_THREADS,
    LUM_SERVE_ISA,
    LUM_SERVE_DETERMINISTIC,
    LUM_SERVE_LOG,
    LUM_SERVE_AUDIT,
    LUM_SERVE_HEALTHCHECK,
    LUM_SERVE_PRINT_CONFIG,
    LUM_SERVE_COUNT
};

struct lum_serve_options {
    /* Strings belong to argv and the environment. NULL: not given and no default. */
    const char *scene, *token_file, *tokens, *allow_host, *allow_origin, *assets, *state, *projects, *importer, *method,
        *isa, *sacn_join, *tls_cert, *tls_key;
    enum lum_durability durability;
    struct lum_address listen;
    struct lum_address desk[LUM_DESK_PROTOCOL_COUNT]; /* host "": not given */
    bool no_auth, audit, deterministic, healthcheck, print_config;
    uint32_t threads; /* 0: all processors */
    uint32_t snapshot_kib;
    uint32_t open_projects, projects_mib, close_unused_s;
    uint32_t upload_mib; /* 0: nobody may send files */
    enum lum_log_level log;
    /* As given, and where it comes from, for messages: "--threads", "$LUMEND_THREADS" or "default". */
    const char *value[LUM_SERVE_COUNT];
    char given[LUM_SERVE_COUNT][32];
};

/* argv[0] is skipped; the environment is searched by name (getenv). The error text is a whole sentence. */
LUM_MUST_USE enum lum_status lum_serve_options_parse(int argc, char **argv, struct lum_serve_options *ret_options,
                                                     struct lum_error *err);
/* Says which LUMEND_ variables of the environment mean nothing here: most likely misspelt. */
void lum_serve_options_warn(const struct lum_log *log);
void lum_serve_options_help(const struct lum_help *h);
void lum_serve_options_print(const struct lum_serve_options *options, FILE *out);

#endif

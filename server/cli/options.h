/* Options of `lumend serve`: flags come before environment variables (LUMEND_TOKEN_FILE for --token-file), those before
 * defaults. One table feeds the parser, --help and --print-config. */
#ifndef LUM_SERVER_CLI_OPTIONS_H
#define LUM_SERVER_CLI_OPTIONS_H

#include <stdio.h>

#include "core/base/base.h"
#include "server/base/log.h"
#include "server/net/address.h"

enum lum_option {
    LUM_OPTION_SCENE,
    LUM_OPTION_LISTEN,
    LUM_OPTION_TOKEN_FILE,
    LUM_OPTION_NO_AUTH,
    LUM_OPTION_ALLOW_HOST,
    LUM_OPTION_ALLOW_ORIGIN,
    LUM_OPTION_ASSETS,
    LUM_OPTION_IMPORTER,
    LUM_OPTION_METHOD,
    LUM_OPTION_THREADS,
    LUM_OPTION_ISA,
    LUM_OPTION_DETERMINISTIC,
    LUM_OPTION_LOG,
    LUM_OPTION_HEALTHCHECK,
    LUM_OPTION_PRINT_CONFIG,
    LUM_OPTION_COUNT
};

struct lum_options {
    /* As given; the strings belong to argv and the environment. NULL: not given and no default. */
    const char *value[LUM_OPTION_COUNT];
    /* Where it comes from, for messages: "--threads", "$LUMEND_THREADS" or "default". */
    char given[LUM_OPTION_COUNT][32];
    /* Checked and converted. */
    struct lum_address listen;
    bool no_auth, deterministic, healthcheck, print_config;
    uint32_t threads; /* 0: all processors */
    enum lum_log_level log_level;
};

/* argv[0] is skipped; env is searched by name (getenv). The error text is a whole sentence. */
LUM_MUST_USE enum lum_status lum_options_parse(int argc, char **argv, struct lum_options *ret_options,
                                               struct lum_error *err);
/* Says which LUMEND_ variables of the environment mean nothing here: most likely misspelt. */
void lum_options_warn(const struct lum_log *log);
void lum_options_help(FILE *out);
void lum_options_print(const struct lum_options *options, FILE *out);

#endif

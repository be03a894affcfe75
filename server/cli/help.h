/* What --help prints and what the man page has, from one source: each command says its part through these, and they
 * print it for a terminal or typeset it for man(1). */
#ifndef LUM_SERVER_CLI_HELP_H
#define LUM_SERVER_CLI_HELP_H

#include <stdio.h>

#include "server/cli/commands.h"
#include "server/cli/option.h"

struct lum_help {
    FILE *out;
    bool man; /* roff, with the macros of man(7) */
};

/* Printed as it is. For man a line counts by how it begins:
 *   "usage: ..."              a synopsis, and so are lines after it that are indented by seven
 *   "word   what it is"       a tag and its text, at most four to the left; lines indented by eight go on with the text
 *   "  lumend ..."            an example, as it stands
 *   anything else             a paragraph */
void lum_help_text(const struct lum_help *h, const char *text);
void lum_help_options(const struct lum_help *h, const struct lum_option_row *rows, size_t n_rows);

/* The whole page lumend(1). */
void lum_help_man(FILE *out, const struct lum_command *commands, size_t n_commands);

/* The page of another program, NAME(1), of what its --help says, in the form that lum_help_text takes. summary: what it
 * is, for apropos(1). */
void lum_help_man_of(FILE *out, const char *name, const char *summary, const char *help);

#endif

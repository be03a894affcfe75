/* Options as rows of a table: one row gives an option's name, kind, limits, default and help text; the parser, --help
 * and the messages come from it. */
#ifndef LUM_SERVER_CLI_OPTION_H
#define LUM_SERVER_CLI_OPTION_H

#include "core/base/base.h"

enum lum_option_kind {
    LUM_OPTION_TEXT,     /* const char *, borrowed */
    LUM_OPTION_SWITCH,   /* bool; takes no value on the command line, 0 or 1 elsewhere */
    LUM_OPTION_WHOLE,    /* uint32_t from min to max */
    LUM_OPTION_NUMBER,   /* double from min to max */
    LUM_OPTION_POSITIVE, /* double above 0 */
    LUM_OPTION_OTHER,    /* what `read` makes of it */
};

struct lum_option_row {
    const char *name;     /* without its -- */
    const char *arg;      /* what its value is called; NULL: a switch */
    const char *fallback; /* its value when it is not given; NULL: none */
    enum lum_option_kind kind;
    size_t offset; /* of the result in the struct of all options */
    double min, max;
    /* given: how the option is called in messages. text is borrowed. */
    enum lum_status (*read)(const struct lum_option_row *row, const char *given, const char *text, void *options,
                            struct lum_error *err);
    const char *help; /* lines of at most 96 bytes, apart by \n */
};

/* Arguments that are no options; borrowed. n also counts those that list has no room for. */
struct lum_option_words {
    const char *list[4];
    size_t n;
};

/* Calls take (NULL: lum_option_read) with the row and the value ("1" of a switch) of each option in argv[1] and after,
 * in order; stops when it fails. Names are written out: an abbreviation would change its meaning with every name added
 * later. words, which start all zero, are added to; NULL: arguments that are no options are refused. */
LUM_MUST_USE enum lum_status lum_option_parse(int argc, char **argv, const struct lum_option_row *rows, size_t n_rows,
                                              struct lum_option_words *words,
                                              enum lum_status (*take)(void *user, size_t row, const char *text,
                                                                      struct lum_error *err),
                                              void *user, struct lum_error *err);
/* Reads text, checks it, and writes it into options. */
LUM_MUST_USE enum lum_status lum_option_read(const struct lum_option_row *row, const char *given, const char *text,
                                             void *options, struct lum_error *err);

/* A LUM_OPTION_OTHER: the name of a method, kept as text. */
enum lum_status lum_option_read_method(const struct lum_option_row *row, const char *given, const char *text,
                                       void *options, struct lum_error *err);
/* A LUM_OPTION_OTHER: an instruction set of the ray tracing, kept as text. */
enum lum_status lum_option_read_isa(const struct lum_option_row *row, const char *given, const char *text,
                                    void *options, struct lum_error *err);

#endif

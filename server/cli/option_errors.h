/* What is said about options that cannot be taken. */
#ifndef LUM_SERVER_CLI_OPTION_ERRORS_H
#define LUM_SERVER_CLI_OPTION_ERRORS_H

#include <getopt.h>

#include "core/base/base.h"

/* Of the option that getopt_long has just returned: is it written out? getopt_long takes the beginning of a name too,
 * which would make every name we add later a change of what scripts mean. */
bool lum_option_is_whole(char **argv, const char *name);

/* arg ("--treads=3") is none of options, which end with a row of zeros. Says which of them was meant, if one is near.
 */
enum lum_status lum_option_unknown(const char *arg, const struct option *options, struct lum_error *err);

/* A name that was given for a method, by `option`. */
LUM_MUST_USE enum lum_status lum_option_method(const char *option, const char *name, struct lum_error *err);

#endif

/* Options of `lumend compare`. */
#ifndef LUM_SERVER_CLI_COMPARE_OPTIONS_H
#define LUM_SERVER_CLI_COMPARE_OPTIONS_H

#include <stdio.h>

#include "server/cli/compare_measure.h"

/* Strings are those of the command line; NULL: not given. */
struct lum_compare_options {
    const char *paths[LUM_COMPARE_PICTURES];
    const char *heatmap, *html;
    bool wanted[LUM_COMPARE_METRICS];
    enum lum_compare_metric first; /* of the list of metrics */
    double pixels_per_degree;      /* 0: not given */
    double multiplier;
    bool help; /* then nothing else is checked */
};

LUM_MUST_USE enum lum_status lum_compare_options_parse(int argc, char **argv, struct lum_compare_options *ret_options,
                                                       struct lum_error *err);

#endif

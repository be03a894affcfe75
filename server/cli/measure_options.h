/* Arguments of `lumend measure`. */
#ifndef LUM_SERVER_CLI_MEASURE_OPTIONS_H
#define LUM_SERVER_CLI_MEASURE_OPTIONS_H

#include <stdio.h>

#include "core/base/base.h"

struct lum_measure_options {
    const char *scene, *edits, *assets; /* as of lum_render_options */
    const char *on;                     /* an object, whose top is measured; NULL: an area */
    bool has_area;
    double area[4]; /* x0, z0, x1, z1; metres */
    bool has_grid;  /* the grid of the command line is meant, not the sensors of the scene */
    bool has_height;
    double height_m; /* above the ground */
    double border_m; /* left out along the sides of a whole scene or object */
    bool has_border;
    double spacing_m; /* 0: by EN 12464-1 */
    bool cylindrical, modelling, ugr;
    uint32_t directions;                           /* of each eye, with ugr */
    double error, target_lx, uniformity, most_ugr; /* 0: no target */
    const char *csv, *json, *html;
    uint32_t pictures_spp; /* of the page */
    uint32_t threads, seed;
    const char *isa;
    bool help;
};

LUM_MUST_USE enum lum_status lum_measure_options_parse(int argc, char **argv, struct lum_measure_options *ret_options,
                                                       struct lum_error *err);

#endif

/* What the accuracy study measures: error over time of every method at every setting, and when path tracing overtakes.
 */
#ifndef LUM_TESTS_BENCH_ACCURACY_H
#define LUM_TESTS_BENCH_ACCURACY_H

#include "core/vpl/vpl.h"
#include "tests/bench/places.h"
#include "tests/bench/reference.h"

enum { ACCURACY_SEEDS = 16, ACCURACY_POINTS = 96 };

/* relMSE of few samples is ruled by few bright pixels; SMAPE is not, but has the reference's noise in it. */
enum accuracy_error { ACCURACY_RELMSE, ACCURACY_SMAPE, ACCURACY_ERRORS };

/* A picture of a method at a setting: so good, at such a cost. Over seeds, in the same order in all points. */
struct accuracy_point {
    const struct lum_method *method;
    char setting[32]; /* "256 VPLs", "8 spp" */
    bool first;       /* a first frame; else samples were added to the point before */
    uint32_t spp, n;
    double own_ms[ACCURACY_SEEDS]; /* from nothing to this picture, as on a machine of its own */
    double error[ACCURACY_ERRORS][ACCURACY_SEEDS];
    double rays; /* a pixel, of all kinds; of the first seed: exact */
    bool front;  /* no other point of the scene has both less error and less time, by medians */
};

struct accuracy_scene {
    char name[64], machine[160];
    double reference_relmse; /* its own noise */
    uint32_t reference_spp, w, h;
    struct accuracy_point points[ACCURACY_POINTS];
    size_t n;
    double same[ACCURACY_SEEDS]; /* A/A: time of path's first sample over that of another view's, which is the same */
    size_t n_same;
};

double accuracy_ms(const struct accuracy_point *p); /* median */
double accuracy_error(const struct accuracy_point *p,
                      enum accuracy_error which); /* mean: few seeds have most of it, and they count */

/* Where the curve of a method that adds samples first is at most at the error, by straight lines between its points in
 * logarithms: milliseconds. NAN: nowhere in what was measured. */
double accuracy_time_to(const struct accuracy_scene *s, const char *method, enum accuracy_error which, double error);
/* Slope of log error over log time of such a curve, by least squares over its later half. NAN: fewer than 3 points. */
double accuracy_slope(const struct accuracy_scene *s, const char *method);

/* Of a method's first frame at the default settings: the point that those with other settings are beside. */
bool accuracy_is_default(const struct accuracy_scene *s, size_t point);

/* The figure that is understood at a glance: error over time at the default settings, of the other methods the best of
 * theirs, and when path tracing is as good as their first frames. accuracy_chart.c; NAME.svg. False after a message on
 * stderr. */
bool accuracy_chart_draw(const struct lum_bench_options *options, const struct accuracy_scene *s, const char *name);

/* Adds a scene to the tables, draws its figure, and writes its part of the page. False after a message on stderr. */
struct accuracy_report;
struct accuracy_report *accuracy_report_open(const struct lum_bench_options *options);
bool accuracy_report_scene(struct accuracy_report *report, const struct accuracy_scene *scene);
/* A picture, 3 * w * h, for the page: called before its scene. white: luminance that is shown as white. */
bool accuracy_report_picture(struct accuracy_report *report, const struct accuracy_scene *scene, const char *title,
                             const char *file, const float *picture, double white);
bool accuracy_report_close(struct accuracy_report *report, bool ok); /* accepts NULL */

#endif

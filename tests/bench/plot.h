/* Line plots as SVG files, for browsers and README pages: one or more panels beside each other under one title, with
 * one legend. No dependency, no script: a white card that reads on light and dark pages, in colours that colour-blind
 * people can tell apart (Okabe & Ito 2008), and marks of different shape. */
#ifndef LUM_TESTS_BENCH_PLOT_H
#define LUM_TESTS_BENCH_PLOT_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>

enum lum_plot_scale { LUM_PLOT_LINEAR, LUM_PLOT_LOG2, LUM_PLOT_LOG10 };

struct lum_plot_axis {
    const char *label;
    enum lum_plot_scale scale;
    double lo, hi; /* lo == hi: as the data ask for */
};

#define LUM_PLOT_COLORS 7u
#define LUM_PLOT_GREY LUM_PLOT_COLORS /* for what is not data: ideals, keys of line styles */

/* Points are joined in order. On a logarithmic axis points at or below 0 are left out. n 0: for the legend alone. */
struct lum_plot_series {
    const char *label; /* in the legend; NULL: not there */
    uint32_t color;    /* 0 .. LUM_PLOT_COLORS - 1, which also chooses the mark; or LUM_PLOT_GREY, without marks */
    bool dashed;       /* with hollow marks */
    bool bare;         /* without marks */
    size_t n;
    const double *x, *y;
    const double *y_lo, *y_hi; /* error bars; NULL: none */
    const char *note;          /* after the last point, above its height; NULL: none */
};

struct lum_plot_panel {
    const char *title; /* NULL: none */
    struct lum_plot_axis x, y;
    const struct lum_plot_series *series;
    size_t n_series;
};

struct lum_plot {
    const char *title, *subtitle;        /* subtitle NULL: none */
    const struct lum_plot_panel *panels; /* the legend is of the first one's series */
    size_t n_panels;
    bool same_y; /* all panels have the y axis that their data together ask for */
};

/* Texts are UTF-8. */
void lum_plot_write(FILE *f, const struct lum_plot *plot);

/* Between ticks: the largest of 1, 2, 5 times a power of ten with at least four steps in span. */
double lum_plot_step(double span);

#endif

/* Stacked horizontal bars as an SVG file, in the colours of plot.h: parts of a whole, a row each. */
#ifndef LUM_TESTS_BENCH_BARS_H
#define LUM_TESTS_BENCH_BARS_H

#include <stddef.h>
#include <stdio.h>

#define LUM_BARS_PARTS 12u

struct lum_bars_row {
    char label[64];
    double parts[LUM_BARS_PARTS]; /* from the left; none below 0 */
};

struct lum_bars {
    const char *title, *subtitle;
    const char *axis, *unit;  /* what is measured, along the bars */
    const char *const *parts; /* names, for the legend; the last is what is left over */
    size_t n_parts;           /* at most LUM_BARS_PARTS */
    const struct lum_bars_row *rows;
    size_t n_rows;
};

/* Texts are plain: no markup characters. */
void lum_bars_write(FILE *f, const struct lum_bars *bars);

#endif

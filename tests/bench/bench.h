/* lumend-bench: one program, one row per study. Results go to --out as JSON and CSV, a summary to stdout. */
#ifndef LUM_TESTS_BENCH_BENCH_H
#define LUM_TESTS_BENCH_BENCH_H

#include <stdbool.h>
#include <stddef.h>
#include <stdio.h>

#include "server/world.h"

struct lum_bench_options {
    const char *out;   /* directory, exists */
    const char *scene; /* name or file */
    const char *bin;   /* directory of lumend and lumend-replay */
    bool quick;        /* fewer repetitions: shows that it works, not a figure to quote */
};

struct lum_bench {
    const char *name, *summary;
    int (*run)(const struct lum_bench_options *options); /* exit status */
};

int lum_bench_export(const struct lum_bench_options *options);
int lum_bench_rays(const struct lum_bench_options *options);
int lum_bench_stream(const struct lum_bench_options *options);

/* Opens OUT/name for writing; NULL after a message on stderr. */
FILE *lum_bench_open(const struct lum_bench_options *options, const char *name);
/* A world with the scene loaded and committed; false after a message on stderr. */
bool lum_bench_world(const struct lum_bench_options *options, uint32_t threads, struct lum_world *ret_world);

/* Sorts values; q in [0,1], linear interpolation between ranks. */
double lum_bench_quantile(double *values, size_t n, double q);

#endif

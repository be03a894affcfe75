/* Results as rows and columns: one description, written as CSV, JSON and markdown. */
#ifndef LUM_TESTS_BENCH_TABLE_H
#define LUM_TESTS_BENCH_TABLE_H

#include <stdio.h>

#include "tests/bench/bench.h"

#define LUM_BENCH_TEXT (-1)

struct lum_bench_column {
    const char *key;   /* in CSV and JSON */
    const char *title; /* in markdown; NULL: left out there */
    int digits;        /* after the point; LUM_BENCH_TEXT: the cells are texts */
};

/* The last column may stand for one of each kind of ray, in the order of enum lum_ray_kind. */
#define LUM_BENCH_RAY_COLUMNS(digits)                                                                                  \
    {                                                                                                                  \
        NULL, NULL, digits                                                                                             \
    }

struct lum_bench_cell {
    char text[64];
};

/* In caller memory. Once cells were put, lum_bench_table_finish must follow. */
struct lum_bench_table {
    const struct lum_bench_column *columns;
    size_t n_columns;
    struct lum_bench_cell *cells;
    size_t n, capacity;
    bool failed; /* a cell is missing: out of memory */
};

#define LUM_BENCH_TABLE(columns)                                                                                       \
    {                                                                                                                  \
        columns, LUM_ARRAY_LEN(columns), NULL, 0, 0, false                                                             \
    }

/* The next cells, row by row. A number that is not finite is an empty cell. Texts are cut at 63 bytes. */
void lum_bench_table_text(struct lum_bench_table *table, const char *text);
void lum_bench_table_number(struct lum_bench_table *table, double value);
#define LUM_BENCH_TEXTS(table, ...)                                                                                    \
    lum_bench_table_texts(table, (const char *const[]){__VA_ARGS__},                                                   \
                          sizeof((const char *const[]){__VA_ARGS__}) / sizeof(char *))
#define LUM_BENCH_NUMBERS(table, ...)                                                                                  \
    lum_bench_table_numbers(table, (const double[]){__VA_ARGS__},                                                      \
                            sizeof((const double[]){__VA_ARGS__}) / sizeof(double))
void lum_bench_table_texts(struct lum_bench_table *table, const char *const *texts, size_t n);
void lum_bench_table_numbers(struct lum_bench_table *table, const double *values, size_t n);
/* A text: "2.00 [1.90, 2.10]"; empty where the median is not finite. */
void lum_bench_table_median(struct lum_bench_table *table, struct lum_bench_median m, int digits);

/* On stdout, where columns have titles; OUT/name.csv and OUT/name.json (an array of objects), where it has a name.
 * Frees the cells. False after a message on stderr. */
bool lum_bench_table_finish(struct lum_bench_table *table, const struct lum_bench_options *options, const char *name);

#endif

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

struct lum_bench_table;

/* columns is borrowed. NULL after a message on stderr. */
struct lum_bench_table *lum_bench_table_create(const struct lum_bench_column *columns, size_t n_columns);
void lum_bench_table_destroy(struct lum_bench_table *table); /* accepts NULL */

/* The next cell, row by row. A number that is not finite is an empty cell. Texts are cut at 63 bytes. */
void lum_bench_table_text(struct lum_bench_table *table, const char *text);
void lum_bench_table_number(struct lum_bench_table *table, double value);

void lum_bench_table_markdown(const struct lum_bench_table *table, FILE *f);
/* OUT/name.csv and OUT/name.json (an array of objects). False after a message on stderr. */
bool lum_bench_table_save(const struct lum_bench_table *table, const struct lum_bench_options *options, const char *name);

#endif

#include "tests/bench/table.h"

#include <math.h>
#include <string.h>

#include "core/trace/effect.h"

static bool has_rays(const struct lum_bench_table *t)
{
    return !t->columns[t->n_columns - 1].key;
}

static size_t n_cells(const struct lum_bench_table *t) /* in a row */
{
    return has_rays(t) ? t->n_columns - 1 + LUM_RAY_KIND_COUNT : t->n_columns;
}

static const struct lum_bench_column *column_at(const struct lum_bench_table *t, size_t c)
{
    return &t->columns[c < t->n_columns ? c : t->n_columns - 1];
}

static void put_cell(struct lum_bench_table *t, const char *text)
{
    if (t->n == t->capacity) {
        size_t capacity = t->capacity ? 2 * t->capacity : 64 * n_cells(t);
        struct lum_bench_cell *cells = lum_calloc(capacity, sizeof *cells);
        if (!cells) {
            t->failed = true;
            return;
        }
        if (t->n)
            memcpy(cells, t->cells, t->n * sizeof *cells);
        lum_free(t->cells);
        t->cells = cells;
        t->capacity = capacity;
    }
    snprintf(t->cells[t->n++].text, sizeof t->cells->text, "%s", text);
}

void lum_bench_table_text(struct lum_bench_table *t, const char *text)
{
    put_cell(t, text);
}

void lum_bench_table_number(struct lum_bench_table *t, double value)
{
    char text[sizeof(struct lum_bench_cell)] = "";
    if (isfinite(value))
        snprintf(text, sizeof text, "%.*f", column_at(t, t->n % n_cells(t))->digits, value);
    put_cell(t, text);
}

void lum_bench_table_texts(struct lum_bench_table *t, const char *const *texts, size_t n)
{
    for (size_t i = 0; i < n; i++)
        put_cell(t, texts[i]);
}

void lum_bench_table_numbers(struct lum_bench_table *t, const double *values, size_t n)
{
    for (size_t i = 0; i < n; i++)
        lum_bench_table_number(t, values[i]);
}

void lum_bench_table_median(struct lum_bench_table *t, struct lum_bench_median m, int digits)
{
    char text[sizeof(struct lum_bench_cell)] = "";
    if (isfinite(m.median))
        snprintf(text, sizeof text, "%.*f [%.*f, %.*f]", digits, m.median, digits, m.lo, digits, m.hi);
    put_cell(t, text);
}

/* ---- writing ---- */

static size_t n_rows(const struct lum_bench_table *t)
{
    return t->n / n_cells(t);
}

static const char *cell_at(const struct lum_bench_table *t, size_t row, size_t column)
{
    return t->cells[row * n_cells(t) + column].text;
}

static void put_key(const struct lum_bench_table *t, size_t c, FILE *f)
{
    if (column_at(t, c)->key)
        fputs(column_at(t, c)->key, f);
    else
        fprintf(f, "rays_%s", lum_ray_kind_name((enum lum_ray_kind)(c - (t->n_columns - 1))));
}

/* Cells padded to the column's width, so that the source reads well too. */
static void put_padded(FILE *f, const char *text, size_t width, bool right)
{
    fprintf(f, right ? " %*s |" : " %-*s |", (int)width, text);
}

static void write_markdown(const struct lum_bench_table *t, FILE *f)
{
    for (size_t line = 0; line < n_rows(t) + 2; line++) {
        fputc('|', f);
        for (size_t c = 0; c < t->n_columns; c++) {
            const struct lum_bench_column *column = &t->columns[c];
            bool right = column->digits != LUM_BENCH_TEXT;
            if (!column->title)
                continue;
            size_t width = strlen(column->title);
            for (size_t r = 0; r < n_rows(t); r++)
                width = strlen(cell_at(t, r, c)) > width ? strlen(cell_at(t, r, c)) : width;
            if (line == 1) {
                for (size_t i = 0; i < width + 1; i++)
                    fputc('-', f);
                fputs(right ? ":|" : "-|", f);
            } else {
                put_padded(f, line == 0 ? column->title : cell_at(t, line - 2, c), width, right);
            }
        }
        fputc('\n', f);
    }
}

static void put_csv_text(FILE *f, const char *text)
{
    bool quoted = strpbrk(text, ",\"\n") != NULL;
    if (quoted)
        fputc('"', f);
    for (; *text; text++)
        fputs(*text == '"' ? "\"\"" : (char[2]){*text, 0}, f);
    if (quoted)
        fputc('"', f);
}

static void write_csv(const struct lum_bench_table *t, FILE *f)
{
    size_t n = n_cells(t);
    for (size_t c = 0; c < n; c++) {
        put_key(t, c, f);
        fputc(c + 1 < n ? ',' : '\n', f);
    }
    for (size_t r = 0; r < n_rows(t); r++)
        for (size_t c = 0; c < n; c++) {
            put_csv_text(f, cell_at(t, r, c));
            fputc(c + 1 < n ? ',' : '\n', f);
        }
}

static void put_json_text(FILE *f, const char *text)
{
    fputc('"', f);
    for (; *text; text++) {
        if (*text == '"' || *text == '\\')
            fputc('\\', f);
        fputc((unsigned char)*text < 0x20 ? ' ' : *text, f);
    }
    fputc('"', f);
}

static void write_json(const struct lum_bench_table *t, FILE *f)
{
    fputs("[\n", f);
    for (size_t r = 0; r < n_rows(t); r++) {
        for (size_t c = 0; c < n_cells(t); c++) {
            const char *text = cell_at(t, r, c);
            fputs(c == 0 ? "  {\"" : ", \"", f);
            put_key(t, c, f);
            fputs("\": ", f);
            if (column_at(t, c)->digits == LUM_BENCH_TEXT)
                put_json_text(f, text);
            else
                fputs(text[0] ? text : "null", f);
        }
        fputs(r + 1 < n_rows(t) ? "},\n" : "}\n", f);
    }
    fputs("]\n", f);
}

static bool save_as(const struct lum_bench_table *t, const struct lum_bench_options *o, const char *name, bool json)
{
    char file[128];
    snprintf(file, sizeof file, "%s.%s", name, json ? "json" : "csv");
    FILE *f = lum_bench_open(o, file);
    if (!f)
        return false;
    if (json)
        write_json(t, f);
    else
        write_csv(t, f);
    return lum_bench_close(f, file);
}

static bool has_title(const struct lum_bench_table *t)
{
    bool has = false;
    for (size_t c = 0; c < t->n_columns; c++)
        has = has || t->columns[c].title;
    return has;
}

bool lum_bench_table_finish(struct lum_bench_table *t, const struct lum_bench_options *options, const char *name)
{
    bool ok = !t->failed;
    if (!ok)
        fprintf(stderr, "lumend-bench: out of memory for a table\n");
    if (ok && has_title(t)) {
        putchar('\n');
        write_markdown(t, stdout);
    }
    if (ok && name)
        ok = save_as(t, options, name, false) && save_as(t, options, name, true);
    lum_free(t->cells);
    return ok;
}

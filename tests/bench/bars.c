#include "tests/bench/bars.h"

#include <math.h>

#include "tests/bench/plot.h"

/* Pixels. */
#define WIDTH 860.0
#define LEFT 190.0  /* row labels */
#define RIGHT 90.0  /* totals */
#define TOP 98.0    /* title, subtitle and legend */
#define BOTTOM 50.0 /* ticks and the axis' name */
#define ROW 24.0
#define BAR 16.0
#define LEGEND_W 150.0 /* of an entry */
#define LEGEND_ROW 18.0
#define PER_LEGEND_ROW 5u

/* Okabe & Ito's, as in plot.c, and greys for what is not of one effect. */
static const char *const colors[LUM_BARS_PARTS] = {"#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9",
                                                   "#222222", "#b08a3c", "#7a5195", "#f0e442", "#8c2d04", "#c3c7cc"};

/* The last part is what is left over: grey. */
static const char *color_of(const struct lum_bars *b, size_t part)
{
    return colors[part + 1 == b->n_parts ? LUM_BARS_PARTS - 1 : part];
}

static double total_of(const struct lum_bars *b, const struct lum_bars_row *row)
{
    double sum = 0.0;
    for (size_t i = 0; i < b->n_parts; i++)
        sum += row->parts[i];
    return sum;
}

static double top_of_rows(const struct lum_bars *b)
{
    return TOP + LEGEND_ROW * (double)((b->n_parts - 1) / PER_LEGEND_ROW);
}

static void write_legend(FILE *f, const struct lum_bars *b)
{
    for (size_t i = 0; i < b->n_parts; i++) {
        double x = 20.0 + LEGEND_W * (double)(i % PER_LEGEND_ROW), y = 74.0 + LEGEND_ROW * (double)(i / PER_LEGEND_ROW);
        fprintf(f,
                "<rect x=\"%.1f\" y=\"%.1f\" width=\"11\" height=\"11\" fill=\"%s\"/>"
                "<text x=\"%.1f\" y=\"%.1f\">%s</text>\n",
                x, y - 10.0, color_of(b, i), x + 16.0, y, b->parts[i]);
    }
}

static void write_row(FILE *f, const struct lum_bars *b, size_t r, double scale)
{
    const struct lum_bars_row *row = &b->rows[r];
    double x = LEFT, y = top_of_rows(b) + ROW * (double)r;
    fprintf(f, "<text x=\"%.1f\" y=\"%.1f\" text-anchor=\"end\">%s</text>\n", LEFT - 8.0, y + 12.5, row->label);
    for (size_t i = 0; i < b->n_parts; i++) {
        double w = row->parts[i] * scale;
        if (w > 0.0)
            fprintf(f,
                    "<rect x=\"%.2f\" y=\"%.1f\" width=\"%.2f\" height=\"%.1f\" fill=\"%s\"><title>%s: %.4g %s"
                    "</title></rect>\n",
                    x, y, w, BAR, color_of(b, i), b->parts[i], row->parts[i], b->unit);
        x += w;
    }
    fprintf(f, "<text x=\"%.1f\" y=\"%.1f\">%.3g %s</text>\n", x + 6.0, y + 12.5, total_of(b, row), b->unit);
}

/* Lines behind the bars, their numbers and the name of what they count, below them. */
static void write_axis(FILE *f, const struct lum_bars *b, double most, double scale)
{
    double top = top_of_rows(b) - 4.0, bottom = top + ROW * (double)b->n_rows, step = lum_plot_step(most);
    for (int k = 0; k * step <= most * (1.0 + 1e-9); k++) {
        double x = LEFT + k * step * scale;
        fprintf(f,
                "<line x1=\"%.2f\" y1=\"%.1f\" x2=\"%.2f\" y2=\"%.1f\" stroke=\"#d9dde3\"/>"
                "<text x=\"%.2f\" y=\"%.1f\" text-anchor=\"middle\" fill=\"#5a6270\">%g</text>\n",
                x, top, x, bottom, x, bottom + 16.0, k * step);
    }
    fprintf(f, "<text x=\"%.1f\" y=\"%.1f\" text-anchor=\"middle\">%s, %s</text>\n", 0.5 * (LEFT + WIDTH - RIGHT),
            bottom + 36.0, b->axis, b->unit);
}

void lum_bars_write(FILE *f, const struct lum_bars *b)
{
    double most = 0.0, height = top_of_rows(b) + ROW * (double)b->n_rows + BOTTOM;
    for (size_t r = 0; r < b->n_rows; r++)
        most = fmax(most, total_of(b, &b->rows[r]));
    fprintf(f,
            "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"%.0f\" height=\"%.0f\" viewBox=\"0 0 %.0f %.0f\" "
            "font-family=\"system-ui, sans-serif\" font-size=\"12.5\" fill=\"#1c2026\">\n"
            "<rect width=\"100%%\" height=\"100%%\" rx=\"8\" fill=\"#ffffff\"/>\n"
            "<text x=\"20\" y=\"28\" font-size=\"16\" font-weight=\"600\">%s</text>\n"
            "<text x=\"20\" y=\"48\" fill=\"#5a6270\">%s</text>\n",
            WIDTH, height, WIDTH, height, b->title, b->subtitle);
    write_legend(f, b);
    double scale = most > 0.0 ? (WIDTH - LEFT - RIGHT) / most : 0.0;
    if (most > 0.0)
        write_axis(f, b, most, scale);
    for (size_t r = 0; r < b->n_rows; r++)
        write_row(f, b, r, scale);
    fputs("</svg>\n", f);
}

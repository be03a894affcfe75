#include "tests/bench/plot.h"

#include <math.h>
#include <string.h>

/* Pixels. */
#define PANEL_W 470.0
#define PANEL_H 300.0
#define LEFT 66.0 /* of a panel: y numbers and label */
#define RIGHT 18.0
#define BELOW 54.0 /* x numbers and label */
#define MARGIN 20.0
#define LEGEND_ROW 21.0
#define TEXT_W 6.6 /* mean width of a character at 12.5 px, for laying out the legend */

/* Okabe & Ito without yellow, which is too light for lines on white; black last. */
static const char *const colors[LUM_PLOT_COLORS + 1] = {"#0072b2", "#d55e00", "#009e73", "#cc79a7",
                                                        "#e69f00", "#56b4e9", "#222222", "#8a8f98"};

/* A panel's place in the picture and its axes as they are drawn: u = scaled value, lo and hi in u. */
struct frame {
    const struct lum_plot_panel *panel;
    double left, top; /* of the plotting area */
    struct range {
        enum lum_plot_scale scale;
        double lo, hi;
    } x, y;
};

static double scaled(enum lum_plot_scale scale, double v)
{
    return scale == LUM_PLOT_LINEAR ? v : scale == LUM_PLOT_LOG2 ? log2(v) : log10(v);
}

static double at_x(const struct frame *f, double v)
{
    return f->left + PANEL_W * (scaled(f->x.scale, v) - f->x.lo) / (f->x.hi - f->x.lo);
}

static double at_y(const struct frame *f, double v)
{
    return f->top + PANEL_H * (f->y.hi - scaled(f->y.scale, v)) / (f->y.hi - f->y.lo);
}

static bool shows(const struct frame *f, double x, double y)
{
    return isfinite(x) && isfinite(y) && (f->x.scale == LUM_PLOT_LINEAR || x > 0.0) &&
           (f->y.scale == LUM_PLOT_LINEAR || y > 0.0);
}

/* ---- text ---- */

static void put_escaped(FILE *f, const char *text)
{
    for (; *text; text++) {
        if (*text == '<')
            fputs("&lt;", f);
        else if (*text == '&')
            fputs("&amp;", f);
        else
            fputc(*text, f);
    }
}

struct text {
    double x, y;
    const char *class; /* t title, s subtitle, p panel title, l label, n number, k key */
    const char *anchor;
};

static void put_text(FILE *f, struct text t, const char *text)
{
    fprintf(f, "<text class=\"%s\" x=\"%.1f\" y=\"%.1f\" text-anchor=\"%s\">", t.class, t.x, t.y, t.anchor);
    put_escaped(f, text);
    fputs("</text>\n", f);
}

/* 0.25, 4, 512, 4k, 1.5M: at most three significant digits and a unit prefix; exact powers of two keep theirs. */
static void number_text(double v, enum lum_plot_scale scale, char *ret_text, size_t size)
{
    double a = fabs(v);
    if (scale == LUM_PLOT_LOG2 && a >= 1.0 && a < 10000.0)
        snprintf(ret_text, size, "%.0f", v);
    else if (a >= 1e9)
        snprintf(ret_text, size, "%.3gG", v * 1e-9);
    else if (a >= 1e6)
        snprintf(ret_text, size, "%.3gM", v * 1e-6);
    else if (a >= 1e4)
        snprintf(ret_text, size, "%.3gk", v * 1e-3);
    else
        snprintf(ret_text, size, "%.4g", v);
}

/* ---- axes ---- */

static void include(struct range *r, double v)
{
    if (!isfinite(v) || (r->scale != LUM_PLOT_LINEAR && !(v > 0.0)))
        return;
    double u = scaled(r->scale, v);
    r->lo = fmin(r->lo, u);
    r->hi = fmax(r->hi, u);
}

double lum_plot_step(double span)
{
    double power = pow(10.0, floor(log10(span / 4.0))), rest = span / 4.0 / power;
    return power * (rest >= 5.0 ? 5.0 : rest >= 2.0 ? 2.0 : 1.0);
}

static void include_series(struct range *r, const struct lum_plot_series *s, bool of_x)
{
    for (size_t i = 0; i < s->n; i++) {
        include(r, of_x ? s->x[i] : s->y[i]);
        if (!of_x && s->y_lo && s->y_hi) {
            include(r, s->y_lo[i]);
            include(r, s->y_hi[i]);
        }
    }
}

/* Linear axes begin at 0, for lengths are compared from there, and end on a number. Logarithmic axes have some
 * room.
 */
static void round_range(struct range *r)
{
    if (!(r->lo <= r->hi))
        r->lo = 0.0, r->hi = 1.0;
    if (r->scale == LUM_PLOT_LINEAR) {
        r->lo = fmin(r->lo, 0.0);
        double step = lum_plot_step(fmax(r->hi - r->lo, 1e-12));
        r->lo = floor(r->lo / step) * step;
        r->hi = ceil(r->hi / step - 1e-9) * step;
    } else {
        double room = 0.04 * fmax(r->hi - r->lo, 0.5);
        r->lo -= room;
        r->hi += room;
    }
    if (!(r->hi > r->lo))
        r->hi = r->lo + 1.0;
}

static struct range range_of(const struct lum_plot_panel *panels, size_t n_panels, bool of_x)
{
    const struct lum_plot_axis *axis = of_x ? &panels[0].x : &panels[0].y;
    struct range r = {axis->scale, HUGE_VAL, -HUGE_VAL};
    if (axis->lo < axis->hi) {
        include(&r, axis->lo);
        include(&r, axis->hi);
        return r;
    }
    for (size_t p = 0; p < n_panels; p++)
        for (size_t s = 0; s < panels[p].n_series; s++)
            include_series(&r, &panels[p].series[s], of_x);
    round_range(&r);
    return r;
}

struct tick {
    double value;
    bool major; /* carries a number */
};

/* In increasing order. Returns how many; at most max. */
static size_t ticks_of(const struct range *r, struct tick *ret_ticks, size_t max)
{
    size_t n = 0;
    if (r->scale == LUM_PLOT_LINEAR) {
        double step = lum_plot_step(r->hi - r->lo);
        for (double k = ceil(r->lo / step - 1e-9); k * step <= r->hi + 1e-9 * step && n < max; k++)
            ret_ticks[n++] = (struct tick){k * step + 0.0, true}; /* never -0 */
        return n;
    }
    if (r->scale == LUM_PLOT_LOG2) {
        double every = ceil((r->hi - r->lo) / 13.0);
        for (double k = ceil(r->lo - 1e-9); k <= r->hi + 1e-9 && n < max; k++)
            ret_ticks[n++] = (struct tick){exp2(k), fmod(k, every) == 0.0};
        return n;
    }
    /* decades; 2 and 5 carry numbers too where there are few decades */
    bool dense = r->hi - r->lo < 2.5;
    for (double k = floor(r->lo); k <= r->hi; k++)
        for (int m = 1; m < 10; m++) {
            double u = k + log10(m);
            if (u >= r->lo - 1e-9 && u <= r->hi + 1e-9 && n < max)
                ret_ticks[n++] = (struct tick){m * pow(10.0, k), m == 1 || (dense && (m == 2 || m == 5))};
        }
    return n;
}

static void put_axes(FILE *f, const struct frame *fr)
{
    struct tick ticks[128];
    char text[32];
    size_t n = ticks_of(&fr->y, ticks, 128);
    for (size_t i = 0; i < n; i++) {
        double y = at_y(fr, ticks[i].value);
        fprintf(f, "<path class=\"%s\" d=\"M%.1f %.1fh%.1f\"/>\n", ticks[i].major ? "g" : "m", fr->left, y, PANEL_W);
        number_text(ticks[i].value, fr->y.scale, text, sizeof text);
        if (ticks[i].major)
            put_text(f, (struct text){fr->left - 8.0, y + 4.0, "n", "end"}, text);
    }
    n = ticks_of(&fr->x, ticks, 128);
    for (size_t i = 0; i < n; i++) {
        double x = at_x(fr, ticks[i].value);
        fprintf(f, "<path class=\"%s\" d=\"M%.1f %.1fv%.1f\"/>\n", ticks[i].major ? "g" : "m", x, fr->top, PANEL_H);
        number_text(ticks[i].value, fr->x.scale, text, sizeof text);
        if (ticks[i].major)
            put_text(f, (struct text){x, fr->top + PANEL_H + 18.0, "n", "middle"}, text);
    }
    fprintf(f, "<path class=\"a\" d=\"M%.1f %.1fv%.1fh%.1f\"/>\n", fr->left, fr->top, PANEL_H, PANEL_W);
    put_text(f, (struct text){fr->left + 0.5 * PANEL_W, fr->top + PANEL_H + 40.0, "l", "middle"}, fr->panel->x.label);
    double lx = fr->left - LEFT + 14.0, ly = fr->top + 0.5 * PANEL_H;
    fprintf(f, "<g transform=\"rotate(-90 %.1f %.1f)\">", lx, ly);
    put_text(f, (struct text){lx, ly, "l", "middle"}, fr->panel->y.label);
    fputs("</g>\n", f);
}

/* ---- series ---- */

/* The colour's own mark around (x, y). */
static void put_mark(FILE *f, const struct lum_plot_series *s, double x, double y)
{
    const char *color = colors[s->color % (LUM_PLOT_COLORS + 1)], *fill = s->dashed ? "#fff" : color;
    const char *style = "stroke-width=\"1.4\"";
    switch (s->color % 4) {
    case 0:
        fprintf(f, "<circle cx=\"%.1f\" cy=\"%.1f\" r=\"3.2\" fill=\"%s\" stroke=\"%s\" %s/>\n", x, y, fill, color,
                style);
        break;
    case 1:
        fprintf(f, "<path d=\"M%.1f %.1fh6v6h-6z\" fill=\"%s\" stroke=\"%s\" %s/>\n", x - 3.0, y - 3.0, fill, color,
                style);
        break;
    case 2:
        fprintf(f, "<path d=\"M%.1f %.1fl3.7 6.4h-7.4z\" fill=\"%s\" stroke=\"%s\" %s/>\n", x, y - 4.0, fill, color,
                style);
        break;
    default:
        fprintf(f, "<path d=\"M%.1f %.1fl4 4l-4 4l-4-4z\" fill=\"%s\" stroke=\"%s\" %s/>\n", x, y - 4.0, fill, color,
                style);
    }
}

static bool has_marks(const struct lum_plot_series *s)
{
    return !s->bare && s->color < LUM_PLOT_COLORS;
}

static void put_line_style(FILE *f, const struct lum_plot_series *s)
{
    fprintf(f, " fill=\"none\" stroke=\"%s\" stroke-width=\"2\" stroke-linejoin=\"round\"%s/>\n",
            colors[s->color % (LUM_PLOT_COLORS + 1)], s->dashed ? " stroke-dasharray=\"6 4\"" : "");
}

static void put_series(FILE *f, const struct frame *fr, const struct lum_plot_series *s)
{
    bool pen_down = false;
    if (s->n == 0)
        return;
    fputs("<path d=\"", f);
    for (size_t i = 0; i < s->n; i++) {
        if (!shows(fr, s->x[i], s->y[i])) {
            pen_down = false;
            continue;
        }
        fprintf(f, "%c%.1f %.1f", pen_down ? 'L' : 'M', at_x(fr, s->x[i]), at_y(fr, s->y[i]));
        pen_down = true;
    }
    fputs("\"", f);
    put_line_style(f, s);
    for (size_t i = 0; s->y_lo && s->y_hi && i < s->n; i++)
        if (shows(fr, s->x[i], s->y_lo[i]) && shows(fr, s->x[i], s->y_hi[i]))
            fprintf(f, "<path d=\"M%.1f %.1fV%.1f\" stroke=\"%s\" stroke-width=\"1.2\" opacity=\"0.6\"/>\n",
                    at_x(fr, s->x[i]), at_y(fr, s->y_lo[i]), at_y(fr, s->y_hi[i]),
                    colors[s->color % (LUM_PLOT_COLORS + 1)]);
    for (size_t i = 0; has_marks(s) && i < s->n; i++)
        if (shows(fr, s->x[i], s->y[i]))
            put_mark(f, s, at_x(fr, s->x[i]), at_y(fr, s->y[i]));
    if (s->note && shows(fr, s->x[s->n - 1], s->y[s->n - 1]))
        put_text(f, (struct text){at_x(fr, s->x[s->n - 1]) + 8.0, at_y(fr, s->y[s->n - 1]) - 6.0, "k", "start"},
                 s->note);
}

/* ---- the whole ---- */

/* Bytes that are not continuations of a UTF-8 sequence. */
static size_t n_characters(const char *text)
{
    size_t n = 0;
    for (; *text; text++)
        n += ((unsigned char)*text & 0xc0u) != 0x80u;
    return n;
}

/* Lays entries out in rows of the given width from (x, y) down and returns the height; f NULL: only measures. */
static double put_legend(FILE *f, const struct lum_plot_panel *p, double x, double y, double width)
{
    double at = 0.0, row = 0.0;
    for (size_t i = 0; i < p->n_series; i++) {
        const struct lum_plot_series *s = &p->series[i];
        if (!s->label)
            continue;
        double w = 38.0 + TEXT_W * (double)n_characters(s->label) + 22.0;
        if (at > 0.0 && at + w - 22.0 > width)
            at = 0.0, row += LEGEND_ROW;
        if (f) {
            double cx = x + at, cy = y + row + 0.5 * LEGEND_ROW;
            fprintf(f, "<path d=\"M%.1f %.1fh30\"", cx, cy);
            put_line_style(f, s);
            if (has_marks(s))
                put_mark(f, s, cx + 15.0, cy);
            put_text(f, (struct text){cx + 38.0, cy + 4.2, "k", "start"}, s->label);
        }
        at += w;
    }
    return row + LEGEND_ROW;
}

static void put_head(FILE *f, double w, double h)
{
    fprintf(f, "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 %.0f %.0f\" width=\"%.0f\" height=\"%.0f\">\n",
            w, h, w, h);
    fputs("<style>text{font-family:system-ui,-apple-system,'Segoe UI',Roboto,'DejaVu Sans',sans-serif;fill:#24292f}"
          ".t{font-size:17px;font-weight:600}.s{font-size:12.5px;fill:#57606a}.p{font-size:13.5px;font-weight:600}"
          ".l{font-size:12.5px}.n{font-size:11.5px;fill:#57606a}.k{font-size:12.5px}"
          ".g{stroke:#d8dee4;stroke-width:1}.m{stroke:#eff2f5;stroke-width:1}"
          ".a{fill:none;stroke:#57606a;stroke-width:1.2}</style>\n",
          f);
    fprintf(f, "<rect x=\"0.5\" y=\"0.5\" width=\"%.1f\" height=\"%.1f\" rx=\"8\" fill=\"#fff\" stroke=\"#d0d7de\"/>\n",
            w - 1.0, h - 1.0);
}

void lum_plot_write(FILE *f, const struct lum_plot *plot)
{
    double panel_w = LEFT + PANEL_W + RIGHT, w = 2.0 * MARGIN + panel_w * (double)plot->n_panels;
    double legend = put_legend(NULL, &plot->panels[0], 0.0, 0.0, w - 2.0 * MARGIN - 12.0);
    double head = MARGIN + 22.0 + (plot->subtitle ? 20.0 : 0.0), titles = plot->panels[0].title ? 24.0 : 0.0;
    double top = head + legend + 10.0 + titles;
    put_head(f, w, top + PANEL_H + BELOW + 4.0);
    put_text(f, (struct text){MARGIN + 6.0, MARGIN + 14.0, "t", "start"}, plot->title);
    if (plot->subtitle)
        put_text(f, (struct text){MARGIN + 6.0, MARGIN + 34.0, "s", "start"}, plot->subtitle);
    (void)put_legend(f, &plot->panels[0], MARGIN + 6.0, head, w - 2.0 * MARGIN - 12.0);
    for (size_t p = 0; p < plot->n_panels; p++) {
        const struct lum_plot_panel *panel = &plot->panels[p];
        const struct lum_plot_panel *ranged = plot->same_y ? plot->panels : panel;
        struct frame fr = {panel, MARGIN + panel_w * (double)p + LEFT, top, range_of(panel, 1, true),
                           range_of(ranged, plot->same_y ? plot->n_panels : 1, false)};
        if (panel->title)
            put_text(f, (struct text){fr.left, top - 9.0, "p", "start"}, panel->title);
        put_axes(f, &fr);
        for (size_t s = 0; s < panel->n_series; s++)
            put_series(f, &fr, &panel->series[s]);
    }
    fputs("</svg>\n", f);
}

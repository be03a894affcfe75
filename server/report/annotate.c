#include "server/report/annotate.h"

#include <stdio.h>
#include <string.h>

/* ---- letters ---- */

/* Those that values and units need, of 5 x 7 dots: a row a byte, its left dot in bit 4. */
enum { DOTS_W = 5, DOTS_H = 7, ADVANCE = DOTS_W + 1 };
struct letter {
    char code;
    uint8_t rows[DOTS_H];
};
/* clang-format off */
static const struct letter letters[] = {
    {'0', {14, 17, 17, 17, 17, 17, 14}}, {'1', {4, 12, 4, 4, 4, 4, 14}},    {'2', {14, 17, 1, 2, 4, 8, 31}},
    {'3', {30, 1, 1, 14, 1, 1, 30}},     {'4', {2, 6, 10, 18, 31, 2, 2}},   {'5', {31, 16, 30, 1, 1, 17, 14}},
    {'6', {14, 16, 30, 17, 17, 17, 14}}, {'7', {31, 1, 2, 2, 4, 4, 4}},     {'8', {14, 17, 17, 14, 17, 17, 14}},
    {'9', {14, 17, 17, 17, 15, 1, 14}},  {'.', {0, 0, 0, 0, 0, 12, 12}},    {'/', {1, 1, 2, 4, 8, 16, 16}},
    {'-', {0, 0, 0, 31, 0, 0, 0}},       {'+', {0, 4, 4, 31, 4, 4, 0}},     {'b', {16, 16, 30, 17, 17, 17, 30}},
    {'c', {0, 0, 14, 16, 16, 16, 14}},   {'d', {1, 1, 15, 17, 17, 17, 15}}, {'e', {0, 0, 14, 17, 31, 16, 14}},
    {'f', {6, 8, 28, 8, 8, 8, 8}},       {'l', {12, 4, 4, 4, 4, 4, 14}},    {'m', {0, 0, 26, 21, 21, 21, 21}},
    {'o', {0, 0, 14, 17, 17, 17, 14}},   {'r', {0, 0, 22, 25, 16, 16, 16}}, {'w', {0, 0, 17, 17, 21, 21, 10}},
    {'x', {0, 0, 17, 10, 4, 10, 17}},
};
/* clang-format on */

static const uint8_t *rows_of(char code)
{
    static const uint8_t space[DOTS_H] = {0};
    for (size_t i = 0; i < LUM_ARRAY_LEN(letters); i++)
        if (letters[i].code == code)
            return letters[i].rows;
    return space;
}

static void fill(const struct lum_canvas *c, int32_t x, int32_t y, int32_t w, int32_t h, const uint8_t rgb[3])
{
    for (int32_t j = y < 0 ? 0 : y; j < y + h && j < (int32_t)c->h; j++)
        for (int32_t i = x < 0 ? 0 : x; i < x + w && i < (int32_t)c->w; i++)
            memcpy(c->rgb + 3 * ((size_t)j * c->w + (size_t)i), rgb, 3);
}

/* Upper left corner at (x, y); a dot is `dot` pixels wide, and drawn `more` wider on all sides. */
static void write_text(const struct lum_canvas *c, int32_t x, int32_t y, const char *text, int32_t dot, int32_t more,
                       const uint8_t rgb[3])
{
    for (; *text; text++, x += ADVANCE * dot) {
        const uint8_t *rows = rows_of(*text);
        for (int32_t j = 0; j < DOTS_H; j++)
            for (int32_t i = 0; i < DOTS_W; i++)
                if (rows[j] >> (DOTS_W - 1 - i) & 1)
                    fill(c, x + i * dot - more, y + j * dot - more, dot + 2 * more, dot + 2 * more, rgb);
    }
}

static int32_t width_of(const char *text, int32_t dot)
{
    return (int32_t)strlen(text) * ADVANCE * dot - dot;
}

/* ---- lines ---- */

static const uint8_t black[3] = {0, 0, 0}, white[3] = {255, 255, 255}, paper[3] = {24, 24, 24};

/* One dot a pixel is too small to read in a picture that is looked at whole. */
static int32_t dot_for(uint32_t h)
{
    return h >= 300 ? 2 : 1;
}

void lum_annotate_lines(const struct lum_overlay *overlay, const struct lum_canvas *canvas)
{
    for (uint32_t i = 0; i < overlay->n_labels; i++) {
        const struct lum_isoline_label *l = &overlay->labels[i];
        int32_t dot = dot_for(overlay->h);
        char text[32];
        snprintf(text, sizeof text, "%g", overlay->scale.limits[l->level]);
        int32_t x = l->x - width_of(text, dot) / 2, y = l->y - DOTS_H * dot / 2;
        write_text(canvas, x, y, text, dot, 1, black);
        write_text(canvas, x, y, text, dot, 0, white);
    }
}

/* ---- legend ---- */

enum { PAD = 6, TEXT = 12 /* letters: "from 1000 lx" */, SWATCH = 12 /* dots wide */, ROW = 10 /* dots high */ };

static uint32_t rows_of_legend(const struct lum_scale *s)
{
    return s->smooth ? 18 : s->n_colors;
}

/* The largest that fits; 0: none. */
static int32_t legend_dot(const struct lum_overlay *o, uint32_t h)
{
    int32_t dot = dot_for(h);
    while (dot > 0 && (int32_t)rows_of_legend(&o->scale) * ROW * dot + 2 * PAD * dot > (int32_t)h)
        dot--;
    return dot;
}

uint32_t lum_annotate_legend_width(const struct lum_overlay *overlay, uint32_t h)
{
    return overlay->classes ? (uint32_t)(legend_dot(overlay, h) * (3 * PAD + SWATCH + TEXT * ADVANCE)) : 0;
}

static void row_text(const struct lum_overlay *o, uint32_t i, char ret_text[64])
{
    const struct lum_scale *s = &o->scale;
    if (s->smooth)
        snprintf(ret_text, 64, "%g%s%s", s->limits[i], i + 1 == s->n_limits ? " " : "",
                 i + 1 == s->n_limits ? o->unit : "");
    else if (i == 0)
        snprintf(ret_text, 64, "below %g", s->limits[0]);
    else if (i == s->n_limits)
        snprintf(ret_text, 64, "from %g %s", s->limits[i - 1], o->unit);
    else
        snprintf(ret_text, 64, "%g", s->limits[i - 1]);
}

/* The greatest on top. */
static void draw_steps(const struct lum_overlay *o, const struct lum_canvas *c, int32_t x, int32_t dot)
{
    for (uint32_t i = 0; i < o->scale.n_colors; i++) {
        int32_t y = PAD * dot + (int32_t)(o->scale.n_colors - 1 - i) * ROW * dot;
        char text[64];
        row_text(o, i, text);
        fill(c, x, y, SWATCH * dot, ROW * dot, o->scale.colors[i]);
        write_text(c, x + (SWATCH + PAD) * dot, y + dot, text, dot, 0, white);
    }
}

static void draw_bar(const struct lum_overlay *o, const struct lum_canvas *c, int32_t x, int32_t dot)
{
    const struct lum_scale *s = &o->scale;
    const int32_t top = (PAD + ROW / 2) * dot, height = (int32_t)(rows_of_legend(s) - 1) * ROW * dot;
    for (int32_t j = 0; j < height; j++)
        fill(c, x, top + height - 1 - j, SWATCH * dot, 1, s->colors[(int32_t)s->n_colors * j / height]);
    for (uint32_t i = 0; i < s->n_limits; i++) {
        double at = (double)lum_scale_color(s, s->limits[i]) / (s->n_colors - 1.0);
        int32_t y = top + height - (int32_t)(at * height);
        char text[64];
        row_text(o, i, text);
        fill(c, x + SWATCH * dot, y, PAD / 2 * dot, 1, white);
        write_text(c, x + (SWATCH + PAD) * dot, y - DOTS_H * dot / 2, text, dot, 0, white);
    }
}

void lum_annotate_legend(const struct lum_overlay *overlay, const struct lum_canvas *canvas)
{
    int32_t dot = legend_dot(overlay, canvas->h), w = (int32_t)lum_annotate_legend_width(overlay, canvas->h);
    int32_t x = (int32_t)canvas->w - w;
    if (w == 0)
        return;
    fill(canvas, x, 0, w, (int32_t)canvas->h, paper);
    if (overlay->scale.smooth)
        draw_bar(overlay, canvas, x + PAD * dot, dot);
    else
        draw_steps(overlay, canvas, x + PAD * dot, dot);
}

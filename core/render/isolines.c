#include "core/render/isolines.h"

#include <stdlib.h>
#include <string.h>

#include "core/accel/accel.h"
#include "core/pass/eye.h"

#define AROUND 2             /* pixels to each side that a value is averaged over */
#define ALIKE 0.95f          /* cosine of normals of one surface, from pixel to pixel */
#define OFF_PLANE 0.3f       /* of the way from pixel to pixel, across the surface: more is a step */
#define DEVIATIONS_APART 2.0 /* from the next level: 95 % sure that a place is not beyond it */

/* Per pixel. */
struct job {
    const struct lum_isolines *of;
    struct lum_vec3 *place; /* metres from the eye */
    uint8_t *below;         /* levels at or below its value */
    float *smooth;
};

/* Levels at or below a value. */
static uint32_t levels_below(const struct lum_isolines *of, float value)
{
    uint32_t n = 0;
    while (n < of->n_levels && (double)value >= of->levels[n])
        n++;
    return n;
}

static size_t index_of(const struct job *j, uint32_t x, uint32_t y)
{
    return (size_t)y * j->of->w + x;
}

static bool same_surface(const struct job *j, uint32_t xa, uint32_t ya, uint32_t xb, uint32_t yb)
{
    size_t a = index_of(j, xa, ya), b = index_of(j, xb, yb);
    const struct lum_aovs *s = j->of->seen;
    if (s->instance[a] != s->instance[b] || s->instance[a] == LUM_NO_OBJECT || isnan(j->of->values[b]) ||
        lum_dot(s->normal_world[a], s->normal_world[b]) < ALIKE)
        return false;
    struct lum_vec3 way = lum_v3_sub(j->place[b], j->place[a]);
    return fabsf(lum_dot(way, s->normal_world[a])) <= OFF_PLANE * lum_length(way);
}

/* No level is crossed in what it would be averaged over. */
static bool is_even_around(const struct job *j, uint32_t x, uint32_t y)
{
    uint8_t here = j->below[index_of(j, x, y)];
    for (uint32_t k = y > AROUND ? y - AROUND : 0; k <= y + AROUND && k < j->of->h; k++)
        for (uint32_t i = x > AROUND ? x - AROUND : 0; i <= x + AROUND && i < j->of->w; i++)
            if (j->below[index_of(j, i, k)] != here)
                return false;
    return true;
}

static float mean_around(const struct job *j, uint32_t x, uint32_t y)
{
    const struct lum_isolines *of = j->of;
    float sum = of->values[index_of(j, x, y)], n = 1.0f;
    if (isnan(sum) || is_even_around(j, x, y))
        return sum;
    for (int dy = -AROUND; dy <= AROUND; dy++)
        for (int dx = -AROUND; dx <= AROUND; dx++) {
            uint32_t i = x + (uint32_t)dx, k = y + (uint32_t)dy; /* left of 0 is right of all */
            if ((dx == 0 && dy == 0) || i >= of->w || k >= of->h || !same_surface(j, x, y, i, k))
                continue;
            sum += of->values[index_of(j, i, k)];
            n++;
        }
    return sum / n;
}

/* Between two levels that are further apart than noise may move their lines. */
static bool is_certain(const struct lum_isolines *of, uint32_t level, uint32_t x, uint32_t y)
{
    if (!of->errors)
        return true;
    double sigma = of->per_error * (double)lum_error_map_at(of->errors, of->errors->rms, x, y);
    double below = level > 0 ? of->levels[level] - of->levels[level - 1] : of->levels[level];
    double above = level + 1 < of->n_levels ? of->levels[level + 1] - of->levels[level] : below;
    return !(DEVIATIONS_APART * sigma > fmin(below, above)); /* not known: as if it were */
}

/* 1 + the level between a pixel and its neighbour; 0: none. */
static uint8_t crossed(const struct job *j, uint32_t x, uint32_t y, uint32_t right, uint32_t down)
{
    const struct lum_isolines *of = j->of;
    if (right >= of->w || down >= of->h)
        return 0;
    float here = j->smooth[index_of(j, x, y)], there = j->smooth[index_of(j, right, down)];
    if (isnan(here) || isnan(there))
        return 0;
    uint32_t a = levels_below(of, here), b = levels_below(of, there);
    if (a == b || !same_surface(j, x, y, right, down))
        return 0;
    uint32_t level = (a < b ? b : a) - 1;
    return is_certain(of, level, x, y) ? (uint8_t)(level + 1) : 0;
}

static void look(struct job *j, const struct lum_eye *eye)
{
    for (uint32_t y = 0; y < j->of->h; y++)
        for (uint32_t x = 0; x < j->of->w; x++) {
            size_t i = index_of(j, x, y);
            struct lum_vec3 d = lum_eye_direction(eye, (float)x + 0.5f, (float)y + 0.5f);
            j->place[i] = lum_v3_mul(d, j->of->seen->depth_m[i]);
            j->below[i] = (uint8_t)levels_below(j->of, j->of->values[i]);
        }
}

/* ---- specks ---- */

#define LEAST_LINE 20u /* pixels: what is shorter is noise, or a spot of sun, and hides the others */

/* Takes the pixels of one line that touch, from `at` on, out of `left`, into list. Returns how many. */
static uint32_t take_piece(const struct job *j, uint8_t *left, uint32_t at, uint32_t *list)
{
    const uint32_t w = j->of->w, h = j->of->h;
    const uint8_t line = left[at];
    uint32_t n = 0;
    left[at] = 0;
    list[n++] = at;
    for (uint32_t i = 0; i < n; i++)
        for (uint32_t k = 0; k < 9; k++) {
            uint32_t x = list[i] % w + k % 3 - 1, y = list[i] / w + k / 3 - 1; /* left of 0 is right of all */
            if (x >= w || y >= h || left[(size_t)y * w + x] != line)
                continue;
            left[(size_t)y * w + x] = 0;
            list[n++] = y * w + x;
        }
    return n;
}

static void drop_specks(const struct job *j, uint8_t *left, uint32_t *list, uint8_t *lines)
{
    const uint32_t n_pixels = j->of->w * j->of->h;
    memcpy(left, lines, n_pixels);
    for (uint32_t at = 0; at < n_pixels; at++) {
        uint32_t n = left[at] ? take_piece(j, left, at, list) : LEAST_LINE;
        for (uint32_t i = 0; n < LEAST_LINE && i < n; i++)
            lines[list[i]] = 0;
    }
}

/* ---- */

static void find_lines(struct job *j, uint8_t *ret_lines)
{
    for (uint32_t y = 0; y < j->of->h; y++)
        for (uint32_t x = 0; x < j->of->w; x++)
            j->smooth[index_of(j, x, y)] = mean_around(j, x, y);
    for (uint32_t y = 0; y < j->of->h; y++)
        for (uint32_t x = 0; x < j->of->w; x++) {
            uint8_t line = crossed(j, x, y, x + 1, y);
            ret_lines[index_of(j, x, y)] = line ? line : crossed(j, x, y, x, y + 1);
        }
}

enum lum_status lum_isolines_find(const struct lum_isolines *of, uint8_t *ret_lines, struct lum_error *err)
{
    const struct lum_normalisation metres = {.scale = 1.0};
    size_t n = (size_t)of->w * of->h;
    struct job j = {.of = of};
    struct lum_eye eye;
    enum lum_status status = lum_eye_init(&eye, of->camera, &metres, of->w, of->h, err);
    if (status)
        return status;
    j.place = lum_calloc(n, sizeof *j.place);
    j.below = lum_calloc(n, sizeof *j.below);
    j.smooth = lum_calloc(n, sizeof *j.smooth);
    uint32_t *list = lum_calloc(n, sizeof *list);
    if (j.place && j.below && j.smooth && list) {
        look(&j, &eye);
        find_lines(&j, ret_lines);
        drop_specks(&j, j.below, list, ret_lines);
    } else {
        status = lum_fail(err, LUM_ERR_NOMEM, "", "no memory for lines over %u x %u pixels", of->w, of->h);
    }
    lum_free(j.place);
    lum_free(j.below);
    lum_free(j.smooth);
    lum_free(list);
    return status;
}

/* ---- labels ---- */

enum { CELL_W = 96, CELL_H = 64, LEAST_OF_LINE = 24 /* pixels in a cell: less is a speck */ };

/* The pixel of a level's line that is next to the middle of a cell. False: it hardly has one. */
static bool middle_of_line(const uint8_t *lines, uint32_t w, uint32_t h, uint32_t x0, uint32_t y0, uint8_t line,
                           struct lum_isoline_label *ret_label)
{
    uint32_t n = 0, best = UINT32_MAX;
    for (uint32_t y = y0; y < y0 + CELL_H && y < h; y++)
        for (uint32_t x = x0; x < x0 + CELL_W && x < w; x++) {
            if (lines[(size_t)y * w + x] != line)
                continue;
            int32_t dx = (int32_t)(x - x0) - CELL_W / 2, dy = (int32_t)(y - y0) - CELL_H / 2;
            uint32_t far = (uint32_t)(dx * dx + dy * dy);
            n++;
            if (far >= best)
                continue;
            best = far;
            *ret_label = (struct lum_isoline_label){(uint16_t)x, (uint16_t)y, (uint8_t)(line - 1)};
        }
    return n >= LEAST_OF_LINE;
}

static bool has_room(const struct lum_isoline_label *l, uint32_t w, uint32_t h, const struct lum_isoline_label *others,
                     uint32_t n)
{
    if (l->x < LUM_LABEL_W / 2 || l->y < LUM_LABEL_H / 2 || l->x + LUM_LABEL_W / 2 > w || l->y + LUM_LABEL_H / 2 > h)
        return false;
    for (uint32_t i = 0; i < n; i++) {
        uint32_t dx = (uint32_t)abs(l->x - others[i].x), dy = (uint32_t)abs(l->y - others[i].y);
        bool same = l->level == others[i].level;
        if ((dx < LUM_LABEL_W && dy < LUM_LABEL_H) || (same && dx * dx + dy * dy < w * w / 9))
            return false;
    }
    return true;
}

static uint32_t common_divisor(uint32_t a, uint32_t b)
{
    while (b) {
        uint32_t rest = a % b;
        a = b;
        b = rest;
    }
    return a;
}

/* Adds those of a cell. Returns how many there are now. */
static uint32_t label_cell(const uint8_t *lines, uint32_t w, uint32_t h, uint32_t x0, uint32_t y0,
                           struct lum_isoline_label *labels, uint32_t n)
{
    bool present[256] = {false};
    for (uint32_t y = y0; y < y0 + CELL_H && y < h; y++)
        for (uint32_t x = x0; x < x0 + CELL_W && x < w; x++)
            present[lines[(size_t)y * w + x]] = true;
    for (uint32_t line = 1; line < 256 && n < LUM_ISOLINE_LABELS; line++) {
        struct lum_isoline_label l;
        if (present[line] && middle_of_line(lines, w, h, x0, y0, (uint8_t)line, &l) && has_room(&l, w, h, labels, n))
            labels[n++] = l;
    }
    return n;
}

uint32_t lum_isolines_label(const uint8_t *lines, uint32_t w, uint32_t h,
                            struct lum_isoline_label ret_labels[LUM_ISOLINE_LABELS])
{
    const uint32_t nx = (w + CELL_W - 1) / CELL_W, ny = (h + CELL_H - 1) / CELL_H, cells = nx * ny;
    uint32_t n = 0, stride = cells / 2 + 1; /* places from all over the picture come early, */
    while (common_divisor(cells, stride) > 1)
        stride++; /* and each once */
    for (uint32_t i = 0; i < cells; i++) {
        uint32_t cell = (uint32_t)((uint64_t)i * stride % cells);
        n = label_cell(lines, w, h, cell % nx * CELL_W, cell / nx * CELL_H, ret_labels, n);
    }
    return n;
}

#include "core/film/error_map.h"

/* A place is looked at through a window of cells, the smallest of these (cells to each side) in which the squared error
 * is known to half of itself: where there are few pixels, or they say little, the map is coarse and not wrong. */
static const uint32_t windows[] = {1, 2, 4, 8, 16, 32};

#define KNOWN 0.5 /* standard deviation of a squared error over itself */

enum lum_status lum_error_map_init(struct lum_error_map *map, const struct lum_film *film, struct lum_error *err)
{
    uint32_t nx = (film->w + LUM_ERROR_CELL - 1) / LUM_ERROR_CELL, ny = (film->h + LUM_ERROR_CELL - 1) / LUM_ERROR_CELL;
    size_t n = (size_t)nx * ny;
    *map = (struct lum_error_map){.w = film->w, .h = film->h, .nx = nx, .ny = ny};
    map->sums = lum_calloc(((size_t)nx + 1) * (ny + 1), sizeof *map->sums);
    map->rms = lum_calloc(n, sizeof *map->rms);
    map->rel = lum_calloc(n, sizeof *map->rel);
    if (!map->sums || !map->rms || !map->rel) {
        lum_error_map_finish(map);
        return lum_fail(err, LUM_ERR_NOMEM, "size", "out of memory for the errors of a picture of %u x %u", film->w,
                        film->h);
    }
    for (uint32_t y = 0; y < film->h; y++)
        for (uint32_t x = 0; x < film->w; x++) {
            struct lum_error_sums *s = &map->sums[(size_t)(y / LUM_ERROR_CELL + 1) * (nx + 1) + x / LUM_ERROR_CELL + 1];
            s->light += (double)lum_luminance(lum_film_mean(film, x, y));
            s->pixels++;
        }
    return LUM_OK;
}

void lum_error_map_finish(struct lum_error_map *map)
{
    lum_free(map->sums);
    lum_free(map->rms);
    lum_free(map->rel);
    *map = (struct lum_error_map){0};
}

void lum_error_map_add(struct lum_error_map *map, uint32_t x, uint32_t y, double square, double weight)
{
    double part = square * weight;
    if (!isfinite(part * part))
        return;
    struct lum_error_sums *s = &map->sums[(size_t)(y / LUM_ERROR_CELL + 1) * (map->nx + 1) + x / LUM_ERROR_CELL + 1];
    s->square += part;
    s->square2 += part * part;
    s->weight += weight;
    s->n++;
}

static void add_sums(struct lum_error_sums *s, const struct lum_error_sums *more, double sign)
{
    s->square += sign * more->square;
    s->square2 += sign * more->square2;
    s->weight += sign * more->weight;
    s->n += sign * more->n;
    s->light += sign * more->light;
    s->pixels += sign * more->pixels;
}

/* Of the cells within r of (cx, cy). */
static struct lum_error_sums around(const struct lum_error_map *m, uint32_t cx, uint32_t cy, uint32_t r)
{
    uint32_t x0 = cx > r ? cx - r : 0, y0 = cy > r ? cy - r : 0;
    uint32_t x1 = m->nx - cx > r ? cx + r + 1 : m->nx, y1 = m->ny - cy > r ? cy + r + 1 : m->ny;
    size_t stride = (size_t)m->nx + 1;
    struct lum_error_sums s = m->sums[y1 * stride + x1];
    add_sums(&s, &m->sums[y0 * stride + x1], -1.0);
    add_sums(&s, &m->sums[y1 * stride + x0], -1.0);
    add_sums(&s, &m->sums[y0 * stride + x0], 1.0);
    return s;
}

/* Mean squared error there. Where no window knows it: no less than it may be by a standard deviation. */
static double square_at(const struct lum_error_map *m, uint32_t cx, uint32_t cy)
{
    double most = (double)NAN;
    for (size_t i = 0; i < sizeof windows / sizeof windows[0]; i++) {
        struct lum_error_sums s = around(m, cx, cy, windows[i]);
        if (s.n < 0.5) /* a count, but for rounding */
            continue;
        double mean = s.square / s.weight, deviation = sqrt(fmax(s.square2, 0.0)) / s.weight;
        if (deviation <= KNOWN * mean)
            return mean;
        most = fmax(mean, 0.0) + deviation;
    }
    return most;
}

void lum_error_map_settle(struct lum_error_map *map)
{
    size_t stride = (size_t)map->nx + 1;
    for (uint32_t y = 1; y <= map->ny; y++)
        for (uint32_t x = 1; x <= map->nx; x++) {
            struct lum_error_sums *s = &map->sums[y * stride + x];
            add_sums(s, &map->sums[(y - 1) * stride + x], 1.0);
            add_sums(s, &map->sums[y * stride + x - 1], 1.0);
            add_sums(s, &map->sums[(y - 1) * stride + x - 1], -1.0);
        }
    const struct lum_error_sums *all = &map->sums[map->ny * stride + map->nx];
    double dark = LUM_ERROR_DARK * all->light / all->pixels;
    for (uint32_t y = 0; y < map->ny; y++)
        for (uint32_t x = 0; x < map->nx; x++) {
            struct lum_error_sums near = around(map, x, y, windows[0]);
            double rms = sqrt(square_at(map, x, y)), light = fmax(near.light / near.pixels, dark);
            map->rms[(size_t)y * map->nx + x] = (float)rms;
            map->rel[(size_t)y * map->nx + x] = light > 0.0 ? (float)(rms / light) : NAN;
        }
}

/* Cell left of or above the place, and how far that is on the way to the next one, between their middles. */
static uint32_t cell_before(uint32_t pixel, uint32_t n, float *ret_part)
{
    float at = lum_clamp(((float)pixel + 0.5f) / (float)LUM_ERROR_CELL - 0.5f, 0.0f, (float)(n - 1));
    uint32_t i = (uint32_t)at;
    *ret_part = at - (float)i;
    return i;
}

float lum_error_map_at(const struct lum_error_map *map, const float *of, uint32_t x, uint32_t y)
{
    float u, v;
    uint32_t x0 = cell_before(x, map->nx, &u), y0 = cell_before(y, map->ny, &v);
    uint32_t x1 = x0 + (x0 + 1 < map->nx), y1 = y0 + (y0 + 1 < map->ny);
    const float *above = of + (size_t)y0 * map->nx, *below = of + (size_t)y1 * map->nx;
    float a = above[x0] + (above[x1] - above[x0]) * u, b = below[x0] + (below[x1] - below[x0]) * u;
    return a + (b - a) * v;
}

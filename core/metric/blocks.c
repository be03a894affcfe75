#include "core/metric/blocks.h"

#include <math.h>
#include <stdlib.h>

struct block {
    double x, r, variance; /* sums over its pixels; variance: of the sum r */
    uint32_t n;
};

/* ---- where they are ---- */

static uint32_t count_along(uint32_t size, uint32_t side)
{
    uint32_t n = (uint32_t)((2 * (uint64_t)size + side) / (2 * (uint64_t)side));
    return n ? n : 1;
}

struct lum_blocks_grid lum_blocks_grid(uint32_t w, uint32_t h)
{
    uint32_t side = (w + LUM_BLOCKS_ACROSS / 2) / LUM_BLOCKS_ACROSS;
    side = side ? side : 1;
    return (struct lum_blocks_grid){side, count_along(w, side), count_along(h, side)};
}

uint32_t lum_blocks_begin(const struct lum_blocks_grid *grid, uint32_t k, uint32_t n, uint32_t size)
{
    return k < n ? k * grid->side : size;
}

/* ---- sums ---- */

/* The pixel at step i of a walk to and fro over the rows, in which each is a neighbour of the one before. */
static size_t pixel_at(const struct lum_blocks_input *in, const uint32_t lo[2], const uint32_t hi[2], size_t i)
{
    uint32_t width = hi[0] - lo[0], row = (uint32_t)(i / width), column = (uint32_t)(i % width);
    return (size_t)(lo[1] + row) * in->w + (row % 2 ? hi[0] - 1 - column : lo[0] + column);
}

static bool pixel_is_finite(const struct lum_blocks_input *in, size_t at)
{
    return isfinite(in->x[at]) && isfinite(in->r[at]) &&
           (!in->r_halves[0] || (isfinite(in->r_halves[0][at]) && isfinite(in->r_halves[1][at])));
}

static double square(double v)
{
    return v * v;
}

/* Neighbours are paired along the walk; the last of an odd number again with the one before, which only adds. A single
 * pixel has no neighbour: nothing is known of its noise, and the variance is NAN. */
static void add_pixels(const struct lum_blocks_input *in, const uint32_t lo[2], const uint32_t hi[2], struct block *b)
{
    size_t n = (size_t)(hi[0] - lo[0]) * (hi[1] - lo[1]);
    double held = (double)NAN, before = (double)NAN; /* waits for its neighbour; the last one seen */
    for (size_t i = 0; i < n; i++) {
        size_t at = pixel_at(in, lo, hi, i);
        if (!pixel_is_finite(in, at))
            continue;
        double r = (double)in->r[at];
        b->n++;
        b->x += (double)in->x[at];
        b->r += r;
        if (in->r_halves[0]) {
            b->variance += 0.25 * square((double)in->r_halves[0][at] - (double)in->r_halves[1][at]);
        } else if (isnan(held)) {
            held = r;
        } else {
            b->variance += square(r - held);
            before = r;
            held = (double)NAN;
        }
    }
    if (!isnan(held))
        b->variance += square(held - before);
}

/* ---- what they say ---- */

static int compare_doubles(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

/* Of sorted values, n > 0; linear between ranks. */
static double quantile(const double *sorted, size_t n, double q)
{
    double at = q * (double)(n - 1);
    size_t i = (size_t)at;
    return i + 1 < n ? sorted[i] + (at - (double)i) * (sorted[i + 1] - sorted[i]) : sorted[n - 1];
}

static void summarise(double *ratios, double *errors, struct lum_blocks_result *result)
{
    size_t n = result->n_counted;
    qsort(ratios, n, sizeof *ratios, compare_doubles);
    result->lowest = ratios[0];
    result->p5 = quantile(ratios, n, 0.05);
    result->p25 = quantile(ratios, n, 0.25);
    result->median = quantile(ratios, n, 0.5);
    result->p75 = quantile(ratios, n, 0.75);
    result->p95 = quantile(ratios, n, 0.95);
    result->highest = ratios[n - 1];
    if (isnan(result->mean_stderr))
        return;
    qsort(errors, n, sizeof *errors, compare_doubles);
    result->stderr_median = quantile(errors, n, 0.5);
    result->stderr_p95 = quantile(errors, n, 0.95);
}

static struct block sum_blocks(const struct lum_blocks_input *in, const struct lum_blocks_grid *grid,
                               struct block *blocks)
{
    struct block all = {0};
    for (uint32_t j = 0; j < grid->ny; j++)
        for (uint32_t i = 0; i < grid->nx; i++) {
            struct block *b = &blocks[(size_t)j * grid->nx + i];
            uint32_t lo[2] = {lum_blocks_begin(grid, i, grid->nx, in->w), lum_blocks_begin(grid, j, grid->ny, in->h)};
            uint32_t hi[2] = {lum_blocks_begin(grid, i + 1, grid->nx, in->w),
                              lum_blocks_begin(grid, j + 1, grid->ny, in->h)};
            add_pixels(in, lo, hi, b);
            all.x += b->x;
            all.r += b->r;
            all.variance += b->variance;
            all.n += b->n;
        }
    return all;
}

enum lum_status lum_blocks_compare(const struct lum_blocks_input *in, double *ret_ratios,
                                   struct lum_blocks_result *ret_result, struct lum_error *err)
{
    const double none = (double)NAN;
    struct lum_blocks_grid grid = lum_blocks_grid(in->w, in->h);
    size_t n = (size_t)grid.nx * grid.ny;
    struct block *blocks = lum_calloc(n, sizeof *blocks);
    double *ratios = lum_calloc(2 * n, sizeof *ratios), *errors = ratios ? ratios + n : NULL;
    enum lum_status st = LUM_OK;
    if (!blocks || !ratios) {
        st = lum_fail(err, LUM_ERR_NOMEM, "", "no memory for %zu blocks", n);
        goto out;
    }
    struct block all = sum_blocks(in, &grid, blocks);
    *ret_result = (struct lum_blocks_result){
        grid, 0, 0, (size_t)in->w * in->h - all.n, none, none, none, none, none, none, none, none, none, none, none};
    for (size_t i = 0; i < n; i++) {
        const struct block *b = &blocks[i];
        bool counts = b->n > 0 && b->r / b->n > LUM_BLOCKS_DARK * (all.r / all.n);
        if (ret_ratios)
            ret_ratios[i] = counts ? b->x / b->r : none;
        if (!counts)
            continue;
        ratios[ret_result->n_counted] = b->x / b->r;
        errors[ret_result->n_counted++] = sqrt(b->variance) / b->r;
    }
    ret_result->n_dark = (uint32_t)n - ret_result->n_counted;
    if (ret_result->n_counted > 0) {
        ret_result->mean = all.x / all.r;
        ret_result->mean_stderr = sqrt(all.variance) / all.r;
        summarise(ratios, errors, ret_result);
    }
out:
    lum_free(blocks);
    lum_free(ratios);
    return st;
}

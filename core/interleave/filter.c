/* The discontinuity buffer and guided upsampling.
 *
 * The box filter works row by row on structures of arrays that the compiler vectorises: for each offset of the window,
 * all pixels of a row are tested against their neighbour there. Constant work, no branch: 13 ns a pixel
 * for a pattern of 3, 27 ns for one of 4 (Release, one core; interleave_test prints it). */
#include "core/interleave/interleave.h"

#include <math.h>
#include <stdlib.h>

static bool takes_part(const struct lum_filter *f, size_t at)
{
    return f->need == 0 || (f->guide->kind[at] & f->need);
}

/* ---- discontinuity buffer ---- */

#define BORDER_MAX LUM_FILTER_BORDER_MAX
#define STRIP LUM_CELL_SIDE /* pixels that are filtered at a time */
#define ROW_MAX (STRIP + 2u * BORDER_MAX)

/* A piece of a row of the picture, with the border on both sides. */
struct row {
    _Alignas(64) float px[ROW_MAX];
    float py[ROW_MAX], pz[ROW_MAX], nx[ROW_MAX], ny[ROW_MAX], nz[ROW_MAX], limit[ROW_MAX];
    float r[ROW_MAX], g[ROW_MAX], b[ROW_MAX];
};

struct strip {
    const struct lum_filter *f;
    uint32_t w, h;                       /* of the picture */
    uint32_t x, n;                       /* columns that are written */
    uint32_t border;                     /* columns and rows beside them that are read */
    struct row rows[2 * BORDER_MAX + 1]; /* a ring, by row number */
};

/* The pixel that stands for position at in 0 .. size - 1: beyond an edge the one of the same subset a period further
 * in. False when there is none. */
static bool inside(int64_t at, uint32_t size, uint32_t side, uint32_t *ret_at)
{
    if (at < 0)
        at += side;
    else if (at >= size)
        at -= side;
    if (at < 0 || at >= size)
        return false;
    *ret_at = (uint32_t)at;
    return true;
}

/* Fails every test, also against itself. */
static void set_absent(struct row *row, uint32_t i)
{
    row->px[i] = row->py[i] = row->pz[i] = row->nx[i] = row->ny[i] = row->nz[i] = row->limit[i] = 0.0f;
    row->r[i] = row->g[i] = row->b[i] = 0.0f;
}

/* The background: passes all tests against itself, and is too far away for any against a surface. */
static void set_background(struct row *row, uint32_t i)
{
    row->px[i] = 0x1p60f;
    row->nx[i] = 2.0f;
}

static void set_pixel(const struct strip *s, struct row *row, uint32_t i, uint32_t x, uint32_t y)
{
    const struct lum_filter *f = s->f;
    const struct lum_guide *g = f->guide;
    size_t at = (size_t)y * f->step * g->w + (size_t)x * f->step;
    set_absent(row, i);
    struct lum_rgb value = f->in[(size_t)y * s->w + x];
    row->r[i] = value.r;
    row->g[i] = value.g;
    row->b[i] = value.b;
    if (!takes_part(f, at))
        return;
    if (!(g->depth[at] < INFINITY)) {
        if (f->need == 0)
            set_background(row, i);
        return;
    }
    row->px[i] = g->p[at].x;
    row->py[i] = g->p[at].y;
    row->pz[i] = g->p[at].z;
    row->nx[i] = g->n[at].x;
    row->ny[i] = g->n[at].y;
    row->nz[i] = g->n[at].z;
    row->limit[i] = lum_guide_limit(g, at);
}

static struct row *row_at(struct strip *s, int64_t y)
{
    return &s->rows[(uint64_t)(y + (int64_t)s->border) % (2 * s->border + 1)];
}

static void load_row(struct strip *s, int64_t y)
{
    struct row *row = row_at(s, y);
    uint32_t at_y = 0, at_x = 0, side = s->f->side * s->f->apart;
    bool there = inside(y, s->h, side, &at_y);
    for (uint32_t i = 0; i < s->n + 2 * s->border; i++) {
        if (there && inside((int64_t)s->x + i - s->border, s->w, side, &at_x))
            set_pixel(s, row, i, at_x, at_y);
        else
            set_absent(row, i);
    }
}

struct sums {
    _Alignas(64) float weight[STRIP];
    float r[STRIP], g[STRIP], b[STRIP];
};

/* Adds to pixel i of the strip, which is a[i], its neighbour b[i], where both are on one surface. */
struct neighbour {
    const struct row *a, *b;
    size_t at_a, at_b; /* where pixel 0 lies in each */
    float weight;
};
static void add_neighbour(struct sums *restrict sums, const struct neighbour *nb, uint32_t n)
{
    const struct row *a = nb->a, *b = nb->b;
    float weight = nb->weight;
    for (size_t i = 0; i < n; i++) {
        size_t k = nb->at_a + i, l = nb->at_b + i;
        float nx = a->nx[k], ny = a->ny[k], nz = a->nz[k], mx = b->nx[l], my = b->ny[l], mz = b->nz[l];
        float cosine = nx * mx + ny * my + nz * mz;
        float off =
            (nx + mx) * (b->px[l] - a->px[k]) + (ny + my) * (b->py[l] - a->py[k]) + (nz + mz) * (b->pz[l] - a->pz[k]);
        bool same = (cosine > LUM_SAME_COS) & (fabsf(off) <= a->limit[k] + b->limit[l]);
        sums->weight[i] += same ? weight : 0.0f;
        sums->r[i] += same ? weight * b->r[l] : 0.0f;
        sums->g[i] += same ? weight * b->g[l] : 0.0f;
        sums->b[i] += same ? weight * b->b[l] : 0.0f;
    }
}

static void begin_sums(struct sums *sums, const struct row *row, uint32_t border, uint32_t n)
{
    for (uint32_t i = 0; i < n; i++) {
        sums->weight[i] = 1.0f;
        sums->r[i] = row->r[border + i];
        sums->g[i] = row->g[border + i];
        sums->b[i] = row->b[border + i];
    }
}

static void filter_row(struct strip *s, uint32_t y, struct lum_rgb *out)
{
    struct sums sums;
    const struct row *center = row_at(s, y);
    int border = (int)s->border, apart = (int)s->f->apart;
    bool even = s->f->side % 2 == 0;
    begin_sums(&sums, center, s->border, s->n);
    for (int dy = -border; dy <= border; dy += apart)
        for (int dx = -border; dx <= border; dx += apart) {
            if (dx == 0 && dy == 0)
                continue;
            float weight = (even && abs(dx) == border ? 0.5f : 1.0f) * (even && abs(dy) == border ? 0.5f : 1.0f);
            struct neighbour nb = {center, row_at(s, (int64_t)y + dy), s->border, (size_t)(border + dx), weight};
            add_neighbour(&sums, &nb, s->n);
        }
    for (uint32_t i = 0; i < s->n; i++)
        out[i] = lum_rgb(sums.r[i] / sums.weight[i], sums.g[i] / sums.weight[i], sums.b[i] / sums.weight[i]);
}

void lum_filter_box(const struct lum_filter *f, const struct lum_filter_rect *r, struct lum_rgb *out, size_t pitch)
{
    struct strip s = {.f = f, .border = f->side / 2 * f->apart};
    s.w = lum_filter_size(f->guide->w, f->step);
    s.h = lum_filter_size(f->guide->h, f->step);
    for (s.x = r->x; s.x < r->x + r->w; s.x += STRIP) {
        s.n = r->x + r->w - s.x < STRIP ? r->x + r->w - s.x : STRIP;
        for (int64_t y = (int64_t)r->y - s.border; y < (int64_t)r->y + s.border; y++)
            load_row(&s, y);
        for (uint32_t y = r->y; y < r->y + r->h; y++) {
            load_row(&s, (int64_t)y + s.border);
            filter_row(&s, y, out + (y - r->y) * pitch + (s.x - r->x));
        }
    }
}

/* ---- upsampling ---- */

/* The samples around a pixel that it takes from, and how much of each. */
struct taps {
    uint32_t n, x[4], y[4];
    float weight[4];
};

/* How much the surface at a tap is like that at a pixel. */
static float likeness(const struct lum_filter *f, size_t at, size_t tap)
{
    const struct lum_guide *g = f->guide;
    if (tap == at)
        return 1.0f;
    if (!takes_part(f, tap))
        return 0.0f;
    if (!f->lenient)
        return lum_guide_same_surface(g, at, tap) ? 1.0f : 0.0f;
    float cosine = lum_dot(g->n[at], g->n[tap]);
    float off = lum_dot(lum_v3_add(g->n[at], g->n[tap]), lum_v3_sub(g->p[tap], g->p[at])) /
                (lum_guide_limit(g, at) + lum_guide_limit(g, tap));
    float same = lum_guide_same_surface(g, at, tap) ? 1.0f : LUM_LENIENT_SHARE / (1.0f + off * off);
    return same * lum_max(cosine, 0.0f);
}

/* The samples around pixel (x, y), along one axis: from `at / step` up to this. */
static uint32_t last_tap(uint32_t at, uint32_t step, uint32_t low_size)
{
    uint32_t last = (at + step - 1) / step;
    return last < low_size ? last : low_size - 1;
}

/* Bilinear weight of sample (i, j) for pixel (x, y), times its likeness. */
static float tap_weight(const struct lum_filter *f, uint32_t x, uint32_t y, uint32_t i, uint32_t j)
{
    const struct lum_guide *g = f->guide;
    float per_step = 1.0f / (float)f->step;
    float dx = fabsf((float)x * per_step - (float)i), dy = fabsf((float)y * per_step - (float)j);
    size_t at = (size_t)y * g->w + x, tap = (size_t)j * f->step * g->w + (size_t)i * f->step;
    return (1.0f - dx) * (1.0f - dy) * likeness(f, at, tap);
}

static struct taps find_taps(const struct lum_filter *f, uint32_t x, uint32_t y)
{
    uint32_t right = last_tap(x, f->step, lum_filter_size(f->guide->w, f->step));
    uint32_t below = last_tap(y, f->step, lum_filter_size(f->guide->h, f->step));
    struct taps taps = {.n = 0};
    for (uint32_t j = y / f->step; j <= below; j++)
        for (uint32_t i = x / f->step; i <= right; i++) {
            float weight = tap_weight(f, x, y, i, j);
            if (!(weight > 0.0f))
                continue;
            taps.x[taps.n] = i;
            taps.y[taps.n] = j;
            taps.weight[taps.n++] = weight;
        }
    return taps;
}

uint8_t lum_upsample_taps(const struct lum_filter *f, uint32_t x, uint32_t y)
{
    uint32_t right = last_tap(x, f->step, lum_filter_size(f->guide->w, f->step));
    uint32_t below = last_tap(y, f->step, lum_filter_size(f->guide->h, f->step));
    uint32_t left = x / f->step, above = y / f->step, taps = 0;
    for (uint32_t j = above; j <= below; j++)
        for (uint32_t i = left; i <= right; i++)
            taps |= (uint32_t)(tap_weight(f, x, y, i, j) > 0.0f) << (2 * (j - above) + i - left);
    return (uint8_t)taps;
}

void lum_filter_by_taps(const struct lum_filter *f, const uint8_t *taps, const struct lum_filter_rect *r,
                        struct lum_rgb *out)
{
    static const float per_tap[] = {0.0f, 1.0f, 0.5f, 1.0f / 3.0f, 0.25f};
    size_t w = f->guide->w, low_w = lum_filter_size(f->guide->w, 2);
    for (uint32_t y = r->y; y < r->y + r->h; y++)
        for (uint32_t x = r->x; x < r->x + r->w; x++) {
            uint32_t t = taps[y * w + x];
            const struct lum_rgb *in = f->in + (y / 2) * low_w + x / 2;
            struct lum_rgb sum = lum_grey(0.0f);
            if (t == 0)
                continue;
            if (t & 1)
                sum = lum_rgb_add(sum, in[0]);
            if (t & 2)
                sum = lum_rgb_add(sum, in[1]);
            if (t & 4)
                sum = lum_rgb_add(sum, in[low_w]);
            if (t & 8)
                sum = lum_rgb_add(sum, in[low_w + 1]);
            out[y * w + x] = lum_rgb_scale(sum, per_tap[__builtin_popcount(t)]);
        }
}

#define LOW_MAX (LUM_CELL_SIDE / 2 + 1) /* samples that a cell lies between, a side */

void lum_filter_upsampled(const struct lum_filter *f, const struct lum_filter_rect *r, struct lum_rgb *out)
{
    const struct lum_guide *g = f->guide;
    struct lum_rgb low[LOW_MAX * LOW_MAX];
    struct lum_filter_rect l = {r->x / f->step, r->y / f->step, 0, 0};
    uint32_t to_x = (r->x + r->w) / f->step + 1, to_y = (r->y + r->h) / f->step + 1;
    uint32_t low_w = lum_filter_size(g->w, f->step), low_h = lum_filter_size(g->h, f->step);
    l.w = (to_x < low_w ? to_x : low_w) - l.x;
    l.h = (to_y < low_h ? to_y : low_h) - l.y;
    lum_filter_box(f, &l, low, LOW_MAX);
    for (uint32_t y = r->y; y < r->y + r->h; y++)
        for (uint32_t x = r->x; x < r->x + r->w; x++) {
            if (!takes_part(f, (size_t)y * g->w + x))
                continue;
            struct taps taps = find_taps(f, x, y);
            if (taps.n == 0)
                continue;
            struct lum_rgb sum = lum_grey(0.0f);
            float weight = 0.0f;
            for (uint32_t k = 0; k < taps.n; k++) {
                sum = lum_rgb_mad(sum, low[(taps.y[k] - l.y) * LOW_MAX + taps.x[k] - l.x], taps.weight[k]);
                weight += taps.weight[k];
            }
            out[(size_t)y * g->w + x] = lum_rgb_scale(sum, 1.0f / weight);
        }
}

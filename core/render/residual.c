#include "core/render/residual.h"

#include <string.h>

#define LEVELS LUM_RESIDUAL_LEVELS
#define ROWS 8u /* of a job */
#define LANES 8u

/* Filter steps over which the errors of levels, and the spread of samples, are averaged: 15 x 15 pixels and more. */
#define SMOOTH_STEPS 4u

/* Side of the squares over which outliers are shared out, pixels. */
#define SPREAD_SIDE 32u

/* Added to the albedo that residuals are divided by: what is not in proportion to it (gloss, mirrors, black surfaces).
 */
#define ALBEDO_FLOOR 0.05f

/* Of a half's residual only what is within so many robust deviations from the robust mean around is filtered. For
 * Gaussian noise that deviation, (mean sqrt |A - B|)^2, is 0.96 standard deviations of a half; noise of paths has long
 * tails. What is beyond, and in both halves alike, is a detail, and stays where it is; the rest is an outlier, and
 * shared out. */
#define OUTLIER 4.0f

/* Two halves are alike where they differ by less than one part in so many of their sum. */
#define ALIKE 5.0f

/* Noise counts so many times more than bias of the same square: the eye takes grain worse than a smooth error. */
#define GRAIN 4.0f

/* Errors below this share of the largest level's are all alike: the estimate is no better. */
#define ERROR_FLOOR 1e-3f

/* Below this, in squares of the picture's mean, there is none: a floor of it would be no number any more. */
#define ERROR_MIN 1e-30f

/* How far off a surface's plane a neighbour may lie, in pixels of it. */
#define PLANE_PIXELS 1.5f

/* Of what the frame shows at least this is left wherever a filtered residual is taken off. */
#define LEAST_SHARE 0.25f

/* How pixels lie in the scene, structure of arrays. */
enum {
    GUIDE_NX,
    GUIDE_NY,
    GUIDE_NZ,
    GUIDE_PX,
    GUIDE_PY,
    GUIDE_PZ,
    GUIDE_PER_TOLERANCE, /* 1 / (distance off the plane that still counts as the same surface, for neighbours) */
    GUIDE_KIND,          /* only the same kind is mixed; NAN: none is */
    GUIDES
};

/* Eight values filtered together. Of residuals: A times its weight, its weight, B likewise. */
struct lanes {
    _Alignas(32) float v[LANES];
};
enum { A = 0, B = 4, WEIGHT = 3 };
_Static_assert(LEVELS < LANES, "a lane for each level, and for none");

/* Over pixels, of luminance. */
struct sums {
    double error, square, mean; /* square: of what is added up as error */
    uint64_t nonfinite;
};

/* Of outliers what is shared out among the pixels of a square, and the sum of the portions that they get. */
struct square {
    struct lum_rgb rest, portions;
};

struct lum_residual_memory {
    uint32_t w, h, grid_w, grid_h;
    float *guide[GUIDES];
    struct lanes *first;     /* residuals as they are, but for outliers */
    struct lanes *from, *to; /* of a filter step */
    struct lanes *by_level;  /* errors of levels 0 to LEVELS, noise weighed; then the weights of these levels */
    struct lanes *blend;     /* residuals: levels by their weights */
    struct square *squares;  /* of a grid: outliers */
    struct sums *sums;       /* by row */
};

void lum_residual_finish(struct lum_residual_memory *m)
{
    if (!m)
        return;
    for (uint32_t k = 0; k < GUIDES; k++)
        lum_free(m->guide[k]);
    lum_free(m->first);
    lum_free(m->from);
    lum_free(m->to);
    lum_free(m->by_level);
    lum_free(m->blend);
    lum_free(m->squares);
    lum_free(m->sums);
    lum_free(m);
}

static bool allocate(struct lum_residual_memory *m)
{
    size_t n = (size_t)m->w * m->h;
    bool guided = true;
    for (uint32_t k = 0; k < GUIDES; k++)
        guided = (m->guide[k] = lum_calloc(n, sizeof *m->guide[k])) && guided;
    m->first = lum_calloc(n, sizeof *m->first);
    m->from = lum_calloc(n, sizeof *m->from);
    m->to = lum_calloc(n, sizeof *m->to);
    m->by_level = lum_calloc(n, sizeof *m->by_level);
    m->blend = lum_calloc(n, sizeof *m->blend);
    m->squares = lum_calloc((size_t)m->grid_w * m->grid_h, sizeof *m->squares);
    m->sums = lum_calloc(m->h, sizeof *m->sums);
    return guided && m->first && m->from && m->to && m->by_level && m->blend && m->squares && m->sums;
}

static enum lum_status reserve(struct lum_residual_memory **memory, uint32_t w, uint32_t h, struct lum_error *err)
{
    if (*memory && (*memory)->w == w && (*memory)->h == h)
        return LUM_OK;
    lum_residual_finish(*memory);
    struct lum_residual_memory *m = *memory = lum_calloc(1, sizeof *m);
    if (m) {
        *m = (struct lum_residual_memory){.w = w,
                                          .h = h,
                                          .grid_w = (w + SPREAD_SIDE - 1) / SPREAD_SIDE,
                                          .grid_h = (h + SPREAD_SIDE - 1) / SPREAD_SIDE};
        if (allocate(m))
            return LUM_OK;
    }
    lum_residual_finish(m);
    *memory = NULL;
    return lum_fail(err, LUM_ERR_NOMEM, "size", "out of memory to correct a picture of %u x %u", w, h);
}

/* ---- steps: each a parallel loop over rows ---- */

struct step {
    const struct lum_residual *r;
    struct lum_residual_memory *m;
    const struct lum_stage_runner *runner;
    void (*row)(const struct step *step, uint32_t y);
    uint32_t level; /* of a filter step: neighbours are 2^level pixels away */
    float scale; /* the picture's mean luminance: residuals are in units of it, so that no square of them overflows */
};

static void run_rows(void *ctx, uint32_t job, struct lum_counters *counters)
{
    const struct step *step = ctx;
    (void)counters;
    for (uint32_t y = job * ROWS; y < step->m->h && y < (job + 1) * ROWS; y++)
        step->row(step, y);
}

static enum lum_status run_step(struct step *step, void (*row)(const struct step *step, uint32_t y))
{
    step->row = row;
    return lum_stage_loop(step->runner, (step->m->h + ROWS - 1) / ROWS, run_rows, step);
}

/* ---- what there is ---- */

static void guide_row(const struct step *step, uint32_t y)
{
    const struct lum_surfaces *s = step->r->guide;
    step->m->sums[y] = (struct sums){0};
    for (uint32_t x = 0; x < step->m->w; x++)
        step->m->sums[y].mean += (double)lum_luminance(lum_film_mean(step->r->truth, x, y));
    for (size_t i = (size_t)y * step->m->w; i < (size_t)(y + 1) * step->m->w; i++) {
        float g[GUIDES] = {
            [GUIDE_NZ] = 1.0f, [GUIDE_KIND] = s ? -1.0f : (float)NAN}; /* the background is one surface */
        if (s && s->object[i] != LUM_NO_OBJECT && s->depth[i] > 0.0f && isfinite(s->depth[i])) {
            g[GUIDE_NX] = s->n[i].x, g[GUIDE_NY] = s->n[i].y, g[GUIDE_NZ] = s->n[i].z;
            g[GUIDE_PX] = s->p[i].x, g[GUIDE_PY] = s->p[i].y, g[GUIDE_PZ] = s->p[i].z;
            g[GUIDE_PER_TOLERANCE] = 1.0f / (PLANE_PIXELS * s->depth[i] * step->r->per_pixel + LUM_RAY_OFFSET);
            g[GUIDE_KIND] = (float)(s->kind[i] & (LUM_PIXEL_SURFACE | LUM_PIXEL_SPECULAR | LUM_PIXEL_SHINES));
        }
        for (uint32_t k = 0; k < GUIDES; k++)
            step->m->guide[k][i] = g[k];
    }
}

/* What residuals are divided by. */
static struct lum_rgb albedo_at(const struct step *step, size_t i)
{
    struct lum_rgb a = step->r->guide ? step->r->guide->albedo[i] : lum_grey(1.0f);
    return lum_rgb_scale(lum_rgb_add(a, lum_grey(ALBEDO_FLOOR)), step->scale);
}

static void put(struct lanes *l, uint32_t half, struct lum_rgb c, float weight)
{
    l->v[half] = c.r * weight;
    l->v[half + 1] = c.g * weight;
    l->v[half + 2] = c.b * weight;
    l->v[half + WEIGHT] = weight;
}

/* Black where no sample went in. */
static struct lum_rgb take(const struct lanes *l, uint32_t half)
{
    float w = l->v[half + WEIGHT], per = w > 0.0f ? 1.0f / w : 0.0f;
    return lum_rgb(l->v[half] * per, l->v[half + 1] * per, l->v[half + 2] * per);
}

static struct lum_rgb mean_of(const struct lanes *l)
{
    float w = l->v[A + WEIGHT] + l->v[B + WEIGHT], per = w > 0.0f ? 1.0f / w : 0.0f;
    return lum_rgb((l->v[A] + l->v[B]) * per, (l->v[A + 1] + l->v[B + 1]) * per, (l->v[A + 2] + l->v[B + 2]) * per);
}

static void put_residual(const struct step *step, size_t i, int half, struct lanes *l, uint32_t lane)
{
    const struct lum_film *film = step->r->truth;
    const double *s = &film->half[half][3 * i], n = (double)film->n[half][i];
    struct lum_rgb f = step->r->frame[i], a = albedo_at(step, i), d = lum_grey(0.0f);
    if (n > 0.0)
        d = lum_rgb((float)(s[0] / n - (double)f.r) / a.r, (float)(s[1] / n - (double)f.g) / a.g,
                    (float)(s[2] / n - (double)f.b) / a.b);
    put(l, lane, d, n > 0.0 ? 1.0f : 0.0f);
}

static float square_of(float x)
{
    return x * x;
}

/* These keep the sign. */
static float root_of(float x)
{
    return copysignf(sqrtf(fabsf(x)), x);
}

static float signed_square_of(float x)
{
    return x * fabsf(x);
}

/* To be smoothed: what robust means and deviations are made of. */
static void residual_row(const struct step *step, uint32_t y)
{
    struct lum_residual_memory *m = step->m;
    for (size_t i = (size_t)y * m->w; i < (size_t)(y + 1) * m->w; i++) {
        put_residual(step, i, 0, &m->first[i], A);
        put_residual(step, i, 1, &m->first[i], B);
        float a = lum_luminance(take(&m->first[i], A)), b = lum_luminance(take(&m->first[i], B));
        bool both = m->first[i].v[A + WEIGHT] > 0.0f && m->first[i].v[B + WEIGHT] > 0.0f;
        m->from[i] = (struct lanes){{0}};
        if (both)
            m->from[i] = (struct lanes){{1.0f, sqrtf(fabsf(a - b)), 0.5f * (root_of(a) + root_of(b))}};
    }
}

/* ---- the filter ---- */

#define RUN 64u /* pixels of a row that are filtered together */

/* How much of n pixels from o on goes into those from c on: same kind, same plane, same direction. */
static void compare(const struct lum_residual_memory *m, size_t c, size_t o, uint32_t n, float per_step,
                    float ret_weight[RUN])
{
    float *const *g = m->guide;
    const float *cn[3] = {g[0] + c, g[1] + c, g[2] + c}, *cp[3] = {g[3] + c, g[4] + c, g[5] + c};
    const float *on[3] = {g[0] + o, g[1] + o, g[2] + o}, *op[3] = {g[3] + o, g[4] + o, g[5] + o};
    const float *ct = g[GUIDE_PER_TOLERANCE] + c, *ot = g[GUIDE_PER_TOLERANCE] + o;
    const float *ck = g[GUIDE_KIND] + c, *ok = g[GUIDE_KIND] + o;
    for (uint32_t i = 0; i < n; i++) {
        float dx = op[0][i] - cp[0][i], dy = op[1][i] - cp[1][i], dz = op[2][i] - cp[2][i];
        float off = (dx * cn[0][i] + dy * cn[1][i] + dz * cn[2][i]) * ct[i] * per_step;
        float back = (dx * on[0][i] + dy * on[1][i] + dz * on[2][i]) * ot[i] * per_step;
        float flat = lum_max(1.0f - lum_max(off * off, back * back), 0.0f);
        float same = lum_max(cn[0][i] * on[0][i] + cn[1][i] * on[1][i] + cn[2][i] * on[2][i], 0.0f);
        same *= same;
        same *= same;
        same *= same;
        same *= same; /* cos^16 */
        ret_weight[i] = ck[i] == ok[i] ? flat * same : 0.0f;
    }
}

struct run {
    struct lanes sum[RUN];
    float weight[RUN];
};

/* Adds the pixels that are (dx, dy) away from n in row y, from x on. */
static void add_neighbours(const struct step *step, struct run *run, uint32_t x, uint32_t y, uint32_t n, int32_t dx,
                           int32_t dy)
{
    const struct lum_residual_memory *m = step->m;
    const int32_t d = (int32_t)(1u << step->level), ny = (int32_t)y + dy * d, shift = dx * d;
    int32_t from = (int32_t)x, to = (int32_t)(x + n); /* of those that have one in the picture */
    if (ny < 0 || ny >= (int32_t)m->h)
        return;
    from = from + shift < 0 ? -shift : from;
    to = to + shift > (int32_t)m->w ? (int32_t)m->w - shift : to;
    if (from >= to)
        return;
    size_t c = (size_t)y * m->w + (size_t)from, o = (size_t)ny * m->w + (size_t)(from + shift);
    uint32_t first = (uint32_t)from - x, count = (uint32_t)(to - from);
    float weight[RUN], kernel = (float)((2 - dx * dx) * (2 - dy * dy));
    compare(m, c, o, count, 1.0f / (float)d, weight);
    for (uint32_t i = 0; i < count; i++) {
        float w = kernel * weight[i];
        run->weight[first + i] += w;
        for (uint32_t k = 0; k < LANES; k++)
            run->sum[first + i].v[k] += w * m->from[o + i].v[k];
    }
}

/* From `from` to `to`, with neighbours 2^level pixels away: 1 2 1 both ways. */
static void filter_row(const struct step *step, uint32_t y)
{
    const struct lum_residual_memory *m = step->m;
    for (uint32_t x = 0; x < m->w; x += RUN) {
        struct run run;
        uint32_t n = m->w - x < RUN ? m->w - x : RUN;
        size_t row = (size_t)y * m->w + x;
        for (uint32_t i = 0; i < n; i++) {
            run.weight[i] = 4.0f;
            for (uint32_t k = 0; k < LANES; k++)
                run.sum[i].v[k] = 4.0f * m->from[row + i].v[k];
        }
        for (int32_t dy = -1; dy <= 1; dy++)
            for (int32_t dx = -1; dx <= 1; dx++)
                if (dx != 0 || dy != 0)
                    add_neighbours(step, &run, x, y, n, dx, dy);
        for (uint32_t i = 0; i < n; i++) {
            float per_all = 1.0f / run.weight[i];
            for (uint32_t k = 0; k < LANES; k++)
                m->to[row + i].v[k] = run.sum[i].v[k] * per_all;
        }
    }
}

static enum lum_status filter(struct step *step, uint32_t level)
{
    struct lum_residual_memory *m = step->m;
    step->level = level;
    enum lum_status status = run_step(step, filter_row);
    struct lanes *from = m->from;
    m->from = m->to;
    m->to = from;
    return status;
}

static enum lum_status smooth(struct step *step)
{
    enum lum_status status = LUM_OK;
    for (uint32_t k = 0; k < SMOOTH_STEPS && status == LUM_OK; k++)
        status = filter(step, k);
    return status;
}

/* ---- outliers ---- */

/* Within `range` of `middle`. */
static void limit_half(struct lanes *l, uint32_t half, float middle, float range)
{
    struct lum_rgb c = take(l, half);
    float y = lum_luminance(c), goal = lum_clamp(y, middle - range, middle + range);
    if (goal == y)
        return;
    c = fabsf(goal) < fabsf(y) ? lum_rgb_scale(c, goal / y) : lum_rgb_add(c, lum_grey(goal - y));
    put(l, half, c, l->v[half + WEIGHT]);
}

/* What is beyond the limits at a pixel, mean of the halves, as light: detail that both show, and the rest. */
struct beyond {
    struct lum_rgb detail, rest;
    float alike; /* share of the detail */
    float apart; /* half the difference of the halves, luminance */
    float both;  /* and their product: the square of their mean, but for noise */
};

static struct beyond beyond_at(const struct step *step, size_t i)
{
    const struct lanes *kept = &step->m->first[i];
    struct lanes whole;
    put_residual(step, i, 0, &whole, A);
    put_residual(step, i, 1, &whole, B);
    struct lum_rgb albedo = albedo_at(step, i);
    struct lum_rgb a = lum_rgb_mul(lum_rgb_mad(take(&whole, A), take(kept, A), -1.0f), albedo);
    struct lum_rgb b = lum_rgb_mul(lum_rgb_mad(take(&whole, B), take(kept, B), -1.0f), albedo);
    struct lum_rgb mean = lum_rgb_scale(lum_rgb_add(a, b), 0.5f);
    float ya = lum_luminance(a), yb = lum_luminance(b), sum = fabsf(ya) + fabsf(yb);
    float alike = sum > 0.0f ? lum_max(1.0f - ALIKE * fabsf(ya - yb) / sum, 0.0f) : 0.0f;
    if (step->r->truth->n[0][i] < 2) /* two samples may be so by chance */
        alike = 0.0f;
    return (struct beyond){lum_rgb_scale(mean, alike), lum_rgb_scale(mean, 1.0f - alike), alike, 0.5f * (ya - yb),
                           ya * yb};
}

/* How much of what is shared out a pixel gets, over its neighbours: none where there is nothing that reflects. */
static struct lum_rgb portion(const struct step *step, size_t i)
{
    bool reflects = step->r->guide && step->r->guide->kind[i] & LUM_PIXEL_SURFACE;
    return reflects ? lum_rgb_scale(albedo_at(step, i), 1.0f / step->scale) : lum_grey(0.0f);
}

static void add_to(double sum[3], struct lum_rgb c)
{
    sum[0] += (double)c.r;
    sum[1] += (double)c.g;
    sum[2] += (double)c.b;
}

/* At the edge of an object: a sample sees it or what is behind, which is no outlier of what others reflect. What is
 * beyond the limits there is left out of what is shared. */
static bool is_at_edge(const struct step *step, uint32_t x, uint32_t y)
{
    const uint32_t *object = step->r->guide ? step->r->guide->object : NULL;
    uint32_t w = step->m->w, h = step->m->h;
    for (uint32_t ny = y > 0 ? y - 1 : 0; object && ny <= y + 1 && ny < h; ny++)
        for (uint32_t nx = x > 0 ? x - 1 : 0; nx <= x + 1 && nx < w; nx++)
            if (object[(size_t)ny * w + nx] != object[(size_t)y * w + x])
                return true;
    return false;
}

/* Limits the pixels of a square of the grid; sums what is shared out, and portions. */
static struct square limit_square(const struct step *step, uint32_t x0, uint32_t y0)
{
    struct lum_residual_memory *m = step->m;
    double rests[3] = {0}, portions[3] = {0};
    for (uint32_t y = y0; y < m->h && y < y0 + SPREAD_SIDE; y++)
        for (uint32_t x = x0; x < m->w && x < x0 + SPREAD_SIDE; x++) {
            size_t i = (size_t)y * m->w + x;
            const float *robust = m->from[i].v;
            float per = robust[0] > 0.0f ? 1.0f / robust[0] : 0.0f;
            float middle = signed_square_of(robust[2] * per), range = OUTLIER * square_of(robust[1] * per);
            limit_half(&m->first[i], A, middle, range);
            limit_half(&m->first[i], B, middle, range);
            if (!is_at_edge(step, x, y))
                add_to(rests, beyond_at(step, i).rest);
            add_to(portions, portion(step, i));
        }
    return (struct square){lum_rgb((float)rests[0], (float)rests[1], (float)rests[2]),
                           lum_rgb((float)portions[0], (float)portions[1], (float)portions[2])};
}

static void limit_job(void *ctx, uint32_t job, struct lum_counters *counters)
{
    const struct step *step = ctx;
    struct lum_residual_memory *m = step->m;
    (void)counters;
    m->squares[job] = limit_square(step, job % m->grid_w * SPREAD_SIDE, job / m->grid_w * SPREAD_SIDE);
}

static struct square mix(struct square a, struct square b, float t)
{
    return (struct square){lum_rgb_mad(lum_rgb_scale(a.rest, 1.0f - t), b.rest, t),
                           lum_rgb_mad(lum_rgb_scale(a.portions, 1.0f - t), b.portions, t)};
}

/* Of what is shared out what the pixel gets. Bilinear between the middles of squares. */
static struct lum_rgb share_at(const struct step *step, uint32_t x, uint32_t y)
{
    const struct lum_residual_memory *m = step->m;
    float fx = lum_clamp(((float)x + 0.5f) / (float)SPREAD_SIDE - 0.5f, 0.0f, (float)(m->grid_w - 1));
    float fy = lum_clamp(((float)y + 0.5f) / (float)SPREAD_SIDE - 0.5f, 0.0f, (float)(m->grid_h - 1));
    uint32_t x0 = (uint32_t)fx, x1 = x0 + 1 < m->grid_w ? x0 + 1 : x0, y0 = (uint32_t)fy;
    const struct square *top = m->squares + (size_t)y0 * m->grid_w, *low = y0 + 1 < m->grid_h ? top + m->grid_w : top;
    float u = fx - (float)x0, v = fy - (float)y0;
    struct square s = mix(mix(top[x0], top[x1], u), mix(low[x0], low[x1], u), v);
    struct lum_rgb part = portion(step, (size_t)y * m->w + x);
    if (!(lum_rgb_max(part) > 0.0f)) /* else all are, of it and of the sums that it is in */
        return lum_grey(0.0f);
    return lum_rgb(s.rest.r * part.r / s.portions.r, s.rest.g * part.g / s.portions.g,
                   s.rest.b * part.b / s.portions.b);
}

/* ---- levels ---- */

/* Of a residual `now` against the unfiltered ones: squared error and the part of it that is noise (residual.h). */
static void measure(const struct lanes *first, const struct lanes *now, float *ret_error, float *ret_noise)
{
    float a0 = lum_luminance(take(first, A)), b0 = lum_luminance(take(first, B));
    float a = lum_luminance(take(now, A)), b = lum_luminance(take(now, B));
    *ret_noise = 0.25f * square_of(a - b);
    *ret_error = 0.5f * (square_of(a - b0) + square_of(b - a0)) - 0.5f * square_of(a0 - b0) - *ret_noise;
}

static const struct lanes *of_level(const struct step *step, size_t i)
{
    return step->level > 0 ? &step->m->from[i] : &step->m->first[i];
}

static void error_row(const struct step *step, uint32_t y)
{
    struct lum_residual_memory *m = step->m;
    for (size_t i = (size_t)y * m->w; i < (size_t)(y + 1) * m->w; i++) {
        float error, noise;
        measure(&m->first[i], of_level(step, i), &error, &noise);
        m->by_level[i].v[step->level] = error + (GRAIN - 1.0f) * noise;
    }
}

/* The less error, the more weight: its cube. */
static void weight_row(const struct step *step, uint32_t y)
{
    struct lum_residual_memory *m = step->m;
    for (size_t i = (size_t)y * m->w; i < (size_t)(y + 1) * m->w; i++) {
        const float *error = m->from[i].v;
        float *weight = m->by_level[i].v, most = 0.0f, least = INFINITY, sum = 0.0f;
        for (uint32_t k = 0; k <= LEVELS; k++)
            most = lum_max(most, error[k]);
        most = most > ERROR_MIN ? most : 0.0f;
        for (uint32_t k = 0; k <= LEVELS; k++)
            least = lum_min(least, lum_max(error[k], ERROR_FLOOR * most));
        for (uint32_t k = 0; k <= LEVELS; k++) {
            float ratio = most > 0.0f ? least / lum_max(error[k], ERROR_FLOOR * most) : 1.0f;
            sum += weight[k] = ratio * ratio * ratio;
        }
        for (uint32_t k = 0; k <= LEVELS; k++)
            weight[k] /= sum;
        m->blend[i] = (struct lanes){{0}};
    }
}

static void add_half(struct lanes *sum, const struct lanes *now, uint32_t half, float weight)
{
    struct lum_rgb c = take(now, half);
    sum->v[half] += c.r * weight;
    sum->v[half + 1] += c.g * weight;
    sum->v[half + 2] += c.b * weight;
    sum->v[half + WEIGHT] += weight;
}

static void blend_row(const struct step *step, uint32_t y)
{
    struct lum_residual_memory *m = step->m;
    for (size_t i = (size_t)y * m->w; i < (size_t)(y + 1) * m->w; i++) {
        const struct lanes *now = of_level(step, i);
        add_half(&m->blend[i], now, A, m->by_level[i].v[step->level]);
        add_half(&m->blend[i], now, B, m->by_level[i].v[step->level]);
    }
}

/* Rows of level 0, and of the others as the filter gets there. */
static enum lum_status run_levels(struct step *step, void (*row)(const struct step *step, uint32_t y))
{
    struct lum_residual_memory *m = step->m;
    step->level = 0;
    enum lum_status status = run_step(step, row);
    memcpy(m->from, m->first, (size_t)m->w * m->h * sizeof *m->from);
    for (uint32_t k = 1; k <= LEVELS && status == LUM_OK; k++) {
        status = filter(step, k - 1);
        step->level = k;
        if (status == LUM_OK)
            status = run_step(step, row);
    }
    return status;
}

/* ---- the picture ---- */

static struct lum_rgb picture_at(const struct step *step, uint32_t x, uint32_t y, struct sums *inout_sums)
{
    const struct lum_residual_memory *m = step->m;
    size_t i = (size_t)y * m->w + x;
    struct lum_rgb frame = step->r->frame[i], albedo = albedo_at(step, i);
    struct beyond beyond = beyond_at(step, i);
    float own = m->by_level[i].v[0], least = LEAST_SHARE * (1.0f - own), error, noise;
    struct lum_rgb spread =
        lum_rgb_scale(share_at(step, x, y), 1.0f - own); /* unfiltered samples have their outliers */
    struct lum_rgb c = lum_rgb_add(frame, lum_rgb_mul(mean_of(&m->blend[i]), albedo));
    c = lum_rgb_mad(lum_rgb_add(lum_rgb_add(c, beyond.detail), spread), beyond.rest, own);
    c = lum_rgb(lum_max(c.r, least * frame.r), lum_max(c.g, least * frame.g), lum_max(c.b, least * frame.b));
    measure(&m->first[i], &m->blend[i], &error, &noise);
    float scale = square_of(lum_luminance(albedo));
    double grain = (double)square_of(beyond.apart * (beyond.alike + own * (1.0f - beyond.alike)));
    float left_out = (1.0f - beyond.alike) * (1.0f - own); /* of what is beyond the limits, but for what is shared */
    double off = (double)(error * scale) + grain + (double)square_of(lum_luminance(spread)) +
                 (double)(beyond.both * left_out * left_out);
    inout_sums->error += off;
    inout_sums->square += off * off;
    inout_sums->mean += (double)lum_luminance(c);
    return c;
}

static void picture_row(const struct step *step, uint32_t y)
{
    struct sums sums = {0};
    for (uint32_t x = 0; x < step->m->w; x++)
        lum_film_set(step->r->picture, x, y, picture_at(step, x, y, &sums), &sums.nonfinite);
    step->m->sums[y] = sums;
}

static void add_up(struct lum_residual *r, const struct lum_residual_memory *m)
{
    struct sums all = {0};
    for (uint32_t y = 0; y < m->h; y++) {
        all.error += m->sums[y].error;
        all.square += m->sums[y].square;
        all.mean += m->sums[y].mean;
        all.nonfinite += m->sums[y].nonfinite;
    }
    r->error = all.error;
    r->doubt = sqrt(all.square);
    r->mean = all.mean;
    r->nonfinite = all.nonfinite;
}

enum lum_status lum_residual_apply(struct lum_residual *r, struct lum_residual_memory **memory,
                                   const struct lum_stage_runner *runner, struct lum_error *err)
{
    enum lum_status status = reserve(memory, r->truth->w, r->truth->h, err);
    if (status != LUM_OK)
        return status;
    struct lum_residual_memory *m = *memory;
    struct step step = {.r = r, .m = m, .runner = runner, .scale = 1.0f};
    status = run_step(&step, guide_row);
    if (status == LUM_OK) {
        add_up(r, m);
        double mean = r->mean / ((double)m->w * m->h);
        step.scale = mean > 0.0 ? (float)mean : 1.0f;
        status = run_step(&step, residual_row);
    }
    if (status == LUM_OK)
        status = smooth(&step);
    if (status == LUM_OK)
        status = lum_stage_loop(runner, m->grid_w * m->grid_h, limit_job, &step);
    if (status == LUM_OK)
        status = run_levels(&step, error_row);
    if (status != LUM_OK)
        return status;
    memcpy(m->from, m->by_level, (size_t)m->w * m->h * sizeof *m->from);
    status = smooth(&step);
    if (status == LUM_OK)
        status = run_step(&step, weight_row);
    if (status == LUM_OK)
        status = run_levels(&step, blend_row);
    if (status == LUM_OK)
        status = run_step(&step, picture_row);
    if (status == LUM_OK)
        add_up(r, m);
    return status;
}

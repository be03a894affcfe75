#include "core/render/residual_steps.h"

#include <string.h>

#include "core/effect/antialias/antialias.h"
#include "core/render/outliers.h"
#include "core/render/residual_lanes.h"

#define ROWS 8u /* of a job */
/* Filter steps over which the errors of levels, and the spread of samples, are averaged: 15 x 15 pixels and more. */
#define SMOOTH_STEPS 4u

/* Noise counts so many times more than bias of the same block while errors are known from few samples, whose tails are
 * long: which level is best is luck then, and grain shows more than what is smoothly wrong. GRAIN_SPP over the number
 * of samples, at most GRAIN; from GRAIN_SPP on a pixel takes the least error that the estimates know of, and is no
 * worse than its samples. (SMAPE of `conference`, 150 x 100, after 1, 4, 8, 32 samples, if noise counts 4 times: .0600,
 * .0518, .0469, .0353; twice: .0621, .0516, .0457, .0331; once: .0651, .0522, .0453, .0319.) */
#define GRAIN 4.0f
#define GRAIN_SPP 8.0f

/* Levels of a pixel are chosen by its neighbours' errors, not by its own: else the error that is stated would be the
 * least of several that are wrong by chance, a half to all of the true one too small. This share of its own counts, for
 * where it has no neighbour. */
#define ALONE 1e-3f
#define CENTRE 4.0f /* of the filter: a pixel's own weight */

/* Errors below this share of the unfiltered samples' are all alike: the estimate is no better. */
#define ERROR_FLOOR 1e-3f
#define ERROR_LEAST 1e-9f /* and below this of the largest level's: rounding */

/* Below this, in squares of the picture's mean, there is none: a floor of it would be no number any more. */
#define ERROR_MIN 1e-30f

/* A neighbour's sample is taken for a pixel's own from this weight of the filter on. */
#define BESIDE_ALIKE 0.5f

/* How far off a surface's plane a neighbour may lie, in pixels of it. */
#define PLANE_PIXELS 1.5f

/* Of what the frame shows, or the samples if that is less, at least this is left wherever a filtered residual is taken
 * off. */
#define LEAST_SHARE 0.25f

void lum_residual_finish(struct lum_residual_memory *m)
{
    if (!m)
        return;
    for (uint32_t k = 0; k < GUIDES; k++)
        lum_free(m->guide[k]);
    lum_free(m->first);
    lum_free(m->from);
    lum_free(m->to);
    lum_free(m->own);
    lum_free(m->by_level);
    lum_free(m->blend);
    lum_free(m->blocks);
    lum_free(m->rates);
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
    m->own = lum_calloc(n, sizeof *m->own);
    m->by_level = lum_calloc(n, sizeof *m->by_level);
    m->blend = lum_calloc(n, sizeof *m->blend);
    m->blocks = lum_calloc((size_t)m->grid_w * m->grid_h, sizeof *m->blocks);
    m->rates = lum_calloc((size_t)(m->grid_w + 1) * (m->grid_h + 1) * CLASSES, sizeof *m->rates);
    m->sums = lum_calloc((size_t)m->grid_w * m->grid_h, sizeof *m->sums);
    return guided && m->first && m->from && m->to && m->own && m->by_level && m->blend && m->blocks && m->rates &&
           m->sums;
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
    for (size_t i = (size_t)y * step->m->w; i < (size_t)(y + 1) * step->m->w; i++) {
        float g[GUIDES] = {[GUIDE_NZ] = 1.0f, [GUIDE_KIND] = -1.0f}; /* the background is one surface */
        if (s->object[i] != LUM_NO_OBJECT && s->depth[i] > 0.0f && isfinite(s->depth[i])) {
            g[GUIDE_NX] = s->n[i].x, g[GUIDE_NY] = s->n[i].y, g[GUIDE_NZ] = s->n[i].z;
            g[GUIDE_PX] = s->p[i].x, g[GUIDE_PY] = s->p[i].y, g[GUIDE_PZ] = s->p[i].z;
            g[GUIDE_PER_TOLERANCE] = 1.0f / (PLANE_PIXELS * s->depth[i] * step->r->per_pixel + LUM_RAY_OFFSET);
            g[GUIDE_KIND] =
                (float)(s->kind[i] & (LUM_PIXEL_SURFACE | LUM_PIXEL_SPECULAR | LUM_PIXEL_SHEET | LUM_PIXEL_SHINES));
        }
        g[GUIDE_LIT] = lum_outliers_class(step, i);
        for (uint32_t k = 0; k < GUIDES; k++)
            step->m->guide[k][i] = g[k];
    }
}

#define RUN 64u /* pixels of a row that are filtered together */

/* How much of n pixels from o on goes into those from c on: same kind, same plane, same direction, lit alike. per_step:
 * 1 / (how far away they are); per_class: 1, or 0 if they need not be lit alike. */
static void compare(const struct lum_residual_memory *m, size_t c, size_t o, uint32_t n, float per_step,
                    float per_class, float ret_weight[RUN])
{
    float *const *g = m->guide;
    const float *cn[3] = {g[0] + c, g[1] + c, g[2] + c}, *cp[3] = {g[3] + c, g[4] + c, g[5] + c};
    const float *on[3] = {g[0] + o, g[1] + o, g[2] + o}, *op[3] = {g[3] + o, g[4] + o, g[5] + o};
    const float *ct = g[GUIDE_PER_TOLERANCE] + c, *ot = g[GUIDE_PER_TOLERANCE] + o;
    const float *ck = g[GUIDE_KIND] + c, *ok = g[GUIDE_KIND] + o;
    const float *cl = g[GUIDE_LIT] + c, *ol = g[GUIDE_LIT] + o;
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
        float classes = (ol[i] - cl[i]) * per_class, lit = lum_max(1.0f - classes * classes, 0.0f);
        ret_weight[i] = ck[i] == ok[i] ? flat * same * lit : 0.0f;
    }
}

/* Whose sample a half takes: the pixel's own; after one sample in all, of one of the halves that of its neighbour. */
static size_t source_of(const struct step *step, size_t i, int half)
{
    const uint32_t *n = step->r->truth->n[half];
    size_t x = i % step->m->w, beside = x % 2 ? i - 1 : i + 1;
    float alike[RUN];
    if (n[i] > 0 || (x ^ 1) >= step->m->w || n[beside] == 0)
        return i;
    compare(step->m, i, beside, 1, 1.0f, 1.0f, alike);
    return alike[0] > BESIDE_ALIKE ? beside : i;
}

struct lum_rgb lum_residual_put(const struct step *step, size_t pixel, int half, struct lanes *l, uint32_t lane)
{
    const struct lum_film *film = step->r->truth;
    const size_t i = source_of(step, pixel, half);
    const double *s = &film->half[half][3 * i], n = (double)film->n[half][i];
    struct lum_rgb a = half_albedo(step, i, half);
    if (!(n > 0.0)) {
        put(l, lane, lum_grey(0.0f), lum_grey(0.0f));
        return lum_grey(0.0f);
    }
    struct lum_rgb f = lum_residual_painted(step, i, a);
    struct lum_rgb d = lum_rgb((float)(s[0] / n - (double)f.r) / a.r, (float)(s[1] / n - (double)f.g) / a.g,
                               (float)(s[2] / n - (double)f.b) / a.b);
    /* By albedo: means are then sums of light over sums of albedo, which no light is lost or found by where the albedo
     * of a texture's pixel is not that of its samples. Means of ratios are too large. */
    put(l, lane, d, lum_rgb_scale(a, 1.0f / step->scale));
    return lum_rgb((float)(s[0] / n), (float)(s[1] / n), (float)(s[2] / n));
}

/* Keeps the sign. */
static float root_of(float x)
{
    return copysignf(sqrtf(fabsf(x)), x);
}

/* To be smoothed: what robust means and deviations are made of. */
static void residual_row(const struct step *step, uint32_t y)
{
    struct lum_residual_memory *m = step->m;
    for (size_t i = (size_t)y * m->w; i < (size_t)(y + 1) * m->w; i++) {
        lum_residual_put(step, i, 0, &m->first[i], A);
        lum_residual_put(step, i, 1, &m->first[i], B);
        float a = lum_luminance(take(&m->first[i], A)), b = lum_luminance(take(&m->first[i], B));
        m->from[i] = (struct lanes){{0}};
        if (in_both(&m->first[i]))
            m->from[i] = (struct lanes){{1.0f, sqrtf(fabsf(a - b)), 0.5f * (root_of(a) + root_of(b))}};
    }
}

/* ---- the filter ---- */

/* Pixels 2^level away from those of a run, all in the same direction. */
struct neighbours {
    size_t row;    /* the first pixel of theirs */
    int32_t shift; /* columns; beyond the picture's edge the weight is 0 */
    float weight[RUN];
};

/* Of n pixels from (x, y) on, in up to 8 directions; returns how many. */
static uint32_t find_neighbours(const struct step *step, uint32_t x, uint32_t y, uint32_t n, struct neighbours ret[8])
{
    const struct lum_residual_memory *m = step->m;
    const int32_t d = (int32_t)(1u << step->level), w = (int32_t)m->w;
    uint32_t found = 0;
    for (int32_t k = 0; k < 9; k++) {
        int32_t dx = k % 3 - 1, dy = k / 3 - 1, ny = (int32_t)y + dy * d, shift = dx * d;
        int32_t from = (int32_t)x, to = (int32_t)(x + n); /* of those that have one in the picture */
        from = from + shift < 0 ? -shift : from;
        to = to + shift > w ? w - shift : to;
        if (k == 4 || ny < 0 || ny >= (int32_t)m->h || from >= to)
            continue;
        struct neighbours *near = &ret[found++];
        float kernel = (float)((2 - dx * dx) * (2 - dy * dy));
        near->row = (size_t)ny * m->w;
        near->shift = shift;
        memset(near->weight, 0, sizeof near->weight);
        compare(m, (size_t)y * m->w + (size_t)from, near->row + (size_t)(from + shift), (uint32_t)(to - from),
                1.0f / (float)d, step->per_class, near->weight + ((uint32_t)from - x));
        for (uint32_t i = 0; i < RUN; i++)
            near->weight[i] *= kernel;
    }
    return found;
}

/* From `in` to `to`, with neighbours 2^level pixels away: 1 2 1 both ways. */
static void filter_row(const struct step *step, uint32_t y)
{
    const struct lum_residual_memory *m = step->m;
    const int32_t last = (int32_t)m->w - 1;
    struct neighbours near[8];
    for (uint32_t x = 0; x < m->w; x += RUN) {
        uint32_t n = m->w - x < RUN ? m->w - x : RUN, n_near = find_neighbours(step, x, y, n, near);
        size_t row = (size_t)y * m->w + x;
        for (uint32_t i = 0; i < n; i++) {
            struct lanes sum = step->in[row + i];
            float all = CENTRE;
            for (uint32_t k = 0; k < LANES; k++)
                sum.v[k] *= CENTRE;
            for (uint32_t j = 0; j < n_near; j++) {
                int32_t at = (int32_t)(x + i) + near[j].shift;
                const struct lanes *in = step->in + near[j].row + (size_t)(at < 0 ? 0 : at > last ? last : at);
                float weight = near[j].weight[i];
                all += weight;
                for (uint32_t k = 0; k < LANES; k++)
                    sum.v[k] += weight * in->v[k];
            }
            for (uint32_t k = 0; k < LANES; k++)
                m->to[row + i].v[k] = sum.v[k] / all;
            m->own[row + i] *= CENTRE / all;
        }
    }
}

/* Of `in`; makes m->from. */
static enum lum_status filter(struct step *step, const struct lanes *in, uint32_t level)
{
    struct lum_residual_memory *m = step->m;
    step->in = in;
    step->level = level;
    enum lum_status status = run_step(step, filter_row);
    struct lanes *from = m->from;
    m->from = m->to;
    m->to = from;
    return status;
}

/* Along surfaces, however they are lit: what the noise around is, and which levels are right. */
static enum lum_status smooth(struct step *step, const struct lanes *in)
{
    step->per_class = 0.0f;
    enum lum_status status = filter(step, in, 0);
    for (uint32_t k = 1; k < SMOOTH_STEPS && status == LUM_OK; k++)
        status = filter(step, step->m->from, k);
    return status;
}

/* ---- levels ---- */

/* Of values of the two halves against the unfiltered ones: squared error of their mean and the part of it that is noise
 * (residual.h). */
static void measure(float a0, float b0, float a, float b, float *ret_error, float *ret_noise)
{
    *ret_noise = 0.25f * square_of(a - b);
    *ret_error = 0.5f * (square_of(a - b0) + square_of(b - a0)) - 0.5f * square_of(a0 - b0) - *ret_noise;
}

/* Where the frame was smoothed at an edge a pixel shows several surfaces, and gets of the filtered residual of each as
 * much as of its light: that of one alone would be a row of pixels too bright or too dark along the edge. */
static struct lanes of_level(const struct step *step, size_t i)
{
    const struct lanes *from = step->m->from;
    const uint32_t neighbours = step->r->neighbours ? step->r->neighbours[i] : LUM_NEIGHBOURS_SELF;
    if (step->level == 0 || neighbours == LUM_NEIGHBOURS_SELF)
        return step->level > 0 ? from[i] : step->m->first[i];
    struct lum_rgb a = lum_grey(0.0f), b = a, per = lum_rgb_scale(lum_residual_albedo(step, i), (float)LUM_EDGE_RAYS);
    struct lanes mixed;
    for (uint32_t k = 0; k < LUM_EDGE_RAYS; k++) {
        size_t at = lum_edge_neighbour(neighbours, k, i, step->m->w);
        struct lum_rgb albedo = lum_residual_albedo(step, at);
        a = lum_rgb_add(a, lum_rgb_mul(take(&from[at], A), albedo));
        b = lum_rgb_add(b, lum_rgb_mul(take(&from[at], B), albedo));
    }
    put(&mixed, A, lum_rgb_div(a, per), lum_grey(1.0f));
    put(&mixed, B, lum_rgb_div(b, per), lum_grey(1.0f));
    return mixed;
}

static float grain_of(const struct step *step, size_t i)
{
    const struct lum_film *film = step->r->truth;
    return lum_clamp(GRAIN_SPP / lum_max((float)(film->n[0][i] + film->n[1][i]), 1.0f), 1.0f, GRAIN);
}

/* The frame as it is lacks the widest level's residual, and what is shared out; a pixel's own samples have its
 * outliers. now: the halves at the widest level, error: without their noise. */
static void count_outliers(const struct step *step, size_t i, const float now[2], float error, float errors[CHOICES])
{
    struct sampled s = lum_outliers_at(step, (uint32_t)(i % step->m->w), (uint32_t)(i / step->m->w));
    struct lum_rgb albedo = lum_residual_albedo(step, i);
    float share = lum_luminance(lum_rgb_div(s.share, albedo));
    if (!s.at_edge && (step->r->guide->kind[i] & LUM_PIXEL_SURFACE))
        errors[0] += grain_of(step, i) * square_of((1.0f - s.part) * s.beyond_apart / lum_luminance(albedo));
    errors[NONE] = error + (now[0] + share) * (now[1] + share);
}

static void error_row(const struct step *step, uint32_t y)
{
    struct lum_residual_memory *m = step->m;
    for (size_t i = (size_t)y * m->w; i < (size_t)(y + 1) * m->w; i++) {
        const struct lanes *first = &m->first[i], now = of_level(step, i);
        float *errors = m->by_level[i].v, error = 0.0f, noise = 0.0f; /* else the pixels around decide */
        const float halves[2] = {lum_luminance(take(&now, A)), lum_luminance(take(&now, B))};
        if (in_both(first))
            measure(lum_luminance(take(first, A)), lum_luminance(take(first, B)), halves[0], halves[1], &error, &noise);
        errors[step->level] = error + (grain_of(step, i) - 1.0f) * noise;
        m->own[i] = 1.0f; /* before they are smoothed */
        if (step->level == LEVELS) {
            errors[NONE] = 0.0f;
            if (in_both(first))
                count_outliers(step, i, halves, error - noise, errors);
        }
    }
}

/* The less error, the more weight: its cube. The frame stays where nothing is known. Errors are measured through the
 * noise of the unfiltered samples, so of that a part is the least that counts. Were it a part of the frame's error,
 * which stays, a picture of many samples would take levels that are wrong by as much, and become worse again. */
static void weigh(const float error[CHOICES], float ret_weight[CHOICES])
{
    float most = 0.0f, least = INFINITY, sum = 0.0f;
    for (uint32_t k = 0; k < CHOICES; k++)
        most = lum_max(most, error[k]);
    most = most > ERROR_MIN ? most : 0.0f;
    const float floor = lum_max(ERROR_FLOOR * error[0], ERROR_LEAST * most);
    for (uint32_t k = 0; k < CHOICES; k++)
        least = lum_min(least, lum_max(error[k], floor));
    for (uint32_t k = 0; k < CHOICES; k++) {
        float ratio = most > 0.0f ? least / lum_max(error[k], floor) : (float)(k == NONE);
        sum += ret_weight[k] = ratio * ratio * ratio;
    }
    for (uint32_t k = 0; k < CHOICES; k++)
        ret_weight[k] /= sum;
}

/* A pixel's own error is taken off again of what is smoothed. Were it left out in the first step, whose neighbours are
 * next to it, those that are 2, 4 and 8 pixels away would miss it, too: every second pixel of every second row would
 * choose otherwise than the rest, and show as a lattice of specks. */
static void weight_row(const struct step *step, uint32_t y)
{
    struct lum_residual_memory *m = step->m;
    for (size_t i = (size_t)y * m->w; i < (size_t)(y + 1) * m->w; i++) {
        for (uint32_t k = 0; k < CHOICES; k++)
            m->from[i].v[k] -= (1.0f - ALONE) * m->own[i] * m->by_level[i].v[k];
        weigh(m->from[i].v, m->by_level[i].v);
        m->blend[i] = (struct lanes){{0}};
    }
}

static void add_half(struct lanes *sum, struct lum_rgb c, uint32_t half, float weight)
{
    float *v = sum->v + half;
    set_rgb(v, lum_rgb_mad(rgb_of(v), c, weight));
    set_rgb(v + WEIGHTS, lum_rgb_add(rgb_of(v + WEIGHTS), lum_grey(weight)));
}

static void blend_row(const struct step *step, uint32_t y)
{
    struct lum_residual_memory *m = step->m;
    for (size_t i = (size_t)y * m->w; i < (size_t)(y + 1) * m->w; i++) {
        const struct lanes now = of_level(step, i);
        const float *weights = m->by_level[i].v;
        for (uint32_t half = A; half <= B; half += B - A) {
            add_half(&m->blend[i], take(&now, half), half, weights[step->level]);
            if (step->level == LEVELS)
                add_half(&m->blend[i], lum_grey(0.0f), half, weights[NONE]);
        }
    }
}

/* Rows of level 0, and of the others as the filter gets there. */
static enum lum_status run_levels(struct step *step, void (*row)(const struct step *step, uint32_t y))
{
    struct lum_residual_memory *m = step->m;
    step->per_class = 1.0f;
    step->level = 0;
    enum lum_status status = run_step(step, row);
    for (uint32_t k = 1; k <= LEVELS && status == LUM_OK; k++) {
        status = filter(step, k == 1 ? m->first : m->from, k - 1);
        step->level = k;
        if (status == LUM_OK)
            status = run_step(step, row);
    }
    return status;
}

/* ---- the picture ---- */

/* What a pixel shows, and by each half, luminance; what its samples say of that. */
struct shown {
    struct lum_rgb c;
    float a, b;
    float sampled_a, sampled_b;
};

/* By a half alone, its samples' albedo, too: of the other's samples it knows nothing. */
static float by_half(const struct step *step, size_t i, int half)
{
    struct lum_rgb albedo = lum_residual_albedo_by(step, i, half);
    struct lum_rgb residual = take(&step->m->blend[i], half ? B : A);
    return lum_luminance(lum_rgb_add(lum_residual_painted(step, i, albedo), lum_rgb_mul(residual, albedo)));
}

/* But for what shines by itself. */
static struct shown light_at(const struct step *step, uint32_t x, uint32_t y)
{
    const struct lum_residual_memory *m = step->m;
    size_t i = (size_t)y * m->w + x;
    struct lum_rgb albedo = lum_residual_albedo(step, i), frame = lum_residual_painted(step, i, albedo);
    struct lum_rgb samples = lum_film_mean(step->r->truth, x, y);
    if (!(step->r->guide->kind[i] & LUM_PIXEL_SURFACE) && lum_rgb_black(frame) && lum_rgb_black(samples))
        return (struct shown){.a = 0.0f}; /* night: edges of what is before it bring it none from far */
    struct sampled s = lum_outliers_at(step, x, y);
    float own = m->by_level[i].v[0], least = LEAST_SHARE * (1.0f - own);
    float stays = s.part + (1.0f - s.part) * own; /* unfiltered samples have their outliers, and no others' */
    struct lum_rgb share = lum_rgb_scale(s.share, taken(m->by_level[i].v));
    struct lum_rgb c = lum_rgb_mad(lum_rgb_add(frame, share), s.beyond, stays);
    c = lum_rgb_add(c, lum_rgb_mul(mean_of(&m->blend[i]), albedo));
    c = lum_rgb(lum_max(c.r, least * lum_min(frame.r, samples.r)), lum_max(c.g, least * lum_min(frame.g, samples.g)),
                lum_max(c.b, least * lum_min(frame.b, samples.b)));
    float both = lum_luminance(share) + stays * lum_luminance(s.beyond), apart = stays * s.beyond_apart;
    return (struct shown){c, by_half(step, i, 0) + both + apart, by_half(step, i, 1) + both - apart, s.a, s.b};
}

static struct lum_rgb picture_at(const struct step *step, uint32_t x, uint32_t y, struct sums *inout_sums)
{
    const struct lum_residual_memory *m = step->m;
    const struct lum_residual *r = step->r;
    size_t i = (size_t)y * m->w + x;
    struct shown s = light_at(step, x, y);
    s.c = lum_rgb_add(s.c, lum_residual_shine(r, i, 0, 1));
    inout_sums->mean += (double)lum_luminance(s.c);
    m->own[i] = NAN;
    if (!in_both(&m->first[i]))
        return s.c;
    float per = 1.0f / step->scale, error, noise;
    s.a += lum_luminance(lum_residual_shine(r, i, 0, 0)), s.b += lum_luminance(lum_residual_shine(r, i, 1, 1));
    s.sampled_a += lum_residual_sampled_shine(r, i, 0), s.sampled_b += lum_residual_sampled_shine(r, i, 1);
    measure(s.sampled_a * per, s.sampled_b * per, s.a * per, s.b * per, &error, &noise);
    m->own[i] = error;
    inout_sums->error += (double)error;
    inout_sums->n_both++;
    return s.c;
}

static void picture_job(void *ctx, uint32_t job, struct lum_counters *counters)
{
    const struct step *step = ctx;
    const struct lum_residual_memory *m = step->m;
    const uint32_t x0 = job % m->grid_w * SPREAD_SIDE, y0 = job / m->grid_w * SPREAD_SIDE;
    struct sums sums = {0};
    (void)counters;
    for (uint32_t y = y0; y < m->h && y < y0 + SPREAD_SIDE; y++)
        for (uint32_t x = x0; x < m->w && x < x0 + SPREAD_SIDE; x++)
            lum_film_set(step->r->picture, x, y, picture_at(step, x, y, &sums), &sums.nonfinite);
    m->sums[job] = sums;
}

/* The errors of a block's pixels are of the same samples, those of blocks are not: of their sum these tell the
 * deviation. */
static void add_up(struct lum_residual *r, const struct lum_residual_memory *m, double scale)
{
    struct sums all = {0};
    double blocks = 0.0;
    for (uint32_t i = 0; i < m->grid_w * m->grid_h; i++) {
        all.error += m->sums[i].error;
        blocks += m->sums[i].error * m->sums[i].error;
        all.mean += m->sums[i].mean;
        all.n_both += m->sums[i].n_both;
        all.nonfinite += m->sums[i].nonfinite;
    }
    double per_known = all.n_both > 0 ? (double)m->w * m->h / all.n_both : (double)NAN;
    r->error = all.error * scale * scale * per_known;
    r->doubt = sqrt(blocks) * scale * scale * per_known;
    r->mean = all.mean;
    r->nonfinite = all.nonfinite;
}

/* Mean luminance of the samples. The first few may all miss what makes the frame bright: residuals are then as large as
 * the frame, of which a pixel has at most w h means, over an albedo of at least 0.05. With this share of its mean they
 * are below 2^20 2^26 / 0.05 = 2^51, and sums of their squares fit a float. */
#define FRAME_SHARE 0x1p-20
static float scale_of(const struct lum_residual *r)
{
    const size_t n = (size_t)r->truth->w * r->truth->h;
    double samples = lum_film_mean_luminance(r->truth), frame = 0.0;
    for (size_t i = 0; i < n; i++)
        frame += (double)(lum_luminance(r->frame[i]) + (r->shine ? lum_luminance(r->shine[i]) : 0.0f));
    double scale = fmax(samples, FRAME_SHARE * frame / (double)n);
    return scale > 0.0 ? (float)scale : 1.0f;
}

enum lum_status lum_residual_apply(struct lum_residual *r, struct lum_residual_memory **memory,
                                   const struct lum_stage_runner *runner, struct lum_error *err)
{
    enum lum_status status = reserve(memory, r->truth->w, r->truth->h, err);
    if (status != LUM_OK)
        return status;
    struct lum_residual_memory *m = *memory;
    m->scale = 0.0;
    struct step step = {.r = r, .m = m, .runner = runner, .scale = scale_of(r)};
    status = run_step(&step, guide_row);
    if (status == LUM_OK)
        status = run_step(&step, residual_row);
    if (status == LUM_OK)
        status = smooth(&step, m->from);
    if (status == LUM_OK)
        status = lum_stage_loop(runner, m->grid_w * m->grid_h, lum_outliers_limit, &step);
    if (status == LUM_OK)
        lum_outliers_settle(m);
    if (status == LUM_OK)
        status = run_levels(&step, error_row);
    if (status != LUM_OK)
        return status;
    status = smooth(&step, m->by_level);
    if (status == LUM_OK)
        status = run_step(&step, weight_row);
    if (status == LUM_OK)
        status = lum_stage_loop(runner, m->grid_w * m->grid_h, lum_outliers_deal, &step);
    if (status == LUM_OK)
        lum_outliers_settle(m);
    if (status == LUM_OK)
        status = run_levels(&step, blend_row);
    if (status == LUM_OK)
        status = lum_stage_loop(runner, m->grid_w * m->grid_h, picture_job, &step);
    if (status == LUM_OK) {
        m->scale = (double)step.scale;
        add_up(r, m, m->scale);
    }
    return status;
}

void lum_residual_add_errors(const struct lum_residual_memory *memory, struct lum_error_map *map)
{
    const double scale2 = memory->scale * memory->scale;
    for (uint32_t y = 0; y < map->h && scale2 > 0.0; y++)
        for (uint32_t x = 0; x < map->w; x++)
            lum_error_map_add(map, x, y, scale2 * (double)memory->own[(size_t)y * memory->w + x], 1.0);
}

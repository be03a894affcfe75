/* Rare samples that are far brighter than those around them: no filter sees them, and no light is lost. Of a half's
 * residual what is within limits is filtered. What is beyond stays where both halves have it; the rest is shared out
 * among pixels around that the frame lights as much. At the edge of an object samples see it or what is behind: there a
 * part of it stays, and the rest is left out. */
#include "core/render/residual_steps.h"

/* Of a half's residual only what is within so many robust deviations from the robust mean around is filtered. For
 * Gaussian noise that deviation, (mean sqrt |A - B|)^2, is 0.96 standard deviations of a half; noise of paths has long
 * tails. What is beyond, and in both halves alike, is a detail, and stays where it is; the rest is an outlier, and
 * shared out. */
#define OUTLIER 4.0f

/* Two halves are alike where they differ by less than one part in so many of their sum. */
#define ALIKE 5.0f

/* Keeps the sign. */
static float signed_square_of(float x)
{
    return x * fabsf(x);
}

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

/* At the edge of an object: a sample sees it or what is behind, which is no outlier of what others reflect. What is
 * beyond the limits there is left out of what is shared. */
static bool is_at_edge(const struct step *step, uint32_t x, uint32_t y)
{
    const uint32_t *object = step->r->guide->object;
    uint32_t w = step->m->w, h = step->m->h;
    for (uint32_t ny = y > 0 ? y - 1 : 0; ny <= y + 1 && ny < h; ny++)
        for (uint32_t nx = x > 0 ? x - 1 : 0; nx <= x + 1 && nx < w; nx++)
            if (object[(size_t)ny * w + nx] != object[(size_t)y * w + x])
                return true;
    return false;
}

static struct sampled sampled_at(const struct step *step, size_t i)
{
    const struct lanes *kept = &step->m->first[i];
    struct lanes whole;
    lum_residual_put(step, i, 0, &whole, A);
    lum_residual_put(step, i, 1, &whole, B);
    struct lum_rgb albedo = albedo_at(step, i);
    struct lum_rgb a = lum_rgb_mul(lum_rgb_mad(take(&whole, A), take(kept, A), -1.0f), albedo);
    struct lum_rgb b = lum_rgb_mul(lum_rgb_mad(take(&whole, B), take(kept, B), -1.0f), albedo);
    float n = whole.v[A + WEIGHT] + whole.v[B + WEIGHT]; /* halves; what one has not is black */
    return (struct sampled){
        .a = lum_luminance(lum_rgb_mul(take(&whole, A), albedo)),
        .b = lum_luminance(lum_rgb_mul(take(&whole, B), albedo)),
        .beyond = n > 0.0f ? lum_rgb_scale(lum_rgb_add(a, b), 1.0f / n) : lum_grey(0.0f),
        .beyond_apart = 0.5f * (lum_luminance(a) - lum_luminance(b)),
    };
}

/* Which part of what is beyond the limits stays where it is, away from edges: none unless the halves are alike. */
static float part_alike(const struct step *step, size_t i, const struct sampled *s)
{
    float mean = fabsf(lum_luminance(s->beyond));
    if (step->r->truth->n[0][i] < 2 || !(mean > 0.0f)) /* two samples may be so by chance */
        return 0.0f;
    return lum_max(1.0f - ALIKE * fabsf(s->beyond_apart) / mean, 0.0f);
}

/* How much of what is shared out a pixel gets, over its neighbours: none where there is nothing that reflects. */
static struct lum_rgb portion(const struct step *step, size_t i)
{
    bool reflects = step->r->guide->kind[i] & LUM_PIXEL_SURFACE;
    return reflects ? lum_rgb_scale(albedo_at(step, i), 1.0f / step->scale) : lum_grey(0.0f);
}

/* How much the frame lights it: number of the class, and how far it is towards the next. */
static float class_of(const struct step *step, size_t i)
{
    float white = lum_luminance(step->r->frame[i]) / lum_luminance(albedo_at(step, i));
    float powers = white > 0.0f ? log2f(white) / CLASS_POWERS : -(float)CLASSES;
    return lum_clamp(powers + 0.5f * (float)(CLASSES - 1), 0.0f, (float)(CLASSES - 1) - 1e-3f);
}

static void add_square(struct square *sum, const struct square *s, float weight)
{
    sum->rest = lum_rgb_mad(sum->rest, s->rest, weight);
    sum->portions = lum_rgb_mad(sum->portions, s->portions, weight);
    sum->edge_square += s->edge_square * weight;
    sum->edge_noise += s->edge_noise * weight;
}

/* Limits the pixels of a square of the grid; sums what is shared out, and portions, by class. */
static void limit_square(const struct step *step, uint32_t x0, uint32_t y0, struct square sum[CLASSES])
{
    struct lum_residual_memory *m = step->m;
    for (uint32_t y = y0; y < m->h && y < y0 + SPREAD_SIDE; y++)
        for (uint32_t x = x0; x < m->w && x < x0 + SPREAD_SIDE; x++) {
            size_t i = (size_t)y * m->w + x;
            const float *robust = m->from[i].v;
            float per = robust[0] > 0.0f ? 1.0f / robust[0] : 0.0f;
            float middle = signed_square_of(robust[2] * per), range = OUTLIER * square_of(robust[1] * per);
            limit_half(&m->first[i], A, middle, range);
            limit_half(&m->first[i], B, middle, range);
            struct square own = {.portions = portion(step, i)};
            struct sampled s = sampled_at(step, i);
            if (!is_at_edge(step, x, y)) {
                own.rest = lum_rgb_scale(s.beyond, 1.0f - part_alike(step, i, &s));
            } else if (in_both(&m->first[i])) {
                own.edge_square = square_of(lum_luminance(s.beyond));
                own.edge_noise = square_of(s.beyond_apart);
            }
            float lit = class_of(step, i), next = lit - floorf(lit);
            add_square(&sum[(uint32_t)lit], &own, 1.0f - next);
            add_square(&sum[(uint32_t)lit + 1], &own, next);
        }
}

void lum_outliers_limit(void *ctx, uint32_t job, struct lum_counters *counters)
{
    const struct step *step = ctx;
    struct lum_residual_memory *m = step->m;
    (void)counters;
    struct square sum[CLASSES] = {0};
    limit_square(step, job % m->grid_w * SPREAD_SIDE, job / m->grid_w * SPREAD_SIDE, sum);
    for (uint32_t k = 0; k < CLASSES; k++)
        m->squares[(size_t)k * m->grid_w * m->grid_h + job] = sum[k];
}

static struct square mix(struct square a, struct square b, float t)
{
    struct square sum = {0};
    add_square(&sum, &a, 1.0f - t);
    add_square(&sum, &b, t);
    return sum;
}

/* Of a class: bilinear between the middles of squares. */
static struct square around(const struct lum_residual_memory *m, uint32_t lit, uint32_t x, uint32_t y)
{
    float fx = lum_clamp(((float)x + 0.5f) / (float)SPREAD_SIDE - 0.5f, 0.0f, (float)(m->grid_w - 1));
    float fy = lum_clamp(((float)y + 0.5f) / (float)SPREAD_SIDE - 0.5f, 0.0f, (float)(m->grid_h - 1));
    uint32_t x0 = (uint32_t)fx, x1 = x0 + 1 < m->grid_w ? x0 + 1 : x0, y0 = (uint32_t)fy;
    const struct square *top = m->squares + ((size_t)lit * m->grid_h + y0) * m->grid_w;
    const struct square *low = y0 + 1 < m->grid_h ? top + m->grid_w : top;
    float u = fx - (float)x0, v = fy - (float)y0;
    return mix(mix(top[x0], top[x1], u), mix(low[x0], low[x1], u), v);
}

/* What a portion of 1 gets. */
static struct lum_rgb rate_of(const struct square *s)
{
    return lum_rgb(s->portions.r > 0.0f ? s->rest.r / s->portions.r : 0.0f,
                   s->portions.g > 0.0f ? s->rest.g / s->portions.g : 0.0f,
                   s->portions.b > 0.0f ? s->rest.b / s->portions.b : 0.0f);
}

/* Which part of what is beyond the limits stays where it is, at edges, by class: that with the least squared error. A
 * part p of a mean m with noise v has the error (1 - p)^2 (m^2 - v) + p^2 v. Known from all edges of the picture that
 * are lit alike, not from the pixel alone, whose halves may be alike by chance. */
void lum_outliers_settle(struct lum_residual_memory *m)
{
    const size_t n = (size_t)m->grid_w * m->grid_h;
    for (uint32_t k = 0; k < CLASSES; k++) {
        struct square all = {0};
        for (size_t i = 0; i < n; i++)
            add_square(&all, &m->squares[k * n + i], 1.0f);
        float noise = all.edge_square > 0.0f ? all.edge_noise / all.edge_square : 1.0f;
        m->edge_part[k] = lum_max(1.0f - noise, 0.0f);
    }
}

struct sampled lum_outliers_at(const struct step *step, uint32_t x, uint32_t y)
{
    const struct lum_residual_memory *m = step->m;
    size_t pixel = (size_t)y * m->w + x;
    struct sampled s = sampled_at(step, pixel);
    float lit = class_of(step, pixel), next = lit - floorf(lit);
    uint32_t k = (uint32_t)lit;
    struct square low = around(m, k, x, y), high = around(m, k + 1, x, y);
    struct lum_rgb rate = lum_rgb_mad(lum_rgb_scale(rate_of(&low), 1.0f - next), rate_of(&high), next);
    s.share = lum_rgb_mul(rate, portion(step, pixel)); /* of each class as much as it gave there: nothing is lost */
    if (!is_at_edge(step, x, y))
        s.part = part_alike(step, pixel, &s);
    else if (step->r->truth->n[0][pixel] > 0 &&
             step->r->truth->n[1][pixel] > 0) /* one sample tells nothing of an edge */
        s.part = m->edge_part[k] * (1.0f - next) + m->edge_part[k + 1] * next;
    return s;
}

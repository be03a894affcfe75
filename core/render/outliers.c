/* Rare samples that are far brighter than those around them: no filter sees them, and no light is lost. Of a half's
 * residual what is within limits is filtered. What is beyond stays where both halves have it; the rest is shared out
 * among pixels around that the frame lights as much. At the edge of an object samples see it or what is behind, often
 * one by far brighter: there a part of it stays, and of the rest what one half alone has is shared out, as far as it is
 * more than chance in the whole picture. */
#include "core/render/outliers.h"

#include <string.h>

#include "core/render/residual_lanes.h"
#include "core/render/residual_steps.h"

/* Of a half's residual only what is within so many robust deviations from the robust mean around is filtered. For
 * Gaussian noise that deviation, (mean sqrt |A - B|)^2, is 0.96 standard deviations of a half; noise of paths has long
 * tails. What is beyond, and in both halves alike, is a detail, and stays where it is; the rest is an outlier, and
 * shared out. */
#define OUTLIER 4.0f

/* Two halves are alike as far as the square of half their difference, so many times, is less than that of their mean.
 * Where an object smaller than a pixel is bright, such as a lamp far away, each half has a binomial share of it; of
 * what one half alone has nothing is alike. */
#define ALIKE 25.0f
#define ALONE_FROM 0.5f /* half the difference over the mean: 1 if one half has nothing beyond the limits */

/* What chance explains up to so many deviations of it is chance. */
#define BY_CHANCE 2.0f

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
    put(l, half, c, rgb_of(l->v + half + WEIGHTS));
}

/* At the edge of an object: a sample sees it or what is behind, which is no outlier of what others reflect. What is
 * beyond the limits there is summed apart. */
bool lum_outliers_are_at_edge(const struct step *step, uint32_t x, uint32_t y)
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
    struct lum_rgb of_a = lum_residual_put(step, i, 0, &whole, A), of_b = lum_residual_put(step, i, 1, &whole, B);
    struct lum_rgb a = lum_rgb_scale(lum_rgb_mad(rgb_of(whole.v + A), rgb_of(kept->v + A), -1.0f), step->scale);
    struct lum_rgb b = lum_rgb_scale(lum_rgb_mad(rgb_of(whole.v + B), rgb_of(kept->v + B), -1.0f), step->scale);
    float n = (in_half(&whole, A) ? 1.0f : 0.0f) + (in_half(&whole, B) ? 1.0f : 0.0f); /* else black */
    return (struct sampled){
        .a = lum_luminance(of_a),
        .b = lum_luminance(of_b),
        .beyond = n > 0.0f ? lum_rgb_scale(lum_rgb_add(a, b), 1.0f / n) : lum_grey(0.0f),
        .beyond_apart = 0.5f * (lum_luminance(a) - lum_luminance(b)),
    };
}

/* Which part of what is beyond the limits stays where it is, away from edges: none unless the halves are alike. */
static float part_alike(const struct step *step, size_t i, const struct sampled *s)
{
    float mean = lum_luminance(s->beyond);
    if (step->r->truth->n[0][i] < 2 || !(fabsf(mean) > 0.0f)) /* two samples may be so by chance */
        return 0.0f;
    return lum_max(1.0f - ALIKE * square_of(s->beyond_apart / mean), 0.0f);
}

/* What a white surface in the pixel's place would show of the frame, over the picture's mean. */
static float white_at(const struct step *step, size_t i)
{
    return lum_luminance(step->r->frame[i]) / lum_luminance(lum_residual_frame_albedo(step, i));
}

/* How much of what is shared out a pixel gets, over its neighbours: by albedo. What is black among dark pixels, such as
 * the night in a mirror, all but nothing, unless all are. */
#define DARK 0.03f /* white_at of the lowest class */
#define ALL_DARK 1e-4f
static struct lum_rgb portion(const struct step *step, size_t i)
{
    float lit = lum_clamp(white_at(step, i) / DARK, ALL_DARK, 1.0f);
    return lum_rgb_scale(lum_residual_albedo(step, i), lit / step->scale);
}

/* What is shared out goes to the corners of a pixel's block, in the two classes that it is lit by, with these weights;
 * and what has come there from others is taken with the same: so all of it is. */
struct place {
    uint32_t lit; /* the first of the classes */
    float by_class[2], by_corner[4];
};

float lum_outliers_class(const struct step *step, size_t i)
{
    float white = white_at(step, i);
    float powers = white > 0.0f ? log2f(white) / CLASS_POWERS : -(float)LIT_CLASSES;
    if (!(step->r->guide->kind[i] & LUM_PIXEL_SURFACE))
        return (float)LIT_CLASSES;
    float lit = lum_clamp(powers + 0.5f * (float)(LIT_CLASSES - 1), 0.0f, (float)(LIT_CLASSES - 1) - 1e-3f);
    return step->r->guide->kind[i] & LUM_PIXEL_SPECULAR ? (float)SPECULAR_CLASSES + lit : lit;
}

static struct place place_of(const struct step *step, uint32_t x, uint32_t y)
{
    float lit = step->m->guide[GUIDE_LIT][(size_t)y * step->m->w + x], next = lit - floorf(lit);
    float u = ((float)(x % SPREAD_SIDE) + 0.5f) / (float)SPREAD_SIDE;
    float v = ((float)(y % SPREAD_SIDE) + 0.5f) / (float)SPREAD_SIDE;
    return (struct place){.lit = (uint32_t)lit,
                          .by_class = {1.0f - next, next},
                          .by_corner = {(1.0f - u) * (1.0f - v), u * (1.0f - v), (1.0f - u) * v, u * v}};
}

static void add_shared(struct shared *sum, const struct shared *s, float weight)
{
    sum->rest = lum_rgb_mad(sum->rest, s->rest, weight);
    sum->alike = lum_rgb_mad(sum->alike, s->alike, weight);
    sum->edge = lum_rgb_mad(sum->edge, s->edge, weight);
    sum->portions = lum_rgb_mad(sum->portions, s->portions, weight);
    sum->n += weight * s->n;
    sum->n_alone += weight * s->n_alone;
    sum->n_alike += weight * s->n_alike;
}

static void share_out(struct block *block, const struct place *place, const struct shared *pixel)
{
    for (uint32_t c = 0; c < 4; c++)
        for (uint32_t k = 0; k < 2; k++)
            add_shared(&block->corner[c][place->lit + k], pixel, place->by_corner[c] * place->by_class[k]);
}

/* Which part of what is beyond the limits one half alone has. What both have the frame lacks there, and nowhere else.
 */
static float part_alone(const struct sampled *s)
{
    float mean = fabsf(lum_luminance(s->beyond));
    return mean > 0.0f ? lum_min(fabsf(s->beyond_apart) / mean, 1.0f) : 0.0f;
}

static void add_edge(const struct step *step, struct edges *e, const struct sampled *s, double weight)
{
    double mean = (double)(lum_luminance(s->beyond) / step->scale), apart = (double)(s->beyond_apart / step->scale);
    e->square += weight * mean * mean;
    e->noise += weight * apart * apart;
    e->sum += weight * mean * (double)part_alone(s);
    e->sum_noise += weight * weight * apart * apart;
}

/* Samples are above the limits, which is so by chance where some are rare and bright. None is below them by chance. */
static bool is_bright(const struct sampled *s)
{
    return lum_luminance(s->beyond) > 0.0f;
}

/* What a pixel does with its outliers: which part of them it gives, which part of its portion it takes, and what else
 * it gives. */
struct dealing {
    float gives, takes;
    struct lum_rgb left;
};

/* Sums in a pixel's block what it gives and takes. */
static void deal(const struct step *step, uint32_t x, uint32_t y, const struct dealing *d, struct block *inout_block)
{
    size_t i = (size_t)y * step->m->w + x;
    struct sampled s = sampled_at(step, i);
    struct place place = place_of(step, x, y);
    struct lum_rgb beyond = lum_rgb_scale(s.beyond, d->gives);
    struct shared pixel = {.portions = lum_rgb_scale(portion(step, i), d->takes)};
    if (lum_outliers_are_at_edge(step, x, y)) { /* what the frame lacks there may be of what is before it */
        pixel.edge = lum_rgb_scale(beyond, part_alone(&s));
    } else {
        float alike = part_alike(step, i, &s);
        bool bright = is_bright(&s);
        pixel.rest = lum_rgb_mad(d->left, beyond, 1.0f - alike);
        pixel.alike = lum_rgb_scale(beyond, bright ? alike : 0.0f);
        pixel.n = 1.0f;
        pixel.n_alike = bright ? alike : 0.0f;
        pixel.n_alone = bright && fabsf(s.beyond_apart) >= ALONE_FROM * lum_luminance(s.beyond) ? 1.0f : 0.0f;
    }
    share_out(inout_block, &place, &pixel);
}

/* Limits the halves of a pixel; sums in its block what is beyond. */
static void limit_pixel(const struct step *step, uint32_t x, uint32_t y, struct block *inout_block)
{
    size_t i = (size_t)y * step->m->w + x;
    struct lanes *first = &step->m->first[i];
    const float *robust = step->m->from[i].v;
    float per = robust[0] > 0.0f ? 1.0f / robust[0] : 0.0f;
    float middle = signed_square_of(robust[2] * per), range = OUTLIER * square_of(robust[1] * per);
    limit_half(first, A, middle, range);
    limit_half(first, B, middle, range);
    deal(step, x, y, &(struct dealing){.gives = 1.0f, .takes = 1.0f}, inout_block);
    if (!lum_outliers_are_at_edge(step, x, y) || !in_both(first))
        return;
    struct sampled s = sampled_at(step, i);
    struct place place = place_of(step, x, y);
    for (uint32_t k = 0; k < 2; k++)
        add_edge(step, &inout_block->edges[place.lit + k], &s, (double)place.by_class[k]);
}

/* By the levels that a pixel takes: of unfiltered samples outliers stay, and the frame as it is gives its residual. */
static void deal_pixel(const struct step *step, uint32_t x, uint32_t y, struct block *inout_block)
{
    size_t i = (size_t)y * step->m->w + x;
    const float *weights = step->m->by_level[i].v;
    struct lum_rgb residual = lum_rgb_mul(mean_of(&step->m->first[i]), lum_residual_albedo(step, i));
    struct dealing d = {1.0f - weights[0], taken(weights), lum_rgb_scale(residual, weights[NONE])};
    deal(step, x, y, &d, inout_block);
}

static void each_pixel(const struct step *step, uint32_t job,
                       void (*pixel)(const struct step *step, uint32_t x, uint32_t y, struct block *inout_block))
{
    const struct lum_residual_memory *m = step->m;
    const uint32_t x0 = job % m->grid_w * SPREAD_SIDE, y0 = job / m->grid_w * SPREAD_SIDE;
    for (uint32_t y = y0; y < m->h && y < y0 + SPREAD_SIDE; y++)
        for (uint32_t x = x0; x < m->w && x < x0 + SPREAD_SIDE; x++)
            pixel(step, x, y, &m->blocks[job]);
}

void lum_outliers_limit(void *ctx, uint32_t job, struct lum_counters *counters)
{
    const struct step *step = ctx;
    (void)counters;
    step->m->blocks[job] = (struct block){0};
    each_pixel(step, job, limit_pixel);
}

void lum_outliers_deal(void *ctx, uint32_t job, struct lum_counters *counters)
{
    const struct step *step = ctx;
    (void)counters;
    memset(step->m->blocks[job].corner, 0, sizeof step->m->blocks[job].corner);
    each_pixel(step, job, deal_pixel);
}

/* Where in m->rates a corner of block (x, y) has what is of a class. */
static size_t corner_at(const struct lum_residual_memory *m, uint32_t lit, uint32_t x, uint32_t y, uint32_t corner)
{
    return ((size_t)lit * (m->grid_h + 1) + y + (corner >> 1)) * (m->grid_w + 1) + x + (corner & 1);
}

/* What comes to the upper left corner of block (x, y), of all blocks that meet there. */
static struct shared shared_at(const struct lum_residual_memory *m, uint32_t lit, uint32_t x, uint32_t y)
{
    struct shared sum = {.n = 0.0f};
    for (uint32_t c = 0; c < 4; c++) {
        uint32_t sx = x - (c & 1), sy = y - (c >> 1); /* it is this one's corner c; beyond the rim there is none */
        if (sx < m->grid_w && sy < m->grid_h)
            add_shared(&sum, &m->blocks[(size_t)sy * m->grid_w + sx].corner[c][lit], 1.0f);
    }
    return sum;
}

/* Which part of what both halves have above the limits they have by chance: where each has a rare bright sample in a
 * share q of the pixels, q^2 of them have two, give or take the root of their number, and 2 q (1 - q) one. Otherwise
 * these, of n * q^2, show as spots. */
static float part_by_chance(const struct shared *s)
{
    float mixed = s->n > 0.0f ? lum_min(2.0f * s->n_alone / s->n, 1.0f) : 0.0f; /* 4 q (1 - q) */
    float both = s->n * square_of(0.5f - 0.5f * sqrtf(1.0f - mixed));
    return s->n_alike > 0.0f ? lum_min((both + BY_CHANCE * sqrtf(both)) / s->n_alike, 1.0f) : 0.0f;
}

static struct lum_rgb per_portion(struct lum_rgb all, struct lum_rgb p)
{
    return lum_rgb(p.r > 0.0f ? all.r / p.r : 0.0f, p.g > 0.0f ? all.g / p.g : 0.0f, p.b > 0.0f ? all.b / p.b : 0.0f);
}

/* Which part of its own a class of mirrors and glass keeps to itself, by how many pixels it has around a corner. Of the
 * rest it is one with what is matt and lit alike: an outlier among a few pixels would show as a spot. */
#define ENOUGH 64.0f /* then half of it: 8 x 8 pixels hide a sample that is as rare and bright as glass makes it */
static float part_apart(const struct shared *s)
{
    return square_of(s->n) / (square_of(s->n) + square_of(ENOUGH));
}

static struct edges edges_of(const struct lum_residual_memory *m, uint32_t lit)
{
    struct edges sum = {0};
    for (size_t i = 0; i < (size_t)m->grid_w * m->grid_h; i++) {
        const struct edges *e = &m->blocks[i].edges[lit];
        sum.square += e->square;
        sum.noise += e->noise;
        sum.sum += e->sum;
        sum.sum_noise += e->sum_noise;
    }
    return sum;
}

/* Which part of what is beyond the limits stays where it is, at edges, by class: that with the least squared error. A
 * part p of a mean m with noise v has the error (1 - p)^2 (m^2 - v) + p^2 v. Known from all edges of the picture that
 * are lit alike, not from the pixel alone, whose halves may be alike by chance. Of the rest that is shared out which
 * the edges together have more of than by chance, by BY_CHANCE deviations: rare bright samples are too many for that,
 * and a lamp before a wall is as often above what the frame shows as below. */
static float settle_edges(struct lum_residual_memory *m, uint32_t lit)
{
    struct edges e = edges_of(m, lit);
    double stays = e.square > 0.0 ? fmax(1.0 - e.noise / e.square, 0.0) : 0.0, sum2 = e.sum * e.sum;
    m->edge_part[lit] = (float)stays;
    if (lit == LIT_CLASSES || !(sum2 > 0.0)) /* the sky gets no light of what is before it */
        return 0.0f;
    return (float)((1.0 - stays) * fmax(1.0 - (double)(BY_CHANCE * BY_CHANCE) * e.sum_noise / sum2, 0.0));
}

/* Around a corner: of a class, and (specular) of that of mirrors and glass which are lit alike. of_edges: of what is
 * beyond the limits there, how much is shared out. */
static void settle_pair(struct shared *matt, struct shared *specular, const float of_edges[2], struct rate ret_rate[2])
{
    struct shared *pair[2] = {matt, specular};
    float apart = part_apart(specular);
    for (uint32_t k = 0; k < 2; k++) {
        ret_rate[k].by_chance = part_by_chance(pair[k]);
        pair[k]->rest = lum_rgb_mad(pair[k]->rest, pair[k]->alike, ret_rate[k].by_chance);
        pair[k]->rest = lum_rgb_mad(pair[k]->rest, pair[k]->edge, of_edges[k]);
    }
    struct lum_rgb own = per_portion(specular->rest, specular->portions);
    ret_rate[0].shared = per_portion(lum_rgb_mad(matt->rest, specular->rest, 1.0f - apart),
                                     lum_rgb_mad(matt->portions, specular->portions, 1.0f - apart));
    ret_rate[1].shared = lum_rgb_mad(lum_rgb_scale(own, apart), ret_rate[0].shared, 1.0f - apart);
}

void lum_outliers_settle(struct lum_residual_memory *m)
{
    for (uint32_t lit = 0; lit < SPECULAR_CLASSES; lit++) {
        const uint32_t specular = lit + SPECULAR_CLASSES;
        const float of_edges[2] = {settle_edges(m, lit), settle_edges(m, specular)};
        for (uint32_t y = 0; y <= m->grid_h; y++)
            for (uint32_t x = 0; x <= m->grid_w; x++) {
                struct shared a = shared_at(m, lit, x, y), b = shared_at(m, specular, x, y);
                struct rate rate[2];
                settle_pair(&a, &b, of_edges, rate);
                m->rates[corner_at(m, lit, x, y, 0)] = rate[0];
                m->rates[corner_at(m, specular, x, y, 0)] = rate[1];
            }
    }
}

struct sampled lum_outliers_at(const struct step *step, uint32_t x, uint32_t y)
{
    const struct lum_residual_memory *m = step->m;
    size_t pixel = (size_t)y * m->w + x;
    struct sampled s = sampled_at(step, pixel);
    struct place place = place_of(step, x, y);
    struct rate rate = {.by_chance = 0.0f};
    for (uint32_t c = 0; c < 4; c++)
        for (uint32_t k = 0; k < 2; k++) {
            size_t at = corner_at(m, place.lit + k, x / SPREAD_SIDE, y / SPREAD_SIDE, c);
            float weight = place.by_corner[c] * place.by_class[k];
            rate.shared = lum_rgb_mad(rate.shared, m->rates[at].shared, weight);
            rate.by_chance += weight * m->rates[at].by_chance;
        }
    s.share = lum_rgb_mul(rate.shared, portion(step, pixel));
    s.at_edge = lum_outliers_are_at_edge(step, x, y);
    if (!s.at_edge)
        s.part = part_alike(step, pixel, &s) * (is_bright(&s) ? 1.0f - rate.by_chance : 1.0f);
    else if (step->r->truth->n[0][pixel] > 0 &&
             step->r->truth->n[1][pixel] > 0) /* one sample tells nothing of an edge */
        s.part = m->edge_part[place.lit] * place.by_class[0] + m->edge_part[place.lit + 1] * place.by_class[1];
    return s;
}

/* Where further samples go.
 *
 * Around a tile of the pattern that sees all of a light, or nothing of it, nothing is left to learn. Elsewhere a share
 * p of the light arrives, and the error of n samples a pixel has a variance of about p (1 - p) / n times the square of
 * what the light would bring. Weighted as the eye does (errors in the light count relative to the brightness, in the
 * dark to its root), a sample more is worth value / n - value / (n + 1). All tiles of all lights compete for the
 * budget; a histogram of what steps are worth gives the worth down to which it lasts. */
#include "core/effect/area_shadow/area_shadow.h"

#include <string.h>

#define BUCKETS 256
#define PER_OCTAVE 4 /* the last step that is taken may be worth a fifth more than another that is not; 64 octaves */

struct plan {
    const struct lum_pass *pass;
    struct lum_tiling subsets;
    const float *brightness; /* per tile of the pattern */
    double mean;
    uint64_t rays[BUCKETS]; /* that steps of this worth cost */
    uint32_t least;         /* bucket down to which all steps are taken */
    uint64_t budget;        /* left for steps of the bucket below */
};

/* What the light brings to the tile, of that which the samples say arrives. */
static float share_of(const struct lum_visibility_tally *t)
{
    return t->traced > 0 ? (float)t->visible / (float)t->traced : 0.0f;
}

static float power_of(const struct lum_pass *pass, const struct lum_layer *layer)
{
    return lum_luminance(pass->snapshot->lights.lights[layer->index].power);
}

/* Sums the direct light of all layers, as the samples have it so far. */
static double sum_brightness(const struct lum_pass *pass, uint32_t n_subsets, float *ret_brightness)
{
    double total = 0.0;
    for (uint32_t i = 0; i < n_subsets; i++)
        ret_brightness[i] = 0.0f;
    uint32_t a = 0;
    for (struct lum_layer *layer; (layer = lum_area_next(pass, &a));) {
        float power = power_of(pass, layer);
        for (uint32_t i = 0; i < n_subsets; i++)
            ret_brightness[i] += layer->area.unshadowed[i] * power * share_of(&layer->area.tally[i]);
    }
    for (uint32_t i = 0; i < n_subsets; i++)
        total += (double)ret_brightness[i];
    return total / n_subsets;
}

/* Of the mean brightness a hundredth is as dark as it gets for the eye: darker tiles take no more samples than that,
 * and black ones no number without end. */
#define WEIGHT_LEAST 0.1f

/* Square of the error that the eye would see from one sample in tile i; 0: there is nothing to learn. Half a sample
 * more of each kind: few that agree do not say that all would. */
static float value_at(const struct plan *p, const struct lum_layer *layer, uint32_t i)
{
    const struct lum_area_visibility *s = &layer->area;
    uint32_t x = i % p->subsets.nx, y = i / p->subsets.nx;
    if (!(s->unshadowed[i] > 0.0f) || lum_area_around(s, &p->subsets, x, y) != (LUM_AREA_LIT | LUM_AREA_DARK))
        return 0.0f;
    float ratio = ((float)s->tally[i].visible + 0.5f) / ((float)s->tally[i].traced + 1.0f);
    float relative = p->brightness[i] / (float)p->mean, weight = relative < 1.0f ? sqrtf(relative) : relative;
    float error = s->unshadowed[i] * power_of(p->pass, layer) / (float)p->mean / lum_max(weight, WEIGHT_LEAST);
    return ratio * (1.0f - ratio) * error * error;
}

static uint32_t bucket_of(float worth)
{
    float b = (float)PER_OCTAVE * log2f(worth) + BUCKETS * 0.75f;
    return (uint32_t)lum_clamp(b, 0.0f, BUCKETS - 1);
}

/* Steps of tile i from n samples a pixel to one more, from `first` on, and what they cost: the first one more where
 * some pixels know nothing yet. Value 0: there are none. */
struct steps {
    float value;
    uint32_t first, rays, rays_at_first;
};

static struct steps steps_at(const struct plan *p, const struct lum_layer *layer, uint32_t i)
{
    struct lum_tile_rect r = lum_tile_at(&p->subsets, i);
    uint32_t n = r.w * r.h, known = layer->area.tally[i].known;
    if (known >= n * LUM_AREA_POINTS || !layer->area.open[i])
        return (struct steps){0};
    uint32_t first = known < n ? 1 : known / n;
    return (struct steps){value_at(p, layer, i), first, n, known < n ? 2 * n - known : n};
}

static uint32_t rays_of_step(const struct steps *s, uint32_t n)
{
    return n == s->first ? s->rays_at_first : s->rays;
}

static uint32_t bucket_of_step(const struct steps *s, uint32_t n)
{
    return bucket_of(s->value / (float)(n * (n + 1)));
}

/* Finds the worth down to which the budget lasts. */
static void choose_least(struct plan *p)
{
    const struct lum_pass *pass = p->pass;
    uint64_t left = (uint64_t)((double)pass->layers->refined_share * pass->settings->shadow_budget);
    p->least = BUCKETS;
    while (p->least > 0 && p->rays[p->least - 1] <= left)
        left -= p->rays[--p->least];
    p->budget = left;
}

static void set_goals(struct plan *p, struct lum_layer *layer)
{
    for (uint32_t i = 0; i < p->subsets.n; i++) {
        struct steps s = steps_at(p, layer, i);
        uint32_t n = s.first;
        layer->area.goal[i] = 0;
        if (!(s.value > 0.0f))
            continue;
        for (; n < LUM_AREA_POINTS; n++) {
            uint32_t bucket = bucket_of_step(&s, n);
            if (bucket < p->least && (bucket + 1 < p->least || p->budget < rays_of_step(&s, n)))
                break;
            if (bucket < p->least)
                p->budget -= rays_of_step(&s, n);
        }
        layer->area.goal[i] = (uint8_t)(n > s.first ? n : 0);
    }
}

void lum_area_plan(const struct lum_pass *pass)
{
    struct lum_layers *l = pass->layers;
    struct plan p = {.pass = pass, .subsets = lum_area_tiling(pass), .brightness = l->brightness};
    struct lum_layer *layer;
    uint32_t a = 0;
    if (!l->brightness || pass->settings->max_depth == 0)
        return;
    p.mean = sum_brightness(pass, p.subsets.n, l->brightness);
    if (!(p.mean > 0.0)) {
        while ((layer = lum_area_next(pass, &a)))
            memset(layer->area.goal, 0, p.subsets.n);
        return;
    }
    while ((layer = lum_area_next(pass, &a)))
        for (uint32_t i = 0; i < p.subsets.n; i++) {
            struct steps s = steps_at(&p, layer, i);
            for (uint32_t n = s.first; s.value > 0.0f && n < LUM_AREA_POINTS; n++)
                p.rays[bucket_of_step(&s, n)] += rays_of_step(&s, n);
        }
    choose_least(&p);
    a = 0;
    while ((layer = lum_area_next(pass, &a)))
        set_goals(&p, layer);
}

/* Unbiased path tracing: one light picked per vertex (next-event estimation) combined with BSDF sampling by the power
 * heuristic (Veach 1995), Russian roulette on throughput, no clamping. Media (medium/medium.h) dim every segment; on
 * those that the eye sees, one point in each medium scatters the light of one light.
 *
 * A wave goes through two batches per bounce: closest hits of all living paths, then the shadow rays that their
 * vertices asked for. Dead paths are squeezed out as vertices are shaded: path i is read before a path j <= i is
 * written.
 *
 * Effects that are left out are left out exactly: what stays converges to the sum of the others. A lobe that no path
 * goes on by still reflects the lights, which are then sampled for it alone. So the picture without indirect_diffuse
 * and glossy is that of direct light on every surface, highlights included.
 *
 * Shadow rays go straight through panes, and what these leave of the light is that light's. A path that goes through
 * one is still on its way from the vertex before: light that it meets behind is weighted against the light sampled
 * there, by the density with which its direction was drawn there, whichever lobe of the pane it took: the weights of
 * both ways of finding the light add up to 1. Without the effect transmission panes stop both.
 *
 * Of a view's samples, later ones are guided (guide.h): that density is then of the BSDF and of what was learned. */
#include "core/path/wave.h"

#include <string.h>

#include "core/light/sample.h"
#include "core/light/tree.h"
#include "core/math/warp.h"
#include "core/path/guide.h"
#include "core/scene/surface.h"

#define ROULETTE_DEPTH 3u /* bounces before roulette starts: the first ones carry most of the energy */

/* Sampler pairs: the pixel filter's; each vertex then takes four. */
enum { PAIR_PICK = LUM_WAVE_PAIR_PIXEL + 1, PAIR_LIGHT, PAIR_BSDF, PAIR_ROULETTE, PAIRS_PER_VERTEX = 4 };

/* Where every light is sampled each has a pair of its own. */
enum { PAIR_EVERY = 0x20000000 };

/* Media have pairs of their own, beyond those of any vertex: what they take does not change a path. */
enum { PAIR_MEDIA = 0x40000000, PAIRS_PER_MEDIUM = 3 };

static uint32_t pair_at(uint32_t depth, uint32_t pair)
{
    return pair + depth * PAIRS_PER_VERTEX;
}

static enum lum_ray_kind bounce_kind(enum lum_lobe lobe)
{
    switch (lobe) {
    case LUM_LOBE_DIFFUSE:
    case LUM_LOBE_DIFFUSE_TRANSMIT:
        return LUM_RAY_INDIRECT_DIFFUSE;
    case LUM_LOBE_GLOSSY:
        return LUM_RAY_GLOSSY;
    case LUM_LOBE_REFLECT:
        return LUM_RAY_REFLECTION;
    case LUM_LOBE_TRANSMIT:
    case LUM_LOBE_GLOSSY_TRANSMIT:
        break;
    }
    return LUM_RAY_TRANSMISSION;
}

static void bring_home(struct lum_wave *w, const struct lum_gain *gain, uint8_t effect)
{
    if (w->parts)
        w->parts[gain->slot][effect] += lum_luminance(gain->value);
    if (!w->gains)
        w->radiance[gain->slot] = lum_rgb_add(w->radiance[gain->slot], gain->value);
    else if (w->gains->n < w->gains->max)
        w->gains->gains[w->gains->n++] = *gain;
    else
        w->gains->n_lost++;
}

/* The effect that light counts as at a vertex: of, where it comes from there; or what brought the path there. */
static uint8_t effect_at(const struct lum_path *path, enum lum_effect of)
{
    return path->effect == LUM_EFFECT_ANTIALIAS ? (uint8_t)of : path->effect;
}

/* Light on its way to the eye: with a shadow ray, which was just pushed, when that comes back; else at once. */
static void keep_light(struct lum_wave *w, const struct lum_gain *gain, enum lum_ray_kind kind, uint8_t effect,
                       bool has_ray)
{
    if (!has_ray) {
        bring_home(w, gain, effect);
        return;
    }
    w->shadow_gain[w->shadow_rays.n - 1] = *gain;
    w->shadow_kind[w->shadow_rays.n - 1] = (uint8_t)kind;
    w->shadow_effect[w->shadow_rays.n - 1] = effect;
}

struct vertex {
    const struct lum_bsdf *b;
    struct lum_vec3 p, wo;
    uint32_t depth;
    uint32_t lobes_off; /* of those that the surface has: what no path goes on by */
    struct lum_path_guide_locate guide;
};

/* ---- effects that are left out ---- */

enum {
    LIGHT_EFFECTS = LUM_EFFECT_BIT(LUM_EFFECT_DIRECT) | LUM_EFFECT_BIT(LUM_EFFECT_SOFT_SHADOW) |
                    LUM_EFFECT_BIT(LUM_EFFECT_ENVIRONMENT),
    LOBE_EFFECTS = LUM_EFFECT_BIT(LUM_EFFECT_INDIRECT_DIFFUSE) | LUM_EFFECT_BIT(LUM_EFFECT_REFLECTION) |
                   LUM_EFFECT_BIT(LUM_EFFECT_TRANSMISSION) | LUM_EFFECT_BIT(LUM_EFFECT_GLOSSY),
};

/* The effect that the cosine-shaped lobe counts as: of a metal it is light from several facets. */
static uint32_t cosine_effect(const struct lum_bsdf *b)
{
    bool matte = !lum_rgb_black(b->diffuse) || b->far_prob > 0.0f;
    return LUM_EFFECT_BIT(matte ? LUM_EFFECT_INDIRECT_DIFFUSE : LUM_EFFECT_GLOSSY);
}

/* Effects that go on from a surface. */
static uint32_t lobe_effects(const struct lum_bsdf *b)
{
    uint32_t effects = b->diffuse_prob > 0.0f ? cosine_effect(b) : 0;
    if (b->diffuse_prob == 1.0f)
        return effects;
    if (b->clear.share > 0.0f)
        effects |= LUM_EFFECT_BIT(b->clear.alpha > 0.0f ? LUM_EFFECT_GLOSSY : LUM_EFFECT_REFLECTION);
    if (b->sheen.share > 0.0f && b->clear.share < 1.0f)
        effects |= LUM_EFFECT_BIT(LUM_EFFECT_GLOSSY);
    if (b->clear.share < 1.0f && b->sheen.share < 1.0f)
        effects |= LUM_EFFECT_BIT(b->alpha > 0.0f ? LUM_EFFECT_GLOSSY : LUM_EFFECT_REFLECTION);
    return b->glass > 0.0f ? effects | LUM_EFFECT_BIT(LUM_EFFECT_TRANSMISSION) : effects;
}

/* f |cos| towards a light, weighted against the lobes that paths go on by; the others have the light to themselves.
 * pdf: of the light sample. */
static struct lum_rgb respond_in_part(const struct vertex *at, struct lum_vec3 wi, float pdf)
{
    const struct lum_bsdf *b = at->b;
    struct lum_bsdf_value v = lum_bsdf_eval_parts(b, at->wo, wi);
    bool across = lum_dot(wi, b->ng) < 0.0f;
    bool cosine = !(at->lobes_off & cosine_effect(b));
    bool gloss = !(at->lobes_off & LUM_EFFECT_BIT(across ? LUM_EFFECT_TRANSMISSION : LUM_EFFECT_GLOSSY));
    float pdf_gloss = (1.0f - b->diffuse_prob) * v.gloss_pdf_sa, pdf_on = gloss ? pdf_gloss : 0.0f;
    if (cosine)
        pdf_on += lum_bsdf_cosine_pdf(b, wi);
    float weight = lum_power_heuristic(pdf, pdf_on);
    return lum_rgb_mad(lum_rgb_scale(v.diffuse, cosine ? weight : 1.0f), v.gloss, gloss ? weight : 1.0f);
}

/* False: the path does not go on by this lobe. Else, where a lobe that covers the same directions is left out, the
 * sample becomes one of what stays. */
static bool keep_lobe(const struct vertex *at, struct lum_bsdf_sample *inout_sample)
{
    const struct lum_bsdf *b = at->b;
    struct lum_bsdf_sample *bs = inout_sample;
    uint32_t effect = LUM_EFFECT_BIT((uint32_t)bounce_kind(bs->lobe) - LUM_RAY_DIRECT);
    if (at->lobes_off & effect)
        return false;
    bool across = lum_dot(bs->wi, b->ng) < 0.0f;
    uint32_t overlap = LUM_EFFECT_BIT(LUM_EFFECT_INDIRECT_DIFFUSE) |
                       LUM_EFFECT_BIT(across ? LUM_EFFECT_TRANSMISSION : LUM_EFFECT_GLOSSY);
    if (!(effect & overlap) || !(at->lobes_off & overlap) || !lum_bsdf_has_gloss(b) || !(bs->pdf_sa > 0.0f))
        return true;
    struct lum_bsdf_value v = lum_bsdf_eval_parts(b, at->wo, bs->wi);
    bool cosine = effect == cosine_effect(b);
    struct lum_rgb f = cosine ? v.diffuse : v.gloss;
    bs->pdf_sa = cosine ? lum_bsdf_cosine_pdf(b, bs->wi) : (1.0f - b->diffuse_prob) * v.gloss_pdf_sa;
    if (!(bs->pdf_sa > 0.0f))
        return false;
    bs->weight = lum_rgb(f.r / bs->pdf_sa, f.g / bs->pdf_sa, f.b / bs->pdf_sa);
    return true;
}

/* ---- guiding ---- */

/* Where no lobe is left out, the diffuse one shares its directions with what was learned here: of one side alone. */
static void ask_guide(const struct lum_wave *w, struct vertex *v, uint32_t n_panes)
{
    if (!v->lobes_off && !lum_rgb_black(v->b->diffuse) && v->b->far_prob == 0.0f &&
        v->depth - n_panes < LUM_PATH_GUIDE_NOTES)
        v->guide = lum_path_guide_find(w->guide, v->p, v->b);
}

/* Density with which the path goes on to wi, given the BSDF's own. */
static inline float pdf_on(const struct vertex *v, struct lum_vec3 wi, float pdf_sa)
{
    return v->guide.share > 0.0f ? lum_path_guide_bsdf_pdf(&v->guide, v->b, wi, pdf_sa) : pdf_sa;
}

/* As lum_bsdf_sample. */
static inline bool sample_on(const struct vertex *v, struct lum_vec2 u, float u_lobe,
                             struct lum_path_guide_step *ret_step)
{
    if (v->guide.cell)
        return lum_path_guide_bsdf_sample(&v->guide, v->b, v->wo, u, u_lobe, ret_step);
    return lum_bsdf_sample(v->b, v->wo, u, u_lobe, &ret_step->s);
}

/* The path goes on; throughput: then, but for roulette. */
static void note_step(struct lum_path_guide_notes *notes, const struct lum_path *path, const struct vertex *v,
                      const struct lum_path_guide_step *step, struct lum_rgb throughput)
{
    uint8_t *n = &notes->n[path->slot];
    if (!v->guide.cell || !(step->cosine > 0.0f) || *n == LUM_PATH_GUIDE_NOTES)
        return;
    notes->note[path->slot][(*n)++] =
        (struct lum_path_guide_note){.cell = v->guide.index,
                                     .bin = step->bin,
                                     .scale = step->cosine / (step->s.pdf_sa * lum_luminance(throughput)),
                                     .before = -1.0f,
                                     .pdf_sa = step->s.pdf_sa,
                                     .pdf_ratio = step->ratio};
}

/* What the path has brought home so far came from before its ray. */
static void note_segment(struct lum_wave *w, uint32_t slot)
{
    struct lum_path_guide_notes *notes = w->notes;
    uint32_t n = notes->n[slot];
    if (n > 0 && notes->note[slot][n - 1].before < 0.0f)
        notes->note[slot][n - 1].before = lum_luminance(w->radiance[slot]);
}

/* What shines at the end of a path's ray. Through panes, and until the path is scattered anew, it has the density of
 * the step. */
static void note_emission(struct lum_path_guide_notes *notes, const struct lum_path *path, struct lum_rgb value)
{
    const struct lum_path_guide_note *first = notes->note[path->slot];
    if (notes->n[path->slot] > 0 && !(first->pdf_sa < path->pdf_sa || first->pdf_sa > path->pdf_sa))
        notes->emitted[path->slot] += lum_luminance(value);
}

/* ---- light ---- */

struct choice {
    uint32_t light;
    float prob; /* with which it was chosen */
    uint32_t pair;
};

/* The direct light of a light is left out: what it lights by way of a diffuse surface is another effect, and stays. */
static bool is_off(const struct lum_wave *w, uint32_t light)
{
    return w->lights_off && (w->lights_off & LUM_EFFECT_BIT(lum_light_effect(&w->snapshot->lights.lights[light])));
}

/* Light sampled from a vertex; queues its shadow ray. */
static void queue_light(struct lum_wave *w, const struct lum_path *path, const struct vertex *v, struct choice choice)
{
    uint32_t light = choice.light;
    enum lum_ray_kind kind = lum_light_ray_kind(&w->snapshot->lights.lights[light]);
    if (is_off(w, light)) {
        if (!path->indirect)
            return;
        kind = LUM_RAY_INDIRECT_DIFFUSE;
    }
    struct lum_light_sample ls;
    struct lum_vec2 u = {0.5f, 0.5f};
    if (!w->snapshot->lights.lights[light].delta)
        u = lum_sampler_2d(&path->sampler, choice.pair);
    if (!lum_light_sample_plainly(w->snapshot, light, v->p, u, &ls))
        return;
    if (w->media)
        ls.radiance = lum_rgb_mul(ls.radiance, lum_media_transmittance(w->snapshot, v->p, ls.wi, ls.distance));
    bool delta = !(ls.pdf_sa > 0.0f);
    float pdf = delta ? choice.prob : choice.prob * ls.pdf_sa, weight = 1.0f, bsdf_pdf_sa;
    struct lum_rgb f;
    if (v->lobes_off && !delta) {
        f = respond_in_part(v, ls.wi, pdf);
    } else {
        f = lum_bsdf_eval(v->b, v->wo, ls.wi, &bsdf_pdf_sa);
        if (!delta && !lum_rgb_black(f))
            weight = lum_power_heuristic(pdf, pdf_on(v, ls.wi, bsdf_pdf_sa));
    }
    struct lum_rgb value = lum_rgb_mul(lum_rgb_mul(path->throughput, f), lum_rgb_scale(ls.radiance, weight / pdf));
    if (lum_rgb_black(value))
        return;
    bool has_ray = lum_shadow_ray(&w->shadow_rays, v->p, v->b->ng, ls.wi, ls.distance);
    uint8_t effect = effect_at(path, lum_light_effect(&w->snapshot->lights.lights[light]));
    keep_light(w, &(struct lum_gain){path->slot, light, value}, kind, effect, has_ray);
}

/* Ray i of a batch, which ends at distance t or goes on for ever. */
static void add_segment(struct lum_wave *w, const struct lum_rays *rays, uint32_t i, float t, uint32_t slot)
{
    struct lum_path_segments *segments_met = w->segments_met;
    if (segments_met->n == segments_met->max) {
        segments_met->n_lost++;
        return;
    }
    struct lum_vec3 o = {rays->ox[i], rays->oy[i], rays->oz[i]};
    struct lum_vec3 end = lum_v3_mad(o, lum_rays_direction(rays, i), lum_min(t, LUM_SEGMENT_FAR));
    segments_met->segments[segments_met->n++] = (struct lum_path_segment){o, end, slot};
}

static void trace_shadows(struct lum_wave *w)
{
    if (w->shadow_rays.n == 0)
        return;
    struct lum_trace trace = lum_trace_of_light(w->snapshot, w->counters, w->panes);
    lum_trace_light(&trace, &w->shadow_rays, w->occluded, w->left);
    for (uint32_t i = 0; i < w->shadow_rays.n; i++) {
        w->counters->rays[w->shadow_kind[i]]++;
        if (w->segments_met)
            add_segment(w, &w->shadow_rays, i, w->shadow_rays.tfar[i], w->shadow_gain[i].slot);
        if (w->occluded[i])
            continue;
        if (trace.panes)
            w->shadow_gain[i].value = lum_rgb_mul(w->shadow_gain[i].value, w->left[i]);
        bring_home(w, &w->shadow_gain[i], w->shadow_effect[i]);
    }
    w->shadow_rays.n = 0;
}

/* As lum_lights_pick_from has it: what lies below is dark to what lets no light through. */
static struct lum_vec3 lit_normal(const struct lum_bsdf *b)
{
    return b->glass > 0.0f || b->far_prob > 0.0f ? lum_v3(0.0f, 0.0f, 0.0f) : b->frame.n;
}

/* A vertex's shadow rays are traced together: what it gains adds up in the same order whatever batch it is in. */
static void queue_lights(struct lum_wave *w, const struct lum_path *path, const struct vertex *v, float u_pick)
{
    const struct lum_light_table *t = &w->snapshot->lights;
    if (!w->every_light) {
        struct choice one = {.pair = pair_at(v->depth, PAIR_LIGHT)};
        one.light = lum_lights_pick_from(t, v->p, lit_normal(v->b), u_pick, &one.prob);
        if (one.light != LUM_NO_OBJECT)
            queue_light(w, path, v, one);
        return;
    }
    if (w->shadow_rays.n + t->n_active > LUM_RAY_BATCH)
        trace_shadows(w);
    for (uint32_t i = 0; i < t->n_active; i++)
        queue_light(w, path, v, (struct choice){t->active[i], 1.0f, PAIR_EVERY + v->depth * LUM_WAVE_LIGHTS + i});
}

/* Light that medium m scatters into the segment. */
static void queue_scatter(struct lum_wave *w, const struct lum_path *path, struct lum_scatter_query q, uint32_t depth)
{
    uint32_t pair = PAIR_MEDIA + (depth * LUM_MEDIA_MAX + q.medium) * PAIRS_PER_MEDIUM;
    float pick = lum_sampler_1d(&path->sampler, pair), prob;
    q.light = lum_lights_pick(&q.snapshot->lights, &pick, &prob);
    if (q.light == LUM_NO_OBJECT)
        return;
    struct lum_vec2 u_light = {0.5f, 0.5f};
    if (!q.snapshot->lights.lights[q.light].delta)
        u_light = lum_sampler_2d(&path->sampler, pair + 2);
    struct lum_scatter s;
    if (!lum_medium_scatter(&q, lum_sampler_2d(&path->sampler, pair + 1), u_light, &s))
        return;
    struct lum_rgb value = lum_rgb_mul(path->throughput, lum_rgb_scale(s.radiance, 1.0f / prob));
    if (lum_rgb_black(value))
        return;
    if (w->shadow_rays.n == LUM_RAY_BATCH)
        trace_shadows(w);
    bool has_ray = lum_shadow_ray(&w->shadow_rays, s.p, lum_v3(0, 0, 0), s.wi, s.distance);
    uint8_t effect = effect_at(path, LUM_EFFECT_MEDIA);
    keep_light(w, &(struct lum_gain){path->slot, q.light, value}, LUM_RAY_MEDIA, effect, has_ray);
}

/* The batch came back: what its segments gain and lose in media. */
static void cross_media(struct lum_wave *w, uint32_t depth)
{
    for (uint32_t i = 0; i < w->rays.n; i++) {
        struct lum_path *path = &w->path[i];
        struct lum_scatter_query q = {
            .snapshot = w->snapshot,
            .o = lum_v3(w->rays.ox[i], w->rays.oy[i], w->rays.oz[i]),
            .d = lum_rays_direction(&w->rays, i),
            .tmax = w->hits.object[i] == LUM_NO_OBJECT ? INFINITY : w->hits.t[i],
        };
        path->seen = path->seen && !(path->pdf_sa > 0.0f);
        if (path->seen && depth < w->max_depth)
            for (q.medium = 0; q.medium < w->snapshot->n_media; q.medium++)
                queue_scatter(w, path, q, depth);
        path->throughput = lum_rgb_mul(path->throughput, lum_media_transmittance(w->snapshot, q.o, q.d, q.tmax));
    }
    trace_shadows(w);
}

/* Roulette keeps the mean: survivors carry what the dead would have. False: the path dies. Radiance inside a solid is
 * denser by the square of the refractive index; the throughput that decides is without that factor, which the way out
 * takes back, or half of the paths would die inside clear glass. */
static bool roulette(const struct lum_wave *w, struct lum_path *path, uint32_t depth)
{
    if (depth < w->roulette_depth)
        return true;
    float survive = fminf(path->survival * lum_rgb_max(path->throughput) / path->roulette_scale, 1.0f);
    if (!(lum_sampler_1d(&path->sampler, pair_at(depth, PAIR_ROULETTE)) < survive))
        return false;
    path->throughput = lum_rgb_scale(path->throughput, 1.0f / survive);
    return true;
}

/* The path goes on from p, on a surface with normal ng. */
static void push_path(struct lum_wave *w, struct lum_path path, struct lum_vec3 p, struct lum_vec3 ng,
                      struct lum_vec3 wi)
{
    w->path[w->rays.n] = path;
    lum_rays_push(&w->rays, lum_ray_offset(p, lum_dot(wi, ng) >= 0.0f ? ng : lum_v3_neg(ng)), wi, INFINITY);
}

/* True when light that was sampled at the vertex before gets here, too, and on. */
static bool passes_pane(const struct lum_wave *w, const struct lum_bsdf *b, const struct lum_bsdf_sample *bs)
{
    return w->panes && bs->lobe == LUM_LOBE_TRANSMIT && b->straight;
}

/* One vertex of a path: light sampling, then the next ray. The path, if it lives on, is appended to the wave. */
static void scatter(struct lum_wave *w, struct lum_path path, struct vertex *v)
{
    const struct lum_bsdf *b = v->b;
    if (w->lobes_off)
        v->lobes_off = w->lobes_off & lobe_effects(b);
    if (w->guide)
        ask_guide(w, v, path.n_panes);
    struct lum_vec2 pick = {0.5f, 0.5f};
    bool one_lobe = b->diffuse_prob == 1.0f && b->far_prob == 0.0f && !(v->guide.share > 0.0f);
    if (w->snapshot->lights.n_active > 1 || !one_lobe) /* something to choose */
        pick = lum_sampler_2d(&path.sampler, pair_at(v->depth, PAIR_PICK));
    queue_lights(w, &path, v, pick.x);
    struct lum_path_guide_step step;
    if (!sample_on(v, lum_sampler_2d(&path.sampler, pair_at(v->depth, PAIR_BSDF)), pick.y, &step))
        return;
    struct lum_bsdf_sample *bs = &step.s;
    if (v->lobes_off && !keep_lobe(v, bs))
        return;
    if (w->snapshot->lights.n_active == 0 && bs->pdf_sa > 0.0f)
        return; /* only a mirror could show something that shines without being a light */
    path.throughput = lum_rgb_mul(path.throughput, bs->weight);
    if (bounce_kind(bs->lobe) == LUM_RAY_TRANSMISSION && !b->thin && !b->straight)
        path.roulette_scale *= b->eta * b->eta;
    if (v->guide.cell)
        path.roulette_scale /= step.ratio; /* or what is looked for more often would end more often */
    struct lum_rgb throughput = path.throughput;
    if (lum_rgb_black(path.throughput) || !roulette(w, &path, v->depth))
        return;
    if (w->notes)
        note_step(w->notes, &path, v, &step, throughput);
    if (passes_pane(w, b, bs)) {
        path.n_panes += path.pdf_sa > 0.0f;
    } else {
        path.p = v->p;
        path.n = lit_normal(b);
        path.pdf_sa = bs->pdf_sa;
        path.every_light = w->every_light;
        path.plain = true;
        path.direct_apart = false;
        path.was_indirect = path.indirect;
        path.indirect = path.indirect || bounce_kind(bs->lobe) == LUM_RAY_INDIRECT_DIFFUSE;
        path.effect = effect_at(&path, (enum lum_effect)(bounce_kind(bs->lobe) - LUM_RAY_DIRECT));
    }
    w->counters->rays[bounce_kind(bs->lobe)]++;
    push_path(w, path, v->p, b->ng, bs->wi);
}

/* Weight of emission that was met by a sampled ray, against the light sampling at the vertex before. */
static float emission_weight(const struct lum_wave *w, const struct lum_path *path, uint32_t light, struct lum_vec3 d,
                             const struct lum_surface *s)
{
    if (!(path->pdf_sa > 0.0f))
        return 1.0f;
    if (path->direct_apart)
        return 0.0f;
    if (!path->was_indirect && is_off(w, light))
        return 0.0f;
    struct lum_vec3 at = s ? s->p : lum_v3(0, 0, 0), ng = s ? s->ng : lum_v3(0, 0, 0);
    float pdf = path->plain ? lum_light_plain_pdf(w->snapshot, light, path->p, d, at, ng)
                            : lum_light_pdf(w->snapshot, light, path->p, d, at, ng);
    if (!path->every_light)
        pdf *= lum_lights_pick_pdf(&w->snapshot->lights, path->p, path->n, light);
    return lum_power_heuristic(path->pdf_sa, pdf);
}

/* What shines at the end of the path's ray. */
static void add(struct lum_wave *w, const struct lum_path *path, uint32_t light, struct lum_rgb radiance, float weight)
{
    struct lum_rgb value = lum_rgb_scale(lum_rgb_mul(path->throughput, radiance), weight);
    if (w->at_first && w->keeps_first) {
        w->first[path->slot].shine = lum_rgb_add(w->first[path->slot].shine, value);
        if (w->parts)
            w->parts[path->slot][path->effect] += lum_luminance(value);
        return;
    }
    if (w->notes)
        note_emission(w->notes, path, value);
    /* What the diffuse lobe's ray meets first is the lamp's own light, sampled in the other way. */
    bool direct = path->effect == LUM_EFFECT_INDIRECT_DIFFUSE && !path->was_indirect && light != LUM_NO_OBJECT;
    uint8_t effect = direct ? (uint8_t)lum_light_effect(&w->snapshot->lights.lights[light]) : path->effect;
    bring_home(w, &(struct lum_gain){path->slot, light, value}, effect);
}

static void add_background(struct lum_wave *w, const struct lum_path *path, struct lum_vec3 d, bool eye)
{
    const struct lum_light_table *lights = &w->snapshot->lights;
    if (lights->environment != LUM_NO_OBJECT)
        add(w, path, lights->environment, lum_lights_background(lights, d, eye),
            emission_weight(w, path, lights->environment, d, NULL));
}

/* Ray i of the batch came back: emission, then scattering. */
static void shade(struct lum_wave *w, uint32_t i, uint32_t depth)
{
    struct lum_path path = w->path[i];
    struct lum_vec3 d = lum_rays_direction(&w->rays, i);
    if (w->notes)
        note_segment(w, path.slot);
    if (w->hits.object[i] == LUM_NO_OBJECT) {
        if (!w->hits.white)
            add_background(w, &path, d, depth == 0);
        return;
    }
    const struct lum_snapshot *snapshot = w->snapshot;
    struct lum_surface s;
    lum_snapshot_surface(snapshot, &w->hits, i, d, &s);
    if (s.instance == LUM_NO_OBJECT) {
        add(w, &path, s.light, s.emission, emission_weight(w, &path, s.light, d, &s));
        return;
    }
    const struct lum_material *m = &snapshot->materials[s.material];
    if (s.backface && !s.white)
        path.throughput = lum_rgb_mul(path.throughput, lum_material_transmittance(m, w->hits.t[i]));
    struct lum_vec3 wo = lum_v3_neg(d);
    struct lum_bsdf b;
    lum_bsdf_init(&b, m, &s, wo);
    if (!(w->lobes_off & LUM_EFFECT_BIT(LUM_EFFECT_TRANSMISSION)))
        lum_bsdf_add_far_side(&b);
    if (w->at_first && w->keeps_first)
        w->first[path.slot].albedo = lum_bsdf_diffuse_albedo(&b);
    if (!lum_rgb_black(b.emission)) {
        if (s.light != LUM_NO_OBJECT)
            add(w, &path, s.light, b.emission, emission_weight(w, &path, s.light, d, &s));
        else if (!(path.pdf_sa > 0.0f)) /* an unlit surface is shown to the eye and in mirrors, it lights nothing */
            add(w, &path, LUM_NO_OBJECT, b.emission, 1.0f);
    }
    if (depth - path.n_panes < w->max_depth)
        scatter(w, path, &(struct vertex){.b = &b, .p = s.p, .wo = wo, .depth = depth});
}

void lum_wave_begin(struct lum_wave *w, const struct lum_snapshot *snapshot, struct lum_counters *counters,
                    uint32_t max_depth, uint32_t effects_off)
{
    w->snapshot = snapshot;
    w->counters = counters;
    w->max_depth = max_depth;
    w->media = snapshot->n_media > 0 && !(effects_off & LUM_EFFECT_BIT(LUM_EFFECT_MEDIA));
    w->panes = snapshot->has_panes && !(effects_off & LUM_EFFECT_BIT(LUM_EFFECT_TRANSMISSION));
    w->roulette_depth = ROULETTE_DEPTH;
    w->gloss_survival = 1.0f;
    w->every_light = false;
    w->illuminance = w->keeps_first = w->at_first = false;
    w->lights_off = effects_off & LIGHT_EFFECTS;
    w->lobes_off = effects_off & LOBE_EFFECTS;
    w->rays.n = w->shadow_rays.n = 0;
    w->parts = NULL;
    w->gains = NULL;
    w->segments_met = NULL;
    w->guide = NULL;
    w->notes = NULL;
    memset(w->radiance, 0, sizeof w->radiance);
    memset(w->first, 0, sizeof w->first);
}

void lum_wave_add_eye(struct lum_wave *w, uint32_t slot, struct lum_sampler sampler, struct lum_vec3 o,
                      struct lum_vec3 d)
{
    w->path[w->rays.n] = (struct lum_path){.throughput = lum_grey(1.0f),
                                           .seen = true,
                                           .survival = 1.0f,
                                           .roulette_scale = 1.0f,
                                           .effect = LUM_EFFECT_ANTIALIAS,
                                           .slot = slot,
                                           .sampler = sampler};
    lum_rays_push(&w->rays, o, d, INFINITY);
}

void lum_wave_add_vertex(struct lum_wave *w, uint32_t slot, struct lum_sampler sampler, struct lum_vec3 p,
                         const struct lum_bsdf *bsdf, struct lum_vec3 wo)
{
    struct lum_path path = {
        .throughput = lum_grey(1.0f), .survival = 1.0f, .roulette_scale = 1.0f, .slot = slot, .sampler = sampler};
    scatter(w, path, &(struct vertex){.b = bsdf, .p = p, .wo = wo});
}

void lum_wave_add_gloss(struct lum_wave *w, uint32_t slot, struct lum_sampler sampler, struct lum_vec3 p,
                        const struct lum_bsdf *bsdf, struct lum_vec3 wo)
{
    struct lum_bsdf gloss = lum_bsdf_gloss(bsdf);
    struct lum_bsdf_sample bs;
    float u_lobe = lum_sampler_2d(&sampler, pair_at(0, PAIR_PICK)).y;
    if (!lum_bsdf_sample(&gloss, wo, lum_sampler_2d(&sampler, pair_at(0, PAIR_BSDF)), u_lobe, &bs))
        return;
    if (!(bs.pdf_sa > 0.0f)) /* mirrors, and what goes straight through, are another estimator's */
        return;
    float reflected = lum_rgb_max(bs.weight) + lum_rgb_max(lum_bsdf_diffuse_albedo(bsdf));
    if (!(reflected > 0.0f))
        return;
    struct lum_path path = {.throughput = bs.weight,
                            .survival = w->gloss_survival / reflected,
                            .roulette_scale = 1.0f,
                            .slot = slot,
                            .sampler = sampler,
                            .p = p,
                            .pdf_sa = bs.pdf_sa,
                            .every_light = true};
    if (bounce_kind(bs.lobe) == LUM_RAY_TRANSMISSION && !bsdf->thin && !bsdf->straight)
        path.roulette_scale = bsdf->eta * bsdf->eta;
    if (!roulette(w, &path, 0))
        return;
    w->counters->rays[LUM_RAY_GLOSSY]++;
    push_path(w, path, p, bsdf->ng, bs.wi);
}

bool lum_wave_add_indirect(struct lum_wave *w, uint32_t slot, struct lum_sampler sampler, struct lum_vec3 p,
                           struct lum_vec3 n, struct lum_vec3 ng)
{
    struct lum_frame frame = lum_frame_from_normal(n);
    struct lum_vec3 local = lum_warp_cosine(lum_sampler_2d(&sampler, pair_at(0, PAIR_BSDF)));
    struct lum_vec3 wi = lum_frame_to_scene(&frame, local);
    if (!(lum_dot(wi, ng) > 0.0f) || !(local.z > 0.0f))
        return false;
    struct lum_path path = {.throughput = lum_grey(1.0f),
                            .survival = 1.0f,
                            .roulette_scale = 1.0f,
                            .slot = slot,
                            .sampler = sampler,
                            .p = p,
                            .pdf_sa = local.z * LUM_INV_PI,
                            .direct_apart = true,
                            .indirect = true};
    w->counters->rays[LUM_RAY_INDIRECT_DIFFUSE]++;
    push_path(w, path, p, ng, wi);
    return true;
}

void lum_wave_step(struct lum_wave *w, uint32_t depth)
{
    uint32_t n = w->rays.n;
    struct lum_trace trace = lum_trace_of(w->snapshot, w->counters);
    if (depth == 0) {
        trace = lum_trace_of_eye(w->snapshot, w->counters);
        w->counters->rays[LUM_RAY_PRIMARY] += n;
    }
    lum_trace_closest(&trace, &w->rays, &w->hits);
    w->at_first = depth == 0;
    w->hits.white = w->at_first && w->illuminance;
    for (uint32_t i = 0; w->segments_met && i < n; i++)
        add_segment(w, &w->rays, i, w->hits.object[i] == LUM_NO_OBJECT ? INFINITY : w->hits.t[i], w->path[i].slot);
    if (w->media && !w->hits.white)
        cross_media(w, depth);
    w->rays.n = 0;
    for (uint32_t i = 0; i < n; i++)
        shade(w, i, depth);
    trace_shadows(w);
}

void lum_wave_run(struct lum_wave *w, uint32_t depth)
{
    trace_shadows(w);
    for (; w->rays.n > 0; depth++)
        lum_wave_step(w, depth);
}

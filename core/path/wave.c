/* Unbiased path tracing: one light picked per vertex (next-event estimation) combined with BSDF sampling by the power
 * heuristic (Veach 1995), Russian roulette on throughput, no clamping. Media (medium/medium.h) dim every segment, and
 * scatter paths (wave_fog.c).
 *
 * A wave goes through two batches per bounce: closest hits of all living paths, then the shadow rays that their
 * vertices asked for. Dead paths are squeezed out as vertices are shaded: path i is read before a path j <= i is
 * written.
 *
 * Of a view's samples, later ones are guided (guide.h): the density of a direction is then of the BSDF and of what was
 * learned. */
#include "core/path/vertex.h"

#include <string.h>

#include "core/light/sample.h"
#include "core/light/tree.h"
#include "core/math/warp.h"
#include "core/scene/surface.h"

#define ROULETTE_DEPTH 3u /* bounces before roulette starts: the first ones carry most of the energy */

/* ---- guiding ---- */

/* Where no lobe is left out, the diffuse one shares its directions with what was learned here: of one side alone. */
static void ask_guide(const struct lum_wave *w, struct lum_vertex *v, uint32_t n_panes)
{
    if (!v->lobes_off && !lum_rgb_black(v->b->diffuse) && v->b->far_prob == 0.0f &&
        v->depth - n_panes < LUM_PATH_GUIDE_NOTES)
        v->guide = lum_path_guide_find(w->guide, v->p, v->b);
}

/* As lum_bsdf_sample. */
static inline bool sample_on(const struct lum_vertex *v, struct lum_vec2 u, float u_lobe,
                             struct lum_path_guide_step *ret_step)
{
    if (v->guide.cell)
        return lum_path_guide_bsdf_sample(&v->guide, v->b, v->wo, u, u_lobe, ret_step);
    return lum_bsdf_sample(v->b, v->wo, u, u_lobe, &ret_step->s);
}

/* The path goes on; throughput: then, but for roulette. */
static void note_step(struct lum_path_guide_notes *notes, const struct lum_path *path, const struct lum_vertex *v,
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

/* Radiance inside a solid is denser by the square of the refractive index; the throughput that decides is without that
 * factor, which the way out takes back, or half of the paths would die inside clear glass. */
bool lum_wave_roulette(const struct lum_wave *w, struct lum_path *path, uint32_t depth)
{
    if (depth < w->roulette_depth)
        return true;
    float survive = fminf(path->survival * lum_rgb_max(path->throughput) / path->roulette_scale, 1.0f);
    if (!(lum_sampler_1d(&path->sampler, lum_wave_pair(depth, LUM_WAVE_PAIR_ROULETTE)) < survive))
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
static void scatter(struct lum_wave *w, struct lum_path path, struct lum_vertex *v)
{
    const struct lum_bsdf *b = v->b;
    if (w->lobes_off)
        v->lobes_off = w->lobes_off & lum_lobe_effects(b);
    if (w->guide)
        ask_guide(w, v, path.n_panes);
    struct lum_vec2 pick = {0.5f, 0.5f};
    bool one_lobe = b->diffuse_prob == 1.0f && b->far_prob == 0.0f && !(v->guide.share > 0.0f);
    if (w->snapshot->lights.n_active > 1 || !one_lobe) /* something to choose */
        pick = lum_sampler_2d(&path.sampler, lum_wave_pair(v->depth, LUM_WAVE_PAIR_PICK));
    lum_wave_sample_lights(w, &path, v, pick.x);
    if (v->fog) { /* what follows is a matter of chance: fog scatters the path instead, or does not */
        if (v->fog->scatters || !(v->fog->pass > 0.0f))
            return;
        path.throughput = lum_rgb_scale(path.throughput, 1.0f / v->fog->pass);
    }
    struct lum_path_guide_step step;
    if (!sample_on(v, lum_sampler_2d(&path.sampler, lum_wave_pair(v->depth, LUM_WAVE_PAIR_BSDF)), pick.y, &step))
        return;
    struct lum_bsdf_sample *bs = &step.s;
    if (v->lobes_off && !lum_vertex_keep_lobe(v, bs))
        return;
    if (w->snapshot->lights.n_active == 0 && bs->pdf_sa > 0.0f)
        return; /* only a mirror could show something that shines without being a light */
    path.throughput = lum_rgb_mul(path.throughput, bs->weight);
    if (lum_lobe_ray_kind(bs->lobe) == LUM_RAY_TRANSMISSION && !b->thin && !b->straight)
        path.roulette_scale *= b->eta * b->eta;
    if (v->guide.cell)
        path.roulette_scale /= step.ratio; /* or what is looked for more often would end more often */
    struct lum_rgb throughput = path.throughput;
    if (lum_rgb_black(path.throughput) || !lum_wave_roulette(w, &path, v->depth))
        return;
    if (w->notes)
        note_step(w->notes, &path, v, &step, throughput);
    if (passes_pane(w, b, bs)) {
        path.n_panes += path.pdf_sa > 0.0f;
    } else {
        path.p = v->p;
        path.n = lum_vertex_lit_normal(b);
        path.from.pdf = 0.0f;
        path.pdf_sa = bs->pdf_sa;
        path.every_light = w->every_light;
        path.plain = true;
        path.direct_apart = false;
        path.was_indirect = path.indirect;
        path.indirect = path.indirect || lum_lobe_ray_kind(bs->lobe) == LUM_RAY_INDIRECT_DIFFUSE;
        path.effect = lum_path_effect(&path, (enum lum_effect)(lum_lobe_ray_kind(bs->lobe) - LUM_RAY_DIRECT));
    }
    w->counters->rays[lum_lobe_ray_kind(bs->lobe)]++;
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
    if (!path->was_indirect && lum_wave_leaves_out(w, light))
        return 0.0f;
    struct lum_vec3 at = s ? s->p : lum_v3(0, 0, 0), ng = s ? s->ng : lum_v3(0, 0, 0);
    float pdf = s ? path->plain ? lum_light_plain_pdf(w->snapshot, light, path->p, d, at, ng)
                                : lum_light_pdf(w->snapshot, light, path->p, d, at, ng)
                  : lum_environment_pdf_by_portals(&w->snapshot->lights.lights[light], path->plain ? w->portals : NULL,
                                                   path->p, d);
    if (path->from.pdf > 0.0f)
        return lum_power_heuristic(path->from.pdf * path->pdf_sa, lum_wave_origin_pdf(w, path, light, pdf));
    if (!path->every_light)
        pdf *= lum_lights_pick_pdf(&w->snapshot->lights, path->p, path->n, light);
    return lum_power_heuristic(path->pdf_sa, pdf);
}

static bool is_seen_lamp(const struct lum_wave *w, const struct lum_path *path, uint32_t light, struct lum_rgb radiance)
{
    return path->effect == LUM_EFFECT_ANTIALIAS && light != LUM_NO_OBJECT &&
           (w->snapshot->lights.lights[light].kind != &lum_emitter_environment ||
            lum_luminance(radiance) > w->apart_cd_m2);
}

/* What shines at the end of the path's ray. */
static void add(struct lum_wave *w, const struct lum_path *path, uint32_t light, struct lum_rgb radiance, float weight)
{
    if (w->lamps_apart && is_seen_lamp(w, path, light, radiance))
        return;
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
    if (effect == LUM_EFFECT_SCATTERING && path->from.pdf > 0.0f && path->from.seen) /* once: likewise */
        effect = LUM_EFFECT_MEDIA;
    lum_wave_bring_home(w, &(struct lum_gain){path->slot, light, value}, effect);
}

static void add_background(struct lum_wave *w, const struct lum_path *path, struct lum_vec3 d, bool eye)
{
    const struct lum_light_table *lights = &w->snapshot->lights;
    if (lights->environment != LUM_NO_OBJECT)
        add(w, path, lights->environment, lum_lights_background(lights, d, eye),
            emission_weight(w, path, lights->environment, d, NULL));
}

/* Where ray i of the batch ended: emission, then scattering. */
static void shade_end(struct lum_wave *w, uint32_t i, uint32_t depth)
{
    struct lum_path path = w->path[i];
    struct lum_vec3 d = lum_rays_direction(&w->rays, i);
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
    const struct lum_wave_fog *fog = w->in_fog && w->fog[i].seen ? &w->fog[i] : NULL;
    if (lum_path_depth(&path, depth) < w->max_depth)
        scatter(w, path, &(struct lum_vertex){.b = &b, .fog = fog, .p = s.p, .wo = wo, .depth = depth});
}

/* Ray i of the batch came back. One path goes on from it at most: from its end, or from fog before that. */
static void shade(struct lum_wave *w, uint32_t i, uint32_t depth)
{
    bool in_fog = w->in_fog && w->fog[i].scatters;
    if (!in_fog || w->fog[i].seen)
        shade_end(w, i, depth);
    if (in_fog)
        lum_wave_scatter_in_fog(w, i, depth);
}

/* What lum_wave_begin may be told to leave out of lights, and of lobes. */
enum {
    LIGHT_EFFECTS = LUM_EFFECT_BIT(LUM_EFFECT_DIRECT) | LUM_EFFECT_BIT(LUM_EFFECT_SOFT_SHADOW) |
                    LUM_EFFECT_BIT(LUM_EFFECT_ENVIRONMENT),
    LOBE_EFFECTS = LUM_EFFECT_BIT(LUM_EFFECT_INDIRECT_DIFFUSE) | LUM_EFFECT_BIT(LUM_EFFECT_REFLECTION) |
                   LUM_EFFECT_BIT(LUM_EFFECT_TRANSMISSION) | LUM_EFFECT_BIT(LUM_EFFECT_GLOSSY),
};

void lum_wave_begin(struct lum_wave *w, const struct lum_snapshot *snapshot, struct lum_counters *counters,
                    uint32_t max_depth, uint32_t effects_off)
{
    w->snapshot = snapshot;
    w->counters = counters;
    w->max_depth = max_depth;
    w->media = snapshot->n_media > 0 && !(effects_off & LUM_EFFECT_BIT(LUM_EFFECT_MEDIA));
    w->scatters = w->media && !(effects_off & LUM_EFFECT_BIT(LUM_EFFECT_SCATTERING));
    w->in_fog = false;
    w->panes = snapshot->has_panes && !(effects_off & LUM_EFFECT_BIT(LUM_EFFECT_TRANSMISSION));
    w->roulette_depth = ROULETTE_DEPTH;
    w->gloss_survival = 1.0f;
    w->every_light = false;
    w->illuminance = w->keeps_first = w->lamps_apart = w->at_first = false;
    w->apart_cd_m2 = INFINITY;
    w->lights_off = effects_off & LIGHT_EFFECTS;
    w->lobes_off = effects_off & LOBE_EFFECTS;
    w->rays.n = w->shadow_rays.n = 0;
    w->parts = NULL;
    w->gains = NULL;
    w->segments_met = NULL;
    w->portals = NULL;
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
    scatter(w, path, &(struct lum_vertex){.b = bsdf, .p = p, .wo = wo});
}

void lum_wave_add_gloss(struct lum_wave *w, uint32_t slot, struct lum_sampler sampler, struct lum_vec3 p,
                        const struct lum_bsdf *bsdf, struct lum_vec3 wo)
{
    struct lum_bsdf gloss = lum_bsdf_gloss(bsdf);
    struct lum_bsdf_sample bs;
    float u_lobe = lum_sampler_2d(&sampler, lum_wave_pair(0, LUM_WAVE_PAIR_PICK)).y;
    if (!lum_bsdf_sample(&gloss, wo, lum_sampler_2d(&sampler, lum_wave_pair(0, LUM_WAVE_PAIR_BSDF)), u_lobe, &bs))
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
    if (lum_lobe_ray_kind(bs.lobe) == LUM_RAY_TRANSMISSION && !bsdf->thin && !bsdf->straight)
        path.roulette_scale = bsdf->eta * bsdf->eta;
    if (!lum_wave_roulette(w, &path, 0))
        return;
    w->counters->rays[LUM_RAY_GLOSSY]++;
    push_path(w, path, p, bsdf->ng, bs.wi);
}

bool lum_wave_add_indirect(struct lum_wave *w, uint32_t slot, struct lum_sampler sampler, struct lum_vec3 p,
                           struct lum_vec3 n, struct lum_vec3 ng)
{
    struct lum_frame frame = lum_frame_from_normal(n);
    struct lum_vec3 local = lum_warp_cosine(lum_sampler_2d(&sampler, lum_wave_pair(0, LUM_WAVE_PAIR_BSDF)));
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
        lum_wave_add_segment(w, &w->rays, i, w->hits.object[i] == LUM_NO_OBJECT ? INFINITY : w->hits.t[i],
                             w->path[i].slot);
    for (uint32_t i = 0; w->notes && i < n; i++) /* before fog on the segment brings its light home */
        note_segment(w, w->path[i].slot);
    w->in_fog = w->scatters && !w->hits.white;
    if (w->media && !w->hits.white)
        lum_wave_cross_media(w, depth);
    w->rays.n = 0;
    for (uint32_t i = 0; i < n; i++) {
        lum_snapshot_ask_ahead(w->snapshot, &w->hits, i, n);
        shade(w, i, depth);
    }
    lum_wave_trace_shadows(w);
}

void lum_wave_run(struct lum_wave *w, uint32_t depth)
{
    lum_wave_trace_shadows(w);
    for (; w->rays.n > 0; depth++)
        lum_wave_step(w, depth);
}

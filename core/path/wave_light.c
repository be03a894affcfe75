/* Light that paths find by sampling it: of one light picked at each vertex, or of all.
 *
 * Shadow rays go straight through panes, and what these leave of the light is that light's. A path that goes through
 * one is still on its way from the vertex before: light that it meets behind is weighted against the light sampled
 * there, by the density with which its direction was drawn there, whichever lobe of the pane it took: the weights of
 * both ways of finding the light add up to 1. Without the effect transmission panes stop both. */
#include "core/path/vertex.h"

#include "core/light/sample.h"
#include "core/light/tree.h"
#include "core/math/warp.h"

void lum_wave_bring_home(struct lum_wave *w, const struct lum_gain *gain, uint8_t effect)
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

void lum_wave_keep_light(struct lum_wave *w, const struct lum_gain *gain, enum lum_ray_kind kind, uint8_t effect,
                         bool has_ray)
{
    if (!has_ray) {
        lum_wave_bring_home(w, gain, effect);
        return;
    }
    w->shadow_gain[w->shadow_rays.n - 1] = *gain;
    w->shadow_kind[w->shadow_rays.n - 1] = (uint8_t)kind;
    w->shadow_effect[w->shadow_rays.n - 1] = effect;
}

struct choice {
    uint32_t light;
    float prob; /* with which it was chosen */
    uint32_t pair;
};

static bool sample_light(const struct lum_wave *w, uint32_t light, struct lum_vec3 p, struct lum_vec2 u,
                         struct lum_light_sample *ret)
{
    const struct lum_light *l = &w->snapshot->lights.lights[light];
    if (l->kind == &lum_emitter_environment)
        return lum_environment_sample_by_portals(l, w->portals, p, u, ret);
    return lum_light_sample_plainly(w->snapshot, light, p, u, ret);
}

/* Light sampled from a vertex; queues its shadow ray. */
static void queue_light(struct lum_wave *w, const struct lum_path *path, const struct lum_vertex *v,
                        struct choice choice)
{
    uint32_t light = choice.light;
    enum lum_ray_kind kind = lum_light_ray_kind(&w->snapshot->lights.lights[light]);
    if (lum_wave_leaves_out(w, light)) {
        if (!path->indirect)
            return;
        kind = LUM_RAY_INDIRECT_DIFFUSE;
    }
    struct lum_light_sample ls;
    struct lum_vec2 u = {0.5f, 0.5f};
    if (!w->snapshot->lights.lights[light].delta)
        u = lum_sampler_2d(&path->sampler, choice.pair);
    if (!sample_light(w, light, v->p, u, &ls))
        return;
    if (w->media)
        ls.radiance = lum_rgb_mul(ls.radiance, lum_media_transmittance(w->snapshot, v->p, ls.wi, ls.distance));
    bool delta = !(ls.pdf_sa > 0.0f);
    float pdf = delta ? choice.prob : choice.prob * ls.pdf_sa, weight = 1.0f, bsdf_pdf_sa;
    struct lum_rgb f;
    if (v->lobes_off && !delta) {
        f = lum_vertex_respond_in_part(v, ls.wi, pdf);
    } else {
        f = lum_bsdf_eval(v->b, v->wo, ls.wi, &bsdf_pdf_sa);
        if (!delta && !lum_rgb_black(f))
            weight = lum_power_heuristic(pdf, lum_vertex_pdf(v, ls.wi, bsdf_pdf_sa));
    }
    struct lum_rgb value = lum_rgb_mul(lum_rgb_mul(path->throughput, f), lum_rgb_scale(ls.radiance, weight / pdf));
    if (lum_rgb_black(value))
        return;
    bool has_ray = lum_shadow_ray(&w->shadow_rays, v->p, v->b->ng, ls.wi, ls.distance);
    uint8_t effect = lum_path_effect(path, lum_light_effect(&w->snapshot->lights.lights[light]));
    lum_wave_keep_light(w, &(struct lum_gain){path->slot, light, value}, kind, effect, has_ray);
}

void lum_wave_add_segment(struct lum_wave *w, const struct lum_rays *rays, uint32_t i, float t, uint32_t slot)
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

void lum_wave_trace_shadows(struct lum_wave *w)
{
    if (w->shadow_rays.n == 0)
        return;
    struct lum_trace trace = lum_trace_of_light(w->snapshot, w->counters, w->panes);
    lum_trace_light(&trace, &w->shadow_rays, w->occluded, w->left);
    for (uint32_t i = 0; i < w->shadow_rays.n; i++) {
        w->counters->rays[w->shadow_kind[i]]++;
        if (w->segments_met)
            lum_wave_add_segment(w, &w->shadow_rays, i, w->shadow_rays.tfar[i], w->shadow_gain[i].slot);
        if (w->occluded[i])
            continue;
        if (trace.panes)
            w->shadow_gain[i].value = lum_rgb_mul(w->shadow_gain[i].value, w->left[i]);
        lum_wave_bring_home(w, &w->shadow_gain[i], w->shadow_effect[i]);
    }
    w->shadow_rays.n = 0;
}

void lum_wave_sample_lights(struct lum_wave *w, const struct lum_path *path, const struct lum_vertex *v, float u_pick)
{
    const struct lum_light_table *t = &w->snapshot->lights;
    if (!w->every_light) {
        struct choice one = {.pair = lum_wave_pair(v->depth, LUM_WAVE_PAIR_LIGHT)};
        one.light = lum_lights_pick_from(t, v->p, lum_vertex_lit_normal(v->b), u_pick, &one.prob);
        if (one.light != LUM_NO_OBJECT)
            queue_light(w, path, v, one);
        return;
    }
    if (w->shadow_rays.n + t->n_active > LUM_RAY_BATCH)
        lum_wave_trace_shadows(w);
    for (uint32_t i = 0; i < t->n_active; i++)
        queue_light(w, path, v,
                    (struct choice){t->active[i], 1.0f, LUM_PAIRS_PATH_LIGHTS + v->depth * LUM_WAVE_LIGHTS + i});
}

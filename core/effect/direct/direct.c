#include "core/effect/direct/direct.h"

#include <string.h>

#include "core/math/color.h"
#include "core/light/emitter.h"
#include "core/light/irradiance.h"
#include "core/math/sampler.h"
#include "core/math/sampler_pairs.h"

void lum_vertices_push(struct lum_vertices *v, uint32_t slot, struct lum_vec3 p, struct lum_vec3 wo,
                       uint32_t pixel_seed)
{
    uint32_t i = v->n++;
    v->slot[i] = slot;
    v->p[i] = p;
    v->wo[i] = wo;
    v->weight[i] = lum_grey(1.0f);
    v->pixel_seed[i] = pixel_seed;
}

bool lum_bsdf_spreads(const struct lum_bsdf *b)
{
    return lum_bsdf_has_gloss(b) || !lum_rgb_black(b->diffuse);
}

/* Where a light shines from that casts hard shadows, as a pair of its samples: near its middle, so that the one sample
 * stands well for all of them, but off its axes. A rod that a lamp hangs on meets its middle, and would shadow all that
 * the lamp lights; from here it shadows a strip. The same for all pixels, or shadows would not be hard. */
static const struct lum_vec2 hard_sample = {0.42f, 0.47f};

static bool is_hard(const struct lum_direct *job)
{
    const struct lum_emitter_row *row = job->snapshot->lights.lights[job->light].kind;
    return job->hard && row->across && !row->from_afar; /* lamps with a body of their own; a mesh is the scene's */
}

/* What a faint reflection shows may be as much noisier as it is fainter: from this weight in the pixel on a vertex has
 * all samples. CornellBox-Water (600 x 400) takes 1.02 million rays for soft shadows instead of 2.30. */
#define ALL_SAMPLES_WEIGHT 0.5f

static uint32_t samples_of(const struct lum_vertices *v, uint32_t i, uint32_t n_samples)
{
    float share = lum_min(lum_rgb_max(v->weight[i]) / ALL_SAMPLES_WEIGHT, 1.0f);
    uint32_t n = (uint32_t)ceilf(share * (float)n_samples);
    return n > 0 ? n : 1;
}

/* Reflected light of sample k at vertex i, were it visible; false when there is none. */
static bool sample_value(const struct lum_direct *job, uint32_t i, uint32_t k, uint32_t n_samples,
                         struct lum_light_sample *ret_sample, struct lum_rgb *ret_value)
{
    const struct lum_vertices *v = job->vertices;
    struct lum_sampler sampler = {v->pixel_seed[i], k};
    struct lum_vec2 u = hard_sample;
    n_samples = samples_of(v, i, n_samples);
    if (k >= n_samples)
        return false;
    if (!is_hard(job))
        u = lum_sampler_2d(&sampler, LUM_PAIRS_LIGHTS | job->salt);
    if (!lum_light_sample_plainly(job->snapshot, job->light, v->p[i], u, ret_sample))
        return false;
    float pdf_unused;
    struct lum_rgb f = lum_bsdf_eval(&v->bsdf[i], v->wo[i], ret_sample->wi, &pdf_unused);
    float pdf = (ret_sample->pdf_sa > 0.0f ? ret_sample->pdf_sa : 1.0f) * (float)n_samples;
    *ret_value = lum_rgb_mul(lum_rgb_mul(v->weight[i], f), lum_rgb_scale(ret_sample->radiance, 1.0f / pdf));
    if (job->media && !lum_rgb_black(*ret_value))
        *ret_value = lum_rgb_mul(*ret_value,
                                 lum_media_transmittance(job->snapshot, v->p[i], ret_sample->wi, ret_sample->distance));
    return !lum_rgb_black(*ret_value);
}

bool lum_direct_unoccluded(const struct lum_direct *job, uint32_t i, struct lum_rgb *ret_value)
{
    struct lum_light_sample unused;
    return sample_value(job, i, 0, 1, &unused, ret_value);
}

static void add(const struct lum_direct *job, uint32_t i, struct lum_rgb value)
{
    struct lum_rgb *sum = &job->response[job->vertices->slot[i]];
    *sum = lum_rgb_add(*sum, value);
}

/* What a vertex gets by way of panes, which is kept as a mean over its samples: so all of them are summed up first. */
struct behind {
    struct lum_rgb value; /* of those that are visible, were no pane in between */
    struct lum_rgb
        left; /* sum of the shares of those that were traced now, weighted by the luminance of their values */
    float known, traced; /* luminance of the others, and of these */
};

/* What is added depends on what is kept alone: traced or known, the sum is the same. */
static void end_behind(const struct lum_direct *job, const struct behind *behind)
{
    const struct lum_vertices *v = job->vertices;
    for (uint32_t i = 0; i < v->n; i++) {
        const struct behind *b = &behind[i];
        uint32_t *left = &job->left[v->slot[i]];
        if (b->traced > 0.0f) {
            struct lum_rgb all = lum_rgb_mad(b->left, lum_transmittance_unpack(*left), b->known);
            *left = lum_transmittance_pack(lum_rgb_scale(all, 1.0f / (b->known + b->traced)));
        }
        add(job, i, lum_rgb_mul(b->value, lum_transmittance_unpack(*left)));
    }
}

/* left: what panes leave of the sample; NULL: it was known before. */
static void add_behind(struct behind *b, struct lum_rgb value, const struct lum_rgb *left)
{
    float weight = lum_luminance(value);
    b->value = lum_rgb_add(b->value, value);
    b->known += left ? 0.0f : weight;
    b->traced += left ? weight : 0.0f;
    if (left)
        b->left = lum_rgb_mad(b->left, *left, weight);
}

/* A sample that is visible. behind: NULL where nothing is kept of panes. */
static inline void add_visible(const struct lum_direct *job, struct behind *behind, uint32_t i, struct lum_rgb value,
                               const struct lum_rgb *left)
{
    if (behind)
        add_behind(&behind[i], value, left);
    else
        add(job, i, left ? lum_rgb_mul(value, *left) : value);
}

/* Sample k of every vertex. Per slot the samples are added in the order of k, whether they are traced or known. */
static void direct_sample(const struct lum_direct *job, uint32_t k, uint32_t n_samples, struct behind *behind)
{
    const struct lum_vertices *v = job->vertices;
    const struct lum_light *light = &job->snapshot->lights.lights[job->light];
    const struct lum_rgb all = lum_grey(1.0f);
    struct lum_rays rays;
    struct lum_rgb value[LUM_RAY_BATCH], left[LUM_RAY_BATCH];
    uint8_t vertex[LUM_RAY_BATCH], occluded[LUM_RAY_BATCH];
    uint16_t bit = (uint16_t)(1u << k);
    rays.n = 0;
    for (uint32_t i = 0; i < v->n; i++) {
        struct lum_light_sample ls;
        struct lum_rgb reflected;
        struct lum_visibility *visibility = job->visibility ? &job->visibility[v->slot[i]] : NULL;
        if (!sample_value(job, i, k, n_samples, &ls, &reflected)) {
            if (visibility && light->delta) /* who looks for edges must find what a new view does */
                visibility->traced = visibility->visible = 0;
            continue;
        }
        if (visibility && (visibility->traced & bit)) {
            if (visibility->visible & bit)
                add_visible(job, behind, i, reflected, NULL);
            continue;
        }
        uint32_t r = rays.n;
        if (lum_shadow_ray(&rays, v->p[i], v->bsdf[i].ng, ls.wi, ls.distance)) {
            value[r] = reflected;
            vertex[r] = (uint8_t)i;
            continue;
        }
        add_visible(job, behind, i, reflected, &all);
        if (visibility) {
            visibility->traced |= bit;
            visibility->visible |= bit;
        }
    }
    if (rays.n == 0)
        return;
    struct lum_trace trace = lum_trace_of_light(job->snapshot, job->counters, job->panes);
    lum_trace_light(&trace, &rays, occluded, left);
    job->counters->rays[lum_light_ray_kind(light)] += rays.n;
    for (uint32_t r = 0; r < rays.n; r++) {
        if (!occluded[r])
            add_visible(job, behind, vertex[r], value[r], trace.panes ? &left[r] : NULL);
        if (!job->visibility)
            continue;
        struct lum_visibility *visibility = &job->visibility[v->slot[vertex[r]]];
        visibility->traced |= bit;
        if (!occluded[r])
            visibility->visible |= bit;
    }
}

/* What vertex i gets, were all of the light visible, in closed form; and what the samples say of that. */
static struct lum_rgb whole_light(const struct lum_direct *job, uint32_t i, uint32_t n_samples,
                                  struct lum_rgb *ret_sampled)
{
    const struct lum_vertices *v = job->vertices;
    const struct lum_bsdf *b = &v->bsdf[i];
    struct lum_light_sample ls;
    struct lum_rgb value, radiance = lum_grey(0.0f);
    *ret_sampled = lum_grey(0.0f);
    for (uint32_t k = 0; k < n_samples; k++)
        if (sample_value(job, i, k, n_samples, &ls, &value)) {
            *ret_sampled = lum_rgb_add(*ret_sampled, value);
            radiance = ls.radiance; /* the same from all of it */
        }
    struct lum_irradiance e;
    lum_light_irradiance(&job->snapshot->lights.lights[job->light], 1, &v->p[i], &b->frame.n, &e);
    struct lum_rgb albedo = lum_rgb_mul(v->weight[i], lum_bsdf_diffuse_at(b, e.mean_cos));
    return lum_rgb_scale(lum_rgb_mul(albedo, radiance), e.cosine_integral * LUM_INV_PI);
}

/* Where a light is seen in whole, there is no noise; and of hard shadows, whose one sample near the middle of a lamp
 * would count for all of it, a sheet right before a wide lamp is as bright as it is. At most one vertex per slot. */
static void light_by_share(const struct lum_direct *job, uint32_t n_samples)
{
    struct lum_rgb seen[LUM_TILE_PIXELS] = {{0}};
    struct lum_direct traced = *job;
    traced.response = seen;
    for (uint32_t k = 0; k < n_samples; k++)
        direct_sample(&traced, k, n_samples, NULL);
    for (uint32_t i = 0; i < job->vertices->n; i++) {
        struct lum_rgb s = seen[job->vertices->slot[i]], sampled;
        if (lum_rgb_black(s))
            continue;
        struct lum_rgb whole = whole_light(job, i, n_samples, &sampled);
        add(job, i, lum_rgb_mul(whole, lum_rgb_share(s, sampled)));
    }
}

void lum_direct_light(const struct lum_direct *job)
{
    struct behind behind[LUM_RAY_BATCH], *kept = job->visibility && job->left ? behind : NULL;
    if (job->vertices->n == 0)
        return;
    const struct lum_light *light = &job->snapshot->lights.lights[job->light];
    bool delta = light->delta;
    uint32_t n_samples = delta || is_hard(job) ? 1 : job->n_samples;
    /* A sample of a mesh may lie on its far side, and say nothing of what is seen. */
    bool by_share = job->by_share && !delta && !job->media && light->kind != &lum_emitter_mesh;
    if (by_share && lum_light_has_irradiance(light)) {
        light_by_share(job, n_samples);
        return;
    }
    if (kept)
        memset(kept, 0, job->vertices->n * sizeof *kept);
    for (uint32_t k = 0; k < n_samples; k++)
        direct_sample(job, k, n_samples, kept);
    if (kept)
        end_behind(job, kept);
}

const struct lum_effect_row lum_effect_direct = {.demand = lum_demand_by_light,
                                                 .why = "shines from a point or direction",
                                                 .why_not = "no point, spot or directional light is on"};

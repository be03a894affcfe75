#include "core/estimator/direct.h"

/* Sampler pairs of lights are spread over the upper half; the path tracer's are small numbers. */
#define PAIR_LIGHTS 0x80000000u

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
    return b->alpha > 0.0f || !lum_rgb_black(b->diffuse);
}

/* Where a light shines from that casts hard shadows, as a pair of its samples: near its middle, so that the one sample
 * stands well for all of them, but off its axes. A rod that a lamp hangs on meets its middle, and would shadow all that
 * the lamp lights; from here it shadows a strip. The same for all pixels, or shadows would not be hard. */
static const struct lum_vec2 hard_sample = {0.42f, 0.47f};

static bool is_hard(const struct lum_direct *job)
{
    enum lum_emitter kind = job->snapshot->lights.lights[job->light].kind;
    return job->hard && (kind == LUM_EMIT_QUAD || kind == LUM_EMIT_DISC || kind == LUM_EMIT_SPHERE);
}

/* Reflected light of sample k at vertex i, were it visible; false when there is none. */
static bool sample_value(const struct lum_direct *job, uint32_t i, uint32_t k, uint32_t n_samples,
                         struct lum_light_sample *ret_sample, struct lum_rgb *ret_value)
{
    const struct lum_vertices *v = job->vertices;
    struct lum_sampler sampler = {v->pixel_seed[i], k};
    struct lum_vec2 u = hard_sample;
    if (!is_hard(job))
        u = lum_sampler_2d(&sampler, PAIR_LIGHTS | job->salt);
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

/* Sample k of every vertex. Per slot the samples are added in the order of k, whether they are traced or known. */
static void direct_sample(const struct lum_direct *job, uint32_t k, uint32_t n_samples)
{
    const struct lum_vertices *v = job->vertices;
    const struct lum_light *light = &job->snapshot->lights.lights[job->light];
    struct lum_rays rays;
    struct lum_rgb value[LUM_RAY_BATCH];
    uint8_t vertex[LUM_RAY_BATCH], occluded[LUM_RAY_BATCH];
    uint16_t bit = (uint16_t)(1u << k);
    rays.n = 0;
    for (uint32_t i = 0; i < v->n; i++) {
        struct lum_light_sample ls;
        struct lum_rgb reflected;
        struct lum_seen *seen = job->seen ? &job->seen[v->slot[i]] : NULL;
        if (!sample_value(job, i, k, n_samples, &ls, &reflected)) {
            if (seen && light->delta) /* who looks for edges must find what a new view does */
                seen->traced = seen->visible = 0;
            continue;
        }
        if (seen && (seen->traced & bit)) {
            if (seen->visible & bit)
                add(job, i, reflected);
            continue;
        }
        uint32_t r = rays.n;
        if (lum_shadow_ray(&rays, v->p[i], v->bsdf[i].ng, ls.wi, ls.distance)) {
            value[r] = reflected;
            vertex[r] = (uint8_t)i;
            continue;
        }
        add(job, i, reflected);
        if (seen) {
            seen->traced |= bit;
            seen->visible |= bit;
        }
    }
    if (rays.n == 0)
        return;
    struct lum_trace trace = lum_trace_of(job->snapshot, job->counters);
    lum_trace_any(&trace, &rays, occluded);
    job->counters->rays[lum_light_ray_kind(light)] += rays.n;
    for (uint32_t r = 0; r < rays.n; r++) {
        if (!occluded[r])
            add(job, vertex[r], value[r]);
        if (!job->seen)
            continue;
        struct lum_seen *seen = &job->seen[v->slot[vertex[r]]];
        seen->traced |= bit;
        if (!occluded[r])
            seen->visible |= bit;
    }
}

void lum_direct_light(const struct lum_direct *job)
{
    if (job->vertices->n == 0)
        return;
    bool one = job->snapshot->lights.lights[job->light].delta || is_hard(job);
    uint32_t n_samples = one ? 1 : job->n_samples;
    for (uint32_t k = 0; k < n_samples; k++)
        direct_sample(job, k, n_samples);
}

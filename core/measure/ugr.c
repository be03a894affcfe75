#include "core/measure/ugr.h"

#include "core/light/environment.h"
#include "core/light/sample.h"
#include "core/math/sampler.h"
#include "core/measure/position_index.h"
#include "core/trace/rays.h"

/* Smaller and larger sources are not what UGR was made for (CIE 117). */
#define SMALL_SR 0.0003
#define LARGE_SR 0.1

struct lum_vec3 lum_observer_upright(struct lum_vec3 sight)
{
    struct lum_vec3 up = fabsf(sight.y) < 0.9999f ? lum_v3(0, 1, 0) : lum_v3(1, 0, 0);
    return lum_normalize(lum_v3_mad(up, sight, -lum_dot(up, sight)));
}

/* The eye, in scene units. */
struct eye {
    struct lum_vec3 at, sight, up;
};

/* A mean over samples, and that of their squares. */
struct mean {
    double value, square;
};

static void add(struct mean *m, double sample, uint32_t n)
{
    m->value += sample / n;
    m->square += sample * sample / n;
}

/* Variance of a mean of n samples over its square. */
static double relative_variance(const struct mean *m, uint32_t n)
{
    return m->value > 0.0 ? fmax(m->square / (m->value * m->value) - 1.0, 0.0) / n : 0.0;
}

/* What the eye sees of a lamp before it, by n samples. Of one without an extent there is light alone. */
struct seen {
    double solid_angle;     /* sr */
    struct mean radiance;   /* cd/m2 sr */
    struct mean lx;         /* on a plane that faces the line of sight */
    struct mean bright;     /* L^2 / p^2 sr, each place with its own p: lamps may be large */
    struct lum_vec3 middle; /* not unit */
    uint32_t n;
};

static void add_sample(struct seen *seen, const struct lum_light_sample *at, struct lum_rgb radiance,
                       const struct eye *eye)
{
    double ahead = (double)lum_dot(at->wi, eye->sight), cd_m2 = (double)lum_luminance(radiance);
    if (!(ahead > 0.0))
        return;
    double per = at->pdf_sa > 0.0f ? 1.0 / (double)at->pdf_sa : 1.0; /* of a point, radiance is lx */
    add(&seen->lx, cd_m2 * per * ahead, seen->n);
    if (!(at->pdf_sa > 0.0f))
        return;
    seen->solid_angle += per / seen->n;
    add(&seen->radiance, cd_m2 * per, seen->n);
    seen->middle = lum_v3_mad(seen->middle, at->wi, (float)per);
    double p = lum_position_index(eye->sight, eye->up, at->wi);
    if (cd_m2 > LUM_DGP_SOURCE_CD_M2)
        add(&seen->bright, cd_m2 * cd_m2 * per / (p * p), seen->n);
}

/* What is not brighter than least_cd_m2, before anything dims it, is left out. */
static void see(const struct lum_snapshot *s, uint32_t light, const struct eye *eye, uint32_t n, uint32_t seed,
                double least_cd_m2, struct seen *ret)
{
    struct lum_counters counters = {0};
    struct lum_light_sample samples[LUM_RAY_BATCH];
    struct lum_rays rays = {.n = 0};
    struct lum_rgb left[LUM_RAY_BATCH];
    uint8_t occluded[LUM_RAY_BATCH];
    *ret = (struct seen){.n = s->lights.lights[light].delta ? 1 : n};
    for (uint32_t i = 0; i < ret->n; i++) {
        struct lum_sampler sampler = lum_sampler_at(light, 0, i, seed);
        struct lum_light_sample *at = &samples[rays.n];
        if (!lum_light_sample_at(s, light, eye->at, lum_sampler_2d(&sampler, 0), at) || lum_rgb_black(at->radiance))
            continue;
        if (!lum_shadow_ray(&rays, eye->at, lum_v3(0, 0, 0), at->wi, at->distance))
            lum_rays_push(&rays, eye->at, at->wi, 0.0f); /* too near for anything between */
    }
    struct lum_trace trace = lum_trace_of_light(s, &counters, true);
    if (rays.n > 0)
        lum_trace_light(&trace, &rays, occluded, left);
    for (uint32_t i = 0; i < rays.n; i++) {
        if (occluded[i])
            continue;
        struct lum_rgb l = trace.panes ? lum_rgb_mul(samples[i].radiance, left[i]) : samples[i].radiance;
        if (s->n_media > 0)
            l = lum_rgb_mul(l, lum_media_transmittance(s, eye->at, samples[i].wi, samples[i].distance));
        if ((double)lum_luminance(samples[i].radiance) > least_cd_m2)
            add_sample(ret, &samples[i], l, eye);
    }
}

/* Sums of variances. */
struct variances {
    double sum, bright, lx;
};

/* For UGR: a lamp is as bright everywhere as in the mean. */
static void count_source(struct lum_glare *glare, const struct seen *seen, const struct eye *eye,
                         double *inout_variance)
{
    double p = lum_position_index_ugr(eye->sight, eye->up, lum_normalize(seen->middle));
    if (isinf(p)) {
        if (!(seen->solid_angle > LARGE_SR)) /* a ceiling that shines is no lamp overhead: it begins before the eye */
            return;
        p = LUM_POSITION_INDEX_MAX;
    }
    double l2w_p2 = seen->radiance.value * seen->radiance.value / (seen->solid_angle * p * p); /* L w = radiance */
    glare->sum += l2w_p2;
    *inout_variance += l2w_p2 * l2w_p2 * relative_variance(&seen->radiance, seen->n);
    glare->n_sources++;
    glare->n_small += seen->solid_angle < SMALL_SR;
    glare->n_large += seen->solid_angle > LARGE_SR;
}

static void count_in(struct lum_glare *glare, const struct lum_light *l, const struct seen *seen, const struct eye *eye,
                     struct variances *v)
{
    bool from_afar = lum_light_is_from_afar(l);
    glare->direct_lx += seen->lx.value;
    glare->n_points += l->delta && (!from_afar || seen->lx.value > 0.0);
    if (!(seen->solid_angle > 0.0))
        return;
    v->lx += seen->lx.value * seen->lx.value * relative_variance(&seen->lx, seen->n);
    if (!from_afar)
        count_source(glare, seen, eye, &v->sum);
    if (seen->bright.value > 0.0) {
        glare->bright.sum += seen->bright.value;
        v->bright += seen->bright.value * seen->bright.value * relative_variance(&seen->bright, seen->n);
        glare->bright.n++;
    }
}

/* ---- a sun in the picture of a sky ---- */

static bool has_peak(const struct lum_light *l)
{
    double cd_m2 = (double)lum_luminance(l->power);
    if (l->env)
        cd_m2 *= lum_env_map_peak(l->env) * lum_env_map_mean_luminance(l->env);
    return cd_m2 > LUM_DGP_PEAK_CD_M2;
}

/* Directions are drawn by their luminance: what is small and bright gets most of them. A sun that gives a tenth of a
 * sky's light is then known to 0.005 of DGP. */
#define PEAK_BATCHES 4u

static void see_peak(const struct lum_snapshot *s, const struct eye *eye, uint32_t seed, struct lum_glare *glare,
                     double *inout_variance)
{
    struct mean bright = {0};
    for (uint32_t i = 0; i < PEAK_BATCHES; i++) {
        struct seen seen;
        see(s, s->lights.environment, eye, LUM_RAY_BATCH, seed + i, LUM_DGP_PEAK_CD_M2, &seen);
        bright.value += seen.bright.value / PEAK_BATCHES;
        bright.square += seen.bright.square / PEAK_BATCHES;
    }
    if (!(bright.value > 0.0))
        return;
    glare->bright.sum += bright.value;
    glare->bright.n++;
    *inout_variance += bright.value * bright.value * relative_variance(&bright, PEAK_BATCHES * LUM_RAY_BATCH);
}

void lum_glare_of(const struct lum_snapshot *s, const struct lum_observer *o, uint32_t n_rays, uint32_t seed,
                  struct lum_glare *ret)
{
    struct eye eye = {.at = lum_world_to_scene(&s->norm, o->eye_world), .sight = lum_normalize(o->direction)};
    eye.up = lum_observer_upright(eye.sight);
    struct variances v = {0};
    *ret = (struct lum_glare){0};
    n_rays = n_rays < LUM_RAY_BATCH ? n_rays : LUM_RAY_BATCH;
    for (uint32_t i = 0; i < s->lights.n_active; i++) {
        uint32_t light = s->lights.active[i];
        struct seen seen;
        if (light == s->lights.environment) {
            if (has_peak(&s->lights.lights[light]))
                see_peak(s, &eye, seed, ret, &v.bright);
            continue;
        }
        see(s, light, &eye, n_rays, seed, 0.0, &seen);
        count_in(ret, &s->lights.lights[light], &seen, &eye, &v);
    }
    ret->sum_stderr = sqrt(v.sum);
    ret->direct_stderr = sqrt(v.lx);
    ret->bright.sum_stderr = sqrt(v.bright);
}

struct lum_ugr lum_ugr_of(const struct lum_glare *g, double background, double background_stderr)
{
    const double per_log = 8.0 / log(10.0);
    if (!(g->sum > 0.0))
        return (struct lum_ugr){-(double)INFINITY, 0.0};
    if (!(background > 0.0))
        return (struct lum_ugr){(double)INFINITY, 0.0}; /* a lamp in perfect darkness */
    return (struct lum_ugr){8.0 * log10(0.25 / background * g->sum),
                            per_log * hypot(background_stderr / background, g->sum_stderr / g->sum)};
}

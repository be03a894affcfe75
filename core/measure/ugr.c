#include "core/measure/ugr.h"

#include "core/light/sample.h"
#include "core/math/sampler.h"
#include "core/trace/rays.h"

#define INDEX_MAX 16.0 /* where the tables of the position index end */
/* Smaller and larger sources are not what UGR was made for (CIE 117). */
#define SMALL_SR 0.0003
#define LARGE_SR 0.1

static double degrees(double rad)
{
    return rad * (180.0 / LUM_PI_D);
}

double lum_position_index(struct lum_vec3 sight, struct lum_vec3 up, struct lum_vec3 wi)
{
    double ahead = (double)lum_dot(wi, sight), above = (double)lum_dot(wi, up),
           aside = (double)fabsf(lum_dot(wi, lum_cross(sight, up)));
    if (!(ahead > 0.0))
        return (double)INFINITY;
    /* s: between the line of sight and the source; t: of the plane of both from the vertical */
    double s = degrees(atan2(hypot(above, aside), ahead)), t = degrees(atan2(aside, fabs(above)));
    double index;
    if (above >= 0.0) {
        index = exp((35.2 - 0.31889 * t - 1.22 * exp(-2.0 * t / 9.0)) * 1e-3 * s +
                    (21.0 + 0.26667 * t - 0.002963 * t * t) * 1e-5 * s * s);
    } else {
        double c = fabs(above) / hypot(above, aside);
        double b = degrees(atan2(hypot(above, aside) * sqrt(1.0 + 0.3225 * c * c), ahead));
        index = exp(6.49e-3 * b + 21e-5 * b * b);
    }
    return fmin(index, INDEX_MAX);
}

/* Upright, at right angles to the line of sight. */
static struct lum_vec3 upright(struct lum_vec3 sight)
{
    struct lum_vec3 up = fabsf(sight.y) < 0.9999f ? lum_v3(0, 1, 0) : lum_v3(1, 0, 0);
    return lum_normalize(lum_v3_mad(up, sight, -lum_dot(up, sight)));
}

/* A lamp as the eye sees it: means over n samples of 1 / pdf and L / pdf where it shines, and its middle there. */
struct seen {
    double solid_angle, radiance; /* sr; cd/m2 sr */
    double square;                /* of radiance: sum of squares of samples */
    struct lum_vec3 middle;       /* not unit */
};

static void see(const struct lum_snapshot *s, uint32_t light, struct lum_vec3 eye, uint32_t n, uint32_t seed,
                struct seen *ret)
{
    struct lum_counters counters = {0};
    struct lum_light_sample samples[LUM_RAY_BATCH];
    struct lum_rays rays = {.n = 0};
    struct lum_rgb left[LUM_RAY_BATCH];
    uint8_t occluded[LUM_RAY_BATCH];
    *ret = (struct seen){0};
    for (uint32_t i = 0; i < n; i++) {
        struct lum_sampler sampler = lum_sampler_at(light, 0, i, seed);
        struct lum_light_sample *at = &samples[rays.n];
        if (!lum_light_sample_at(s, light, eye, lum_sampler_2d(&sampler, 0), at) || lum_rgb_black(at->radiance))
            continue;
        if (!lum_shadow_ray(&rays, eye, lum_v3(0, 0, 0), at->wi, at->distance))
            lum_rays_push(&rays, eye, at->wi, 0.0f); /* too near for anything between */
    }
    struct lum_trace trace = lum_trace_of_light(s, &counters, true);
    if (rays.n > 0)
        lum_trace_light(&trace, &rays, occluded, left);
    for (uint32_t i = 0; i < rays.n; i++) {
        if (occluded[i])
            continue;
        struct lum_rgb l = trace.panes ? lum_rgb_mul(samples[i].radiance, left[i]) : samples[i].radiance;
        if (s->n_media > 0)
            l = lum_rgb_mul(l, lum_media_transmittance(s, eye, samples[i].wi, samples[i].distance));
        double per = 1.0 / (double)samples[i].pdf_sa, value = (double)lum_luminance(l) * per;
        ret->solid_angle += per / n;
        ret->radiance += value / n;
        ret->square += value * value / n;
        ret->middle = lum_v3_mad(ret->middle, samples[i].wi, (float)per);
    }
}

void lum_glare_of(const struct lum_snapshot *s, const struct lum_observer *o, uint32_t n_rays, uint32_t seed,
                  struct lum_glare *ret)
{
    struct lum_vec3 eye = lum_world_to_scene(&s->norm, o->eye_world), sight = lum_normalize(o->direction),
                    up = upright(sight);
    double variance = 0.0;
    *ret = (struct lum_glare){0};
    n_rays = n_rays < LUM_RAY_BATCH ? n_rays : LUM_RAY_BATCH;
    for (uint32_t i = 0; i < s->lights.n_active; i++) {
        const struct lum_light *l = &s->lights.lights[s->lights.active[i]];
        if (lum_light_is_from_afar(l))
            continue;
        if (l->delta) {
            ret->n_points++;
            continue;
        }
        struct seen seen;
        see(s, s->lights.active[i], eye, n_rays, seed, &seen);
        if (!(seen.solid_angle > 0.0))
            continue;
        double p = lum_position_index(sight, up, lum_normalize(seen.middle));
        if (!isfinite(p))
            continue;
        double glare = seen.radiance * seen.radiance / (seen.solid_angle * p * p);        /* L^2 w = (L w)^2 / w */
        double relative = (seen.square / (seen.radiance * seen.radiance) - 1.0) / n_rays; /* variance of L w */
        ret->sum += glare;
        variance += glare * glare * fmax(relative, 0.0);
        ret->n_sources++;
        ret->n_small += seen.solid_angle < SMALL_SR;
        ret->n_large += seen.solid_angle > LARGE_SR;
    }
    ret->sum_stderr = sqrt(variance);
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

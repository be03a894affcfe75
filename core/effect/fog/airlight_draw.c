/* Pairs of medium and light, and where along a ray their points are drawn. */
#include "core/effect/fog/airlight.h"
#include "core/light/emitter.h"
#include "core/math/warp.h"

/* Nearer to the ray than this, relative to the ray's length in the medium, and for less optical depth than this, a
 * light's halo is aimed at. For the samples 0.06 would do; the closed form, which has few points, gains up to 0.3. At a
 * depth of 2 a seventh of the light is left: beyond, dimming decides where light comes from, and is aimed at. */
#define NEAR_RATIO 0.3f
#define NEAR_DEPTH 2.0f

/* ---- pairs ---- */

bool lum_airlight_next(const struct lum_pass *pass, uint32_t i, struct lum_airlight_pair *ret_pair)
{
    const struct lum_light_table *lights = &pass->snapshot->lights;
    if (i >= pass->snapshot->n_media * lights->n_active)
        return false;
    uint32_t medium = i / lights->n_active, light = lights->active[i % lights->n_active];
    const struct lum_airlights *kept = lum_airlights_of(pass);
    uint32_t slots = kept->n, at = medium * lights->n_lights + light; /* whatever is switched on */
    bool alone = !kept->shared || at < slots - 1;
    *ret_pair = (struct lum_airlight_pair){medium, light, alone ? at : slots - 1, alone};
    return true;
}

struct lum_rgb lum_airlight_power(const struct lum_pass *pass, const struct lum_airlight_pair *pair)
{
    return pair->alone ? pass->snapshot->lights.lights[pair->light].power : lum_grey(1.0f);
}

/* ---- along one ray ---- */

struct lum_scatter_query lum_airlight_query(const struct lum_pass *pass, const struct lum_airlight_pair *pair,
                                            uint32_t x, uint32_t y)
{
    return (struct lum_scatter_query){
        .snapshot = pair->alone ? &pass->layers->unit : pass->snapshot,
        .medium = pair->medium,
        .light = pair->light,
        .o = pass->eye.o,
        .d = lum_eye_direction(&pass->eye, (float)x + 0.5f, (float)y + 0.5f),
        .tmax = pass->surfaces->depth[(size_t)y * pass->tiling.w + x],
    };
}

/* The least that dims what is scattered. */
static float least_sigma(const struct lum_medium *m)
{
    float sigma = INFINITY;
    if (m->sigma_s.r > 0.0f)
        sigma = m->sigma_t.r;
    if (m->sigma_s.g > 0.0f)
        sigma = lum_min(sigma, m->sigma_t.g);
    if (m->sigma_s.b > 0.0f)
        sigma = lum_min(sigma, m->sigma_t.b);
    return sigma;
}

static bool has_place(const struct lum_light *l)
{
    return l->kind->half != NULL;
}

/* Towards the light the way to it gets shorter: light is dimmed by exp(-sigma (s + r(s))), of which the exponent grows
 * as s (1 - cos) at first. How much it grows up to where the ray passes the light decides which of the two is aimed at.
 */
static void aim(struct lum_airlight_draw *w, struct lum_vec3 light, float length)
{
    const struct lum_segment *s = &w->segment;
    float ahead = w->angle.nearest - s->t0, way = lum_clamp(ahead, 0.0f, s->t1 - s->t0);
    float r0 = lum_length(lum_v3_sub(light, lum_v3_mad(s->o, s->d, s->t0)));
    float r = lum_length(lum_v3_sub(light, lum_v3_mad(s->o, s->d, s->t0 + way)));
    w->by_angle = w->angle.miss < NEAR_RATIO * length && w->sigma * (way + r - r0) < NEAR_DEPTH;
    if (r0 > 0.0f)
        w->sigma *= 1.0f - lum_clamp(ahead / r0, -1.0f, 1.0f);
}

bool lum_airlight_plan(const struct lum_scatter_query *q, struct lum_airlight_draw *ret_draw)
{
    const struct lum_light *light = &q->snapshot->lights.lights[q->light];
    struct lum_airlight_draw w = {.segment = {.o = q->o, .d = q->d}};
    if (!lum_medium_scatters(q, &w.segment.t0, &w.segment.t1))
        return false;
    float length = w.segment.t1 - w.segment.t0;
    if (!lum_light_reaches(light, &w.segment))
        return false;
    w.sigma = least_sigma(&q->snapshot->media[q->medium]);
    if (has_place(light)) {
        w.angle = lum_equiangular_init(&w.segment, light->p);
        aim(&w, light->p, length);
    }
    *ret_draw = w;
    return true;
}

float lum_airlight_distance(const struct lum_airlight_draw *w, float u, float *ret_pdf)
{
    float length = w->segment.t1 - w->segment.t0;
    float t = w->by_angle ? lum_equiangular_sample(&w->angle, u)
                          : w->segment.t0 + lum_exponential_sample(w->sigma, length, u);
    *ret_pdf =
        w->by_angle ? lum_equiangular_pdf(&w->angle, t) : lum_exponential_pdf(w->sigma, length, t - w->segment.t0);
    return t;
}

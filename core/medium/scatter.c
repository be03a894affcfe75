/* Where along a ray to look for scattered light, and what is there. */
#include <string.h>

#include "core/accel/trace.h"
#include "core/light/sample.h"
#include "core/medium/medium.h"
#include "core/scene/snapshot.h"

/* ---- distances ---- */

/* With A = t0 - nearest and h = miss, the angle between the light's lines of sight to t0 and t1 is
 * atan2(h (t1 - t0), h^2 + A (t1 - nearest)), which has no difference of two nearly equal angles in it. */
struct lum_equiangular lum_equiangular_init(const struct lum_segment *segment, struct lum_vec3 light)
{
    struct lum_vec3 to_light = lum_v3_sub(light, segment->o);
    struct lum_equiangular e = {.t0 = segment->t0, .t1 = segment->t1, .nearest = lum_dot(to_light, segment->d)};
    float before = e.t0 - e.nearest, h = lum_length(lum_v3_mad(to_light, segment->d, -e.nearest));
    h = lum_max(h, lum_max(LUM_POINT_LIGHT_NEAR, 0x1p-20f * fabsf(before)));
    e.miss = h;
    e.angle = atan2f(h * (e.t1 - e.t0), h * h + before * (e.t1 - e.nearest));
    return e;
}

/* t - t0 = h (tan(theta0 + phi) - tan(theta0)), with tan(theta0) = A / h, by the addition theorem. */
float lum_equiangular_sample(const struct lum_equiangular *e, float u)
{
    float phi = u * e->angle, before = e->t0 - e->nearest, h = e->miss;
    float s = sinf(phi), c = cosf(phi), below = h * c - before * s;
    if (!(below > 0.0f)) /* rounded beyond the far end */
        return e->t1;
    return lum_min(e->t0 + s * (h * h + before * before) / below, e->t1);
}

float lum_equiangular_pdf(const struct lum_equiangular *e, float t)
{
    float along = t - e->nearest;
    return e->miss / (e->angle * (e->miss * e->miss + along * along));
}

/* Shallower than this, 1 - exp(-depth) is not a normal number, nor is there a difference from even. */
#define DEPTH_MIN 0x1p-100f

float lum_exponential_sample(float sigma, float length, float u)
{
    if (!(sigma * length > DEPTH_MIN))
        return u * length;
    return lum_min(-log1pf(u * expm1f(-sigma * length)) / sigma, length);
}

float lum_exponential_pdf(float sigma, float length, float s)
{
    if (!(sigma * length > DEPTH_MIN))
        return 1.0f / length;
    return sigma * expf(-sigma * s) / -expm1f(-sigma * length);
}

/* ---- the mixture ---- */

/* Where the light is, roughly; false: nowhere. */
static bool place_of_light(const struct lum_snapshot *s, const struct lum_light *l, struct lum_vec3 *ret_p)
{
    if (lum_light_is_from_afar(l))
        return false;
    *ret_p = l->p;
    if (l->kind == &lum_emitter_mesh) {
        const struct lum_instance *instance = &s->instances[l->instance];
        struct lum_vec3 sum = lum_v3_add(instance->mesh->bounds_lo, instance->mesh->bounds_hi);
        *ret_p = lum_affine_point(&instance->local_to_scene, lum_v3_mul(sum, 0.5f));
    }
    return true;
}

/* The ways to draw a distance, all equally likely among their kind. */
struct mixture {
    struct lum_segment segment;
    bool by_angle; /* with probability 1/2; else never */
    struct lum_equiangular angle;
    float sigma[3]; /* of the channels that scatter */
    uint32_t n_sigma;
};

static void init_mixture(struct mixture *x, const struct lum_scatter_query *q)
{
    const struct lum_medium *m = &q->snapshot->media[q->medium];
    const float s[3] = {m->sigma_s.r, m->sigma_s.g, m->sigma_s.b}, t[3] = {m->sigma_t.r, m->sigma_t.g, m->sigma_t.b};
    x->n_sigma = 0;
    for (int c = 0; c < 3; c++)
        if (s[c] > 0.0f)
            x->sigma[x->n_sigma++] = t[c];
    struct lum_vec3 light;
    x->by_angle = place_of_light(q->snapshot, &q->snapshot->lights.lights[q->light], &light);
    if (x->by_angle)
        x->angle = lum_equiangular_init(&x->segment, light);
}

static float mixture_sample(const struct mixture *x, struct lum_vec2 u)
{
    if (x->by_angle && u.y < 0.5f)
        return lum_equiangular_sample(&x->angle, u.x);
    float v = x->by_angle ? 2.0f * u.y - 1.0f : u.y;
    uint32_t c = (uint32_t)(v * (float)x->n_sigma);
    float sigma = x->sigma[c < x->n_sigma ? c : x->n_sigma - 1];
    return x->segment.t0 + lum_exponential_sample(sigma, x->segment.t1 - x->segment.t0, u.x);
}

static float mixture_pdf(const struct mixture *x, float t)
{
    float sum = 0.0f, length = x->segment.t1 - x->segment.t0;
    for (uint32_t c = 0; c < x->n_sigma; c++)
        sum += lum_exponential_pdf(x->sigma[c], length, t - x->segment.t0);
    sum /= (float)x->n_sigma;
    return x->by_angle ? 0.5f * (sum + lum_equiangular_pdf(&x->angle, t)) : sum;
}

/* ---- a sample ---- */

/* No ray reaches farther: between two points within LUM_RAY_LIMIT there are at most 3.5e8. */
#define REACH 0x1p29f

bool lum_medium_scatter(const struct lum_scatter_query *q, struct lum_vec2 u_distance, struct lum_vec2 u_light,
                        struct lum_scatter *ret_scatter)
{
    struct mixture x = {.segment = {.o = q->o, .d = q->d}};
    if (!lum_medium_scatters(q, &x.segment.t0, &x.segment.t1))
        return false;
    init_mixture(&x, q);
    float t = mixture_sample(&x, u_distance);
    return lum_medium_scatter_at(q, t, mixture_pdf(&x, t), u_light, ret_scatter);
}

float lum_medium_scatter_pdf(const struct lum_scatter_query *q, float t)
{
    struct mixture x = {.segment = {.o = q->o, .d = q->d}};
    if (!lum_medium_scatters(q, &x.segment.t0, &x.segment.t1) || t < x.segment.t0 || t > x.segment.t1)
        return 0.0f;
    init_mixture(&x, q);
    return mixture_pdf(&x, t);
}

bool lum_medium_scatters(const struct lum_scatter_query *q, float *ret_t0, float *ret_t1)
{
    const struct lum_medium *m = &q->snapshot->media[q->medium];
    return !lum_rgb_black(m->sigma_s) && lum_medium_clip(m, q->o, q->d, lum_min(q->tmax, REACH), ret_t0, ret_t1);
}

bool lum_medium_scatter_at(const struct lum_scatter_query *q, float t, float pdf, struct lum_vec2 u_light,
                           struct lum_scatter *ret_scatter)
{
    const struct lum_medium *m = &q->snapshot->media[q->medium];
    struct lum_scatter s = {.p = lum_v3_mad(q->o, q->d, t), .t = t};
    struct lum_light_sample ls;
    if (!(pdf > 0.0f) || !lum_ray_can_start(s.p) || !lum_light_sample_at(q->snapshot, q->light, s.p, u_light, &ls))
        return false;
    s.wi = ls.wi;
    s.distance = ls.distance;
    if (ls.pdf_sa > 0.0f)
        s.pdf = pdf *= ls.pdf_sa;
    struct lum_rgb left = lum_rgb_mul(lum_media_transmittance(q->snapshot, q->o, q->d, t),
                                      lum_media_transmittance(q->snapshot, s.p, s.wi, s.distance));
    s.radiance = lum_rgb_mul(lum_rgb_mul(m->sigma_s, left),
                             lum_rgb_scale(ls.radiance, lum_phase_hg(m->g, lum_dot(s.wi, q->d)) / pdf));
    if (lum_rgb_black(s.radiance))
        return false;
    *ret_scatter = s;
    return true;
}

/* ---- several distances at once ---- */

#define LANES LUM_SCATTER_POINTS

/* Points of the ray, and from there the direction of the light and the way to it. */
struct lanes {
    float t[LANES], x[LANES], y[LANES], z[LANES], wx[LANES], wy[LANES], wz[LANES], way[LANES];
};

static void look_at_light(const struct lum_scatter_query *q, struct lum_vec3 light, struct lanes *inout)
{
    struct lum_vec3 o = q->o, d = q->d;
    for (uint32_t k = 0; k < LANES; k++) {
        float t = inout->t[k], x = o.x + d.x * t, y = o.y + d.y * t, z = o.z + d.z * t;
        float dx = light.x - x, dy = light.y - y, dz = light.z - z, way = sqrtf(dx * dx + dy * dy + dz * dz);
        inout->x[k] = x, inout->y[k] = y, inout->z[k] = z;
        inout->wx[k] = dx / way, inout->wy[k] = dy / way, inout->wz[k] = dz / way;
        inout->way[k] = way;
    }
}

/* Narrows the ways to the slab lo < o + t d < hi; a way along it is all of it or nothing. */
static void clip_ways(float lo, float hi, const float *o, const float *d, float *restrict inout_t0,
                      float *restrict inout_t1)
{
    for (uint32_t k = 0; k < LANES; k++) {
        float a = d[k] != 0.0f ? (lo - o[k]) / d[k] : lo < o[k] ? -INFINITY : INFINITY;
        float b = d[k] != 0.0f ? (hi - o[k]) / d[k] : o[k] < hi ? INFINITY : -INFINITY;
        float near = a < b ? a : b, far = a < b ? b : a;
        inout_t0[k] = near > inout_t0[k] ? near : inout_t0[k];
        inout_t1[k] = far < inout_t1[k] ? far : inout_t1[k];
    }
}

/* How far light goes through a medium: from the light to the point, and from there to the eye. */
static void find_ways(const struct lum_scatter_query *q, const struct lum_medium *m, const struct lanes *at,
                      float *restrict ret_length)
{
    float t0[LANES] = {0}, t1[LANES], eye0 = 0.0f, eye1 = 0.0f;
    memcpy(t1, at->way, sizeof t1);
    if (!lum_medium_clip(m, q->o, q->d, lum_min(q->tmax, REACH), &eye0, &eye1))
        eye0 = eye1 = 0.0f;
    clip_ways(m->lo.x, m->hi.x, at->x, at->wx, t0, t1);
    clip_ways(m->lo.y, m->hi.y, at->y, at->wy, t0, t1);
    clip_ways(m->lo.z, m->hi.z, at->z, at->wz, t0, t1);
    for (uint32_t k = 0; k < LANES; k++) {
        float to_eye = (at->t[k] < eye1 ? at->t[k] : eye1) - eye0, to_light = t1[k] - t0[k];
        ret_length[k] = (to_eye > 0.0f ? to_eye : 0.0f) + (to_light > 0.0f ? to_light : 0.0f);
    }
}

static struct lum_rgb left_of(const struct lum_rgb *sigma, const float length[][LANES], uint32_t n_media, uint32_t k)
{
    struct lum_rgb tau = lum_grey(0.0f);
    for (uint32_t i = 0; i < n_media; i++)
        tau = lum_rgb_mad(tau, sigma[i], length[i][k]);
    float r = expf(-tau.r), g = tau.g == tau.r ? r : expf(-tau.g);
    return lum_rgb(r, g, tau.b == tau.g ? g : expf(-tau.b));
}

void lum_medium_scatter_points(const struct lum_scatter_query *q, uint32_t n, const float *t, const float *pdf,
                               struct lum_rgb *ret_radiance)
{
    const struct lum_snapshot *s = q->snapshot;
    const struct lum_medium *m = &s->media[q->medium];
    const struct lum_light *l = &s->lights.lights[q->light];
    struct lum_rgb sigma[LUM_MEDIA_MAX];
    float length[LUM_MEDIA_MAX][LANES];
    struct lanes at;
    for (uint32_t k = 0; k < LANES; k++)
        at.t[k] = t[k < n ? k : 0];
    look_at_light(q, l->p, &at);
    for (uint32_t i = 0; i < s->n_media; i++) {
        sigma[i] = s->media[i].sigma_t;
        find_ways(q, &s->media[i], &at, length[i]);
    }
    for (uint32_t k = 0; k < n; k++) {
        struct lum_vec3 p = {at.x[k], at.y[k], at.z[k]}, wi = {at.wx[k], at.wy[k], at.wz[k]};
        float share = at.way[k] > 0.0f ? l->falloff->share(l, wi) : 0.0f;
        ret_radiance[k] = lum_grey(0.0f);
        if (!(pdf[k] > 0.0f) || !(share > 0.0f) || !lum_ray_can_start(p))
            continue;
        float near = lum_max(at.way[k], LUM_POINT_LIGHT_NEAR);
        float f = share / (near * near) * lum_phase_hg(m->g, lum_dot(wi, q->d)) / pdf[k];
        ret_radiance[k] =
            lum_rgb_scale(lum_rgb_mul(lum_rgb_mul(m->sigma_s, l->power), left_of(sigma, length, s->n_media, k)), f);
    }
}

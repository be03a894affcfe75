/* Where fog scatters a path: samples of one colour among three, directions. */
#include "core/medium/collide.h"

#include "core/scene/snapshot.h"

static float of_colour(struct lum_rgb c, int k)
{
    return k == 0 ? c.r : k == 1 ? c.g : c.b;
}

/* How deep the scattering alone is, of one colour, up to t. */
static float depth_to(const struct lum_collider *c, int k, float t)
{
    float sum = 0.0f;
    for (uint32_t i = 0; i < c->on.n && c->on.t[i] < t; i++)
        sum += lum_optical_depth(of_colour(c->on.sigma_s[i], k), lum_min(c->on.t[i + 1], t) - c->on.t[i]);
    return sum;
}

void lum_collider_init(struct lum_collider *c, const struct lum_snapshot *s, struct lum_vec3 o, struct lum_vec3 d,
                       float tmax, struct lum_rgb carried)
{
    c->snapshot = s;
    c->o = o;
    c->d = d;
    c->tmax = tmax;
    float most = lum_rgb_max(carried), sum = 0.0f; /* first over the largest: the sum of huge ones is infinite */
    for (int k = 0; k < 3; k++)
        sum += c->share[k] = of_colour(carried, k) / most;
    for (int k = 0; k < 3; k++)
        c->share[k] /= sum;
    lum_stretches_find(&c->on, s, o, d, tmax);
    c->pass = 1.0f;
    if (c->on.n == 0)
        return;
    c->pass = 0.0f;
    for (int k = 0; k < 3; k++)
        c->pass += c->share[k] * expf(-depth_to(c, k, tmax));
}

/* ---- samples ---- */

/* The colour by which the sample goes; *inout_u becomes a fresh number. */
static int pick_colour(const struct lum_collider *c, float *inout_u)
{
    float below = 0.0f;
    int last = 0;
    for (int k = 0; k < 3; k++) {
        if (!(c->share[k] > 0.0f))
            continue;
        last = k;
        if (*inout_u < below + c->share[k])
            break;
        below += c->share[k];
    }
    *inout_u = lum_clamp((*inout_u - below) / c->share[last], 0.0f, 0x1.fffffep-1f);
    return last;
}

/* Of the media at t, one by how much of colour k it scatters. */
static uint32_t pick_medium(const struct lum_collider *c, float t, int k, float sum, float u)
{
    const struct lum_snapshot *s = c->snapshot;
    float below = 0.0f, t0, t1;
    uint32_t last = LUM_NO_OBJECT;
    for (uint32_t m = 0; m < s->n_media; m++) {
        float sigma = of_colour(s->media[m].sigma_s, k);
        if (!(sigma > 0.0f) || !lum_medium_clip(&s->media[m], c->o, c->d, c->tmax, &t0, &t1) || t < t0 || t > t1)
            continue;
        last = m;
        below += sigma;
        if (u * sum < below)
            break;
    }
    return last;
}

float lum_collider_pdf(const struct lum_collider *c, float t, uint32_t medium)
{
    float pdf = 0.0f;
    for (int k = 0; k < 3; k++)
        if (c->share[k] > 0.0f)
            pdf += c->share[k] * of_colour(c->snapshot->media[medium].sigma_s, k) * expf(-depth_to(c, k, t));
    return pdf;
}

bool lum_collider_sample(const struct lum_collider *c, struct lum_vec2 u, struct lum_collision *ret_collision)
{
    if (c->on.n == 0)
        return false;
    int k = pick_colour(c, &u.x);
    /* Depth at which it is scattered; about in the middle of u's step, not 0, and not endless. */
    float left = -log1pf(-lum_min(u.y + 0x1p-25f, 0x1.fffffep-1f));
    for (uint32_t i = 0; i < c->on.n; i++) {
        float sigma = of_colour(c->on.sigma_s[i], k), whole = lum_optical_depth(sigma, c->on.t[i + 1] - c->on.t[i]);
        if (!(left < whole)) {
            left -= whole;
            continue;
        }
        struct lum_collision r = {.t = lum_min(c->on.t[i] + left / sigma, c->on.t[i + 1])};
        r.medium = pick_medium(c, r.t, k, sigma, u.x);
        if (r.medium == LUM_NO_OBJECT) /* t rounded out of it */
            return false;
        r.pdf = lum_collider_pdf(c, r.t, r.medium);
        if (!(r.pdf > 0.0f))
            return false;
        struct lum_rgb transmitted = lum_media_transmittance(c->snapshot, c->o, c->d, r.t);
        r.weight = lum_rgb_scale(lum_rgb_mul(c->snapshot->media[r.medium].sigma_s, transmitted), 1.0f / r.pdf);
        *ret_collision = r;
        return true;
    }
    return false;
}

/* ---- directions ---- */

/* With a = |g|, s = (1 - a^2) / (1 - a + 2 a u) and the cosine c to the side where the lobe is, 2 a (1 - c) =
 * s^2 - (1 - a)^2, which without the difference is (1 - a) (1 - u) (s + 1 - a) / (1 - a + 2 a u) for 1 - c. */
struct lum_vec3 lum_phase_hg_sample(float g, struct lum_vec3 d, struct lum_vec2 u)
{
    float a = fabsf(g), below = 1.0f - a + 2.0f * a * u.x, s = (1.0f - a) * (1.0f + a) / below;
    float omc = lum_clamp((1.0f - a) * (1.0f - u.x) * (s + 1.0f - a) / below, 0.0f, 2.0f);
    float sine = sqrtf(omc * (2.0f - omc)), phi = 2.0f * LUM_PI * u.y;
    struct lum_frame frame = lum_frame_from_normal(g < 0.0f ? lum_v3_neg(d) : d);
    return lum_normalize(lum_frame_to_scene(&frame, lum_v3(sine * cosf(phi), sine * sinf(phi), 1.0f - omc)));
}

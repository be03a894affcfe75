#include "core/medium/medium.h"

#include "core/scene/snapshot.h"

/* Narrows [t0, t1] to the slab lo < o + t d < hi. Divides instead of multiplying by 1 / d: 0 times the infinite inverse
 * of a denormal would be no number. */
static bool clip_slab(float lo, float hi, float o, float d, float *inout_t0, float *inout_t1)
{
    if (d == 0.0f)
        return lo < o && o < hi;
    float a = (lo - o) / d, b = (hi - o) / d;
    *inout_t0 = lum_max(*inout_t0, lum_min(a, b));
    *inout_t1 = lum_min(*inout_t1, lum_max(a, b));
    return *inout_t0 < *inout_t1;
}

bool lum_medium_clip(const struct lum_medium *m, struct lum_vec3 o, struct lum_vec3 d, float tmax, float *ret_t0,
                     float *ret_t1)
{
    float t0 = 0.0f, t1 = tmax;
    if (!clip_slab(m->lo.x, m->hi.x, o.x, d.x, &t0, &t1) || !clip_slab(m->lo.y, m->hi.y, o.y, d.y, &t0, &t1) ||
        !clip_slab(m->lo.z, m->hi.z, o.z, d.z, &t0, &t1) || !(t0 < t1))
        return false;
    *ret_t0 = t0;
    *ret_t1 = t1;
    return true;
}

struct lum_rgb lum_media_transmittance(const struct lum_snapshot *s, struct lum_vec3 o, struct lum_vec3 d, float tmax)
{
    struct lum_rgb tau = lum_grey(0.0f);
    for (uint32_t i = 0; i < s->n_media; i++) {
        const struct lum_medium *m = &s->media[i];
        float t0, t1;
        if (!lum_medium_clip(m, o, d, tmax, &t0, &t1))
            continue;
        tau.r += lum_optical_depth(m->sigma_t.r, t1 - t0);
        tau.g += lum_optical_depth(m->sigma_t.g, t1 - t0);
        tau.b += lum_optical_depth(m->sigma_t.b, t1 - t0);
    }
    float r = expf(-tau.r), g = tau.g == tau.r ? r : expf(-tau.g); /* most fog is grey */
    return lum_rgb(r, g, tau.b == tau.g ? g : expf(-tau.b));
}

/* With a = |g| and the cosine c to the side where the lobe is, 1 + a^2 - 2 a c = (1 - a)^2 + 2 a (1 - c), which keeps
 * its digits where it is small. */
float lum_phase_hg(float g, float cos_theta)
{
    float a = fabsf(g), c = lum_clamp(copysignf(1.0f, g) * cos_theta, -1.0f, 1.0f);
    float square = (1.0f - a) * (1.0f - a) + 2.0f * a * (1.0f - c);
    return 0.25f * LUM_INV_PI * (1.0f - a) * (1.0f + a) / (square * sqrtf(square));
}

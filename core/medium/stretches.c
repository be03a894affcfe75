#include "core/medium/stretches.h"

#include "core/scene/snapshot.h"

/* Puts t among those that are there, in order. */
static void put_end(struct lum_stretches *s, uint32_t *inout_n, float t)
{
    uint32_t i = (*inout_n)++;
    for (; i > 0 && s->t[i - 1] > t; i--)
        s->t[i] = s->t[i - 1];
    s->t[i] = t;
}

void lum_stretches_find(struct lum_stretches *ret, const struct lum_snapshot *s, struct lum_vec3 o, struct lum_vec3 d,
                        float tmax)
{
    float t0[LUM_MEDIA_MAX], t1[LUM_MEDIA_MAX];
    bool met[LUM_MEDIA_MAX];
    uint32_t n_ends = 0;
    for (uint32_t m = 0; m < s->n_media; m++) {
        met[m] = lum_medium_clip(&s->media[m], o, d, tmax, &t0[m], &t1[m]);
        if (!met[m])
            continue;
        put_end(ret, &n_ends, t0[m]);
        put_end(ret, &n_ends, t1[m]);
    }
    ret->n = n_ends > 0 ? n_ends - 1 : 0;
    for (uint32_t i = 0; i < ret->n; i++) {
        ret->sigma_s[i] = ret->sigma_t[i] = lum_grey(0.0f);
        for (uint32_t m = 0; m < s->n_media; m++) {
            if (!met[m] || t0[m] > ret->t[i] || ret->t[i + 1] > t1[m])
                continue;
            ret->sigma_s[i] = lum_rgb_add(ret->sigma_s[i], s->media[m].sigma_s);
            ret->sigma_t[i] = lum_rgb_add(ret->sigma_t[i], s->media[m].sigma_t);
        }
    }
}

/* sigma_s (1 - exp(-sigma_t length)) / sigma_t times what is left before, which falls to what is left after. */
static float scatter_one(float sigma_s, float sigma_t, float length, float *inout_left)
{
    if (!(sigma_t > 0.0f)) /* nor does it scatter */
        return 0.0f;
    float before = *inout_left, taken = -expm1f(-sigma_t * length);
    *inout_left = before * expf(-sigma_t * length);
    return before * taken * (sigma_s / sigma_t);
}

struct lum_rgb lum_stretches_scatter(const struct lum_stretches *s, float t)
{
    struct lum_rgb sum = lum_grey(0.0f), left = lum_grey(1.0f);
    for (uint32_t i = 0; i < s->n && s->t[i] < t; i++) {
        float length = lum_min(s->t[i + 1], t) - s->t[i];
        sum.r += scatter_one(s->sigma_s[i].r, s->sigma_t[i].r, length, &left.r);
        sum.g += scatter_one(s->sigma_s[i].g, s->sigma_t[i].g, length, &left.g);
        sum.b += scatter_one(s->sigma_s[i].b, s->sigma_t[i].b, length, &left.b);
    }
    return sum;
}

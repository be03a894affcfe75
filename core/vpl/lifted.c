#include "core/vpl/lifted.h"

#include "core/base/base.h"

/* Of a wall that is near few rays, far along it, have what all others lack: at most so many times their light. */
#define RATIO_MAX 64.0f

/* Where few rays were shot hardly one of them, or none, went where near light goes, and a gain divided by that is far
 * off, and too large in the mean: this much near light is taken to be there, too. Without, the floor of a closed cube
 * of 1,024 VPLs had 2.6 % too much light beside its walls, now .1 % too little (tests/numeric/corner_test.c). */
#define NEAR_AT_LEAST 0.5f

void lum_vpl_kept_add_miss(struct lum_vpl_kept *inout)
{
    inout->n += 1.0f;
    for (uint32_t k = 0; k < LUM_VPL_LIFTS; k++)
        inout->light[k] += 1.0f;
}

/* With a, b, h, u of lifted_terms (core/cache/vpl_sum.c): the term a b / (t^2 + m^2 u)^2 over the true one, which is
 * a h / t^4 with the a of m = 0. */
void lum_vpl_kept_add_weighted(struct lum_vpl_kept *inout, float weight, float scene_radius, struct lum_vec3 v,
                               struct lum_vec3 d, float t, struct lum_vec3 n)
{
    float facing = -lum_dot(n, d), faces = facing < 0.0f ? -lum_dot(n, v) : lum_dot(n, v);
    float along = lum_max(t * fabsf(facing), 0x1p-20f), h = lum_max(t * lum_dot(d, v), 0x1p-20f);
    float m = LUM_VPL_LIFT_WIDEST * scene_radius;
    inout->n += weight;
    for (uint32_t k = 0; k < LUM_VPL_LIFTS; k++, m *= 0.5f) {
        float u = m * m / (h * h + m * m), rise = m * m * u, b = sqrtf(h * h + rise);
        float a = along - (b - h) * lum_min(faces, 0.0f), far = t * t / (t * t + rise);
        float ratio = lum_min(a / along * (b / h) * far * far, RATIO_MAX);
        inout->light[k] += weight * ratio;
        inout->near[k] += weight * ratio * (1.0f - far);
        inout->beside[k] += weight * (1.0f - far);
    }
}

void lum_vpl_kept_add(struct lum_vpl_kept *inout, float scene_radius, struct lum_vec3 v, struct lum_vec3 d, float t,
                      struct lum_vec3 n)
{
    lum_vpl_kept_add_weighted(inout, 1.0f, scene_radius, v, d, t, n);
}

void lum_vpl_kept_add_all(struct lum_vpl_kept *inout, const struct lum_vpl_kept *more)
{
    inout->n += more->n;
    for (uint32_t k = 0; k < LUM_VPL_LIFTS; k++) {
        inout->light[k] += more->light[k];
        inout->near[k] += more->near[k];
        inout->beside[k] += more->beside[k];
    }
}

/* Where a lift m is among those that are known: from lift k to the next one, linearly in m. */
static uint32_t find_lift(float scene_radius, float m, float *ret_part)
{
    float at = lum_clamp(log2f(LUM_VPL_LIFT_WIDEST * scene_radius / m), 0.0f, (float)LUM_VPL_LIFTS - 1.0f);
    uint32_t k = at < (float)LUM_VPL_LIFTS - 2.0f ? (uint32_t)at : LUM_VPL_LIFTS - 2u;
    *ret_part = 2.0f - exp2f(1.0f - (at - (float)k)); /* along m, not its logarithm: 0 at lift k, 1 at the next one */
    return k;
}

static float between(const float *by_lift, float part)
{
    return by_lift[0] + part * (by_lift[1] - by_lift[0]);
}

struct lum_vpl_lost lum_vpl_lost_of(const struct lum_vpl_kept *kept, float scene_radius, float m)
{
    float part, per = kept->n > 0.0f ? 1.0f / kept->n : 0.0f;
    uint32_t k = find_lift(scene_radius, m, &part);
    return (struct lum_vpl_lost){per * (kept->n - between(kept->light + k, part)),
                                 per * between(kept->beside + k, part)};
}

float lum_vpl_gain(const struct lum_vpl_kept *kept, float scene_radius, float m)
{
    float part;
    uint32_t k = find_lift(scene_radius, m, &part);
    float light = between(kept->light + k, part), near = between(kept->near + k, part);
    return lum_clamp((kept->n - light) / (near + NEAR_AT_LEAST), -0.5f, LUM_VPL_GAIN_MAX);
}

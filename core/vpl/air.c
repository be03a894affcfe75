/* Loops over LUM_LANES values without a branch, which become vector code. */
#include "core/vpl/air.h"

#include "core/math/lanes.h"
#include "core/math/warp.h"
#include "core/vpl/lifted.h"
#include "core/vpl/lobe.h"

/* Lifting takes a point away from a wall as if nothing dimmed the light of what of it is near: in fog it is lifted by
 * no more than this share of a mean free path. In a white room two of these wide .956 +- .012 of the light is there
 * with 0.25, .97 +- .013 with 0.1, in one of six .81 and .83 +- .06 (tests/numeric/scattered_test.c, g 0). */
#define LIFT_OF_FREE_PATH 0.1f

/* What LANES VPLs from k on would bring: importance, lifted term b / r^3, phase function, lobe. With h, u, rise and b
 * of core/cache/vpl_sum.c, and no cosine at p: air faces all sides. Those in fog likewise: each faces a side, and all
 * of them every one. (Not lifted, but as their mean over a ball: half as much noise again, for the same light.) */
static void find_reach(const struct lum_vpl_set *set, const struct lum_vpl_air *at, uint32_t k, float *restrict ret)
{
    const float *restrict px = set->px + k, *restrict py = set->py + k, *restrict pz = set->pz + k;
    const float *restrict nx = set->nx + k, *restrict ny = set->ny + k, *restrict nz = set->nz + k;
    const float *restrict radius = set->radius + k, *restrict gain = set->gain + k;
    const float *restrict importance = set->importance + k;
    const struct lum_vec3 p = at->p, to = at->to;
    const float most = at->sigma_t > 0.0f ? LIFT_OF_FREE_PATH / at->sigma_t : INFINITY;
    const float a = fabsf(at->g), sign = at->g < 0.0f ? -1.0f : 1.0f;
    const float phase = 0.25f * LUM_INV_PI * (1.0f - a) * (1.0f + a), peak = (1.0f - a) * (1.0f - a);
    for (uint32_t i = 0; i < LUM_LANES; i++) {
        float wide = LUM_VPL_LIFT * radius[i];
        wide = wide < most ? wide : most;
        float m = wide > LUM_POINT_LIGHT_NEAR ? wide : LUM_POINT_LIGHT_NEAR, lift2 = m * m;
        float dx = p.x - px[i], dy = p.y - py[i], dz = p.z - pz[i];
        float h = dx * nx[i] + dy * ny[i] + dz * nz[i], u = lift2 / (h * h + lift2), rise = lift2 * u;
        float b = sqrtf(h * h + rise), d2 = dx * dx + dy * dy + dz * dz, per_r2 = 1.0f / (d2 + rise);
        float term = b * per_r2 * sqrtf(per_r2) * (1.0f + gain[i] * rise * per_r2);
        float cosine = sign * (dx * to.x + dy * to.y + dz * to.z) / sqrtf(d2 + 1e-12f);
        float square = peak + 2.0f * a * (1.0f - (cosine < 1.0f ? cosine : 1.0f));
        float reach = importance[i] * term * phase / (square * sqrtf(square));
        ret[i] = h > 0.0f ? reach : 0.0f;
    }
}

static void add_lobes(const struct lum_vpl_set *set, const struct lum_vpl_air *at, uint32_t k, float *restrict inout)
{
    for (uint32_t i = 0; i < LUM_LANES; i++) {
        float x = at->p.x - set->px[k + i], y = at->p.y - set->py[k + i], z = at->p.z - set->pz[k + i];
        float r2 = x * x + y * y + z * z + 1e-12f, per_r = 1.0f / sqrtf(r2), near = LUM_LOBE_NEAR * set->radius[k + i];
        inout[i] *= lum_vpl_lobe(lum_v3(set->nx[k + i], set->ny[k + i], set->nz[k + i]),
                                 lum_v3(set->wx[k + i], set->wy[k + i], set->wz[k + i]),
                                 lum_v3(x * per_r, y * per_r, z * per_r), set->lobe[k + i] * r2 / (r2 + near * near),
                                 set->alpha[k + i], set->f0[k + i], set->f90[k + i]);
    }
}

uint32_t lum_vpl_air_draw(const struct lum_vpl_set *set, const struct lum_vpl_air *at, uint32_t n, float u,
                          struct lum_vpl_air_draw *ret)
{
    float reach[LUM_VPL_MAX + LUM_LANES]; /* 256 KiB of a worker's stack, touched as far as the set goes */
    double sum = 0.0;
    for (uint32_t k = 0; k < set->n_bounced; k += LUM_LANES) {
        find_reach(set, at, k, reach + k);
        if (set->gloss)
            add_lobes(set, at, k, reach + k);
        for (uint32_t i = 0; i < LUM_LANES && k + i < set->n_bounced; i++)
            sum += (double)reach[k + i];
    }
    if (!(sum > 0.0) || !isfinite(sum))
        return 0;
    /* Systematic sampling: every step-th unit of the sum, from u on. */
    double step = sum / n, next = (double)u * step, below = 0.0;
    uint32_t n_drawn = 0, taken = 0;
    for (uint32_t k = 0; k < set->n_bounced && taken < n; k++) {
        below += (double)reach[k];
        uint32_t times = 0;
        for (; next < below && taken < n; next += step, taken++)
            times++;
        if (times > 0)
            ret[n_drawn++] =
                (struct lum_vpl_air_draw){k, (float)(times * step / (double)set->importance[k]) * LUM_INV_PI};
    }
    return n_drawn;
}

/* The glossy lobe of a virtual point light. */
#ifndef LUM_CORE_VPL_LOBE_H
#define LUM_CORE_VPL_LOBE_H

#include "core/math/vec.h"

/* A VPL stands for an area, and near it light by its lobe comes from all of that: the lobe counts by r^2 / (r^2 +
 * (LUM_LOBE_NEAR radius)^2) of itself, else one that is near would show as a spot. */
#define LUM_LOBE_NEAR 3.0f

/* How much a VPL of normal n sends in direction o (unit; n.o may be anything, below the horizon counts as along it),
 * over what it would if it sent all evenly: 1 - gloss + gloss pi f / albedo, with the microfacet reflection f = D G2 F
 * / (4 cos cos) of GGX (material/ggx.h) for light from w, and Schlick's F. Its mean over the hemisphere, weighted by
 * the cosine, is 1 but for the error of the table of albedos. No branch: it becomes vector code. */
static inline float lum_vpl_lobe(struct lum_vec3 n, struct lum_vec3 w, struct lum_vec3 o, float gloss, float alpha,
                                 float f0, float f90)
{
    float a2 = alpha * alpha, hx = w.x + o.x, hy = w.y + o.y, hz = w.z + o.z;
    float per_h = 1.0f / sqrtf(hx * hx + hy * hy + hz * hz + 1e-12f);
    float nh = (n.x * hx + n.y * hy + n.z * hz) * per_h, wh = (w.x * hx + w.y * hy + w.z * hz) * per_h;
    float nw = n.x * w.x + n.y * w.y + n.z * w.z, no = n.x * o.x + n.y * o.y + n.z * o.z;
    nw = nw > 1e-3f ? nw : 1e-3f; /* a sixteenth of a degree above the horizon: g2 has no 0 to divide by */
    no = no > 1e-3f ? no : 1e-3f;
    nh = nh < 1.0f ? nh : 1.0f;
    float t = a2 * nh * nh + 1.0f - nh * nh, d = a2 / (LUM_PI * t * t);
    float sw = sqrtf(a2 + (1.0f - a2) * nw * nw), so = sqrtf(a2 + (1.0f - a2) * no * no);
    float g2 = 2.0f / (no * sw + nw * so), m = 1.0f - wh, m2 = m * m;
    float f = f0 + (f90 - f0) * m2 * m2 * m;
    return 1.0f - gloss + gloss * (0.25f * LUM_PI) * d * g2 * f;
}

#endif

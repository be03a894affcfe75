/* What virtual point lights send through a point in the air: by way of fog there it comes to the eye. */
#ifndef LUM_CORE_VPL_AIR_H
#define LUM_CORE_VPL_AIR_H

#include "core/vpl/vpl.h"

/* A point in fog, and where its light is looked for. */
struct lum_vpl_air {
    struct lum_vec3 p, to; /* scene space; to: unit, from p to the eye */
    float g, sigma_t;      /* of the fog: asymmetry (Henyey-Greenstein); what it takes, mean of its colours */
};

struct lum_vpl_air_draw {
    uint32_t slot;
    /* Its flux times this is what fog at p scatters on to the eye of its light if p sees it and nothing dims it:
     * radiance per unit of length, over sigma_s. Of draws that are the same VPL there is one, which counts for all. */
    float weight;
};

/* Draws n VPLs of bounced light, by what they would bring to the eye were each as bright as its importance says; the
 * mean over u (in [0, 1)) of what they bring is the sum over all. The geometry term is lifted (core/cache/vpl_sum.h),
 * which loses no light of walls in the air either: they light what is above them the same, however high; unless fog
 * dims it on the way, so that it is lifted less in dense fog. Returns how many different ones there are in ret, which
 * has room for n; 0: no VPL shines here. Whether p sees them is for the caller to ask, a ray for each. */
uint32_t lum_vpl_air_draw(const struct lum_vpl_set *set, const struct lum_vpl_air *at, uint32_t n, float u,
                          struct lum_vpl_air_draw *ret);

#endif

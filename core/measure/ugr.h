/* Glare of lamps, by the Unified Glare Rating (CIE 117:1995):
 *
 *   UGR = 8 log10( 0.25 / Lb * sum of L^2 w / p^2 )
 *
 * L: luminance of a luminaire's shining parts towards the eye, w: their solid angle, p: Guth's position index
 * (position_index.h),
 * Lb = (Ev - direct light of luminaires) / pi: luminance of the background, cd/m2. */
#ifndef LUM_CORE_MEASURE_UGR_H
#define LUM_CORE_MEASURE_UGR_H

#include "core/measure/dgp.h"
#include "core/scene/snapshot.h"

struct lum_observer {
    struct lum_vec3d eye_world; /* metres */
    struct lum_vec3 direction;  /* the line of sight; any length but 0. Upright is +Y, or +X for one along +Y */
};

/* Unit, at right angles to a line of sight that is a unit vector. */
struct lum_vec3 lum_observer_upright(struct lum_vec3 sight);

/* What glares. */
struct lum_glare {
    double sum, sum_stderr;    /* of L^2 w / p^2, cd^2/m4 */
    uint32_t n_sources;        /* luminaires that are seen where they glare (position_index.h) */
    uint32_t n_points;         /* lamps that are on and have no extent, and parallel light that the eye gets: they have
                                * no luminance, and are left out */
    uint32_t n_small, n_large; /* of the sources: below 0.0003 sr and above 0.1 sr, which the formula is not for */
    double direct_lx, direct_stderr; /* straight from all lamps and the sun, at the eye */
    struct lum_bright bright;        /* of these, those that glare by day, each place with its own p */
};
/* By n_rays shadow rays for each lamp; the sky is background, but by day what it has above LUM_DGP_PEAK_CD_M2 (a sun in
 * a picture of it) is a source, however small or coarse its texels are. The sun is no source of sum, nor one of the
 * counts. Thread: any. */
void lum_glare_of(const struct lum_snapshot *snapshot, const struct lum_observer *observer, uint32_t n_rays,
                  uint32_t seed, struct lum_glare *ret_glare);

struct lum_ugr {
    double ugr, stderr_of; /* -INFINITY: nothing glares; INFINITY: a lamp does, and all else is dark */
};
struct lum_ugr lum_ugr_of(const struct lum_glare *glare, double background_cd_m2, double background_stderr);

#endif

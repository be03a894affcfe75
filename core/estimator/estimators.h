/* The rows that methods choose from. */
#ifndef LUM_CORE_ESTIMATOR_ESTIMATORS_H
#define LUM_CORE_ESTIMATOR_ESTIMATORS_H

#include "core/pass/pass.h"

extern const struct lum_estimator lum_estimator_shadow;   /* deferred: direct light with shadows */
extern const struct lum_estimator lum_estimator_penumbra; /* deferred: direct light with soft shadows, refined pass by pass */
extern const struct lum_estimator lum_estimator_specular; /* deferred: mirror and glass */
extern const struct lum_estimator lum_stage_gloss;        /* filters: what glossy surfaces, mirrors and glass show, */
extern const struct lum_estimator lum_stage_upsample;     /* indirect light to full resolution */
extern const struct lum_estimator lum_estimator_airlight; /* components: single scattering in media, for `live` */
extern const struct lum_estimator lum_estimator_glossy;   /* components: light by way of glossy surfaces */
extern const struct lum_estimator lum_estimator_edges;    /* components: anti-aliasing of edges */
extern const struct lum_estimator lum_shadow_edges;       /* deferred: of those of hard shadows */
extern const struct lum_estimator lum_estimator_path;     /* progressive: everything, unbiased */

#endif

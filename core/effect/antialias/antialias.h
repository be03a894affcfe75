/* Anti-aliasing of what one ray a pixel showed. */
#ifndef LUM_CORE_EFFECT_ANTIALIAS_ANTIALIAS_H
#define LUM_CORE_EFFECT_ANTIALIAS_ANTIALIAS_H

#include "core/pass/pass.h"

extern const struct lum_estimator lum_estimator_edges; /* of surfaces, and then */
extern const struct lum_estimator lum_shadow_edges;    /* of hard shadows */

#endif

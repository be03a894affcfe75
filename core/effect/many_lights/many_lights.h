/* Direct light of the lights that direct/crowd.h keeps. Its stages: samples are traced and summed; sums over windows of 16 pixels a
 * side become such over 8, those 4, and these the filtered whole. */
#ifndef LUM_CORE_EFFECT_MANY_LIGHTS_MANY_LIGHTS_H
#define LUM_CORE_EFFECT_MANY_LIGHTS_MANY_LIGHTS_H

#include "core/effect/direct/crowd.h"

extern const struct lum_estimator lum_crowd_trace, lum_crowd_widen, lum_crowd_narrow, lum_crowd_join;

#endif

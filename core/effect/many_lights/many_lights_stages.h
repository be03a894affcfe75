/* Direct light of the lights that direct/many_lights.h keeps. Its stages: samples are traced and summed; sums over
 * windows of 16 pixels a side become such over 8, those 4, and these the filtered whole. */
#ifndef LUM_CORE_EFFECT_MANY_LIGHTS_MANY_LIGHTS_STAGES_H
#define LUM_CORE_EFFECT_MANY_LIGHTS_MANY_LIGHTS_STAGES_H

#include "core/effect/direct/many_lights.h"

extern const struct lum_estimator lum_many_lights_trace, lum_many_lights_widen;

#endif

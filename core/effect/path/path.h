/* Every effect by path tracing: unbiased, a sample of every pixel a pass. */
#ifndef LUM_CORE_EFFECT_PATH_PATH_H
#define LUM_CORE_EFFECT_PATH_PATH_H

#include "core/pass/pass.h"

extern const struct lum_estimator lum_estimator_path;

#endif

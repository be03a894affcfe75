/* What mirrors and glass show. */
#ifndef LUM_CORE_EFFECT_SPECULAR_SPECULAR_H
#define LUM_CORE_EFFECT_SPECULAR_SPECULAR_H

#include "core/pass/pass.h"

extern const struct lum_estimator lum_estimator_specular;

#endif

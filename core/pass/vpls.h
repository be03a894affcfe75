/* Virtual point lights of a pass. */
#ifndef LUM_CORE_PASS_VPLS_H
#define LUM_CORE_PASS_VPLS_H

#include "core/pass/pass.h"

extern const struct lum_estimator lum_stage_vpls; /* of methods without a cache: fills in pass->vpls */

/* For whoever fills in pass->vpls. */
void lum_vpls_count(const struct lum_vpl_set *set, struct lum_pass_stats *stats);

#endif

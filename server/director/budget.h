/* Where the refinement of a picture stops, in views and in lumend render alike. */
#ifndef LUM_SERVER_DIRECTOR_BUDGET_H
#define LUM_SERVER_DIRECTOR_BUDGET_H

#include "core/method/method.h"
#include "core/pass/stats.h"
#include "server/director/view_params.h"

/* After a pass, with spent_ms since the last change: why no further one is called for: "error", "time", "spp" (it has
 * its samples), "whole" (of methods that add none). NULL: it goes on; a picture of no whole sample always does. */
const char *lum_budget_stop(const struct lum_view_budget *budget, const struct lum_method *method,
                            const struct lum_pass_stats *pass, double spent_ms);

#endif

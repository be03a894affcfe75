#include "server/director/budget.h"

const char *lum_budget_stop(const struct lum_view_budget *budget, const struct lum_method *method,
                            const struct lum_pass_stats *pass, double spent_ms)
{
    if (pass->spp == 0)
        return NULL;
    if (!lum_method_adds_samples(method))
        return pass->complete ? "whole" : NULL;
    bool known = pass->error.fresh == 1.0; /* and not guessed from pictures before */
    if (budget->error.set && known && pass->error.bound <= budget->error.value)
        return "error";
    if (pass->complete)
        return "spp";
    /* One more like the last would end further from the time than this one did. */
    return budget->time_ms.set && spent_ms + 0.5 * pass->ms >= budget->time_ms.value ? "time" : NULL;
}

#include "core/pass/vpls.h"

#include "core/vpl/vpl.h"

/* Slots that moved without a VPL, then or now, and those of the sky, are no lights that anybody saw move. */
void lum_vpls_count(const struct lum_vpl_set *set, struct lum_pass_stats *stats)
{
    stats->n_vpls = set->n_lit;
    stats->n_vpls_moved = 0;
    for (uint32_t i = 0; set->n_moved > 0 && i < set->n_bounced; i++)
        if (set->moved[i / 64] >> (i % 64) & 1)
            stats->n_vpls_moved += set->flux[0][i] > 0.0f || set->flux[1][i] > 0.0f || set->flux[2][i] > 0.0f;
}

static enum lum_status run_vpls(struct lum_pass *pass, const struct lum_stage_runner *runner, struct lum_error *err)
{
    const struct lum_view_settings *set = pass->settings;
    struct lum_vpl_request request = {
        .snapshot = pass->snapshot,
        .n = set->n_vpls,
        .max_bounces = set->max_depth > 0 ? set->max_depth - 1 : 0,
        .seed = set->seed,
        .media = pass->on[LUM_EFFECT_MEDIA],
        .lobes_off = set->effects_off & LUM_VPL_LOBES,
        .pool = runner->pool,
        .counters = runner->counters,
    };
    enum lum_status status = lum_vpl_update(pass->kept_vpls, &request, err);
    if (status != LUM_OK)
        return status;
    pass->vpls = pass->kept_vpls;
    lum_vpls_count(pass->vpls, runner->stats);
    return LUM_OK;
}

const struct lum_estimator lum_stage_vpls = {.name = "vpls", .stage = LUM_STAGE_VPLS, .run = run_vpls};

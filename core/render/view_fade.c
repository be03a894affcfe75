/* Pictures of a view while its lights fade (mix.h). */
#include <string.h>

#include "core/render/view_state.h"

/* The pictures of both ends are there. */
static bool knows_way(const struct lum_view *v, const struct lum_snapshot *end)
{
    return v->mixed && v->mix.end && lum_versions_equal(&v->mix.end->versions, &end->versions);
}

/* What the film shows, and is whole; NULL: that is not known. */
static const struct lum_snapshot *shown_by(const struct lum_view *v)
{
    return v->mixed ? v->mix.shown : v->whole ? v->deferred.motion_mask.snapshot : NULL;
}

/* It costs what the first picture on the way would. */
static enum lum_status make_end(struct lum_view *v, const struct lum_pass *frame, const struct lum_snapshot *end,
                                const struct lum_stage_runner *runner, struct lum_error *err)
{
    struct lum_pass pass = *frame;
    pass.snapshot = end;
    enum lum_status status = lum_view_frame(v, &pass, runner, err);
    if (status == LUM_OK)
        lum_mix_take_end(&v->mix, &v->film, end);
    else
        memset(v->tile_spp, 0, v->tiling.n * sizeof *v->tile_spp); /* what is there is of the end */
    return status;
}

enum lum_status lum_view_mix(struct lum_view *v, const struct lum_pass *frame, const struct lum_stage_runner *runner,
                             bool *ret_made, struct lum_error *err)
{
    const struct lum_snapshot *end = frame->snapshot->whole;
    *ret_made = false;
    if (!frame->settings->fading || !end || !v->relit || v->team)
        return LUM_OK;
    bool known = knows_way(v, end);
    const struct lum_snapshot *start = known ? v->mix.start : shown_by(v);
    double share = start ? lum_mix_share(start, end, frame->snapshot) : (double)NAN;
    if (isnan(share) || (!known && !lum_mix_begin(&v->mix, &v->film, start)))
        return LUM_OK;
    enum lum_status status = known ? LUM_OK : make_end(v, frame, end, runner, err);
    if (status == LUM_OK)
        status = lum_mix_show(&v->mix, frame, share, runner);
    v->mixed = status == LUM_OK;
    v->whole = false; /* of the end */
    if (v->refinement.frame)
        lum_refine_begin(&v->refinement, &v->tiling);
    if (status != LUM_OK)
        memset(v->tile_spp, 0, v->tiling.n * sizeof *v->tile_spp);
    v->error = LUM_FILM_ERROR_UNKNOWN;
    runner->stats->changed = *ret_made = true;
    return status;
}

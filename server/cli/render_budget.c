#include "server/cli/render_budget.h"

#include <stdio.h>
#include <string.h>

#define WORTH_TELLING_MS 2000.0 /* of what is there sooner nobody wants to know when */
#define VAGUE 4.0 /* a range of more than this ratio is not told before it has been tried so long to narrow it */
#define ABOUT 1.1 /* a time is met within a tenth */

struct lum_view_budget lum_render_budget(const struct lum_render_options *o)
{
    return (struct lum_view_budget){.time_ms = {o->time_s > 0.0, o->time_s * 1e3}, .error = {o->error > 0.0, o->error}};
}

/* "12.3 s (8.1 to 20)"; "12.3 s (8.1 or more)" */
static void put_range(FILE *out, const struct lum_forecast_range *ms)
{
    fprintf(out, "%.3g s (%.3g", ms->likely * 1e-3, ms->least * 1e-3);
    if (isfinite(ms->most))
        fprintf(out, " to %.3g)", ms->most * 1e-3);
    else
        fprintf(out, " or more)");
}

void lum_render_tell_expected(const struct lum_render_options *o, uint32_t frame, const struct lum_budget_watch *w,
                              bool *inout_told)
{
    const struct lum_budget_end *end = &w->now;
    bool unlikely = w->verdict && strcmp(w->verdict, "unlikely") == 0;
    bool clear = end->ms.most < VAGUE * end->ms.least || w->spent_ms > WORTH_TELLING_MS;
    bool long_wait = end->stopped_by && clear && end->ms.likely - w->spent_ms > WORTH_TELLING_MS;
    if (*inout_told || w->stopped_by || !(o->error > 0.0) || !(unlikely || long_wait))
        return;
    *inout_told = true;
    fprintf(stderr, "lumend render: frame %u is ", frame + 1);
    if (unlikely && !end->stopped_by) {
        fprintf(stderr,
                "not expected to be within --error %g: its error is about %.4f, and the method adds no samples\n",
                o->error, w->pass.error.rel);
        return;
    }
    if (strcmp(end->stopped_by, "error") == 0)
        fprintf(stderr, "expected to be within --error %g after ", o->error);
    else
        fprintf(stderr,
                "%sexpected to be within --error %g: by --%s its error will be below %.2g (%.2g to %.2g), after ",
                unlikely ? "not " : "hardly ", o->error, end->stopped_by, end->error.likely, end->error.least,
                end->error.most);
    put_range(stderr, &end->ms);
    fputc('\n', stderr);
}

static void tell_missed_time(const struct lum_render_options *o, uint32_t frame, const struct lum_frame_stats *s)
{
    double took_s = s->budget.spent_ms * 1e-3;
    if (!(o->time_s > 0.0) || took_s <= ABOUT * o->time_s)
        return;
    fprintf(stderr, "lumend render: frame %u took %.3g s, and not --time %g: no whole picture takes less\n", frame + 1,
            took_s, o->time_s);
}

bool lum_render_tell_missed(const struct lum_render_options *o, uint32_t frame, const struct lum_frame_stats *s)
{
    tell_missed_time(o, frame, s);
    if (!(o->error > 0.0) || s->sum.error.bound <= o->error)
        return false;
    fprintf(stderr, "lumend render: frame %u is not within --error %g: ", frame + 1, o->error);
    if (isfinite(s->sum.error.bound))
        fprintf(stderr, "its relative error is known to be below %.4f", s->sum.error.bound);
    else
        fprintf(stderr, "its error is not known");
    if (strcmp(s->stopped_by, "black") == 0)
        fprintf(stderr, ": it is black, %u samples a pixel found no light, though something shines\n", s->sum.spp);
    else if (strcmp(s->stopped_by, "whole") == 0)
        fprintf(stderr, "; the method makes a frame in one pass, and adds no samples\n");
    else
        fprintf(stderr, " after %u samples, which is all that --%s allows\n", s->sum.spp, s->stopped_by);
    return true;
}

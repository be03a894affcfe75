/* What lumend render says of --time and --error: what is expected, once that is known, and what came of it. */
#ifndef LUM_SERVER_CLI_RENDER_BUDGET_H
#define LUM_SERVER_CLI_RENDER_BUDGET_H

#include "server/cli/render_options.h"
#include "server/director/budget.h"
#include "server/director/stats_json.h"

struct lum_view_budget lum_render_budget(const struct lum_render_options *o);

/* After each pass of a frame, from 0: once, on stderr, what is expected, where somebody waits for it or waits in vain.
 */
void lum_render_tell_expected(const struct lum_render_options *o, uint32_t frame, const struct lum_budget_watch *w,
                              bool *inout_told);
/* Of a frame that is done: what was asked for and is not so, on stderr. True: it is not within --error. */
bool lum_render_tell_missed(const struct lum_render_options *o, uint32_t frame, const struct lum_frame_stats *s);

#endif

/* Where the refinement of a picture stops, in views and in lumend render alike; and, while it goes on, where it will.
 */
#ifndef LUM_SERVER_DIRECTOR_BUDGET_H
#define LUM_SERVER_DIRECTOR_BUDGET_H

#include "core/method/method.h"
#include "core/pass/settings.h"
#include "core/pass/stats.h"
#include "core/render/forecast.h"
#include "server/director/view_params.h"

/* After a pass, with spent_ms since the last change: why no further one is called for: "error", "time", "spp" (it has
 * its samples), "black" (so far they found no light, so that there is no error to be told), "whole" (of methods that
 * add none: they stop by "error", too, but not before all is known that is to be known of it). NULL: it goes on; a
 * picture of no whole sample always does. */
const char *lum_budget_stop(const struct lum_view_budget *budget, const struct lum_method *method,
                            const struct lum_pass_stats *pass, double spent_ms);

/* What is expected of a picture's end. */
struct lum_budget_end {
    const char *stopped_by;          /* as lum_budget_stop would say; NULL: nothing is known yet */
    struct lum_forecast_range ms;    /* since the picture began */
    struct lum_forecast_range error; /* its bound; NAN: not known */
    bool undecided;                  /* whether it is by the error that was asked for */
};

/* A picture, from its first pass to its last. */
struct lum_budget_watch {
    struct lum_forecast forecast;
    double spent_ms;
    struct lum_pass_stats pass;       /* the last one */
    const char *stopped_by;           /* NULL: it goes on */
    struct lum_budget_end now, first; /* expected by now, and when anything was first known */
    /* Of a budget's error, while it is measured and when all is over: "open", "likely", "unlikely", "met", "missed".
     * NULL: none was asked for. */
    const char *verdict;
};

/* What is told of it: of one that goes on what is expected by now, of one that stopped what was expected first. */
struct lum_budget_news {
    double spent_ms;
    const char *verdict;
    struct lum_budget_end predicted;
};
struct lum_budget_news lum_budget_news_of(const struct lum_budget_watch *w);

void lum_budget_begin(struct lum_budget_watch *w); /* another picture */
/* After a pass, with spent_ms since the picture began. */
void lum_budget_note(struct lum_budget_watch *w, const struct lum_view_budget *budget,
                     const struct lum_view_settings *settings, const struct lum_pass_stats *pass, double spent_ms);
/* The same picture under another budget, or another number of samples: what was expected first is that from now on. */
void lum_budget_change(struct lum_budget_watch *w, const struct lum_view_budget *budget,
                       const struct lum_view_settings *settings);

#endif

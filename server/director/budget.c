#include "server/director/budget.h"

#include <string.h>

/* As many as lumend render takes by itself. What a picture of 300 x 200 has not met in 4 million paths it may meet in
 * 65536 samples, in hours; whoever waits for an error is to hear before that there is nothing to be seen. */
#define UNLIT_SPP 64u

static bool is_within(const struct lum_view_budget *budget, const struct lum_pass_stats *pass)
{
    bool known = pass->error.fresh == 1.0; /* and not guessed from pictures before */
    return budget->error.set && known && pass->error.bound <= budget->error.value;
}

const char *lum_budget_stop(const struct lum_view_budget *budget, const struct lum_method *method,
                            const struct lum_pass_stats *pass, double spent_ms)
{
    if (pass->spp == 0)
        return NULL;
    if (!lum_method_adds_samples(method)) {
        if (!pass->complete)
            return NULL;
        return is_within(budget, pass) ? "error" : "whole";
    }
    if (is_within(budget, pass))
        return "error";
    if (pass->complete)
        return "spp";
    if (budget->error.set && pass->unlit && pass->spp >= UNLIT_SPP)
        return "black";
    /* One more like the last would end further from the time than this one did. */
    return budget->time_ms.set && spent_ms + 0.5 * pass->ms >= budget->time_ms.value ? "time" : NULL;
}

/* ---- what is expected ---- */

static void expect(struct lum_budget_end *end, const char *stopped_by, const struct lum_forecast_range *ms)
{
    if (!end->stopped_by || ms->likely < end->ms.likely) {
        end->stopped_by = stopped_by;
        end->ms.likely = ms->likely;
    }
    end->ms.least = fmin(end->ms.least, ms->least); /* of which NAN is neither */
    end->ms.most = fmin(end->ms.most, ms->most);
}

/* Samples of a pixel that can make a picture better: of methods that refine the first is the frame. */
static double samples_of(const struct lum_method *method, uint32_t spp)
{
    return method->refines && spp > 0 ? spp - 1.0 : spp;
}

static struct lum_budget_end end_of(const struct lum_budget_watch *w, const struct lum_view_budget *budget,
                                    const struct lum_view_settings *s)
{
    struct lum_budget_end end = {.ms = LUM_FORECAST_UNKNOWN, .error = LUM_FORECAST_UNKNOWN};
    struct lum_forecast_range spp = lum_forecast_samples(&w->forecast, samples_of(s->method, s->max_spp));
    if (!lum_method_adds_samples(s->method) || isnan(spp.likely))
        return end;
    if (s->max_spp > 0)
        expect(&end, "spp", &spp);
    if (budget->time_ms.set) {
        double t = budget->time_ms.value;
        expect(&end, "time", &(struct lum_forecast_range){t, t, t});
    }
    if (budget->error.set) {
        struct lum_forecast_range error = lum_forecast_until(&w->forecast, budget->error.value);
        if (isnan(error.likely))
            return (struct lum_budget_end){.ms = LUM_FORECAST_UNKNOWN, .error = LUM_FORECAST_UNKNOWN};
        end.undecided = error.least <= end.ms.most && !(error.most <= end.ms.least);
        expect(&end, "error", &error);
    }
    if (end.stopped_by && strcmp(end.stopped_by, "error") == 0)
        end.error = (struct lum_forecast_range){budget->error.value, budget->error.value, budget->error.value};
    else if (end.stopped_by)
        end.error = lum_forecast_error(&w->forecast, end.ms.likely);
    return end;
}

static const char *verdict_of(const struct lum_budget_watch *w, const struct lum_view_budget *budget,
                              const struct lum_method *method)
{
    const struct lum_film_error *error = &w->pass.error;
    if (!budget->error.set)
        return NULL;
    if (w->stopped_by)
        return strcmp(w->stopped_by, "error") == 0 ? "met" : "missed";
    if (!lum_method_adds_samples(method) && w->pass.spp > 0) /* it stays as it is */
        return error->fresh == 1.0 && error->probes >= LUM_MANY_PROBES && error->rel > budget->error.value ? "unlikely"
                                                                                                           : "open";
    if (!w->now.stopped_by || w->now.undecided)
        return "open";
    return strcmp(w->now.stopped_by, "error") == 0 ? "likely" : "unlikely";
}

static void judge(struct lum_budget_watch *w, const struct lum_view_budget *budget, const struct lum_view_settings *s)
{
    w->stopped_by = lum_budget_stop(budget, s->method, &w->pass, w->spent_ms);
    w->now = end_of(w, budget, s);
    if (!w->first.stopped_by && !w->stopped_by)
        w->first = w->now;
    w->verdict = verdict_of(w, budget, s->method);
}

/* ---- a picture ---- */

struct lum_budget_news lum_budget_news_of(const struct lum_budget_watch *w)
{
    return (struct lum_budget_news){w->spent_ms, w->verdict, w->stopped_by ? w->first : w->now};
}

void lum_budget_begin(struct lum_budget_watch *w)
{
    *w = (struct lum_budget_watch){.pass = {.error = LUM_FILM_ERROR_UNKNOWN, .noise = (double)NAN}};
    lum_forecast_begin(&w->forecast);
}

void lum_budget_note(struct lum_budget_watch *w, const struct lum_view_budget *budget,
                     const struct lum_view_settings *settings, const struct lum_pass_stats *pass, double spent_ms)
{
    const struct lum_film_error *e = &pass->error;
    bool known = e->fresh == 1.0 && isfinite(pass->noise); /* what probes say falls with their number, too */
    struct lum_forecast_point now = {.n = samples_of(settings->method, pass->spp),
                                     .ms = spent_ms,
                                     .rel = known ? e->rel : (double)NAN,
                                     .bound = known ? e->bound : (double)NAN,
                                     .noise = pass->noise};
    lum_forecast_add(&w->forecast, &now);
    w->pass = *pass;
    w->spent_ms = spent_ms;
    judge(w, budget, settings);
}

void lum_budget_change(struct lum_budget_watch *w, const struct lum_view_budget *budget,
                       const struct lum_view_settings *settings)
{
    w->first.stopped_by = NULL;
    judge(w, budget, settings);
}

#include "server/cli/render_layers.h"

#include <math.h>
#include <string.h>

void lum_layer_sum_add(struct lum_layer_sum *sum, const struct lum_film *film, const struct lum_pass_stats *last,
                       const char *stopped_by, double spent_ms)
{
    double mean = lum_film_mean_luminance(film);
    sum->error.rel += last->error.rel * mean;
    sum->error.bound += last->error.bound * mean;
    sum->error.probes = last->error.probes; /* as many in each */
    sum->mean += mean;
    sum->spent_ms += spent_ms;
    sum->spp = last->spp < sum->spp ? last->spp : sum->spp;
    if (!sum->stopped_by || strcmp(stopped_by, "error") != 0) /* that is said when it is true of all */
        sum->stopped_by = stopped_by;
}

void lum_layer_sum_tell(struct lum_frame_stats *stats, const struct lum_layer_sum *sum, double max_error)
{
    double mean = sum->mean > 0.0 ? sum->mean : 1.0; /* a black picture is not off, nor one of no groups */
    stats->sum.error = (struct lum_film_error){
        .rel = sum->error.rel / mean, .bound = sum->error.bound / mean, .probes = sum->error.probes, .fresh = 1.0};
    stats->sum.spp = sum->spp;
    stats->stopped_by = sum->stopped_by;
    stats->budget = (struct lum_budget_news){.spent_ms = sum->spent_ms};
    if (max_error > 0.0)
        stats->budget.verdict = stats->sum.error.bound <= max_error ? "met" : "missed";
}

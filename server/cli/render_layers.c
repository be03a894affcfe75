#include "server/cli/render_layers.h"

#include <math.h>
#include <string.h>

/* Whose end is told of all, the more the rather: "error" is said when it is true of all that are not black, "black"
 * when none is lit, and what is off waits for nothing. */
static int rank_of(const char *stopped_by, bool off)
{
    if (off)
        return 0;
    if (strcmp(stopped_by, "black") == 0)
        return 1;
    return strcmp(stopped_by, "error") == 0 ? 2 : 3;
}

void lum_layer_sum_add(struct lum_layer_sum *sum, const struct lum_film *film, const struct lum_pass_stats *last,
                       const char *stopped_by, double spent_ms)
{
    double mean = lum_film_mean_luminance(film);
    if (mean > 0.0) { /* light that no sample has found is in no error */
        sum->error.rel += last->error.rel * mean;
        sum->error.bound += last->error.bound * mean;
        sum->error.probes = last->error.probes; /* as many in each */
    }
    sum->unlit = sum->unlit || last->unlit;
    sum->mean += mean;
    sum->spent_ms += spent_ms;
    int rank = rank_of(stopped_by, mean == 0.0 && !last->unlit);
    if (rank > 0 && sum->rank == 0)
        sum->spp = UINT32_MAX;
    if (rank > 0 || sum->rank == 0)
        sum->spp = last->spp < sum->spp ? last->spp : sum->spp;
    if (rank >= sum->rank) {
        sum->stopped_by = stopped_by;
        sum->rank = rank;
    }
}

void lum_layer_sum_tell(struct lum_frame_stats *stats, const struct lum_layer_sum *sum, double max_error)
{
    double mean = sum->mean > 0.0 ? sum->mean : 1.0; /* a black picture is not off, nor one of no groups */
    stats->sum.error = (struct lum_film_error){
        .rel = sum->error.rel / mean, .bound = sum->error.bound / mean, .probes = sum->error.probes, .fresh = 1.0};
    if (!(sum->mean > 0.0) && sum->unlit)
        stats->sum.error = LUM_FILM_ERROR_UNKNOWN;
    stats->sum.spp = sum->spp;
    stats->stopped_by = sum->stopped_by;
    stats->budget = (struct lum_budget_news){.spent_ms = sum->spent_ms};
    if (max_error > 0.0)
        stats->budget.verdict = stats->sum.error.bound <= max_error ? "met" : "missed";
}

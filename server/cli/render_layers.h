/* What the layers of lumend render --light-groups come to. */
#ifndef LUM_SERVER_CLI_RENDER_LAYERS_H
#define LUM_SERVER_CLI_RENDER_LAYERS_H

#include "server/director/stats_json.h"

/* Of those so far. Their errors are added up as if all were off in the same way: they share random numbers, so that
 * what is known of them does not say otherwise; a sum is never further off. */
struct lum_layer_sum {
    struct lum_film_error error; /* times the mean luminance */
    double mean;
    double spent_ms;
    uint32_t spp; /* least of those that are not off */
    bool unlit;   /* one of them is black, though its lamps shine */
    const char *stopped_by;
    int rank; /* of the layer that it is of */
};

void lum_layer_sum_add(struct lum_layer_sum *sum, const struct lum_film *film, const struct lum_pass_stats *last,
                       const char *stopped_by, double spent_ms);
/* Into the statistics of their picture. max_error: of --error, 0: none. */
void lum_layer_sum_tell(struct lum_frame_stats *stats, const struct lum_layer_sum *sum, double max_error);

#endif

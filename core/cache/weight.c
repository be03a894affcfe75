#include "core/cache/weight.h"

float lum_cache_record_weight(const struct lum_cache_record *record, enum lum_metric metric, float accuracy,
                              struct lum_vec3 p, struct lum_vec3 n)
{
    struct lum_weighting w = lum_weighting_of(accuracy);
    return lum_weight_of(&w, metric, record, p, n);
}

#include "core/cache/weight.h"

float lum_record_weight(const struct lum_record *record, enum lum_metric metric, float accuracy, struct lum_vec3 p,
                        struct lum_vec3 n)
{
    struct lum_weighting w = lum_weighting_of(accuracy);
    struct lum_vec3 d = lum_v3_sub(p, record->p);
    float per_radius = 1.0f / record->radius;
    return metric == LUM_METRIC_WARD ? lum_weight_ward(&w, per_radius, d, record->n, n)
                                     : lum_weight_hats(&w, per_radius, d, record->n, n);
}

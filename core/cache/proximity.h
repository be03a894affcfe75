/* How far it is from points of surfaces to what is around them: the radius over which indirect light may be carried. */
#ifndef LUM_CORE_CACHE_PROXIMITY_H
#define LUM_CORE_CACHE_PROXIMITY_H

#include "core/cache/vpl_sum.h"

#define LUM_PROXIMITY_RAYS 16u                                    /* of a point: one packet of Embree */
#define LUM_PROXIMITY_POINTS (LUM_RAY_BATCH / LUM_PROXIMITY_RAYS) /* at a time */

/* Harmonic mean of the distances that LUM_PROXIMITY_RAYS rays find, spread over the hemisphere of each point; at most
 * limit, and at most three times the nearest. A function of the scene and of the point alone. n: at most
 * LUM_PROXIMITY_POINTS. Rays count as indirect_diffuse. */
void lum_proximity(const struct lum_snapshot *s, const struct lum_receiver *points, uint32_t n, float limit,
                   struct lum_counters *counters, float *ret_distance);

#endif

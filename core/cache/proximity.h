/* How far it is from points of surfaces to what is around them: the radius over which indirect light may be carried. */
#ifndef LUM_CORE_CACHE_PROXIMITY_H
#define LUM_CORE_CACHE_PROXIMITY_H

#include "core/cache/vpl_sum.h"
#include "core/vpl/lifted.h"

#define LUM_PROXIMITY_RAYS 16u                                    /* of a point: one packet of Embree */
#define LUM_PROXIMITY_POINTS (LUM_RAY_BATCH / LUM_PROXIMITY_RAYS) /* at a time */

/* What the rays of a point met: how far away, and what the point would be lacking of light that comes from there, were
 * it of VPLs lifted as lum_vpl_kept has them; by the cosine, which the rays are too few to be drawn by. */
struct lum_around {
    float t[LUM_PROXIMITY_RAYS];      /* limit: nothing */
    uint32_t met[LUM_PROXIMITY_RAYS]; /* instance; LUM_NO_OBJECT: nothing, or a lamp */
    float scene_radius;               /* that it was made for */
    struct lum_vpl_kept kept;
};

/* Harmonic mean of the distances that LUM_PROXIMITY_RAYS rays find, spread over the hemisphere of each point; at most
 * limit, and at most three times the nearest. A function of the scene and of the point alone. n: at most
 * LUM_PROXIMITY_POINTS. Rays count as indirect_diffuse. */
void lum_proximity(const struct lum_snapshot *s, const struct lum_receiver *points, uint32_t n, float limit,
                   struct lum_counters *counters, float *ret_distance, struct lum_around *ret_around);
/* Ray i of a point as a segment to what it met: from lum_ray_offset of the point, this way. */
struct lum_vec3 lum_proximity_way(const struct lum_receiver *at, const struct lum_around *around, uint32_t i);

#endif

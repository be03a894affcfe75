/* Where rays ended before an edit: those that ask again and meet no box of what moved are not traced anew.
 *
 * A ray is known by its origin and direction, bit by bit, and what it meets is then what tracing would find, bit by
 * bit: who asks cannot tell, but for the count. */
#ifndef LUM_CORE_TRACE_KNOWN_RAYS_H
#define LUM_CORE_TRACE_KNOWN_RAYS_H

#include "core/accel/trace.h"
#include "core/base/status.h"

struct lum_motion;

struct lum_known_rays;
/* Room for n rays, 1 to 2^24; what is beyond that is traced and not kept. */
LUM_MUST_USE enum lum_status lum_known_rays_create(uint32_t n, struct lum_known_rays **ret, struct lum_error *err);
void lum_known_rays_destroy(struct lum_known_rays *known); /* accepts NULL */

/* What rays are asked with. Zeroed: nothing is known, nor kept. */
struct lum_known {
    const struct lum_known_rays *before; /* NULL: nothing is known */
    const struct lum_motion *since;      /* what moved; set where before is */
    struct lum_known_rays *now;          /* keeps what is asked; NULL: nobody does. Not `before` */
    float far;                           /* nothing is farther from any origin, scene units */
};

/* As lum_trace_closest, for rays with tnear 0 and tfar INFINITY and a trace that is not the camera's: returns how many
 * were traced. Thread: any, concurrently. */
uint32_t lum_known_closest(const struct lum_known *known, const struct lum_trace *trace, const struct lum_rays *rays,
                           struct lum_hits *ret_hits);

#endif

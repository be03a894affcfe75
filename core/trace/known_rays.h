/* Where rays ended before an edit: those that ask again and meet no box of what moved are not traced anew.
 *
 * A ray is known by its origin and direction, bit by bit, and what it meets is then what tracing would find, bit by
 * bit: who asks cannot tell, but for the count. (Where two surfaces are met at the very same distance, either may be
 * found, known or traced: moves_test.c.) */
#ifndef LUM_CORE_TRACE_KNOWN_RAYS_H
#define LUM_CORE_TRACE_KNOWN_RAYS_H

#include "core/accel/trace.h"
#include "core/base/status.h"

struct lum_motion;

struct lum_known_rays;
/* Room for n rays, 1 to 2^24; what is beyond that is traced and not kept. */
LUM_MUST_USE enum lum_status lum_known_rays_create(uint32_t n, struct lum_known_rays **ret, struct lum_error *err);
void lum_known_rays_destroy(struct lum_known_rays *known); /* accepts NULL */
/* Nothing is known any more. Accepts NULL. */
void lum_known_rays_forget(struct lum_known_rays *known);
/* Rays are about to be asked again: of those that are not asked until the next call nothing is known then. Thread: one,
 * while nobody asks. */
void lum_known_rays_begin(struct lum_known_rays *known);

/* What rays are asked with. Zeroed: nothing is known, nor kept. */
struct lum_known {
    struct lum_known_rays *rays;
    const struct lum_motion *since; /* what moved since they were asked last, but for all at once or what gives objects
                                     * other numbers; may be NULL where nothing is known */
};

/* As lum_trace_closest, for rays with tnear 0 and tfar INFINITY and a trace that is not the camera's: returns how many
 * were traced. Thread: any, concurrently. */
uint32_t lum_known_closest(const struct lum_known *known, const struct lum_trace *trace, const struct lum_rays *rays,
                           struct lum_hits *ret_hits);

#endif

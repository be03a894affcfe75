/* Finds the openings of rooms. */
#ifndef LUM_CORE_VPL_PORTALS_H
#define LUM_CORE_VPL_PORTALS_H

#include "core/light/portals.h"
#include "core/vpl/vpl.h"

/* The portals of the request's snapshot; of the request seed, pool and counters count, too: rays are added as
 * LUM_RAY_VPL. n 0: there are none. On failure likewise. Thread: the director. */
LUM_MUST_USE enum lum_status lum_vpl_find_portals(struct lum_portals *ret_portals,
                                                  const struct lum_vpl_request *request, struct lum_error *err);

#endif

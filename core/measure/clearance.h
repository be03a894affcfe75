/* Can a light meter be held there? A grid over a room also has points inside furniture, where it is dark for ever, and
 * just below table tops: standards leave those out, and so does whoever measures a real room. */
#ifndef LUM_CORE_MEASURE_CLEARANCE_H
#define LUM_CORE_MEASURE_CLEARANCE_H

#include "core/scene/snapshot.h"

enum lum_clearance {
    LUM_CLEARANCE_UNKNOWN, /* not looked at yet */
    LUM_CLEARANCE_FREE,
    LUM_CLEARANCE_COVERED, /* something lies on it: within LUM_CLEARANCE_M along the normal */
    LUM_CLEARANCE_INSIDE,  /* inside a closed body */
    LUM_CLEARANCE_FAR,     /* too far from the scene to be traced from */
};

#define LUM_CLEARANCE_M 0.1 /* there is no room to work in below that, nor to hold a meter */

/* Of the point p (scene space) with unit normal n.
 *
 * Inside: three of four directions meet back sides, and these lie in a box that is thinner than LUM_BODY_M along some
 * axis (and than half of the scene): a room whose walls were wound outwards is no body. Models whose winding says
 * nothing: a body, too, is what no walk leaves that goes on from surface to surface, if it is as thin. What shines, or
 * lets light through, is no part of a body. Takes 129 rays, and at most seven times as many where it is narrow.
 * Thread: any. */
#define LUM_BODY_M 1.0
enum lum_clearance lum_clearance_of(const struct lum_snapshot *snapshot, struct lum_vec3 p, struct lum_vec3 n);

#endif

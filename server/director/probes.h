/* Probes: illuminance at a point by paths, for whoever asks. They wait in a queue for each session, and the sessions
 * take turns, slice by slice (beside.h), so that a burst of one delays nobody else's. Thread: director. */
#ifndef LUM_SERVER_DIRECTOR_PROBES_H
#define LUM_SERVER_DIRECTOR_PROBES_H

#include "server/director/beside.h"
#include "server/director/request.h"

struct lum_prober; /* the queue of one session */

/* All zero: none waits. */
struct lum_director_probes {
    struct lum_prober *first; /* whose turn is next */
};

enum lum_need lum_director_probes_need(const struct lum_director *d);
/* About slice_ns of the probe whose turn it is; at its end, the answer. */
void lum_director_probe(struct lum_director *d, double slice_ns);
/* The session is gone, and nobody waits for its probes. */
void lum_director_drop_probes(struct lum_director *d, struct lum_session_ref session);
void lum_director_drop_all_probes(struct lum_director *d);

#endif

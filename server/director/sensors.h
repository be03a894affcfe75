/* What the scene's sensors show, measured while some session watches: in slices of a few milliseconds beside the
 * frames, of which they take a share of the time. After an edit a glance at every point comes first, so that who drags
 * a lamp sees values follow; it is finished whatever comes next, and then done anew for the newest scene. At rest,
 * paths until every point is known within LUM_SENSOR_ERROR. Once nobody watches all of it is forgotten. Thread:
 * director. */
#ifndef LUM_SERVER_DIRECTOR_SENSORS_H
#define LUM_SERVER_DIRECTOR_SENSORS_H

#include <stdbool.h>

#include "server/director/request.h"

struct lum_director;
struct lum_director_sensors;

#define LUM_SENSOR_ERROR 0.01 /* standard error over the value of each point at rest, as of lumend measure */

/* One slice, if its time has come; busy: views want passes. True: there is more to do. */
bool lum_director_measure(struct lum_director *d, bool busy);
/* The session is gone. */
void lum_director_stop_watching(struct lum_director *d, struct lum_session_ref session);
void lum_director_sensors_destroy(struct lum_director_sensors *sensors); /* accepts NULL */

#endif

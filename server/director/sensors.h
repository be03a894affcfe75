/* What the scene's sensors show, measured while some session watches, in slices beside the frames (beside.h). After an
 * edit a glance at every point comes first, so that who drags a lamp sees values follow; it is finished whatever comes
 * next, and then done anew for the newest scene. At rest, paths until every point is known within LUM_SENSOR_ERROR.
 * Once nobody watches all of it is forgotten. Thread: director. */
#ifndef LUM_SERVER_DIRECTOR_SENSORS_H
#define LUM_SERVER_DIRECTOR_SENSORS_H

#include "server/director/beside.h"
#include "server/director/request.h"

struct lum_director;
struct lum_director_sensors;

#define LUM_SENSOR_ERROR 0.01 /* standard error over the value of each point at rest, as of lumend measure */

/* Of the scene as it is now; busy: there are passes to do, too. */
enum lum_need lum_director_sensors_need(struct lum_director *d, bool busy);
/* About slice_ns, where there is a need. */
void lum_director_measure(struct lum_director *d, double slice_ns);
/* What is new to those who watch, if it is time. */
void lum_director_tell_sensors(struct lum_director *d);
/* A copy of what is known of a sensor in the scene as it is shown; NULL: nothing is. */
struct lum_sensor *lum_director_copy_sensor(const struct lum_director *d, const struct lum_record *record);
/* The session is gone. */
void lum_director_stop_watching(struct lum_director *d, struct lum_session_ref session);
void lum_director_sensors_destroy(struct lum_director_sensors *sensors); /* accepts NULL */

#endif

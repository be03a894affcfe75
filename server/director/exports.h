/* The scene as a glTF file, for who asks for it by scene.export: written by a thread of its own, one at a time, from
 * the records as they were when its turn came; edits and frames go on meanwhile. Thread: director. */
#ifndef LUM_SERVER_DIRECTOR_EXPORTS_H
#define LUM_SERVER_DIRECTOR_EXPORTS_H

#include "server/director/request.h"

struct lum_export_job;

/* All zero: nobody asks. */
struct lum_director_exports {
    struct lum_export_job *jobs; /* oldest first; the first may be running */
};

/* Answers what is written, begins the next. */
void lum_director_turn_exports(struct lum_director *d);
/* The session is gone. */
void lum_director_drop_exports(struct lum_director *d, struct lum_session_ref session);
/* At the end: stops the one that runs, and drops all. */
void lum_director_drop_all_exports(struct lum_director *d);

#endif

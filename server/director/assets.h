/* What the asset folder offers, for who chooses from it: names, and what photometric files say. One at a time is read
 * on a thread of its own, as imports are; edits and frames go on meanwhile. Thread: director. */
#ifndef LUM_SERVER_DIRECTOR_ASSETS_H
#define LUM_SERVER_DIRECTOR_ASSETS_H

#include "server/director/request.h"

struct lum_asset_job;

/* All zero: nobody asks. */
struct lum_director_assets {
    struct lum_asset_job *jobs; /* oldest first; the first may be running */
};

/* Answers what is read, begins the next. */
void lum_director_turn_assets(struct lum_director *d);
/* The session is gone. */
void lum_director_drop_assets(struct lum_director *d, struct lum_session_ref session);
/* At the end, with stop_imports set: waits for the one that runs, and drops all. */
void lum_director_drop_all_assets(struct lum_director *d);

#endif

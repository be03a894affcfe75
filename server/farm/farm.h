/* Processes that one mpirun started, as a team (core/base/team.h): they may be on several machines. Only in builds with
 * LUMEND_MPI; in others there is never anybody. */
#ifndef LUM_SERVER_FARM_FARM_H
#define LUM_SERVER_FARM_FARM_H

#include "core/base/team.h"

/* Joins those that were started with this process. NULL in *ret_team: it was started alone. Once, on the main thread,
 * before others are there. */
LUM_MUST_USE enum lum_status lum_farm_join(struct lum_team **ret_team, struct lum_error *err);
/* All members leave. Accepts NULL. */
void lum_farm_leave(struct lum_team *team);

/* What MPI this is, "" without. */
#define LUM_FARM_VERSION_BYTES 128
void lum_farm_version(char ret_text[LUM_FARM_VERSION_BYTES]);

#endif

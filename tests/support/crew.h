/* A team (core/base/team.h) of threads of one process: each works with memory of its own, as processes do. */
#ifndef LUM_TESTS_SUPPORT_CREW_H
#define LUM_TESTS_SUPPORT_CREW_H

#include "core/base/team.h"

/* Runs fn with each of n members, the first of them on this thread, and returns when all have ended. Aborts where they
 * are not at the same step: where a job over MPI would hang. Who gives up ends the process with CREW_GAVE_UP. */
enum { CREW_MAX = 8, CREW_GAVE_UP = 3 };
void crew_run(uint32_t n, void (*fn)(struct lum_team *team, void *user), void *user);

#endif

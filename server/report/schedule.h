/* The luminaires of a scene as a designer lists them: of each kind how many, their light, and what power they take. */
#ifndef LUM_SERVER_REPORT_SCHEDULE_H
#define LUM_SERVER_REPORT_SCHEDULE_H

#include "server/world/world.h"

struct lum_schedule_row {
    char what[128]; /* name or file of the photometric web, else what it is */
    char first[LUM_ID_MAX + 1];
    uint32_t n, n_on;
    double flux_lm; /* of each */
    double watts;   /* of each, as its file says; NAN: unknown */
};

/* What all that are on take together. Some are not known: those of a kind are named by the first of them. */
#define LUM_LOAD_NAMES 4u
struct lum_load {
    double watts; /* of those that are known, undimmed */
    uint32_t n_on, n_unknown, n_names;
    struct {
        char what[128], first[LUM_ID_MAX + 1];
        uint32_t n;
    } names[LUM_LOAD_NAMES];
};
/* Of the published scene. */
void lum_load_of(const struct lum_world *world, struct lum_load *ret_load);

struct lum_schedule {
    struct lum_schedule_row *rows; /* in the order of their first light */
    size_t n;
    double flux_lm; /* of all that are on */
    struct lum_load load;
};

/* Of the published scene. Lamps and objects that shine; daylight and light from infinitely far is none. */
LUM_MUST_USE enum lum_status lum_schedule_make(const struct lum_world *world, struct lum_schedule *ret_schedule,
                                               struct lum_error *err);
void lum_schedule_finish(struct lum_schedule *schedule);

#endif

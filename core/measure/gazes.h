/* What lamps do to many observers: each has a place and a line of sight. Those of a grid of eyes. */
#ifndef LUM_CORE_MEASURE_GAZES_H
#define LUM_CORE_MEASURE_GAZES_H

#include "core/base/pool.h"
#include "core/measure/ugr.h"

struct lum_gazes;
LUM_MUST_USE enum lum_status lum_gazes_create(uint32_t n, struct lum_gazes **ret_gazes, struct lum_error *err);
void lum_gazes_destroy(struct lum_gazes *gazes); /* accepts NULL */
LUM_MUST_USE enum lum_status lum_gazes_copy(const struct lum_gazes *gazes, struct lum_gazes **ret_gazes,
                                            struct lum_error *err);

/* Whoever is one of them; has_place false: nobody can stand there, and there is nothing to know. */
struct lum_gazer {
    bool has_place;
    struct lum_observer observer;
};
typedef struct lum_gazer (*lum_gazer_fn)(const void *user, uint32_t i);

void lum_gazes_forget(struct lum_gazes *gazes);
/* So many of those that have not looked as n_rays shadow rays are enough for, but at least as many as the pool has
 * workers: at a glance, or closely, which replaces the glance, if there was one. False: all have. Thread: as
 * lum_pool_run. */
struct lum_gazes_look {
    const struct lum_snapshot *snapshot;
    lum_gazer_fn gazer;
    const void *user;
    struct lum_pool *pool;
    uint64_t n_rays;
    uint32_t seed;
    bool closely;
};
bool lum_gazes_look(struct lum_gazes *gazes, const struct lum_gazes_look *look);
uint64_t lum_gazes_rays(const struct lum_gazes *gazes); /* since they were forgotten, or would be if all had a place */
/* NULL: has not looked, or had no place then. */
const struct lum_glare *lum_gazes_at(const struct lum_gazes *gazes, uint32_t i);

#endif

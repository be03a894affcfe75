/* A light meter at many places: illuminance, each with its standard error, in slices that a caller fits between other
 * work.
 *
 * Two estimates of each place. A glance: every lamp by a few shadow rays, indirect light by a few paths; at once useful
 * to a hand that drags a lamp. Then paths, as the reference has them (core/path/wave.h), unbiased, as many as the goal
 * asks for. What is known better is shown. No value depends on the number of threads. */
#ifndef LUM_CORE_MEASURE_METER_H
#define LUM_CORE_MEASURE_METER_H

#include "core/base/pool.h"
#include "core/measure/clearance.h"
#include "core/scene/snapshot.h"

enum lum_meter_kind {
    LUM_METER_PLANE,         /* E = integral of L max(0, cos) */
    LUM_METER_CYLINDER,      /* Ez = (1/pi) integral of L sin, angle from the axis: the mean of all planes along it */
    LUM_METER_HALF_CYLINDER, /* Esc = (1/pi) integral of L sin (1 + cos(phi - phi0)): of those that face so */
    LUM_METER_EYE,           /* as PLANE, without the light that comes straight from lamps: the sky's is in it */
};

struct lum_meter_place {
    struct lum_vec3d point_world; /* metres */
    struct lum_vec3 normal;       /* of the plane, to its lit side; or the axis. Any length but 0 */
    struct lum_vec3 facing;       /* HALF_CYLINDER: phi0, not along the axis */
    bool is_roomy;                /* EYE: clearance is asked of it as of a level plane */
    enum lum_meter_kind kind;
};

struct lum_meter_reading {
    enum lum_clearance clearance;
    double lx, stderr_lx; /* stderr_lx < 0: not known yet */
};

struct lum_meter;

/* Copies the places. Of those of kind EYE that are not to be roomy no more clearance is asked than that they
 * are not too far. */
LUM_MUST_USE enum lum_status lum_meter_create(const struct lum_meter_place *places, uint32_t n, uint32_t seed,
                                              struct lum_meter **ret_meter, struct lum_error *err);
void lum_meter_destroy(struct lum_meter *meter); /* accepts NULL */
/* With all that is known of it. */
LUM_MUST_USE enum lum_status lum_meter_copy(const struct lum_meter *meter, struct lum_meter **ret_meter,
                                            struct lum_error *err);

/* Forgets what it read, and measures in this snapshot, which it holds. What is known of clearance stays; where the
 * geometry changed, until lum_meter_refine: it costs more rays than a glance, and of what a hand drags it would have to
 * be known all the time. */
void lum_meter_aim(struct lum_meter *meter, const struct lum_snapshot *snapshot);

struct lum_meter_goal {
    double error;         /* standard error over the value, 0.01: 1 % */
    double dark;          /* of the mean: darker places are to be known to the same lux as this */
    uint64_t max_samples; /* of a place */
};

/* Clearance where nothing is known of it, and a glance with `glance`, of at most n_places that have not had it; false:
 * all have. */
bool lum_meter_look(struct lum_meter *meter, struct lum_pool *pool, uint32_t n_places, bool glance);
/* At most n_samples paths, for places that are free and not as well known as the goal asks; or as much of the clearance
 * of places. Of all, something is known of that. */
LUM_MUST_USE enum lum_status lum_meter_refine(struct lum_meter *meter, struct lum_pool *pool,
                                              const struct lum_meter_goal *goal, uint32_t n_samples, bool *ret_more,
                                              struct lum_error *err);

struct lum_meter_reading lum_meter_read(const struct lum_meter *meter, uint32_t place);
uint64_t lum_meter_samples(const struct lum_meter *meter); /* paths of all places since it was aimed */

#endif

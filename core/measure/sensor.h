/* Sensors: a meter at a point, along a line, on a grid; an observer whom lamps may glare; or eyes there that look all
 * around. What they say is computed in slices, so that who drags a lamp sees values follow, and is exact in the end. */
#ifndef LUM_CORE_MEASURE_SENSOR_H
#define LUM_CORE_MEASURE_SENSOR_H

#include "core/measure/fisheye.h"
#include "core/measure/meter.h"
#include "core/measure/ugr.h"

enum lum_sensor_kind { LUM_SENSOR_POINT, LUM_SENSOR_LINE, LUM_SENSOR_GRID, LUM_SENSOR_OBSERVER };

/* World, metres. */
struct lum_sensor_desc {
    enum lum_sensor_kind kind;
    enum lum_meter_kind quantity; /* but of an observer. EYE: UGR of eyes at the points */
    uint32_t n_directions;        /* of each eye, evenly around the vertical from facing on; at least 1 */
    bool modelling;               /* of a plane: the illuminance of a cylinder along normal at each point, too */
    struct lum_vec3d position;    /* the point; middle of the line or grid; the eye */
    struct lum_vec3d u, v;        /* full edges: line: u; grid: both, not parallel */
    struct lum_vec3 normal;       /* of the plane that is lit, or the axis of the cylinder */
    struct lum_vec3 facing;       /* half cylinder, observer */
    double spacing_m;             /* between points, at most; 0: by EN 12464-1 */
    double floor_m2;              /* of the room that a work plane is in; 0: its own area. Changes no value */
    uint32_t seed;
};

/* Of the modelling ratio, what EN 12464-1 recommends. */
#define LUM_MODELLING_LEAST 0.30
#define LUM_MODELLING_MOST 0.60
#define LUM_SENSOR_POINTS_MAX 65536u /* 256 x 256; of eyes times their directions */
#define LUM_SENSOR_EYE_ERROR 0.04    /* least of a goal: of the background it is 0.14 of UGR */

static inline bool lum_sensor_has_eyes(const struct lum_sensor_desc *desc)
{
    return desc->kind != LUM_SENSOR_OBSERVER && desc->quantity == LUM_METER_EYE;
}

/* For struct lum_meter_goal. */
#define LUM_SENSOR_DARK 0.1 /* of the mean: darker points are known to the same lux */
/* Of a point: one that is darker than it needs to be known, or lit by what is hardly ever found, ends here. */
#define LUM_SENSOR_SAMPLES_MAX (1u << 24)

/* LUM_ERR_LIMIT, field "spacing_m": more than max_points. */
LUM_MUST_USE enum lum_status lum_sensor_check(const struct lum_sensor_desc *desc, uint32_t max_points,
                                              struct lum_error *err);

struct lum_amount {
    double value, stderr_of;
};

struct lum_sensor;
/* LUM_ERR_LIMIT, field "spacing_m": more points than max_points. */
LUM_MUST_USE enum lum_status lum_sensor_create(const struct lum_sensor_desc *desc, uint32_t max_points,
                                               struct lum_sensor **ret_sensor, struct lum_error *err);
void lum_sensor_destroy(struct lum_sensor *sensor); /* accepts NULL */
/* With all that it shows. */
LUM_MUST_USE enum lum_status lum_sensor_copy(const struct lum_sensor *sensor, struct lum_sensor **ret_sensor,
                                             struct lum_error *err);

/* Row by row: nu points along u, nv rows; in the middles of equal cells. */
void lum_sensor_size(const struct lum_sensor *sensor, uint32_t *ret_nu, uint32_t *ret_nv);
struct lum_vec3d lum_sensor_point(const struct lum_sensor *sensor, uint32_t i);
struct lum_meter_reading lum_sensor_reading(const struct lum_sensor *sensor, uint32_t i);
struct lum_meter_reading lum_sensor_cylindrical(const struct lum_sensor *sensor, uint32_t i); /* with modelling */
/* Of eyes: the direction in which one is glared most, of those where something is lit but lamps, if there is one. */
struct lum_gaze {
    bool known; /* else ugr is NAN */
    bool dark;  /* in some direction a lamp is all that is lit: UGR is INFINITY */
    uint32_t direction;
    struct lum_ugr ugr;
    struct lum_amount background; /* cd/m2 */
    struct lum_glare glare;
};
struct lum_gaze lum_sensor_gaze(const struct lum_sensor *sensor, uint32_t i);
struct lum_vec3 lum_sensor_direction(const struct lum_sensor *sensor, uint32_t direction);
/* Paths, or what takes as long as them, since it was aimed. */
uint64_t lum_sensor_samples(const struct lum_sensor *sensor);

/* As of lum_meter_aim, lum_meter_look and lum_meter_refine. */
void lum_sensor_aim(struct lum_sensor *sensor, const struct lum_snapshot *snapshot);
bool lum_sensor_look(struct lum_sensor *sensor, struct lum_pool *pool, uint32_t n_places, bool glance);
/* Of eyes, once lum_sensor_look is done: as long as n_samples take. False: all have, or there are no eyes. May be left
 * out: refining looks closely in the end. */
bool lum_sensor_glance_at_lamps(struct lum_sensor *sensor, struct lum_pool *pool, uint32_t n_samples);
LUM_MUST_USE enum lum_status lum_sensor_refine(struct lum_sensor *sensor, struct lum_pool *pool,
                                               const struct lum_meter_goal *goal, uint32_t n_samples, bool *ret_more,
                                               struct lum_error *err);

struct lum_sensor_result {
    uint32_t n, n_known;          /* points; of those that count, how many have a value: n - n_covered - n_inside */
    uint32_t n_covered, n_inside; /* left out (clearance.h); those that are too far count as covered */
    struct lum_amount mean, least, most, uniformity; /* lx; Uo = least / mean. Of an observer: the background, cd/m2 */
    uint32_t least_at;
    uint32_t worst_at, worst_direction;       /* of eyes, whose ugr, glare and background are of that */
    struct lum_amount cylindrical, modelling; /* with modelling: mean, lx; that over the mean. Else NAN */
    /* Of an observer or eyes; NAN: not known. */
    struct lum_ugr ugr;
    struct lum_glare glare;
    struct lum_amount eye; /* all light at the eye of an observer, lx */
    struct lum_dgp dgp;
    uint32_t n_bright; /* sources of it */
    uint32_t n_dark;   /* points of eyes, whose gaze is dark */
};
/* True when every point that counts has a value, and there is one. Amounts of none are NAN. */
bool lum_sensor_result(const struct lum_sensor *sensor, struct lum_sensor_result *ret_result);

#endif

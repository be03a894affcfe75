/* Sensors between records, the renderer and JSON: `lumend measure` and the daemon say the same in the same words. */
#ifndef LUM_SERVER_WORLD_SENSORS_H
#define LUM_SERVER_WORLD_SENSORS_H

#include "core/measure/sensor.h"
#include "protocol/record/record.h"

struct cJSON;

/* What is wanted of a sensor; 0: nothing. */
struct lum_sensor_targets {
    double lx, uo, ugr, dgp;
};

struct lum_verdict {
    bool asked, passes;
    bool sure; /* two standard errors are between value and target */
};
struct lum_sensor_verdicts {
    struct lum_verdict lx, uo, ugr, dgp;
};
struct lum_sensor_verdicts lum_sensor_judge(const struct lum_sensor_result *result,
                                            const struct lum_sensor_targets *targets);

/* Of a record of type sensor that was validated. */
struct lum_sensor_desc lum_sensor_desc_of(const struct lum_record *r);
struct lum_sensor_targets lum_sensor_targets_of(const struct lum_record *r);

extern const char *const lum_sensor_kind_names[]; /* by enum lum_sensor_kind */
/* By enum lum_meter_kind. */
extern const char *const lum_sensor_quantity_names[];
/* As records have it; of an observer NULL. */
const char *lum_sensor_quantity_name(const struct lum_sensor_desc *desc);
/* As people say it: of a plane "horizontal", "vertical", or "plane". */
const char *lum_sensor_quantity_of(const struct lum_sensor_desc *desc);

/* Where EN 12464-1 recommends the modelling ratio to be. */
bool lum_modelling_in_range(const struct lum_sensor_result *result);

/* By enum lum_dgp_band. */
extern const char *const lum_dgp_band_names[];

/* Adds what a result says to the object; memory short: false. */
bool lum_sensor_add_result(struct cJSON *to, const struct lum_sensor_desc *desc, const struct lum_sensor *sensor,
                           const struct lum_sensor_result *result, const struct lum_sensor_targets *targets);
/* "points": [{"point","lx","stderr_lx"}], of eyes {"point","ugr","ugr_stderr","direction"}, with modelling
 * "ez_lx","ez_stderr_lx" as well, and of those left out
 * {"point","left_out"} alone. NULL: memory is short. */
struct cJSON *lum_sensor_points_json(const struct lum_sensor_desc *desc, const struct lum_sensor *sensor);

/* NULL: it counts. */
const char *lum_sensor_left_out(enum lum_clearance clearance);

#endif

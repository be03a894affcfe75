/* What `lumend measure` prints and writes. */
#ifndef LUM_SERVER_CLI_MEASURE_REPORT_H
#define LUM_SERVER_CLI_MEASURE_REPORT_H

#include "protocol/base/error.h"
#include "server/world/sensors.h"

struct lum_measured {
    const char *id; /* of a sensor of the scene; NULL: the grid of the command line */
    const char *name;
    struct lum_sensor_desc desc;
    struct lum_sensor_targets targets;
    struct lum_sensor *sensor;
    struct lum_sensor_result result;
};

/* "horizontal", "vertical", "cylindrical" ... */
const char *lum_measure_quantity(const struct lum_sensor_desc *d);

/* On stdout. False: a target is missed. */
bool lum_measure_print(const struct lum_measured *m);
bool lum_measure_write_csv(const char *path, const struct lum_measured *measured, size_t n,
                           struct lum_proto_error *err);
bool lum_measure_write_json(const char *path, const char *scene, const struct lum_measured *measured, size_t n,
                            struct lum_proto_error *err);

#endif

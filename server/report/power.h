/* The electric power of the luminaires over a room: W, W/m2, and W/m2 for each 100 lx on its work plane. */
#ifndef LUM_SERVER_REPORT_POWER_H
#define LUM_SERVER_REPORT_POWER_H

#include "server/report/schedule.h"
#include "server/world/sensors.h"

struct lum_power {
    struct lum_load load;
    double floor_m2, w_per_m2;         /* NAN: no luminaire says what it takes */
    struct lum_amount w_per_m2_100_lx; /* by the mean of the work plane; NAN likewise, and in the dark */
};

/* The floor that a sensor stands for: its record's, or its own area; 0: it is no level grid that is lit from above. Of
 * several the largest is the room's. */
double lum_power_floor(const struct lum_sensor_desc *desc);
struct lum_power lum_power_of(const struct lum_load *load, const struct lum_sensor_desc *desc,
                              const struct lum_sensor_result *result);

/* "power" of a sensor, as in PROTOCOL.md. False: memory is short. */
bool lum_power_add(struct cJSON *to, const struct lum_power *power);

/* The lamps that do not say: "quad (panel-a and others); disc (spot); ...". */
#define LUM_POWER_TEXT 640u
void lum_power_unknown(const struct lum_load *load, char ret_text[LUM_POWER_TEXT]);

#endif

/* Sun and sky: records in the renderer's terms, and as people are told of them. */
#ifndef LUM_SERVER_WORLD_DAYLIGHT_H
#define LUM_SERVER_WORLD_DAYLIGHT_H

#include "core/light/solar.h"
#include "core/scene/desc.h"
#include "protocol/record/record.h"
#include "server/world/world.h"

struct cJSON;

struct lum_daylight_sun {
    double elevation_deg, azimuth_deg; /* where it is seen */
    double illuminance_lx;             /* on a plane that faces it; 0 while it is down */
};
/* Of a valid record of kind sun. */
struct lum_daylight_sun lum_daylight_sun(const struct lum_record_light *l);

/* What a sun and a sky have of their own. l is valid, and *inout_light complete but for direction, amount and kind's
 * own fields. Other kinds are left alone. */
void lum_daylight_apply(const struct lum_record_light *l, struct lum_light_desc *inout_light);

/* {"sun":{..},"sky":{..}}, each null where there is none: as in PROTOCOL.md. NULL when memory is short. */
struct cJSON *lum_daylight_describe(const struct lum_world *world);

#endif

/* What was measured as a page to print, with pictures, in one file that needs no other: of `lumend measure --html`, and
 * of the request report.get. */
#ifndef LUM_SERVER_REPORT_REPORT_H
#define LUM_SERVER_REPORT_REPORT_H

#include "server/report/annotate.h"
#include "server/report/power.h"
#include "server/world/sensors.h"

struct lum_measured {
    const char *id; /* of a sensor of the scene; NULL: the grid of the command line */
    const char *name;
    struct lum_sensor_desc desc;
    struct lum_sensor_targets targets;
    struct lum_sensor *sensor;
    struct lum_sensor_result result;
};

/* The one over whose floor power is reckoned; NULL: none is a work plane. */
const struct lum_measured *lum_report_room(const struct lum_measured *measured, size_t n);

/* The observer that is glared most, by UGR or, by_day, by DGP. NULL: there are not two to compare. */
const struct lum_measured *lum_report_worst(const struct lum_measured *measured, size_t n, bool by_day,
                                            size_t *ret_observers);

enum { LUM_REPORT_PICTURE, LUM_REPORT_ILLUMINANCE, LUM_REPORT_PICTURES };
/* px, 3:2: sharp where it is printed 15 cm wide, at 150 dpi. */
#define LUM_REPORT_PICTURE_W 900u
#define LUM_REPORT_PICTURE_H 600u

/* All of one revision of one scene. */
struct lum_report {
    const char *scene; /* its name, or its file's */
    const struct lum_measured *measured;
    size_t n;
    const struct lum_schedule *schedule;
    struct lum_canvas pictures[LUM_REPORT_PICTURES]; /* rgb NULL: left out */
};

/* *ret_html, which ends with a null byte, is released with free. */
LUM_MUST_USE enum lum_status lum_report_write(const struct lum_report *report, char **ret_html, size_t *ret_n,
                                              struct lum_error *err);

#endif

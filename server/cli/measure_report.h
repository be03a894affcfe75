/* What `lumend measure` prints and writes. */
#ifndef LUM_SERVER_CLI_MEASURE_REPORT_H
#define LUM_SERVER_CLI_MEASURE_REPORT_H

#include "protocol/base/error.h"
#include "server/report/report.h"

/* On stdout. False: a target is missed. */
bool lum_measure_print(const struct lum_measured *m);
/* Of several observers the one that is glared most. */
void lum_measure_print_worst(const struct lum_measured *measured, size_t n);
/* Over the room's floor, where there is a work plane. */
void lum_measure_print_power(const struct lum_measured *measured, size_t n, const struct lum_load *load);
bool lum_measure_write_csv(const char *path, const struct lum_measured *measured, size_t n,
                           struct lum_proto_error *err);
bool lum_measure_write_json(const char *path, const char *scene, const struct lum_measured *measured, size_t n,
                            const struct lum_load *load, struct lum_proto_error *err);

#endif

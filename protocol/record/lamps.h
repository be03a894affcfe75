/* How bright lamps are, and of what colour: what a preset keeps. Read whole, never changed: copies of a record share
 * the list. */
#ifndef LUM_PROTOCOL_RECORD_LAMPS_H
#define LUM_PROTOCOL_RECORD_LAMPS_H

#include <stddef.h>

#include "protocol/base/value.h"

struct lum_lamp {
    lum_id id; /* need not exist */
    bool on;
    struct lum_opt flux_lm, intensity_cd, luminance_cd_m2, illuminance_lx, multiplier; /* one at most */
    double color[3];                                                                   /* 0 0 0: none */
    struct lum_opt cct_k;                                                              /* excludes color */
};

struct lum_lamps {
    struct lum_lamp *items; /* a reference (bulk.h) */
    size_t n;
};

struct cJSON;
struct lum_field;
struct lum_proto_error;
bool lum_lamps_read(const struct lum_field *f, struct lum_lamps *ret_lamps, const struct cJSON *json,
                    struct lum_proto_error *err);
struct cJSON *lum_lamps_write(const struct lum_lamps *lamps); /* NULL: memory is short */
bool lum_lamps_equal(const struct lum_lamps *a, const struct lum_lamps *b);
bool lum_lamps_validate(const struct lum_lamps *lamps, struct lum_proto_error *err);

#endif

/* Values that fields and messages are made of. */
#ifndef LUM_PROTOCOL_BASE_VALUE_H
#define LUM_PROTOCOL_BASE_VALUE_H

#include <stdbool.h>

#include "protocol/base/limits.h"

typedef char lum_id[LUM_LIMIT_ID_BYTES + 1];
/* [A-Za-z0-9_.:/-], 1 to LUM_LIMIT_ID_BYTES bytes. */
bool lum_id_valid(const char *id);

/* A number that may be absent: null in JSON. */
struct lum_opt {
    bool set;
    double value;
};

#endif

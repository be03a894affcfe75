/* The check that runs over a JSON text before it is parsed. */
#ifndef LUM_PROTOCOL_JSON_SCAN_H
#define LUM_PROTOCOL_JSON_SCAN_H

#include "protocol/base/error.h"

#include <stddef.h>

/* True when every token is strict JSON in UTF-8 within the limits; the order of tokens is left to the parser.
 * max_bytes: LUM_LIMIT_MESSAGE_BYTES of what comes from outside. */
bool lum_json_scan(const char *text, size_t n_bytes, unsigned max_bytes, struct lum_proto_error *err);

#endif

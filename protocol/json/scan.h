/* The check that runs over a JSON text before it is parsed. */
#ifndef LUM_PROTOCOL_JSON_SCAN_H
#define LUM_PROTOCOL_JSON_SCAN_H

#include "protocol/base/error.h"

#include <stddef.h>

/* True when every token is strict JSON in UTF-8 within the limits; the order of tokens is left to the parser.
 * stored: of a file, whose limits are wider. */
bool lum_json_scan(const char *text, size_t n_bytes, bool stored, struct lum_proto_error *err);

#endif

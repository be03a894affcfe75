/* UTF-8, for texts that come in and texts that go out. */
#ifndef LUM_PROTOCOL_BASE_UTF8_H
#define LUM_PROTOCOL_BASE_UTF8_H

#include <stddef.h>
#include <stdint.h>

/* Length of the well-formed sequence at p (Unicode 15, table 3-7), or 0. p < end. */
size_t lum_utf8_length(const uint8_t *p, const uint8_t *end);

#endif

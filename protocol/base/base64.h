/* Base64 (RFC 4648, with padding) for pixels in JSON. */
#ifndef LUM_PROTOCOL_BASE_BASE64_H
#define LUM_PROTOCOL_BASE_BASE64_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/* The caller frees the text. NULL when memory is short. */
char *lum_base64_encode(const uint8_t *bytes, size_t n_bytes);
/* How many bytes the text stands for. False when its length is not one of base64. */
bool lum_base64_bytes(const char *text, size_t *ret_n_bytes);
/* Fills so many bytes. False when the text is not base64. */
bool lum_base64_decode(const char *text, uint8_t *ret_bytes);

#endif

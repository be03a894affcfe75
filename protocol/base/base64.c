#include "protocol/base/base64.h"

#include <stdlib.h>
#include <string.h>

static const char digits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";

char *lum_base64_encode(const uint8_t *bytes, size_t n_bytes)
{
    char *text = calloc((n_bytes + 2) / 3 * 4 + 1, 1);
    if (!text)
        return NULL;
    char *out = text;
    for (size_t i = 0; i < n_bytes; i += 3, out += 4) {
        size_t n = n_bytes - i < 3 ? n_bytes - i : 3;
        uint32_t v = (uint32_t)bytes[i] << 16;
        v |= n > 1 ? (uint32_t)bytes[i + 1] << 8 : 0;
        v |= n > 2 ? bytes[i + 2] : 0;
        for (size_t k = 0; k < 4; k++)
            out[k] = k <= n ? digits[v >> (18 - 6 * k) & 63] : '=';
    }
    return text;
}

/* 0..63, or 64 for what is no digit. */
static uint32_t digit_value(char c)
{
    if (c >= 'A' && c <= 'Z')
        return (uint32_t)(c - 'A');
    if (c >= 'a' && c <= 'z')
        return (uint32_t)(c - 'a') + 26;
    if (c >= '0' && c <= '9')
        return (uint32_t)(c - '0') + 52;
    return c == '+' ? 62 : c == '/' ? 63 : 64;
}

static size_t padding(const char *text, size_t length)
{
    return length && text[length - 1] == '=' ? 1 + (text[length - 2] == '=') : 0;
}

bool lum_base64_bytes(const char *text, size_t *ret_n_bytes)
{
    size_t length = strlen(text);
    *ret_n_bytes = length / 4 * 3 - (length % 4 == 0 ? padding(text, length) : 0);
    return length % 4 == 0;
}

bool lum_base64_decode(const char *text, uint8_t *ret_bytes)
{
    size_t length = strlen(text), pad = padding(text, length), n = length / 4 * 3 - pad;
    for (size_t i = 0, o = 0; i < length; i += 4) {
        uint32_t v = 0;
        for (size_t k = 0; k < 4; k++) {
            uint32_t d = i + k >= length - pad ? 0 : digit_value(text[i + k]);
            if (d > 63)
                return false;
            v = v << 6 | d;
        }
        for (size_t k = 0; k < 3 && o < n; k++)
            ret_bytes[o++] = (uint8_t)(v >> (16 - 8 * k));
    }
    return true;
}

#include "protocol/base/value.h"

#include <string.h>

bool lum_id_valid(const char *id)
{
    static const char charset[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789_.:/-";
    size_t n = strlen(id);
    return n >= 1 && n <= LUM_LIMIT_ID_BYTES && strspn(id, charset) == n;
}

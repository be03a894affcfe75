#include "server/net/fragments.h"

#include <stdlib.h>
#include <string.h>

#define KEPT_BYTES (16u << 10) /* as much as is read at once */

/* Grows to what the client sends, doubled, so that a message costs amortised linear time. */
static bool reserve(struct lum_fragments *rx, size_t n, size_t max)
{
    if (rx->n + n <= rx->capacity)
        return true;
    size_t capacity = rx->capacity ? 2 * rx->capacity : 1024;
    while (capacity < rx->n + n)
        capacity *= 2;
    capacity = capacity < max ? capacity : max;
    char *bytes = realloc(rx->bytes, capacity);
    if (!bytes)
        return false;
    rx->bytes = bytes;
    rx->capacity = capacity;
    return true;
}

bool lum_fragments_add(struct lum_fragments *rx, const char *bytes, size_t n, size_t max)
{
    if (n == 0)
        return true;
    if (!reserve(rx, n, max))
        return false;
    memcpy(rx->bytes + rx->n, bytes, n);
    rx->n += n;
    return true;
}

void lum_fragments_clear(struct lum_fragments *rx)
{
    rx->n = 0;
    if (rx->capacity > KEPT_BYTES) /* large messages are rare: do not keep their memory */
        lum_fragments_finish(rx);
}

void lum_fragments_finish(struct lum_fragments *rx)
{
    free(rx->bytes);
    *rx = (struct lum_fragments){0};
}

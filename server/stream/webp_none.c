#include "server/stream/webp.h"

bool lum_webp_available(void)
{
    return false;
}

size_t lum_webp_encode(const struct lum_webp *image, uint8_t *out, size_t size)
{
    (void)image;
    (void)out;
    (void)size;
    return 0;
}

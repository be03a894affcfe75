/* The picture readers over arbitrary bytes: above all our own of Radiance files. */
#include <stdint.h>

#include "server/importer/image.h"
#include "tests/fuzz/fuzz.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t n)
{
    struct lum_texels texels = {0};
    struct lum_bytes file = {(uint8_t *)(uintptr_t)data, n};
    struct lum_error err;
    if (!lum_image_decode(&file, &texels, &err))
        lum_free(texels.pixels);
    return 0;
}

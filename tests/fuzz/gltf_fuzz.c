/* The glTF reader over arbitrary bytes, without files beside it. */
#include <stdint.h>

#include "server/importer/importer.h"
#include "tests/fuzz/fuzz.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t n)
{
    struct lum_importer im = {.emit = {.fd = -1}, .files = {-1}, .asset = "a.glb"};
    struct lum_bytes file = {(uint8_t *)(uintptr_t)data, n};
    struct lum_error err;
    lum_ids_init(&im.ids, "m");
    enum lum_status status = lum_gltf_import(&im, &file, &err);
    lum_ids_finish(&im.ids);
    return status == LUM_ERR_INTERNAL ? -1 : 0;
}

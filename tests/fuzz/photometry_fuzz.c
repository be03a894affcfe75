/* Photometric files, by both readers. What they accept, the renderer has to take. */
#include "server/importer/photometry.h"
#include "tests/fuzz/fuzz.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t n)
{
    static const char *const names[] = {"a.ies", "a.ldt"};
    struct lum_bytes file = {(uint8_t *)(uintptr_t)data, n};
    for (int k = 0; k < 2; k++) {
        struct lum_photometry p;
        struct lum_op_text op;
        struct lum_emit emit = {.fd = -1};
        struct lum_error err = {0};
        if (!lum_photometry_read(&file, names[k], &p, &err)) {
            lum_op_begin(&op, "light", "a");
            lum_photometry_put(&emit, &op, &p);
            FUZZ_REQUIRE(!lum_emit_op(&emit, &op, &err));
        }
        lum_photometry_finish(&p);
    }
    return 0;
}

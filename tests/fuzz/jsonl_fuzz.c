/* Scene and replay files from arbitrary bytes. */
#include "tests/fuzz/fuzz.h"

#include "protocol/document/document.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t n)
{
    struct lum_proto_error err = {0};
    struct lum_ops ops;
    if (!lum_ops_from_jsonl((const char *)data, n, &ops, &err)) {
        FUZZ_REQUIRE(err.code != LUM_PROTO_OK && err.text[0]);
        return 0;
    }
    for (size_t i = 1; ops.t_ms && i < ops.n; i++)
        FUZZ_REQUIRE(ops.t_ms[i] >= ops.t_ms[i - 1]);
    lum_ops_finish(&ops);
    return 0;
}

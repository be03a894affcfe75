/* Frame headers from arbitrary bytes: what is decoded encodes to the same bytes. */
#include "tests/fuzz/fuzz.h"

#include <string.h>

#include "protocol/message/frame.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t n)
{
    struct lum_frame_header h;
    size_t payload;
    uint8_t again[LUM_FRAME_HEADER_BYTES];
    if (!lum_frame_header_unpack(data, n, &h, &payload))
        return 0;
    FUZZ_REQUIRE(payload >= LUM_FRAME_HEADER_BYTES && payload <= n && n - payload == h.payload_len);
    lum_frame_header_pack(&h, again);
    for (size_t i = 0; i < LUM_FRAME_HEADER_BYTES; i++)
        if (i != 6 && i != 7 && i != 55) /* header_len may be longer, and the spare byte anything */
            FUZZ_REQUIRE(again[i] == data[i]);
    return 0;
}

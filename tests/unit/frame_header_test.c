/* The 64-byte header: every field, every refusal. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include <cmocka.h>

#include "protocol/message/frame.h"

static const struct lum_frame_header sample = {
    .kind = LUM_FRAME_TILE,
    .flags = LUM_FRAME_LAST_TILE | LUM_FRAME_CONVERGED,
    .payload_len = 5,
    .frame_seq = 0x1122334455667788u,
    .scene_rev = 0x99aabbccddeeff01u,
    .view_id = 0xdeadbeefu,
    .camera_seq = 0x01020304u,
    .x = 1,
    .y = 0x0203,
    .w = 128,
    .h = 127,
    .full_w = 4096,
    .full_h = 65535,
    .codec = LUM_CODEC_PNG,
    .quality = 100,
    .downscale = 2,
    .server_us = 1234567,
    .error = 65535,
    .spp = 4095,
};

static void bytes_are_where_the_table_says(void **state)
{
    static const uint8_t want[LUM_FRAME_HEADER_BYTES] = {
        'L',  'U',  'M',  'F',  1,    1,    64,   0,    5,    0,    0,    0,    5,    0,    0,    0,
        0x88, 0x77, 0x66, 0x55, 0x44, 0x33, 0x22, 0x11, 0x01, 0xff, 0xee, 0xdd, 0xcc, 0xbb, 0xaa, 0x99,
        0xef, 0xbe, 0xad, 0xde, 4,    3,    2,    1,    1,    0,    3,    2,    128,  0,    127,  0,
        0,    16,   255,  255,  2,    100,  2,    0,    0x87, 0xd6, 0x12, 0x00, 255,  255,  255,  15,
    };
    uint8_t bytes[LUM_FRAME_HEADER_BYTES];
    (void)state;
    lum_frame_header_pack(&sample, bytes);
    assert_memory_equal(bytes, want, sizeof want);
}

static void decode_is_the_inverse(void **state)
{
    uint8_t bytes[LUM_FRAME_HEADER_BYTES + 5] = {0}, again[LUM_FRAME_HEADER_BYTES];
    struct lum_frame_header h;
    size_t payload;
    (void)state;
    lum_frame_header_pack(&sample, bytes);
    assert_true(lum_frame_header_unpack(bytes, sizeof bytes, &h, &payload));
    assert_int_equal(payload, LUM_FRAME_HEADER_BYTES);
    lum_frame_header_pack(&h, again);
    assert_memory_equal(again, bytes, sizeof again);
    assert_true(h.frame_seq == sample.frame_seq && h.scene_rev == sample.scene_rev && h.view_id == sample.view_id &&
                h.full_h == sample.full_h && h.server_us == sample.server_us && h.spp == sample.spp);
}

static void refusals(void **state)
{
    uint8_t bytes[LUM_FRAME_HEADER_BYTES + 16] = {0};
    struct lum_frame_header h;
    size_t payload;
    (void)state;
    lum_frame_header_pack(&sample, bytes);
    size_t n = LUM_FRAME_HEADER_BYTES + 5;
    for (size_t k = 0; k < n; k++)
        assert_false(lum_frame_header_unpack(bytes, k, &h, &payload));
    assert_false(lum_frame_header_unpack(bytes, n + 1, &h, &payload));
    for (size_t i = 0; i < 5; i++) { /* magic and version */
        bytes[i] ^= 0x20;
        assert_false(lum_frame_header_unpack(bytes, n, &h, &payload));
        bytes[i] ^= 0x20;
    }
    bytes[6] = 63;
    assert_false(lum_frame_header_unpack(bytes, n, &h, &payload));
    bytes[6] = 69; /* all header, but payload_len says 5 */
    assert_false(lum_frame_header_unpack(bytes, n, &h, &payload));
    bytes[6] = 72; /* a longer header of a later version of the protocol */
    assert_true(lum_frame_header_unpack(bytes, n + 8, &h, &payload));
    assert_int_equal(payload, 72);
    bytes[12] = bytes[13] = bytes[14] = bytes[15] = 255;
    assert_false(lum_frame_header_unpack(bytes, n, &h, &payload));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(bytes_are_where_the_table_says),
        cmocka_unit_test(decode_is_the_inverse),
        cmocka_unit_test(refusals),
    };
    return cmocka_run_group_tests_name("frame_header", tests, NULL, NULL);
}

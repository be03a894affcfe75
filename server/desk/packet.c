#include "server/desk/packet.h"

#include <string.h>

#include "protocol/base/utf8.h"

const char *const lum_desk_protocol_names[LUM_DESK_PROTOCOL_COUNT] = {
    [LUM_DESK_SACN] = "sacn", [LUM_DESK_ARTNET] = "artnet"};

static uint32_t be16(const uint8_t *p)
{
    return (uint32_t)p[0] << 8 | p[1];
}

static uint32_t be32(const uint8_t *p)
{
    return be16(p) << 16 | be16(p + 2);
}

/* ---- sACN: layers within layers, each with its length (E1.31, table 4-1) ---- */

#define SACN_ROOT_DATA 4u
#define SACN_ROOT_EXTENDED 8u /* synchronisation, discovery */
#define SACN_SLOTS_AT 126u

/* Flags 0x7, and a length from there to the packet's end. */
static bool is_layer(const uint8_t *data, size_t n, size_t at)
{
    return n >= at + 2 && be16(data + at) == (0x7000u | (uint32_t)(n - at));
}

/* A name is for people: what is no UTF-8, or does not end, is none. */
static void take_name(const uint8_t *from, char to[LUM_DESK_NAME_BYTES])
{
    const uint8_t *end = memchr(from, 0, LUM_DESK_NAME_BYTES);
    memset(to, 0, LUM_DESK_NAME_BYTES);
    for (const uint8_t *p = from; p < end;) {
        size_t length = lum_utf8_length(p, end);
        if (length == 0 || *p < 0x20 || *p == 0x7f)
            return;
        p += length;
    }
    if (end)
        memcpy(to, from, (size_t)(end - from));
}

static enum lum_packet_kind read_sacn(const uint8_t *data, size_t n, struct lum_desk_packet *p)
{
    static const uint8_t preamble[16] = "\0\x10\0\0ASC-E1.17\0\0"; /* and a third 0 */
    if (n < 42 || memcmp(data, preamble, sizeof preamble) != 0 || !is_layer(data, n, 16) || !is_layer(data, n, 38))
        return LUM_PACKET_BAD;
    if (be32(data + 18) == SACN_ROOT_EXTENDED)
        return LUM_PACKET_OTHER;
    if (be32(data + 18) != SACN_ROOT_DATA || n < SACN_SLOTS_AT || be32(data + 40) != 2u)
        return LUM_PACKET_BAD;
    const uint8_t *dmp = data + 115;
    uint32_t universe = be16(data + 113), n_values = be16(dmp + 8);
    bool framed =
        is_layer(data, n, 115) && dmp[2] == 0x02 && dmp[3] == 0xa1 && be16(dmp + 4) == 0 && be16(dmp + 6) == 1;
    if (!framed || n_values < 1 || n_values > 1 + LUM_DESK_SLOTS || n != SACN_SLOTS_AT - 1 + n_values)
        return LUM_PACKET_BAD;
    if (universe < 1 || universe > 63999 || data[108] > 200)
        return LUM_PACKET_BAD;
    *p = (struct lum_desk_packet){.protocol = LUM_DESK_SACN,
                                  .universe = (uint16_t)universe,
                                  .priority = data[108],
                                  .sequence = data[111],
                                  .sequenced = true,
                                  .preview = data[112] & 0x80,
                                  .terminated = data[112] & 0x40,
                                  .n_slots = (uint16_t)(n_values - 1),
                                  .slots = data + SACN_SLOTS_AT};
    memcpy(p->source, data + 22, sizeof p->source);
    take_name(data + 44, p->name);
    return data[125] == 0 ? LUM_PACKET_SLOTS : LUM_PACKET_OTHER;
}

/* ---- Art-Net: little-endian operation, the rest big-endian ---- */

#define ARTNET_DMX 0x5000u  /* its operation */
#define ARTNET_SLOTS_AT 18u /* bytes before them */

static enum lum_packet_kind read_artnet(const uint8_t *data, size_t n, struct lum_desk_packet *p)
{
    if (n < 10 || memcmp(data, "Art-Net", 8) != 0)
        return LUM_PACKET_BAD;
    if (((uint32_t)data[9] << 8 | data[8]) != ARTNET_DMX)
        return LUM_PACKET_OTHER;
    if (n < ARTNET_SLOTS_AT || be16(data + 10) < 14)
        return LUM_PACKET_BAD;
    uint32_t n_slots = be16(data + 16);
    bool even = n_slots % 2 == 0 && n_slots >= 2 && n_slots <= LUM_DESK_SLOTS;
    if (!even || n != ARTNET_SLOTS_AT + n_slots || data[15] > 127)
        return LUM_PACKET_BAD;
    *p = (struct lum_desk_packet){.protocol = LUM_DESK_ARTNET,
                                  .universe = (uint16_t)((uint32_t)data[15] << 8 | data[14]),
                                  .priority = 100,
                                  .sequence = data[12],
                                  .sequenced = data[12] != 0,
                                  .n_slots = (uint16_t)n_slots,
                                  .slots = data + ARTNET_SLOTS_AT};
    return LUM_PACKET_SLOTS;
}

enum lum_packet_kind lum_packet_read(enum lum_desk_protocol protocol, const uint8_t *data, size_t n,
                                     struct lum_desk_packet *ret_packet)
{
    *ret_packet = (struct lum_desk_packet){0};
    if (n > LUM_DESK_PACKET_BYTES)
        return LUM_PACKET_BAD;
    return protocol == LUM_DESK_SACN ? read_sacn(data, n, ret_packet) : read_artnet(data, n, ret_packet);
}

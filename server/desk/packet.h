/* Packets of lighting desks, as they come off the wire: sACN (ANSI E1.31-2018) and Art-Net 4. Nobody vouches for who
 * sends them: whatever is not exactly of the form is refused whole. Pure; thread: any. */
#ifndef LUM_SERVER_DESK_PACKET_H
#define LUM_SERVER_DESK_PACKET_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#define LUM_DESK_SLOTS 512u        /* of a universe, as DMX512 has it */
#define LUM_DESK_PACKET_BYTES 638u /* of the longest, sACN's with 512 slots */
#define LUM_DESK_NAME_BYTES 64u    /* with the final 0 */

enum lum_desk_protocol { LUM_DESK_SACN, LUM_DESK_ARTNET, LUM_DESK_PROTOCOL_COUNT };
extern const char *const lum_desk_protocol_names[LUM_DESK_PROTOCOL_COUNT]; /* "sacn", "artnet" */

struct lum_desk_packet {
    enum lum_desk_protocol protocol;
    uint16_t universe;              /* sacn: 1..63999; artnet: the port address, 0..32767 */
    uint8_t source[16];             /* sacn: the CID; artnet: the sender's address, which the caller fills in */
    char name[LUM_DESK_NAME_BYTES]; /* of the source: UTF-8, or "" */
    uint8_t priority;               /* 0..200 */
    uint8_t sequence;
    bool sequenced; /* false: the sender does not count */
    bool preview;   /* not for output */
    bool terminated;
    uint16_t n_slots;
    const uint8_t *slots; /* in the packet */
};

enum lum_packet_kind {
    LUM_PACKET_BAD,   /* not of the protocol, or broken */
    LUM_PACKET_OTHER, /* of the protocol, and none of our business: synchronisation, other start codes, polls */
    LUM_PACKET_SLOTS,
};
enum lum_packet_kind lum_packet_read(enum lum_desk_protocol protocol, const uint8_t *data, size_t n,
                                     struct lum_desk_packet *ret_packet);

#endif

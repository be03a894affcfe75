/* What the sources of one universe make of its slots. A state machine of packets and time: no clock, no socket.
 *
 * sACN: the sources of the highest priority count, and of these, slot by slot, the highest value (HTP). A source is
 * gone when it says so or is silent for 2.5 s. Packets that come late by less than 20 numbers are left out. Art-Net:
 * two sources at most, by address, HTP; one is gone after 10 s of silence. When the last source is gone the slots stay
 * as they are: the last look holds. Not thread-safe. */
#ifndef LUM_SERVER_DESK_UNIVERSE_H
#define LUM_SERVER_DESK_UNIVERSE_H

#include "server/desk/packet.h"

#define LUM_DESK_SOURCES 8u /* of one universe; Art-Net: 2. More are turned away, but for one of a higher priority */
#define LUM_SACN_SILENCE_NS 2500000000ll    /* E1.31: network data loss timeout */
#define LUM_ARTNET_SILENCE_NS 10000000000ll /* Art-Net 4: a source that merges is forgotten after 10 s */

struct lum_desk_source {
    bool here;
    uint8_t id[16];
    char name[LUM_DESK_NAME_BYTES];
    uint8_t priority, sequence;
    bool sequenced; /* sequence is one */
    uint16_t n_slots;
    uint8_t slots[LUM_DESK_SLOTS];
    int64_t heard_ns;
    /* counted since the source is here */
    uint64_t packets, late, lost; /* late: left out for their number; lost: numbers that never came */
    int64_t rate_from_ns;         /* the second that is being counted */
    uint32_t rate_packets;
    double rate_hz; /* of the second before */
};

struct lum_universe {
    enum lum_desk_protocol protocol;
    uint16_t number;
    struct lum_desk_source sources[LUM_DESK_SOURCES];
    uint8_t slots[LUM_DESK_SLOTS];    /* what counts */
    uint16_t n_slots;                 /* that anybody ever sent */
    uint8_t unwanted[LUM_DESK_SLOTS]; /* not 0: it is kept, but nobody is told when it changes */
    uint64_t turned_away;             /* packets of sources for which there was no room */
    uint64_t previews;                /* packets that are not for output */
    uint64_t packets, late, lost;     /* of all sources, those that are gone, too */
    int64_t heard_ns;                 /* of the newest packet that counted */
};

/* Takes a packet of this universe. True: slots changed that are wanted. */
bool lum_universe_take(struct lum_universe *u, const struct lum_desk_packet *packet, int64_t now_ns);
/* Forgets who is silent for too long. True: likewise. */
bool lum_universe_expire(struct lum_universe *u, int64_t now_ns);
uint32_t lum_universe_sources(const struct lum_universe *u);
/* Packets per second of a source, over the last whole second; 0 once it is silent. */
double lum_desk_source_rate(const struct lum_desk_source *s, int64_t now_ns);

#endif

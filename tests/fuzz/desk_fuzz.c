/* Packets of both protocols, as a desk would take them: the first byte says which, and how much time has passed. What
 * is merged stays within what was sent. */
#include <string.h>

#include "server/desk/universe.h"
#include "tests/fuzz/fuzz.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t n)
{
    static struct lum_universe universes[LUM_DESK_PROTOCOL_COUNT];
    int64_t now_ns = 0;
    memset(universes, 0, sizeof universes);
    universes[LUM_DESK_ARTNET].protocol = LUM_DESK_ARTNET;
    while (n >= 3) { /* head: protocol and time, length */
        size_t length = (size_t)data[1] << 8 | data[2];
        enum lum_desk_protocol protocol = data[0] & 1 ? LUM_DESK_ARTNET : LUM_DESK_SACN;
        struct lum_universe *u = &universes[protocol];
        struct lum_desk_packet p;
        now_ns += (int64_t)(data[0] >> 1) * 40000000;
        data += 3;
        n -= 3;
        length = length < n ? length : n;
        if (lum_packet_read(protocol, data, length, &p) == LUM_PACKET_SLOTS) {
            FUZZ_REQUIRE(p.n_slots <= LUM_DESK_SLOTS && p.slots >= data && p.slots + p.n_slots <= data + length);
            FUZZ_REQUIRE(memchr(p.name, 0, sizeof p.name) && p.priority <= 200);
            lum_universe_take(u, &p, now_ns);
            FUZZ_REQUIRE(lum_universe_sources(u) <= LUM_DESK_SOURCES && u->n_slots <= LUM_DESK_SLOTS);
        }
        lum_universe_expire(u, now_ns);
        data += length;
        n -= length;
    }
    return 0;
}

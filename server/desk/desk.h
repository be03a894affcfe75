/* Ears for lighting desks: sACN and Art-Net over UDP, on a thread of their own. It keeps the newest state of the
 * universes that are watched, never a queue; packets of others are counted and dropped. Who may speak is who can reach
 * the socket: neither protocol knows passwords. */
#ifndef LUM_SERVER_DESK_DESK_H
#define LUM_SERVER_DESK_DESK_H

#include "core/base/base.h"
#include "server/desk/universe.h"

struct lum_desk_ear {
    bool open;
    char host[64];      /* numeric IPv4 */
    uint16_t port;      /* 0: a free one */
    char interface[64]; /* sacn: whose address joins the multicast groups of watched universes; "": none is joined */
};
struct lum_desk_config {
    struct lum_desk_ear ears[LUM_DESK_PROTOCOL_COUNT];
    struct lum_log log;
};

struct lum_desk;

/* Binds. Packets wait in the kernel's queue until lum_desk_start. */
LUM_MUST_USE enum lum_status lum_desk_create(const struct lum_desk_config *config, struct lum_desk **ret_desk,
                                             struct lum_error *err);
/* changed is called from the desk's thread whenever slots of a watched universe did; it must be quick. */
LUM_MUST_USE enum lum_status lum_desk_start(struct lum_desk *desk, void (*changed)(void *user), void *user,
                                            struct lum_error *err);
void lum_desk_stop(struct lum_desk *desk); /* accepts NULL, and one that was not started */
void lum_desk_destroy(struct lum_desk *desk);

/* ---- any thread ---- */
struct lum_desk_key {
    enum lum_desk_protocol protocol;
    uint16_t universe;
};
int lum_desk_key_order(const void *a, const void *b); /* for qsort of keys */
/* These from now on; sorted, none twice. Those watched before keep their state. unwanted: of each, slots whose changes
 * are nobody's; NULL: all are wanted. False: no memory, all is as it was. */
bool lum_desk_watch(struct lum_desk *desk, const struct lum_desk_key *keys, const uint8_t (*unwanted)[LUM_DESK_SLOTS],
                    size_t n);
/* Grows whenever slots change. */
uint64_t lum_desk_changes(const struct lum_desk *desk);
/* Slots of a watched universe, and how many were ever sent: 0 before the first packet. *ret_heard_ns: when the newest
 * packet came. */
uint32_t lum_desk_read(struct lum_desk *desk, struct lum_desk_key key, uint8_t ret_slots[LUM_DESK_SLOTS],
                       int64_t *ret_heard_ns);
/* A copy of the first watched universe after this one (NULL: of the first of all); false: there is none. */
bool lum_desk_next(struct lum_desk *desk, const struct lum_desk_key *after, struct lum_universe *ret_universe);

struct lum_desk_counts {
    uint16_t port; /* 0: not open */
    uint64_t packets, bad, other, unwatched;
    uint64_t dropped; /* by the kernel, before they were read */
};
struct lum_desk_counts lum_desk_counts(struct lum_desk *desk, enum lum_desk_protocol protocol);

/* A datagram, as if it had come in. Also of tests. */
void lum_desk_take(struct lum_desk *desk, enum lum_desk_protocol protocol, const uint8_t *data, size_t n,
                   uint32_t from_ipv4, int64_t now_ns);
/* Forgets silent sources. */
void lum_desk_expire(struct lum_desk *desk, int64_t now_ns);

#endif

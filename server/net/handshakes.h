/* How many handshakes of TLS begin in a second: of one network (see peers.h), and of all. They cost this server more
 * than who begins them. A part of what all may begin is kept for networks of which somebody is in: strangers, however
 * many they are, do not keep those out who come back. Thread: the net thread. */
#ifndef LUM_SERVER_NET_HANDSHAKES_H
#define LUM_SERVER_NET_HANDSHAKES_H

#include <netinet/in.h>

#include "protocol/base/limits.h"
#include "server/net/bucket.h"

/* Of what all may begin at once: for networks of which somebody is in. */
#define LUM_HANDSHAKES_KEPT (LUM_LIMIT_HANDSHAKES_BURST / 4)

struct lum_handshakes {
    struct lum_bucket all;
    struct {
        struct in6_addr network;
        struct lum_bucket bucket; /* full 0: the place is free */
    } of[LUM_LIMIT_HANDSHAKE_NETWORKS];
};

void lum_handshakes_init(struct lum_handshakes *h, int64_t now_ns);
/* Would lum_handshakes_take say yes? Before a connection costs anything. known: somebody of this network is in. */
bool lum_handshakes_may(struct lum_handshakes *h, const struct in6_addr *network, bool known, int64_t now_ns);
/* One begins. False: it must not. */
bool lum_handshakes_take(struct lum_handshakes *h, const struct in6_addr *network, bool known, int64_t now_ns);

#endif

/* Open connections by address, so that one address cannot take them all. Thread: the net thread. */
#ifndef LUM_SERVER_NET_PEERS_H
#define LUM_SERVER_NET_PEERS_H

#include <netinet/in.h>
#include <stdbool.h>
#include <stdint.h>

#include "protocol/base/limits.h"

struct lum_peer {
    struct in6_addr address; /* IPv4 as ::ffff:a.b.c.d */
    uint32_t n_connections;  /* 0: the entry is free */
};

/* Zero is empty. */
struct lum_peers {
    struct lum_peer peers[LUM_LIMIT_CONNECTIONS];
    uint32_t n_connections;
};

/* True when the connection on this socket stays within LUM_LIMIT_CONNECTIONS and LUM_LIMIT_CONNECTIONS_PER_IP. */
bool lum_peers_admit(struct lum_peers *peers, int fd);
/* Counts it. NULL: it cannot be told whose it is, and it is not counted. */
struct lum_peer *lum_peers_add(struct lum_peers *peers, int fd);
void lum_peers_remove(struct lum_peers *peers, struct lum_peer *peer); /* accepts NULL */

#endif

/* Open connections by network, so that no network can take them all. A network is an IPv4 address, or the /64 of an
 * IPv6 address: who has one address of it has them all.
 *
 * Who has not said hello makes room for who comes anew: the network with the most of those loses its oldest. So
 * half-open connections shut nobody out, however many they are. Thread: the net thread. */
#ifndef LUM_SERVER_NET_PEERS_H
#define LUM_SERVER_NET_PEERS_H

#include <netinet/in.h>
#include <stdbool.h>
#include <stdint.h>

#include "protocol/base/limits.h"

struct lum_peer {
    struct in6_addr network; /* IPv4 as ::ffff:a.b.c.d */
    void *connection;        /* NULL: the entry is free */
    uint64_t number;         /* in the order of coming */
    bool greeted;            /* said hello, or sends files with a ticket: is not turned out for another */
};

/* Zero is empty. */
struct lum_peers {
    struct lum_peer peers[LUM_LIMIT_CONNECTIONS];
    uint64_t n_came;
};

/* False: it is of no family that we know. */
bool lum_peer_network(const struct sockaddr *address, struct in6_addr *ret_network);
bool lum_peer_network_of(int fd, struct in6_addr *ret_network); /* of who is at the other end of a socket */
/* True when one more connection of this network stays within LUM_LIMIT_CONNECTIONS and LUM_LIMIT_CONNECTIONS_PER_IP. */
bool lum_peers_admit(const struct lum_peers *peers, const struct in6_addr *network);
/* Who has to go so that it does. NULL: nobody has to, or nobody may. */
const struct lum_peer *lum_peers_in_the_way(const struct lum_peers *peers, const struct in6_addr *network);
/* Somebody of this network has said hello, and is there. */
bool lum_peers_know(const struct lum_peers *peers, const struct in6_addr *network);
/* Counts it. NULL: there is no place left, and it is not counted. */
struct lum_peer *lum_peers_add(struct lum_peers *peers, const struct in6_addr *network, void *connection);
void lum_peers_remove(struct lum_peer *peer); /* accepts NULL */

#endif

#include "server/net/peers.h"

#include <string.h>
#include <sys/socket.h>

static bool peer_address(int fd, struct in6_addr *ret_address)
{
    union {
        struct sockaddr any;
        struct sockaddr_in v4;
        struct sockaddr_in6 v6;
    } name;
    socklen_t n = sizeof name;
    if (getpeername(fd, &name.any, &n))
        return false;
    memset(ret_address, 0, sizeof *ret_address);
    if (name.any.sa_family == AF_INET6) {
        *ret_address = name.v6.sin6_addr;
    } else {
        ret_address->s6_addr[10] = ret_address->s6_addr[11] = 0xff;
        memcpy(&ret_address->s6_addr[12], &name.v4.sin_addr, 4);
    }
    return true;
}

/* The entry of this address, or a free one; NULL when there is none. */
static struct lum_peer *find(struct lum_peers *peers, const struct in6_addr *address)
{
    struct lum_peer *unused = NULL;
    for (uint32_t i = 0; i < LUM_LIMIT_CONNECTIONS; i++) {
        struct lum_peer *p = &peers->peers[i];
        if (p->n_connections && memcmp(&p->address, address, sizeof *address) == 0)
            return p;
        if (!p->n_connections && !unused)
            unused = p;
    }
    return unused;
}

bool lum_peers_admit(struct lum_peers *peers, int fd)
{
    struct in6_addr address;
    const struct lum_peer *p = peer_address(fd, &address) ? find(peers, &address) : NULL;
    return p && p->n_connections < LUM_LIMIT_CONNECTIONS_PER_IP && peers->n_connections < LUM_LIMIT_CONNECTIONS;
}

struct lum_peer *lum_peers_add(struct lum_peers *peers, int fd)
{
    struct in6_addr address;
    struct lum_peer *p = peer_address(fd, &address) ? find(peers, &address) : NULL;
    if (!p)
        return NULL;
    p->address = address;
    p->n_connections++;
    peers->n_connections++;
    return p;
}

void lum_peers_remove(struct lum_peers *peers, struct lum_peer *peer)
{
    if (!peer)
        return;
    peer->n_connections--;
    peers->n_connections--;
}

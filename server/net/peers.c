#include "server/net/peers.h"

#include <string.h>
#include <sys/socket.h>

#include "core/base/base.h"

bool lum_peer_network(const struct sockaddr *address, struct in6_addr *ret_network)
{
    struct in6_addr n = {0};
    if (address->sa_family == AF_INET) {
        n.s6_addr[10] = n.s6_addr[11] = 0xff;
        memcpy(&n.s6_addr[12], &((const struct sockaddr_in *)(const void *)address)->sin_addr, 4);
    } else if (address->sa_family == AF_INET6) {
        n = ((const struct sockaddr_in6 *)(const void *)address)->sin6_addr;
        /* all of a link share one /64 of link-local addresses */
        if (!IN6_IS_ADDR_V4MAPPED(&n) && !IN6_IS_ADDR_LINKLOCAL(&n))
            memset(&n.s6_addr[8], 0, 8);
    } else {
        return false;
    }
    *ret_network = n;
    return true;
}

bool lum_peer_network_of(int fd, struct in6_addr *ret_network)
{
    union {
        struct sockaddr any;
        struct sockaddr_in6 largest;
    } address;
    socklen_t n = sizeof address;
    return getpeername(fd, &address.any, &n) == 0 && lum_peer_network(&address.any, ret_network);
}

static bool is_of(const struct lum_peer *p, const struct in6_addr *network)
{
    return p->connection && memcmp(&p->network, network, sizeof *network) == 0;
}

struct tally {
    uint32_t n, n_guests;          /* guests: have not said hello */
    const struct lum_peer *oldest; /* of the guests */
};

static struct tally count(const struct lum_peers *peers, const struct in6_addr *network)
{
    struct tally t = {0};
    for (size_t i = 0; i < LUM_ARRAY_LEN(peers->peers); i++) {
        const struct lum_peer *p = &peers->peers[i];
        if (!is_of(p, network))
            continue;
        t.n++;
        t.n_guests += !p->greeted;
        if (!p->greeted && (!t.oldest || p->number < t.oldest->number))
            t.oldest = p;
    }
    return t;
}

static uint32_t count_all(const struct lum_peers *peers)
{
    uint32_t n = 0;
    for (size_t i = 0; i < LUM_ARRAY_LEN(peers->peers); i++)
        n += peers->peers[i].connection != NULL;
    return n;
}

bool lum_peers_admit(const struct lum_peers *peers, const struct in6_addr *network)
{
    return count(peers, network).n < LUM_LIMIT_CONNECTIONS_PER_IP && count_all(peers) < LUM_LIMIT_CONNECTIONS;
}

const struct lum_peer *lum_peers_in_the_way(const struct lum_peers *peers, const struct in6_addr *network)
{
    struct tally most = count(peers, network);
    if (most.n >= LUM_LIMIT_CONNECTIONS_PER_IP)
        return most.oldest;
    if (count_all(peers) < LUM_LIMIT_CONNECTIONS)
        return NULL;
    for (size_t i = 0; i < LUM_ARRAY_LEN(peers->peers); i++) {
        struct tally t = count(peers, &peers->peers[i].network);
        most = t.n_guests > most.n_guests ? t : most;
    }
    return most.oldest;
}

bool lum_peers_know(const struct lum_peers *peers, const struct in6_addr *network)
{
    struct tally t = count(peers, network);
    return t.n > t.n_guests;
}

struct lum_peer *lum_peers_add(struct lum_peers *peers, const struct in6_addr *network, void *connection)
{
    for (size_t i = 0; i < LUM_ARRAY_LEN(peers->peers); i++) {
        struct lum_peer *p = &peers->peers[i];
        if (p->connection)
            continue;
        *p = (struct lum_peer){.network = *network, .connection = connection, .number = peers->n_came++};
        return p;
    }
    return NULL;
}

void lum_peers_remove(struct lum_peer *peer)
{
    if (peer)
        memset(peer, 0, sizeof *peer);
}

#define _GNU_SOURCE /* pthread_setname_np */
#include "server/desk/desk.h"

#include <arpa/inet.h>
#include <errno.h>
#include <netinet/in.h>
#include <poll.h>
#include <pthread.h>
#include <stdlib.h>
#include <string.h>
#include <sys/eventfd.h>
#include <sys/socket.h>
#include <unistd.h>

#include "server/base/log.h"

#define QUEUE_BYTES (1 << 20) /* in the kernel: a second of 32 universes */
#define AT_ONCE 64            /* datagrams under one lock */
#define EXPIRE_EVERY_MS 100

struct ear {
    int fd; /* -1: closed */
    uint32_t dropped_seen;
    struct lum_desk_counts counts;
};

struct lum_desk {
    struct lum_desk_config config;
    int stop_fd;
    pthread_t thread;
    bool has_thread;
    void (*changed)(void *user);
    void *user;
    _Atomic uint64_t changes;

    pthread_mutex_t lock;
    /* guarded by lock */
    struct ear ears[LUM_DESK_PROTOCOL_COUNT];
    struct lum_universe *universes; /* sorted */
    size_t n_universes;
};

/* ---- universes ---- */

int lum_desk_key_order(const void *a, const void *b)
{
    const struct lum_desk_key *x = a, *y = b;
    int d = (int)x->protocol - (int)y->protocol;
    return d ? d : (int)x->universe - (int)y->universe;
}

static struct lum_desk_key key_of(const struct lum_universe *u)
{
    return (struct lum_desk_key){u->protocol, u->number};
}

/* The first that is not before this key. */
static size_t place_locked(const struct lum_desk *d, struct lum_desk_key key)
{
    size_t lo = 0, hi = d->n_universes;
    while (lo < hi) {
        size_t middle = lo + (hi - lo) / 2;
        struct lum_desk_key at = key_of(&d->universes[middle]);
        if (lum_desk_key_order(&at, &key) < 0)
            lo = middle + 1;
        else
            hi = middle;
    }
    return lo;
}

static struct lum_universe *find_locked(const struct lum_desk *d, struct lum_desk_key key)
{
    size_t i = place_locked(d, key);
    struct lum_desk_key at = i < d->n_universes ? key_of(&d->universes[i]) : (struct lum_desk_key){0};
    return i < d->n_universes && lum_desk_key_order(&at, &key) == 0 ? &d->universes[i] : NULL;
}

/* Joining twice and leaving what was not joined are harmless. */
static void join(const struct lum_desk *d, struct lum_desk_key key, bool joins)
{
    const struct lum_desk_ear *ear = &d->config.ears[key.protocol];
    int fd = d->ears[key.protocol].fd;
    if (fd < 0 || key.protocol != LUM_DESK_SACN || !ear->interface[0])
        return;
    struct ip_mreqn group = {.imr_multiaddr.s_addr = htonl(0xefff0000u | key.universe)};
    inet_pton(AF_INET, ear->interface, &group.imr_address);
    if (setsockopt(fd, IPPROTO_IP, joins ? IP_ADD_MEMBERSHIP : IP_DROP_MEMBERSHIP, &group, sizeof group) && joins &&
        errno != EADDRINUSE)
        lum_log(&d->config.log, LUM_LOG_WARNING, "desk", "the group of universe %u cannot be joined: %s%s",
                key.universe, strerror(errno), errno == ENOBUFS ? " (raise net.ipv4.igmp_max_memberships)" : "");
}

bool lum_desk_watch(struct lum_desk *d, const struct lum_desk_key *keys, const uint8_t (*unwanted)[LUM_DESK_SLOTS],
                    size_t n)
{
    struct lum_universe *universes = lum_calloc(n, sizeof *universes);
    if (!universes)
        return false;
    pthread_mutex_lock(&d->lock);
    for (size_t i = 0; i < n; i++) {
        const struct lum_universe *was = find_locked(d, keys[i]);
        if (was)
            universes[i] = *was;
        universes[i].protocol = keys[i].protocol;
        universes[i].number = keys[i].universe;
        if (unwanted)
            memcpy(universes[i].unwanted, unwanted[i], sizeof *unwanted);
        else
            memset(universes[i].unwanted, 0, sizeof universes[i].unwanted);
    }
    for (size_t i = 0; i < d->n_universes; i++) {
        struct lum_desk_key key = key_of(&d->universes[i]);
        if (n == 0 || !bsearch(&key, keys, n, sizeof *keys, lum_desk_key_order))
            join(d, key, false);
    }
    for (size_t i = 0; i < n; i++) /* all of them: where there was no room before, or no interface, there may be now */
        join(d, keys[i], true);
    lum_free(d->universes);
    d->universes = universes;
    d->n_universes = n;
    pthread_mutex_unlock(&d->lock);
    return true;
}

uint64_t lum_desk_changes(const struct lum_desk *d)
{
    return atomic_load(&d->changes);
}

uint32_t lum_desk_read(struct lum_desk *d, struct lum_desk_key key, uint8_t ret_slots[LUM_DESK_SLOTS],
                       int64_t *ret_heard_ns)
{
    uint32_t n = 0;
    pthread_mutex_lock(&d->lock);
    const struct lum_universe *u = find_locked(d, key);
    if (u) {
        n = u->n_slots;
        memcpy(ret_slots, u->slots, sizeof u->slots);
        *ret_heard_ns = u->heard_ns;
    }
    pthread_mutex_unlock(&d->lock);
    return n;
}

bool lum_desk_next(struct lum_desk *d, const struct lum_desk_key *after, struct lum_universe *ret_universe)
{
    pthread_mutex_lock(&d->lock);
    size_t i = after ? place_locked(d, *after) : 0;
    if (after && find_locked(d, *after))
        i++;
    bool found = i < d->n_universes;
    if (found)
        *ret_universe = d->universes[i];
    pthread_mutex_unlock(&d->lock);
    return found;
}

struct lum_desk_counts lum_desk_counts(struct lum_desk *d, enum lum_desk_protocol protocol)
{
    pthread_mutex_lock(&d->lock);
    struct lum_desk_counts counts = d->ears[protocol].counts;
    pthread_mutex_unlock(&d->lock);
    return counts;
}

/* ---- packets ---- */

/* True: slots changed. */
static bool take_locked(struct lum_desk *d, enum lum_desk_protocol protocol, const uint8_t *data, size_t n,
                        uint32_t from_ipv4, int64_t now_ns)
{
    struct lum_desk_counts *counts = &d->ears[protocol].counts;
    struct lum_desk_packet p;
    enum lum_packet_kind kind = lum_packet_read(protocol, data, n, &p);
    counts->packets++;
    counts->bad += kind == LUM_PACKET_BAD;
    counts->other += kind == LUM_PACKET_OTHER;
    if (kind != LUM_PACKET_SLOTS)
        return false;
    if (protocol == LUM_DESK_ARTNET)
        memcpy(p.source, &from_ipv4, sizeof from_ipv4);
    struct lum_universe *u = find_locked(d, (struct lum_desk_key){protocol, p.universe});
    counts->unwatched += !u;
    return u && lum_universe_take(u, &p, now_ns);
}

static void tell(struct lum_desk *d, bool changed)
{
    if (!changed)
        return;
    atomic_fetch_add(&d->changes, 1);
    if (d->changed)
        d->changed(d->user);
}

void lum_desk_take(struct lum_desk *d, enum lum_desk_protocol protocol, const uint8_t *data, size_t n,
                   uint32_t from_ipv4, int64_t now_ns)
{
    pthread_mutex_lock(&d->lock);
    bool changed = take_locked(d, protocol, data, n, from_ipv4, now_ns);
    pthread_mutex_unlock(&d->lock);
    tell(d, changed);
}

void lum_desk_expire(struct lum_desk *d, int64_t now_ns)
{
    bool changed = false;
    pthread_mutex_lock(&d->lock);
    for (size_t i = 0; i < d->n_universes; i++)
        changed = lum_universe_expire(&d->universes[i], now_ns) || changed;
    pthread_mutex_unlock(&d->lock);
    tell(d, changed);
}

/* ---- sockets ---- */

/* The kernel counts what it dropped of this socket, in 32 bits. */
static void count_dropped(struct ear *ear, struct msghdr *message)
{
    for (struct cmsghdr *c = CMSG_FIRSTHDR(message); c; c = CMSG_NXTHDR(message, c)) {
        uint32_t dropped;
        if (c->cmsg_level != SOL_SOCKET || c->cmsg_type != SO_RXQ_OVFL)
            continue;
        memcpy(&dropped, CMSG_DATA(c), sizeof dropped);
        ear->counts.dropped += (uint32_t)(dropped - ear->dropped_seen);
        ear->dropped_seen = dropped;
    }
}

/* One datagram that waits. False: none does. */
static bool receive_locked(struct lum_desk *d, enum lum_desk_protocol protocol, bool *inout_changed)
{
    struct ear *ear = &d->ears[protocol];
    uint8_t data[LUM_DESK_PACKET_BYTES + 1]; /* what is longer is cut, and refused for its length */
    _Alignas(struct cmsghdr) char control[CMSG_SPACE(sizeof(uint32_t))];
    struct sockaddr_in from = {0};
    struct iovec part = {data, sizeof data};
    struct msghdr message = {.msg_name = &from,
                             .msg_namelen = sizeof from,
                             .msg_iov = &part,
                             .msg_iovlen = 1,
                             .msg_control = control,
                             .msg_controllen = sizeof control};
    ssize_t n = recvmsg(ear->fd, &message, MSG_DONTWAIT);
    if (n < 0)
        return false;
    count_dropped(ear, &message);
    *inout_changed = take_locked(d, protocol, data, (size_t)n, from.sin_addr.s_addr, lum_clock_ns()) || *inout_changed;
    return true;
}

static void drain(struct lum_desk *d, enum lum_desk_protocol protocol)
{
    bool changed = false;
    int n = 0;
    pthread_mutex_lock(&d->lock);
    while (n < AT_ONCE && receive_locked(d, protocol, &changed))
        n++;
    pthread_mutex_unlock(&d->lock);
    tell(d, changed);
}

static bool anybody_here(struct lum_desk *d)
{
    uint32_t n = 0;
    pthread_mutex_lock(&d->lock);
    for (size_t i = 0; i < d->n_universes && n == 0; i++)
        n = lum_universe_sources(&d->universes[i]);
    pthread_mutex_unlock(&d->lock);
    return n > 0;
}

static void *desk_main(void *arg)
{
    struct lum_desk *d = arg;
    int64_t expire_at_ns = 0;
    bool anybody = false;
    struct pollfd fds[LUM_DESK_PROTOCOL_COUNT + 1] = {{.fd = d->stop_fd, .events = POLLIN}};
    pthread_setname_np(pthread_self(), "lum-desk");
    for (int p = 0; p < LUM_DESK_PROTOCOL_COUNT; p++) /* poll leaves out what is -1 */
        fds[p + 1] = (struct pollfd){.fd = d->ears[p].fd, .events = POLLIN};
    for (;;) {
        int n = poll(fds, LUM_ARRAY_LEN(fds), anybody ? EXPIRE_EVERY_MS : -1);
        if (fds[0].revents || (n < 0 && errno != EINTR))
            return NULL;
        for (int p = 0; n > 0 && p < LUM_DESK_PROTOCOL_COUNT; p++)
            if (fds[p + 1].revents)
                drain(d, (enum lum_desk_protocol)p);
        anybody = anybody || n > 0;
        int64_t now = lum_clock_ns();
        if (now < expire_at_ns)
            continue;
        lum_desk_expire(d, now);
        expire_at_ns = now + EXPIRE_EVERY_MS * 1000000ll;
        anybody = anybody_here(d);
    }
}

static enum lum_status open_ear(struct lum_desk *d, enum lum_desk_protocol protocol, struct lum_error *err)
{
    const struct lum_desk_ear *want = &d->config.ears[protocol];
    const char *name = lum_desk_protocol_names[protocol];
    struct sockaddr_in at = {.sin_family = AF_INET, .sin_port = htons(want->port)};
    socklen_t length = sizeof at;
    int off = 0, on = 1, queue = QUEUE_BYTES;
    if (!want->open)
        return LUM_OK;
    int fd = d->ears[protocol].fd = socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
    if (inet_pton(AF_INET, want->host, &at.sin_addr) != 1)
        return lum_fail(err, LUM_ERR_INVALID, name, "%s needs an IPv4 address, not '%.60s'", name, want->host);
    if (fd >= 0) { /* without these it works, too: groups that others joined may speak, drops are not counted */
        setsockopt(fd, IPPROTO_IP, IP_MULTICAST_ALL, &off, sizeof off);
        setsockopt(fd, SOL_SOCKET, SO_RXQ_OVFL, &on, sizeof on);
        setsockopt(fd, SOL_SOCKET, SO_RCVBUF, &queue, sizeof queue);
    }
    if (fd < 0 || bind(fd, (struct sockaddr *)&at, sizeof at) || getsockname(fd, (struct sockaddr *)&at, &length))
        return lum_fail(err, LUM_ERR_IO, name, "%s cannot listen on %s port %u: %s", name, want->host, want->port,
                        strerror(errno));
    d->ears[protocol].counts.port = ntohs(at.sin_port);
    lum_log(&d->config.log, LUM_LOG_INFO, "desk", "%s on %s port %u", name, want->host, ntohs(at.sin_port));
    return LUM_OK;
}

/* ---- life ---- */

enum lum_status lum_desk_create(const struct lum_desk_config *config, struct lum_desk **ret_desk, struct lum_error *err)
{
    struct lum_desk *d = lum_calloc(1, sizeof *d);
    if (!d || pthread_mutex_init(&d->lock, NULL)) {
        lum_free(d);
        return lum_fail(err, LUM_ERR_NOMEM, "", "no memory for the desk");
    }
    d->config = *config;
    for (int p = 0; p < LUM_DESK_PROTOCOL_COUNT; p++)
        d->ears[p].fd = -1;
    d->stop_fd = eventfd(0, EFD_CLOEXEC);
    enum lum_status st =
        d->stop_fd < 0 ? lum_fail(err, LUM_ERR_IO, "", "no event descriptor: %s", strerror(errno)) : LUM_OK;
    for (int p = 0; p < LUM_DESK_PROTOCOL_COUNT && !st; p++)
        st = open_ear(d, (enum lum_desk_protocol)p, err);
    if (st)
        lum_desk_destroy(d);
    else
        *ret_desk = d;
    return st;
}

enum lum_status lum_desk_start(struct lum_desk *d, void (*changed)(void *user), void *user, struct lum_error *err)
{
    d->changed = changed;
    d->user = user;
    d->has_thread = pthread_create(&d->thread, NULL, desk_main, d) == 0;
    return d->has_thread ? LUM_OK : lum_fail(err, LUM_ERR_NOMEM, "", "the desk's thread cannot be started");
}

void lum_desk_stop(struct lum_desk *d)
{
    uint64_t one = 1;
    if (!d || !d->has_thread)
        return;
    while (write(d->stop_fd, &one, sizeof one) < 0 && errno == EINTR)
        ;
    pthread_join(d->thread, NULL);
    d->has_thread = false;
}

void lum_desk_destroy(struct lum_desk *d)
{
    if (!d)
        return;
    lum_desk_stop(d);
    for (int p = 0; p < LUM_DESK_PROTOCOL_COUNT; p++)
        if (d->ears[p].fd >= 0)
            close(d->ears[p].fd);
    if (d->stop_fd >= 0)
        close(d->stop_fd);
    pthread_mutex_destroy(&d->lock);
    lum_free(d->universes);
    lum_free(d);
}

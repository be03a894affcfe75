/* Who may connect, and how often: networks of addresses, buckets that fill, handshakes of TLS. */
#define _GNU_SOURCE /* POLLRDHUP */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

#include <arpa/inet.h>
#include <poll.h>
#include <stdio.h>
#include <string.h>
#include <sys/socket.h>
#include <unistd.h>

#include "protocol/base/limits.h"
#include "server/net/bucket.h"
#include "server/net/handshakes.h"
#include "server/net/peers.h"
#include "server/net/received.h"

static struct in6_addr network_of(const char *text)
{
    struct sockaddr_in v4 = {.sin_family = AF_INET};
    struct sockaddr_in6 v6 = {.sin6_family = AF_INET6};
    struct in6_addr network;
    if (inet_pton(AF_INET, text, &v4.sin_addr) == 1)
        assert_true(lum_peer_network((struct sockaddr *)&v4, &network));
    else if (inet_pton(AF_INET6, text, &v6.sin6_addr) == 1)
        assert_true(lum_peer_network((struct sockaddr *)&v6, &network));
    else
        fail_msg("%s is no address", text);
    return network;
}

static bool one_network(const char *a, const char *b)
{
    struct in6_addr network_a = network_of(a), network_b = network_of(b);
    return memcmp(&network_a, &network_b, sizeof network_a) == 0;
}

static void networks(void **state)
{
    (void)state;
    assert_true(one_network("2001:db8:1:2::1", "2001:db8:1:2:ffff:1:2:3"));
    assert_false(one_network("2001:db8:1:2::1", "2001:db8:1:3::1"));
    assert_true(one_network("192.0.2.7", "::ffff:192.0.2.7"));
    assert_false(one_network("192.0.2.7", "192.0.2.8"));
    assert_false(one_network("::ffff:192.0.2.7", "::ffff:192.0.2.8"));
    assert_false(one_network("::1", "::ffff:127.0.0.1"));
    assert_false(one_network("fe80::1", "fe80::2")); /* neighbours, not one subscriber */
    struct in6_addr ignored;
    assert_false(lum_peer_network(&(struct sockaddr){.sa_family = AF_UNIX}, &ignored));
}

/* Connections from addresses of one /64, each other. */
static void a_network_is_limited_whatever_its_addresses(void **state)
{
    (void)state;
    struct lum_peers peers = {0};
    char text[INET6_ADDRSTRLEN];
    for (unsigned i = 0; i < LUM_LIMIT_CONNECTIONS_PER_IP; i++) {
        snprintf(text, sizeof text, "2001:db8:1:2::%x", i + 1);
        struct in6_addr network = network_of(text);
        assert_true(lum_peers_admit(&peers, &network));
        lum_peers_add(&peers, &network, &peers)->greeted = true;
    }
    struct in6_addr network = network_of("2001:db8:1:2:a:b:c:d"), other = network_of("2001:db8:1:3::1");
    assert_false(lum_peers_admit(&peers, &network));
    assert_null(lum_peers_in_the_way(&peers, &network)); /* who said hello stays */
    assert_true(lum_peers_admit(&peers, &other));
}

static void the_network_with_most_guests_makes_room(void **state)
{
    (void)state;
    struct lum_peers peers = {0};
    static const char *const crowd[] = {"192.0.2.1", "192.0.2.2", "192.0.2.3", "192.0.2.4"};
    struct in6_addr loner = network_of("198.51.100.1"), late = network_of("198.51.100.2");
    const struct lum_peer *lonely = lum_peers_add(&peers, &loner, &peers), *oldest = NULL;
    for (unsigned i = 0; i + 1 < LUM_LIMIT_CONNECTIONS; i++) {
        struct in6_addr network = network_of(crowd[i % 4]);
        struct lum_peer *p = lum_peers_add(&peers, &network, &peers);
        oldest = i == 1 ? p : oldest;
        p->greeted = i % 4 == 0; /* nobody of the first is a guest */
    }
    assert_false(lum_peers_admit(&peers, &late));
    const struct lum_peer *out = lum_peers_in_the_way(&peers, &late);
    assert_ptr_equal(out, oldest);
    assert_ptr_not_equal(out, lonely); /* though it came first */
    lum_peers_remove((struct lum_peer *)(uintptr_t)out);
    assert_true(lum_peers_admit(&peers, &late));
    assert_null(lum_peers_in_the_way(&peers, &late));
}

static void buckets_fill_at_their_pace(void **state)
{
    (void)state;
    const int64_t s = 1000000000;
    struct lum_bucket b = lum_bucket_full(10.0, 20.0, 5 * s);
    for (int i = 0; i < 20; i++)
        assert_true(lum_bucket_take(&b, 5 * s));
    assert_false(lum_bucket_take(&b, 5 * s));
    assert_false(lum_bucket_take(&b, 5 * s + s / 20));
    assert_true(lum_bucket_take(&b, 5 * s + s / 10));
    assert_int_equal(lum_bucket_charge(&b, 20.0, 100 * s), 0); /* never more than it holds */
    assert_int_equal(lum_bucket_charge(&b, 5.0, 100 * s), s / 2);
    assert_int_equal(lum_bucket_charge(&b, 5.0, 100 * s), s);
    assert_false(lum_bucket_take(&b, 101 * s)); /* what was owed is paid, and no more */
    assert_int_equal(lum_bucket_charge(&b, 0.0, 101 * s), 0);
    assert_int_equal(lum_bucket_charge(&b, 18446744073709551615.0, 101 * s),
                     3600 * s); /* more than can be waited for */
    assert_int_equal(lum_bucket_charge(&b, 1.0, 3701 * s), 3600 * s);
}

/* Two ends of a connection. */
static void join(int *ret_from, int *ret_to)
{
    struct sockaddr_in here = {.sin_family = AF_INET, .sin_addr.s_addr = htonl(INADDR_LOOPBACK)};
    socklen_t n = sizeof here;
    int listening = socket(AF_INET, SOCK_STREAM, 0);
    *ret_from = socket(AF_INET, SOCK_STREAM, 0);
    assert_true(listening >= 0 && *ret_from >= 0);
    assert_int_equal(bind(listening, (struct sockaddr *)&here, sizeof here), 0);
    assert_int_equal(listen(listening, 1), 0);
    assert_int_equal(getsockname(listening, (struct sockaddr *)&here, &n), 0);
    assert_int_equal(connect(*ret_from, (struct sockaddr *)&here, sizeof here), 0);
    *ret_to = accept(listening, NULL, NULL);
    assert_true(*ret_to >= 0);
    close(listening);
}

static void what_was_read_is_counted(void **state)
{
    (void)state;
    int from, to;
    char bytes[1000] = {0};
    uint64_t n = 0;
    join(&from, &to);
    assert_int_equal(send(from, bytes, sizeof bytes, 0), sizeof bytes);
    assert_int_equal(recv(to, bytes, sizeof bytes, MSG_PEEK | MSG_WAITALL), sizeof bytes); /* all of them are there */
    assert_true(lum_received_bytes(to, &n));
    assert_int_equal(n, 0);
    assert_int_equal(recv(to, bytes, 300, 0), 300);
    assert_true(lum_received_bytes(to, &n));
    assert_int_equal(n, 300);
    close(to);
    assert_false(lum_received_bytes(to, &n));
    assert_int_equal(n, 300);
    close(from);
}

/* As long as an out-of-band byte is before them, the system does not tell of bytes that are unread. */
static void what_was_read_never_becomes_less(void **state)
{
    (void)state;
    int from, to;
    char bytes[1000] = {0};
    uint64_t n = 0, before = 0, n_read = 0;
    join(&from, &to);
    assert_int_equal(send(from, bytes, 10, 0), 10);
    assert_int_equal(send(from, "!", 1, MSG_OOB), 1);
    assert_int_equal(send(from, bytes, sizeof bytes, 0), sizeof bytes);
    assert_int_equal(shutdown(from, SHUT_WR), 0);
    struct pollfd end = {.fd = to, .events = POLLRDHUP};
    assert_int_equal(poll(&end, 1, -1), 1); /* all of them are there */
    assert_true(lum_received_bytes(to, &before));
    assert_true(before > 0); /* too many; more than were read are paid for, and not again */
    for (ssize_t k = 1; k > 0; before = n) {
        k = recv(to, bytes, 100, 0);
        n_read += (uint64_t)k;
        assert_true(lum_received_bytes(to, &n));
        assert_true(n >= before && n >= n_read);
    }
    assert_int_equal(n_read, 10 + sizeof bytes);
    close(to);
    close(from);
}

static struct in6_addr nth_network(unsigned i)
{
    char text[INET6_ADDRSTRLEN];
    snprintf(text, sizeof text, "2001:db8:%x:%x::1", i >> 16, i & 0xffffu);
    return network_of(text);
}

/* How many it may begin now, one after the other. */
static unsigned begin_all(struct lum_handshakes *h, const struct in6_addr *network, bool known, int64_t now_ns)
{
    unsigned n = 0;
    while (lum_handshakes_may(h, network, known, now_ns)) {
        assert_true(lum_handshakes_take(h, network, known, now_ns));
        n++;
    }
    assert_false(lum_handshakes_take(h, network, known, now_ns));
    return n;
}

static void handshakes_of_a_network_are_limited(void **state)
{
    (void)state;
    static struct lum_handshakes h;
    const int64_t s = 1000000000;
    struct in6_addr flooder = nth_network(1), other = nth_network(2);
    lum_handshakes_init(&h, 5 * s);
    assert_int_equal(begin_all(&h, &flooder, false, 5 * s), LUM_LIMIT_HANDSHAKES_IP_BURST);
    assert_true(lum_handshakes_take(&h, &other, false, 5 * s)); /* it keeps nobody else out */
    assert_int_equal(begin_all(&h, &flooder, false, 6 * s), LUM_LIMIT_HANDSHAKES_IP_PER_S);
    assert_int_equal(begin_all(&h, &flooder, true, 6 * s), 0); /* whoever it is */
    assert_int_equal(begin_all(&h, &flooder, false, 1000 * s), LUM_LIMIT_HANDSHAKES_IP_BURST);
}

/* Strangers from everywhere, each once, more than are remembered: their share, and who has somebody in gets the rest.
 */
static void handshakes_of_all_are_limited(void **state)
{
    (void)state;
    static struct lum_handshakes h;
    const int64_t s = 1000000000;
    struct in6_addr known = nth_network(0);
    unsigned n = 0;
    lum_handshakes_init(&h, 5 * s);
    for (unsigned i = 1; i <= 2 * LUM_LIMIT_HANDSHAKE_NETWORKS; i++) {
        struct in6_addr network = nth_network(i);
        bool may = lum_handshakes_may(&h, &network, false, 5 * s);
        assert_int_equal(lum_handshakes_take(&h, &network, false, 5 * s), may);
        n += may;
    }
    assert_int_equal(n, LUM_LIMIT_HANDSHAKES_BURST - LUM_HANDSHAKES_KEPT);
    assert_int_equal(begin_all(&h, &known, true, 5 * s), LUM_HANDSHAKES_KEPT);
}

/* There are places for so many; who has begun most is forgotten last. */
static void who_begins_most_is_remembered(void **state)
{
    (void)state;
    static struct lum_handshakes h;
    const int64_t s = 1000000000;
    struct in6_addr flooder = nth_network(0);
    lum_handshakes_init(&h, 5 * s);
    begin_all(&h, &flooder, false, 5 * s);
    for (unsigned i = 1; i <= 2 * LUM_LIMIT_HANDSHAKE_NETWORKS; i++) {
        struct in6_addr network = nth_network(i);
        assert_true(
            lum_handshakes_may(&h, &network, true, 5 * s)); /* which takes a place, and nothing of what all may */
    }
    assert_int_equal(begin_all(&h, &flooder, true, 5 * s), 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(networks),
        cmocka_unit_test(a_network_is_limited_whatever_its_addresses),
        cmocka_unit_test(the_network_with_most_guests_makes_room),
        cmocka_unit_test(buckets_fill_at_their_pace),
        cmocka_unit_test(what_was_read_is_counted),
        cmocka_unit_test(what_was_read_never_becomes_less),
        cmocka_unit_test(handshakes_of_a_network_are_limited),
        cmocka_unit_test(handshakes_of_all_are_limited),
        cmocka_unit_test(who_begins_most_is_remembered),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

#include "server/net/handshakes.h"

#include <string.h>

#include "core/base/base.h"

void lum_handshakes_init(struct lum_handshakes *h, int64_t now_ns)
{
    memset(h, 0, sizeof *h);
    h->all = lum_bucket_full(LUM_LIMIT_HANDSHAKES_PER_S, LUM_LIMIT_HANDSHAKES_BURST, now_ns);
}

/* That of the network. Where it has none: the place of the network that has most left, which loses least by being
 * forgotten; often all that it had to pay is paid. */
static struct lum_bucket *bucket_of(struct lum_handshakes *h, const struct in6_addr *network, int64_t now_ns)
{
    size_t best = 0;
    double most = -1.0;
    for (size_t i = 0; i < LUM_ARRAY_LEN(h->of); i++) {
        struct lum_bucket *b = &h->of[i].bucket;
        bool used = b->full > 0.0;
        if (used && memcmp(&h->of[i].network, network, sizeof *network) == 0)
            return b;
        double level = used ? lum_bucket_level(b, now_ns) : 2.0 * LUM_LIMIT_HANDSHAKES_IP_BURST;
        if (level > most) {
            most = level;
            best = i;
        }
    }
    h->of[best].network = *network;
    h->of[best].bucket = lum_bucket_full(LUM_LIMIT_HANDSHAKES_IP_PER_S, LUM_LIMIT_HANDSHAKES_IP_BURST, now_ns);
    return &h->of[best].bucket;
}

static bool all_may(struct lum_handshakes *h, bool known, int64_t now_ns)
{
    return lum_bucket_level(&h->all, now_ns) >= 1.0 + (known ? 0.0 : LUM_HANDSHAKES_KEPT);
}

bool lum_handshakes_may(struct lum_handshakes *h, const struct in6_addr *network, bool known, int64_t now_ns)
{
    return all_may(h, known, now_ns) && lum_bucket_level(bucket_of(h, network, now_ns), now_ns) >= 1.0;
}

bool lum_handshakes_take(struct lum_handshakes *h, const struct in6_addr *network, bool known, int64_t now_ns)
{
    return all_may(h, known, now_ns) && lum_bucket_take(bucket_of(h, network, now_ns), now_ns) &&
           lum_bucket_take(&h->all, now_ns);
}

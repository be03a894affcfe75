/* What the network counts, and the text of /metrics, which shows that and what the director counts. */
#ifndef LUM_SERVER_NET_METRICS_H
#define LUM_SERVER_NET_METRICS_H

#include <stdint.h>
#include <stdio.h>

struct lum_projects;

/* Thread: the net thread, for everything. */
struct lum_net_counters {
    uint64_t connections, connections_refused, connections_turned_out, http_requests, sessions, sessions_refused,
        messages, messages_refused, frames_acked, tx_bytes, rx_bytes, rx_rest, rx_waits, tiles_sent, handshakes,
        handshakes_refused;
    uint32_t sessions_open;
    int64_t certificate_ends_s; /* of the Unix epoch; 0: no TLS is spoken */
};

/* started_ns: lum_clock_ns at the start of the daemon. */
void lum_metrics_print(FILE *out, const struct lum_net_counters *counters, const struct lum_projects *projects,
                       int64_t started_ns);

#endif

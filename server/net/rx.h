/* A text message of a client while its fragments come. Thread: the net thread, for everything. */
#ifndef LUM_SERVER_NET_RX_H
#define LUM_SERVER_NET_RX_H

#include <stdbool.h>
#include <stddef.h>

/* In caller memory, all zero: empty. */
struct lum_rx {
    char *bytes;
    size_t n, capacity;
};
/* max: of the whole message, which the caller keeps to. False: memory is short. */
bool lum_rx_add(struct lum_rx *rx, const char *bytes, size_t n, size_t max);
void lum_rx_clear(struct lum_rx *rx); /* for the next message */
void lum_rx_finish(struct lum_rx *rx);

#endif

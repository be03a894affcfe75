/* What came by a TCP connection, whatever it was. */
#ifndef LUM_SERVER_NET_RECEIVED_H
#define LUM_SERVER_NET_RECEIVED_H

#include <stdbool.h>
#include <stdint.h>

/* Bytes that were read from it since it was made. *n: 0, or what was told before; it never goes back. False: the system
 * does not tell, and *n is as it was. */
bool lum_received_bytes(int fd, uint64_t *n);

#endif

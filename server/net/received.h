/* What came by a TCP connection, whatever it was. */
#ifndef LUM_SERVER_NET_RECEIVED_H
#define LUM_SERVER_NET_RECEIVED_H

#include <stdbool.h>
#include <stdint.h>

/* Bytes that were read from it since it was made. False: the system does not tell. */
bool lum_received_bytes(int fd, uint64_t *ret_n);

#endif

/* Where the server listens. */
#ifndef LUM_SERVER_NET_ADDRESS_H
#define LUM_SERVER_NET_ADDRESS_H

#include "core/base/base.h"

struct lum_address {
    char host[64];            /* numeric: "127.0.0.1", "::1" */
    bool ipv6, loopback, any; /* any: on all addresses of this machine */
    uint16_t port;            /* 0: a free one */
};

/* "HOST:PORT" or "[ADDRESS]:PORT" with a numeric address, or localhost. given: what the text came by, for the message.
 */
LUM_MUST_USE enum lum_status lum_address_parse(const char *given, const char *text, struct lum_address *ret_address,
                                               struct lum_error *err);
/* By which this machine reaches it: a server on all addresses is on loopback too. */
const char *lum_address_local(const struct lum_address *address);

#endif

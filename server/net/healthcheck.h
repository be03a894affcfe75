/* `lumend --healthcheck`: asks a running daemon for /healthz, so that a container needs no other program for it. */
#ifndef LUM_SERVER_NET_HEALTHCHECK_H
#define LUM_SERVER_NET_HEALTHCHECK_H

#include "core/base/base.h"
#include "server/net/address.h"

/* LUM_OK when the server that listens at this address answers 200. Gives up after 5 s. */
LUM_MUST_USE enum lum_status lum_healthcheck(const struct lum_address *address, bool tls, struct lum_error *err);

#endif

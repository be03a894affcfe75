/* Which Host and Origin headers are answered: what keeps other sites' pages in a user's browser away from this server.
 *
 * Host: an attacker can point a DNS name at 127.0.0.1 (rebinding), but not make a browser send an address or
 * "localhost" for it. So addresses and localhost are fine, names must be listed. Origin: must be this server itself, or
 * listed; absent (scripts, not browsers) is fine, because the token is asked for anyway. */
#ifndef LUM_SERVER_NET_ACCESS_H
#define LUM_SERVER_NET_ACCESS_H

#include <stdbool.h>

struct lum_access {
    bool loopback;       /* bound to loopback: only loopback addresses are this server */
    bool tls;            /* this server speaks TLS itself: no page of it comes by http */
    const char *hosts;   /* "a.example,b.example"; names only, any port */
    const char *origins; /* "https://a.example,..." */
};

/* host: the header's text, or NULL when there is none. */
bool lum_access_host(const struct lum_access *access, const char *host);
/* True: the whole name is ours, because it is reached by the port that a browser takes by itself: what is said of it
 * does not speak for another server on another port of this machine. host has passed lum_access_host. */
bool lum_access_owns_name(const char *host);
/* origin may be NULL: absent. host has passed lum_access_host. */
bool lum_access_origin(const struct lum_access *access, const char *origin, const char *host);

#endif

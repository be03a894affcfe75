#include "server/net/address.h"

#include <arpa/inet.h>
#include <ctype.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum lum_status lum_address_parse(const char *given, const char *text, struct lum_address *ret_address,
                                  struct lum_error *err)
{
    struct lum_address a = {0};
    struct in_addr v4 = {0};
    struct in6_addr v6 = {0};
    const char *colon = strrchr(text, ':');
    size_t n = colon ? (size_t)(colon - text) : 0;
    char *end = NULL;
    long port = colon && isdigit((unsigned char)colon[1]) ? strtol(colon + 1, &end, 10) : -1;
    if (n == 0 || n + 1 > sizeof a.host || port < 0 || port > 65535 || *end)
        return lum_fail(err, LUM_ERR_INVALID, "listen", "%s must be HOST:PORT, not '%.60s'", given, text);
    a.ipv6 = n > 2 && text[0] == '[' && text[n - 1] == ']';
    snprintf(a.host, sizeof a.host, "%.*s", (int)(a.ipv6 ? n - 2 : n), a.ipv6 ? text + 1 : text);
    if (strcmp(a.host, "localhost") == 0)
        strcpy(a.host, "127.0.0.1");
    if (inet_pton(a.ipv6 ? AF_INET6 : AF_INET, a.host, a.ipv6 ? (void *)&v6 : (void *)&v4) != 1)
        return lum_fail(err, LUM_ERR_INVALID, "listen",
                        "%s needs an address such as 127.0.0.1, 0.0.0.0 or [::1], not '%s'", given, a.host);
    a.loopback = a.ipv6 ? IN6_IS_ADDR_LOOPBACK(&v6) : (ntohl(v4.s_addr) >> 24) == 127;
    a.any = a.ipv6 ? IN6_IS_ADDR_UNSPECIFIED(&v6) : v4.s_addr == 0;
    a.port = (uint16_t)port;
    *ret_address = a;
    return LUM_OK;
}

const char *lum_address_local(const struct lum_address *address)
{
    return !address->any ? address->host : address->ipv6 ? "::1" : "127.0.0.1";
}

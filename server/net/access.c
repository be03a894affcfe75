#include "server/net/access.h"

#include <arpa/inet.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>
#include <strings.h>

static bool in_list(const char *list, const char *text)
{
    size_t n = strlen(text);
    while (list && *list) {
        size_t item = strcspn(list, ",");
        if (item == n && strncasecmp(list, text, n) == 0)
            return true;
        list += item + (list[item] == ',');
    }
    return false;
}

/* Splits "name", "name:port", "[v6]" or "[v6]:port". False when it is none of them. */
static bool host_name(const char *host, char *name, size_t size, bool *ret_v6)
{
    bool v6 = host[0] == '[';
    size_t n = v6 ? strcspn(host + 1, "]") : strcspn(host, ":");
    const char *rest = v6 ? host + 1 + n + (host[1 + n] == ']') : host + n;
    if (n == 0 || n >= size || (v6 && host[1 + n] != ']'))
        return false;
    if (*rest && (rest[0] != ':' || strspn(rest + 1, "0123456789") != strlen(rest + 1)))
        return false;
    memcpy(name, host + v6, n);
    name[n] = '\0';
    *ret_v6 = v6;
    return true;
}

bool lum_access_host(const struct lum_access *access, const char *host)
{
    char name[256];
    bool v6;
    struct in_addr a4;
    struct in6_addr a6;
    if (!host || !host_name(host, name, sizeof name, &v6))
        return false;
    if (v6)
        return inet_pton(AF_INET6, name, &a6) == 1 && (!access->loopback || IN6_IS_ADDR_LOOPBACK(&a6));
    if (strcasecmp(name, "localhost") == 0 || in_list(access->hosts, name))
        return true;
    return inet_pton(AF_INET, name, &a4) == 1 && (!access->loopback || (ntohl(a4.s_addr) >> 24) == 127);
}

bool lum_access_owns_name(const char *host)
{
    char name[256];
    bool v6;
    struct in_addr a4;
    const char *colon = strrchr(host, ':');
    if (!host_name(host, name, sizeof name, &v6) || v6 || inet_pton(AF_INET, name, &a4) == 1)
        return false;
    return strcasecmp(name, "localhost") != 0 && (!colon || strcmp(colon, ":443") == 0);
}

bool lum_access_origin(const struct lum_access *access, const char *origin, const char *host)
{
    if (!origin || in_list(access->origins, origin))
        return true;
    static const char *const schemes[] = {"http://", "https://"}; /* https: we, or a proxy in front of us, end TLS */
    for (size_t i = access->tls; i < sizeof schemes / sizeof schemes[0]; i++) {
        size_t n = strlen(schemes[i]);
        if (strncasecmp(origin, schemes[i], n) == 0 && strcasecmp(origin + n, host) == 0)
            return true;
    }
    return false;
}

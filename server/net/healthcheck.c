#define _GNU_SOURCE
#include "server/net/healthcheck.h"

#include <arpa/inet.h>
#include <errno.h>
#include <signal.h>
#include <string.h>
#include <sys/socket.h>
#include <sys/time.h>
#include <unistd.h>

#include "server/net/tls.h"

static int connect_to(const struct lum_address *a)
{
    const char *host = lum_address_local(a);
    struct sockaddr_in v4 = {.sin_family = AF_INET, .sin_port = htons(a->port)};
    struct sockaddr_in6 v6 = {.sin6_family = AF_INET6, .sin6_port = htons(a->port)};
    inet_pton(AF_INET, host, &v4.sin_addr);
    inet_pton(AF_INET6, host, &v6.sin6_addr);
    const struct timeval patience = {.tv_sec = 5};
    int fd = socket(a->ipv6 ? AF_INET6 : AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
    if (fd < 0)
        return -1;
    setsockopt(fd, SOL_SOCKET, SO_RCVTIMEO, &patience, sizeof patience);
    setsockopt(fd, SOL_SOCKET, SO_SNDTIMEO, &patience, sizeof patience);
    int failed =
        a->ipv6 ? connect(fd, (struct sockaddr *)&v6, sizeof v6) : connect(fd, (struct sockaddr *)&v4, sizeof v4);
    if (!failed)
        return fd;
    close(fd);
    return -1;
}

static const char request[] = "GET /healthz HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\r\n";

/* Reads at least the status line. */
static size_t exchange(int fd, char *answer, size_t size)
{
    size_t n = 0;
    ssize_t got = send(fd, request, sizeof request - 1, MSG_NOSIGNAL);
    if (got != (ssize_t)(sizeof request - 1))
        return 0;
    while (n + 1 < size && (got = recv(fd, answer + n, size - 1 - n, 0)) > 0)
        n += (size_t)got;
    answer[n] = '\0';
    return n;
}

enum lum_status lum_healthcheck(const struct lum_address *address, bool tls, struct lum_error *err)
{
    char answer[512] = "";
    signal(SIGPIPE, SIG_IGN); /* of a server that hangs up: an error code, not a signal */
    int fd = connect_to(address);
    if (fd < 0)
        return lum_fail(err, LUM_ERR_IO, "listen", "no server at %s port %u: %s", address->host, address->port,
                        strerror(errno));
    size_t n =
        tls ? lum_tls_ask(fd, request, sizeof request - 1, answer, sizeof answer) : exchange(fd, answer, sizeof answer);
    close(fd);
    if (n >= 12 && strncmp(answer, "HTTP/1.1 200", 12) == 0)
        return LUM_OK;
    return lum_fail(err, LUM_ERR_IO, "healthz", "the server answers \"%.*s\"", (int)strcspn(answer, "\r\n"), answer);
}

#define _GNU_SOURCE
#include "server/base/service.h"

#include <errno.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <sys/time.h>
#include <sys/un.h>
#include <unistd.h>

/* A name that begins with '@' is none of a file: it is the kernel's, and begins with a zero byte. */
static enum lum_status connect_to(const char *name, int *ret_fd, struct lum_error *err)
{
    struct sockaddr_un to = {.sun_family = AF_UNIX};
    size_t n = strlen(name);
    if ((name[0] != '/' && name[0] != '@') || n >= sizeof to.sun_path)
        return lum_fail(err, LUM_ERR_INVALID, "",
                        "$NOTIFY_SOCKET must be a path or @NAME of at most %zu bytes, not '%.60s'",
                        sizeof to.sun_path - 1, name);
    memcpy(to.sun_path, name, n);
    if (name[0] == '@')
        to.sun_path[0] = '\0';
    int fd = socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0);
    const struct timeval patience = {.tv_sec = LUM_SERVICE_PATIENCE_S};
    if (fd >= 0 && setsockopt(fd, SOL_SOCKET, SO_SNDTIMEO, &patience, sizeof patience) == 0 &&
        connect(fd, (const struct sockaddr *)&to, (socklen_t)(offsetof(struct sockaddr_un, sun_path) + n)) == 0) {
        *ret_fd = fd;
        return LUM_OK;
    }
    int e = errno;
    if (fd >= 0)
        close(fd);
    return lum_fail(err, LUM_ERR_IO, "", "nobody listens at $NOTIFY_SOCKET (%.100s): %s", name, strerror(e));
}

/* Half of what is allowed, so that one that comes late is no harm. */
static int64_t read_watchdog(void)
{
    const char *time_us = getenv("WATCHDOG_USEC"), *pid = getenv("WATCHDOG_PID");
    if (!time_us || (pid && strtoll(pid, NULL, 10) != (long long)getpid()))
        return 0;
    long long us = strtoll(time_us, NULL, 10);
    return us > 0 && us < INT64_MAX / 1000 ? us * 1000 / 2 : 0;
}

enum lum_status lum_service_open(struct lum_service *ret_service, struct lum_error *err)
{
    const char *name = getenv("NOTIFY_SOCKET");
    struct lum_service s = {.fd = -1};
    enum lum_status st = name && *name ? connect_to(name, &s.fd, err) : LUM_OK;
    if (s.fd >= 0)
        s.alive_ns = read_watchdog();
    unsetenv("NOTIFY_SOCKET");
    unsetenv("WATCHDOG_USEC");
    unsetenv("WATCHDOG_PID");
    *ret_service = s;
    return st;
}

void lum_service_close(struct lum_service *s)
{
    if (s->fd >= 0)
        close(s->fd);
    s->fd = -1;
}

void lum_service_tell(const struct lum_service *s, const char *state)
{
    if (s->fd >= 0)
        (void)!send(s->fd, state, strlen(state), MSG_NOSIGNAL);
}

void lum_service_tell_alive(const struct lum_service *s)
{
    static const char state[] = "WATCHDOG=1";
    if (s->fd >= 0)
        (void)!send(s->fd, state, sizeof state - 1, MSG_NOSIGNAL | MSG_DONTWAIT);
}

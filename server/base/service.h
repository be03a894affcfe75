/* What the daemon tells who started it, in the protocol of sd_notify(3): one datagram to the socket that $NOTIFY_SOCKET
 * names. Where there is none nothing is told. systemd's library is not needed for that. */
#ifndef LUM_SERVER_BASE_SERVICE_H
#define LUM_SERVER_BASE_SERVICE_H

#include "core/base/base.h"

#define LUM_SERVICE_PATIENCE_S 5 /* for a manager that does not read: longer would hold the start up for it */

struct lum_service {
    int fd;           /* connected; -1: nobody wants to know */
    int64_t alive_ns; /* "WATCHDOG=1" is expected at least so often; 0: never */
};
/* Reads $NOTIFY_SOCKET, $WATCHDOG_USEC and $WATCHDOG_PID, and removes them: they are not for the programs that are
 * started from here. Before there are threads. An error where the socket cannot be reached. */
LUM_MUST_USE enum lum_status lum_service_open(struct lum_service *ret_service, struct lum_error *err);
void lum_service_close(struct lum_service *s);
/* state: lines such as "READY=1". Their queue is short, and may be full of signs of life: waits for room, at most
 * LUM_SERVICE_PATIENCE_S; where nobody reads until then, it is lost. Thread: any. */
void lum_service_tell(const struct lum_service *s, const char *state);
/* "WATCHDOG=1". Never waits: those before it in a full queue say the same. Thread: any. */
void lum_service_tell_alive(const struct lum_service *s);

#endif

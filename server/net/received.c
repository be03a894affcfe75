#include "server/net/received.h"

#include <linux/tcp.h> /* glibc's tcp_info ends before tcpi_bytes_received */
#include <netinet/in.h>
#include <stddef.h>
#include <string.h>
#include <sys/ioctl.h>
#include <sys/socket.h>

bool lum_received_bytes(int fd, uint64_t *n_read)
{
    struct tcp_info info;
    socklen_t n = sizeof info;
    int n_unread = 0; /* they wait in the kernel */
    memset(&info, 0, sizeof info);
    if (getsockopt(fd, IPPROTO_TCP, TCP_INFO, &info, &n) || ioctl(fd, FIONREAD, &n_unread) ||
        n < offsetof(struct tcp_info, tcpi_bytes_received) + sizeof info.tcpi_bytes_received)
        return false;
    uint64_t came = info.tcpi_bytes_received, unread = (uint64_t)n_unread;
    /* The two are asked one after the other: what comes in between is taken off, and was not counted. And as long as
     * there is an out-of-band byte, only what comes before it counts as unread. */
    if (came > unread && came - unread > *n_read)
        *n_read = came - unread;
    return true;
}

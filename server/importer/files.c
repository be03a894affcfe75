#define _GNU_SOURCE
#include "server/importer/files.h"

#include <errno.h>
#include <string.h>
#include <sys/socket.h>
#include <unistd.h>

#include "protocol/base/limits.h"

static bool send_request(int sock, const char *name, unsigned flags)
{
    char datagram[1 + LUM_FILE_NAME_BYTES];
    size_t n = strlen(name);
    datagram[0] = (char)flags;
    memcpy(datagram + 1, name, n);
    struct iovec iov = {datagram, n + 1};
    struct msghdr msg = {.msg_iov = &iov, .msg_iovlen = 1};
    ssize_t sent;
    do
        sent = sendmsg(sock, &msg, MSG_NOSIGNAL);
    while (sent < 0 && errno == EINTR);
    return sent == (ssize_t)(n + 1);
}

/* ret_fd: -1 when none came. */
static bool receive_reply(int sock, struct lum_file_reply *ret_reply, int *ret_fd)
{
    union {
        char bytes[CMSG_SPACE(sizeof(int))];
        struct cmsghdr align;
    } control;
    struct iovec iov = {ret_reply, sizeof *ret_reply};
    struct msghdr msg = {.msg_iov = &iov, .msg_iovlen = 1, .msg_control = &control, .msg_controllen = sizeof control};
    ssize_t n;
    do
        n = recvmsg(sock, &msg, MSG_CMSG_CLOEXEC);
    while (n < 0 && errno == EINTR);
    *ret_fd = -1;
    struct cmsghdr *c = n >= 0 ? CMSG_FIRSTHDR(&msg) : NULL;
    if (c && c->cmsg_level == SOL_SOCKET && c->cmsg_type == SCM_RIGHTS)
        memcpy(ret_fd, CMSG_DATA(c), sizeof *ret_fd);
    return n == (ssize_t)sizeof *ret_reply;
}

static enum lum_status read_whole(int fd, const char *name, uint64_t n_bytes, struct lum_bytes *ret_bytes,
                                  struct lum_error *err)
{
    uint8_t *data = lum_calloc(1, (size_t)n_bytes + 1);
    if (!data)
        return lum_fail(err, LUM_ERR_NOMEM, "", "out of memory for %.80s", name);
    size_t n = 0;
    while (n < n_bytes) {
        ssize_t got = read(fd, data + n, (size_t)n_bytes - n);
        if (got < 0 && errno == EINTR)
            continue;
        if (got <= 0)
            break; /* the file shrank: what is there counts */
        n += (size_t)got;
    }
    *ret_bytes = (struct lum_bytes){data, n};
    return LUM_OK;
}

static enum lum_status refusal(uint32_t status, const char *name, struct lum_error *err)
{
    switch (status) {
    case LUM_ERR_NOT_FOUND:
        return lum_fail(err, LUM_ERR_NOT_FOUND, "", "%.120s: no such file", name);
    case LUM_ERR_INVALID:
        return lum_fail(err, LUM_ERR_INVALID, "", "%.120s: only plain files below the asset's directory may be used",
                        name);
    case LUM_ERR_LIMIT:
        return lum_fail(err, LUM_ERR_LIMIT, "", "%.120s: larger than %llu MiB, or too many files", name,
                        (unsigned long long)(LUM_LIMIT_IMPORT_FILE_BYTES >> 20));
    default:
        return lum_fail(err, LUM_ERR_IO, "", "%.120s: cannot be read", name);
    }
}

enum lum_status lum_files_read(const struct lum_files *files, const char *name, unsigned flags,
                               struct lum_bytes *ret_bytes, struct lum_error *err)
{
    size_t n = strlen(name);
    if (n == 0 || n > LUM_FILE_NAME_BYTES)
        return refusal(LUM_ERR_INVALID, name, err);
    if (files->socket < 0)
        return refusal(LUM_ERR_NOT_FOUND, name, err);
    struct lum_file_reply reply;
    int fd = -1;
    if (!send_request(files->socket, name, flags) || !receive_reply(files->socket, &reply, &fd)) {
        if (fd >= 0)
            close(fd);
        return lum_fail(err, LUM_ERR_IO, "", "%.120s: nobody answers file requests", name);
    }
    if (reply.status != LUM_OK || fd < 0) {
        if (fd >= 0)
            close(fd);
        return refusal(reply.status, name, err);
    }
    enum lum_status status = reply.n_bytes > LUM_LIMIT_IMPORT_FILE_BYTES
                                 ? refusal(LUM_ERR_LIMIT, name, err)
                                 : read_whole(fd, name, reply.n_bytes, ret_bytes, err);
    close(fd);
    return status;
}

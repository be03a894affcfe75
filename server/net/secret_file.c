#define _GNU_SOURCE
#include "server/net/secret_file.h"

#include <errno.h>
#include <fcntl.h>
#include <stdbool.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

static enum lum_status fail(const char *option, const char *path, struct lum_error *err)
{
    return lum_fail(err, LUM_ERR_IO, option, "cannot read the file of --%s, %s: %s", option, path, strerror(errno));
}

static bool is_open_to_others(const struct stat *st, enum lum_file_readers readers)
{
    mode_t closed = S_IRWXG | S_IRWXO;
    if (st->st_uid == 0 && (st->st_gid == 0 || readers == LUM_FILE_OF_OWNER_OR_ROOTS_GROUP))
        closed &= ~(mode_t)S_IRGRP;
    return readers != LUM_FILE_OF_ALL && (st->st_mode & closed);
}

static enum lum_status read_all(int fd, enum lum_file_readers readers, const char *option, const char *path, char *out,
                                size_t size, size_t *ret_n, struct lum_error *err)
{
    struct stat st;
    if (fstat(fd, &st))
        return fail(option, path, err);
    if (is_open_to_others(&st, readers))
        return lum_fail(err, LUM_ERR_INVALID, option,
                        "%s: its mode is %03o, so others than its owner may use it: chmod 600 %s", path,
                        (unsigned)st.st_mode & 0777u, path);
    ssize_t n = 1;
    *ret_n = 0;
    while (n != 0 && *ret_n < size - 1) {
        n = read(fd, out + *ret_n, size - 1 - *ret_n);
        if (n < 0 && errno != EINTR)
            return fail(option, path, err);
        *ret_n += n > 0 ? (size_t)n : 0;
    }
    out[*ret_n] = '\0';
    return LUM_OK;
}

enum lum_status lum_secret_file_read(enum lum_file_readers readers, const char *option, const char *path, char *out,
                                     size_t size, size_t *ret_n, struct lum_error *err)
{
    int fd = open(path, O_RDONLY | O_CLOEXEC);
    if (fd < 0)
        return fail(option, path, err);
    enum lum_status status = read_all(fd, readers, option, path, out, size, ret_n, err);
    close(fd);
    return status;
}

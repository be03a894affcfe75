#define _GNU_SOURCE
#include "server/import/asset.h"

#include <dirent.h>
#include <errno.h>
#include <fcntl.h>
#include <string.h>
#include <strings.h>
#include <sys/stat.h>
#include <unistd.h>

#define DIR_FLAGS (O_RDONLY | O_DIRECTORY | O_NOFOLLOW | O_CLOEXEC)
#define FILE_FLAGS (O_RDONLY | O_NOFOLLOW | O_NONBLOCK | O_NOCTTY | O_CLOEXEC) /* NONBLOCK: a pipe must not hang us */

bool lum_asset_is_upload(const char *name)
{
    static const char folder[] = LUM_UPLOAD_FOLDER "/";
    const char *id = name + sizeof folder - 1;
    return strncmp(name, folder, sizeof folder - 1) == 0 && strspn(id, "0123456789abcdef") == LUM_UPLOAD_ID_BYTES &&
           id[LUM_UPLOAD_ID_BYTES] == '/';
}

/* The next component of *path into ret_name; *path moves behind it and its slashes. False: it is not allowed. */
static bool next_component(const char **path, char ret_name[NAME_MAX + 1])
{
    size_t n = strcspn(*path, "/");
    if (n == 0 || n > NAME_MAX || (n == 1 && (*path)[0] == '.') || (n == 2 && memcmp(*path, "..", 2) == 0) ||
        memchr(*path, '\\', n))
        return false;
    memcpy(ret_name, *path, n);
    ret_name[n] = 0;
    *path += n + strspn(*path + n, "/");
    return true;
}

/* Replaces name by the entry of dir_fd that equals it but for letter case; the first in alphabetical order, so that the
 * answer does not depend on the file system. */
static bool fold_case(int dir_fd, char name[NAME_MAX + 1])
{
    int fd = openat(dir_fd, ".", DIR_FLAGS);
    DIR *dir = fd < 0 ? NULL : fdopendir(fd);
    if (!dir) {
        if (fd >= 0)
            close(fd);
        return false;
    }
    char best[NAME_MAX + 1] = "";
    for (struct dirent *e = readdir(dir); e; e = readdir(dir))
        if (strcasecmp(e->d_name, name) == 0 && (!best[0] || strcmp(e->d_name, best) < 0))
            memcpy(best, e->d_name, strlen(e->d_name) + 1);
    closedir(dir);
    if (!best[0])
        return false;
    memcpy(name, best, strlen(best) + 1);
    return true;
}

static enum lum_status status_of_errno(int e)
{
    return e == ENOENT || e == ENOTDIR ? LUM_ERR_NOT_FOUND : e == ELOOP ? LUM_ERR_INVALID : LUM_ERR_IO;
}

static enum lum_status open_component(int dir_fd, char *name, int flags, bool any_case, int *ret_fd)
{
    int fd = openat(dir_fd, name, flags);
    if (fd < 0 && errno == ENOENT && any_case && fold_case(dir_fd, name))
        fd = openat(dir_fd, name, flags);
    if (fd < 0)
        return status_of_errno(errno);
    *ret_fd = fd;
    return LUM_OK;
}

/* Opens all directories of name; *ret_last holds the last component. */
static enum lum_status walk(int root_fd, const char *name, bool any_case, int *ret_dir_fd, char ret_last[NAME_MAX + 1])
{
    int dir_fd = fcntl(root_fd, F_DUPFD_CLOEXEC, 0);
    if (dir_fd < 0)
        return LUM_ERR_IO;
    enum lum_status status = LUM_OK;
    const char *path = name;
    while (!status) {
        if (!next_component(&path, ret_last)) {
            status = LUM_ERR_INVALID;
            break;
        }
        if (!*path)
            break;
        int next_fd = -1;
        status = open_component(dir_fd, ret_last, DIR_FLAGS, any_case, &next_fd);
        close(dir_fd);
        dir_fd = next_fd;
    }
    if (status) {
        if (dir_fd >= 0)
            close(dir_fd);
        return status;
    }
    *ret_dir_fd = dir_fd;
    return LUM_OK;
}

enum lum_status lum_asset_open_dir(int root_fd, const char *name, int *ret_dir_fd)
{
    char last[NAME_MAX + 1];
    return walk(root_fd, name, false, ret_dir_fd, last);
}

enum lum_status lum_asset_open(int root_fd, const char *name, bool any_case, int *ret_fd, uint64_t *ret_n_bytes)
{
    char last[NAME_MAX + 1];
    int dir_fd = -1, fd = -1;
    struct stat st;
    enum lum_status status = walk(root_fd, name, any_case, &dir_fd, last);
    if (status)
        return status;
    status = open_component(dir_fd, last, FILE_FLAGS, any_case, &fd);
    close(dir_fd);
    if (status)
        return status;
    if (fstat(fd, &st) || !S_ISREG(st.st_mode)) {
        close(fd);
        return LUM_ERR_INVALID;
    }
    *ret_fd = fd;
    *ret_n_bytes = (uint64_t)st.st_size;
    return LUM_OK;
}

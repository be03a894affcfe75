#define _GNU_SOURCE
#include "server/journal/disk.h"

#include <dirent.h>
#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <string.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

/* ---- the calls ---- */

static int real_create(void *user, int dir_fd, const char *name)
{
    (void)user;
    return openat(dir_fd, name, O_WRONLY | O_CREAT | O_EXCL | O_NOFOLLOW | O_CLOEXEC, 0600);
}

static ssize_t real_write(void *user, int fd, const void *bytes, size_t n)
{
    (void)user;
    return write(fd, bytes, n);
}

static int real_sync(void *user, int fd)
{
    (void)user;
    return fsync(fd);
}

static int real_rename(void *user, int dir_fd, const char *from, const char *to)
{
    (void)user;
    return renameat(dir_fd, from, dir_fd, to);
}

const struct lum_disk lum_disk_real = {real_create, real_write, real_sync, real_rename, NULL};

static enum lum_status fail_errno(struct lum_error *err, const char *what, const char *name)
{
    int e = errno;
    return lum_fail(err, e == ENOENT ? LUM_ERR_NOT_FOUND : LUM_ERR_IO, "state", "cannot %s %.100s: %s", what, name,
                    strerror(e));
}

/* ---- folders ---- */

/* The name of a new folder is in the one above. Made by somebody else, it may be in one that we may not look into, or
 * in a file system that cannot sync, such as a read-only one. */
static enum lum_status sync_above(const struct lum_dir *dir, const char *name, bool made, struct lum_error *err)
{
    int fd = openat(dir->fd, "..", O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    if (fd < 0 && errno == EACCES && !made)
        return LUM_OK;
    bool ok = fd >= 0 && (dir->disk->sync(dir->disk->user, fd) == 0 || (!made && (errno == EINVAL || errno == EROFS)));
    enum lum_status st = ok ? LUM_OK : fail_errno(err, "write the folder above", name);
    if (fd >= 0)
        close(fd);
    return st;
}

enum lum_status lum_dir_open(int at_fd, const char *name, bool make, const struct lum_disk *disk,
                             struct lum_dir *ret_dir, struct lum_error *err)
{
    bool made = make && mkdirat(at_fd, name, 0700) == 0;
    if (make && !made && errno != EEXIST)
        return fail_errno(err, "make the folder", name);
    /* the user's own path may lead over links; below it nothing does */
    int fd = openat(at_fd, name, O_RDONLY | O_DIRECTORY | O_CLOEXEC | (at_fd == AT_FDCWD ? 0 : O_NOFOLLOW));
    if (fd < 0)
        return fail_errno(err, "open the folder", name);
    struct lum_dir dir = {fd, disk};
    enum lum_status st = make ? sync_above(&dir, name, made, err) : LUM_OK;
    if (st)
        lum_dir_close(&dir);
    else
        *ret_dir = dir;
    return st;
}

void lum_dir_close(struct lum_dir *dir)
{
    if (dir->disk && dir->fd >= 0)
        close(dir->fd);
    *dir = (struct lum_dir){.fd = -1};
}

enum lum_status lum_dir_sync(const struct lum_dir *dir, struct lum_error *err)
{
    return dir->disk->sync(dir->disk->user, dir->fd) ? fail_errno(err, "write", "the folder") : LUM_OK;
}

enum lum_status lum_dir_lock(const struct lum_dir *dir, const char *path, int *ret_fd, struct lum_error *err)
{
    int fd = openat(dir->fd, "lock", O_RDWR | O_CREAT | O_NOFOLLOW | O_CLOEXEC, 0600);
    if (fd < 0)
        return fail_errno(err, "open", "the file lock");
    if (flock(fd, LOCK_EX | LOCK_NB) == 0) {
        *ret_fd = fd;
        return LUM_OK;
    }
    bool taken = errno == EWOULDBLOCK;
    close(fd);
    if (!taken)
        return fail_errno(err, "lock", "the file lock");
    return lum_fail(err, LUM_ERR_CONFLICT, "state",
                    "another lumend writes the state in %.100s: stop that one first, or give another folder", path);
}

enum lum_status lum_dir_each(const struct lum_dir *dir, void (*fn)(void *user, const char *name), void *user,
                             struct lum_error *err)
{
    int fd = openat(dir->fd, ".", O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    DIR *list = fd < 0 ? NULL : fdopendir(fd);
    if (!list) {
        enum lum_status st = fail_errno(err, "read", "the folder");
        if (fd >= 0)
            close(fd);
        return st;
    }
    struct dirent *e;
    while (errno = 0, e = readdir(list)) /* a list that is cut short would be files that are lost */
        if (e->d_name[0] != '.')
            fn(user, e->d_name);
    enum lum_status st = errno ? fail_errno(err, "read", "the folder") : LUM_OK;
    closedir(list);
    return st;
}

/* ---- files ---- */

enum lum_status lum_dir_create(const struct lum_dir *dir, const char *name, int *ret_fd, struct lum_error *err)
{
    lum_dir_remove(dir, name);
    int fd = dir->disk->create(dir->disk->user, dir->fd, name);
    if (fd < 0)
        return fail_errno(err, "create", name);
    *ret_fd = fd;
    return LUM_OK;
}

enum lum_status lum_dir_read(const struct lum_dir *dir, const char *name, int *ret_fd, uint64_t *ret_n_bytes,
                             struct lum_error *err)
{
    /* a pipe in place of a file must not hang us */
    int fd = openat(dir->fd, name, O_RDONLY | O_NOFOLLOW | O_NONBLOCK | O_NOCTTY | O_CLOEXEC);
    struct stat st;
    if (fd < 0 && (errno == ELOOP || errno == ENXIO)) /* a link, a socket */
        return lum_fail(err, LUM_ERR_INVALID, "state", "%.100s is no plain file", name);
    if (fd < 0 || fstat(fd, &st) != 0) {
        enum lum_status status = fail_errno(err, "open", name);
        if (fd >= 0)
            close(fd);
        return status;
    }
    if (!S_ISREG(st.st_mode)) {
        close(fd);
        return lum_fail(err, LUM_ERR_INVALID, "state", "%.100s is no plain file", name);
    }
    *ret_fd = fd;
    *ret_n_bytes = (uint64_t)st.st_size;
    return LUM_OK;
}

enum lum_status lum_dir_size(const struct lum_dir *dir, const char *name, uint64_t *ret_n_bytes, struct lum_error *err)
{
    struct stat st;
    if (fstatat(dir->fd, name, &st, AT_SYMLINK_NOFOLLOW) != 0)
        return fail_errno(err, "find", name);
    *ret_n_bytes = (uint64_t)st.st_size;
    return LUM_OK;
}

enum lum_status lum_dir_write(const struct lum_dir *dir, const char *name, int fd, const void *bytes, size_t n,
                              struct lum_error *err)
{
    const char *at = bytes;
    while (n > 0) {
        ssize_t done = dir->disk->write(dir->disk->user, fd, at, n);
        if (done < 0 && errno == EINTR)
            continue;
        if (done == 0)
            errno = ENOSPC; /* as good a reason as any: there is no progress */
        if (done <= 0)
            return fail_errno(err, "write", name);
        at += done;
        n -= (size_t)done;
    }
    return LUM_OK;
}

enum lum_status lum_dir_sync_file(const struct lum_dir *dir, const char *name, int fd, struct lum_error *err)
{
    return dir->disk->sync(dir->disk->user, fd) ? fail_errno(err, "write", name) : LUM_OK;
}

enum lum_status lum_dir_rename(const struct lum_dir *dir, const char *from, const char *to, struct lum_error *err)
{
    if (dir->disk->rename(dir->disk->user, dir->fd, from, to) != 0)
        return fail_errno(err, "rename", from);
    return lum_dir_sync(dir, err);
}

void lum_dir_remove(const struct lum_dir *dir, const char *name)
{
    (void)unlinkat(dir->fd, name, 0);
}

/* ---- trees ---- */

#define DEPTH 256u /* beyond, folders stay: nothing of ours is so deep, and each holds a descriptor */

static void walk(int at_fd, const char *name, unsigned depth, void (*fn)(void *user, int at_fd, const char *name),
                 void *user)
{
    int fd = depth < DEPTH ? openat(at_fd, name, O_RDONLY | O_DIRECTORY | O_NOFOLLOW | O_CLOEXEC) : -1;
    DIR *list = fd < 0 ? NULL : fdopendir(fd);
    if (fd >= 0 && !list)
        close(fd);
    for (struct dirent *e = list ? readdir(list) : NULL; e; e = readdir(list))
        if (strcmp(e->d_name, ".") != 0 && strcmp(e->d_name, "..") != 0)
            walk(dirfd(list), e->d_name, depth + 1, fn, user);
    if (list)
        closedir(list);
    fn(user, at_fd, name);
}

void lum_dir_walk(int at_fd, const char *name, void (*fn)(void *user, int at_fd, const char *name), void *user)
{
    walk(at_fd, name, 0, fn, user);
}

static void remove_one(void *user, int at_fd, const char *name)
{
    (void)user;
    if (unlinkat(at_fd, name, 0))
        (void)unlinkat(at_fd, name, AT_REMOVEDIR);
}

void lum_dir_remove_tree(int at_fd, const char *name)
{
    walk(at_fd, name, 0, remove_one, NULL);
}

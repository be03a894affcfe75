/* The folder of the state, and the few calls that change it: each can fail, and tests make each fail (struct lum_disk).
 *
 * Everything is named relative to an open folder, without following symbolic links; files are 0600, folders 0700. A
 * file appears under its name only when it is whole: written beside it, synced, renamed, the folder synced. */
#ifndef LUM_SERVER_JOURNAL_DISK_H
#define LUM_SERVER_JOURNAL_DISK_H

#include <sys/types.h>

#include "core/base/base.h"

/* As the system calls of these names: -1 and errno. */
struct lum_disk {
    int (*create)(void *user, int dir_fd, const char *name); /* a new file for writing, 0600 */
    ssize_t (*write)(void *user, int fd, const void *bytes, size_t n);
    int (*sync)(void *user, int fd);
    int (*rename)(void *user, int dir_fd, const char *from, const char *to);
    void *user;
};
extern const struct lum_disk lum_disk_real;

struct lum_dir {
    int fd; /* -1: closed */
    const struct lum_disk *disk;
};
/* Opens the folder `name` below at_fd (AT_FDCWD: a path), and makes it if it is not there: then its name is durable. */
LUM_MUST_USE enum lum_status lum_dir_open(int at_fd, const char *name, bool make, const struct lum_disk *disk,
                                          struct lum_dir *ret_dir, struct lum_error *err);
void lum_dir_close(struct lum_dir *dir); /* accepts a zeroed or closed one */
LUM_MUST_USE enum lum_status lum_dir_sync(const struct lum_dir *dir, struct lum_error *err);

/* The one writer: an exclusive lock on the file "lock", until the descriptor is closed (or the process ends). */
LUM_MUST_USE enum lum_status lum_dir_lock(const struct lum_dir *dir, const char *path, int *ret_fd,
                                          struct lum_error *err);

/* A new empty file, in place of one that a crash left under that name. */
LUM_MUST_USE enum lum_status lum_dir_create(const struct lum_dir *dir, const char *name, int *ret_fd,
                                            struct lum_error *err);
/* A plain file for reading. LUM_ERR_NOT_FOUND: there is none. */
LUM_MUST_USE enum lum_status lum_dir_read(const struct lum_dir *dir, const char *name, int *ret_fd,
                                          uint64_t *ret_n_bytes, struct lum_error *err);
/* How long the file is. LUM_ERR_NOT_FOUND: there is none. */
LUM_MUST_USE enum lum_status lum_dir_size(const struct lum_dir *dir, const char *name, uint64_t *ret_n_bytes,
                                          struct lum_error *err);
/* All n bytes; writes that are cut short or interrupted go on. */
LUM_MUST_USE enum lum_status lum_dir_write(const struct lum_dir *dir, const char *name, int fd, const void *bytes,
                                           size_t n, struct lum_error *err);
LUM_MUST_USE enum lum_status lum_dir_sync_file(const struct lum_dir *dir, const char *name, int fd,
                                               struct lum_error *err);
/* And the folder is synced: the new name outlives a power cut. */
LUM_MUST_USE enum lum_status lum_dir_rename(const struct lum_dir *dir, const char *from, const char *to,
                                            struct lum_error *err);
void lum_dir_remove(const struct lum_dir *dir, const char *name); /* as far as it can be */
/* Calls fn for what lies in a folder, in whatever depth, and last for it; folders after what they hold. A file: for it.
 * Links are not followed. */
void lum_dir_walk(int at_fd, const char *name, void (*fn)(void *user, int at_fd, const char *name), void *user);
void lum_dir_remove_tree(int at_fd, const char *name); /* as far as it can be */

/* Calls fn for each name in the folder, as they come. */
LUM_MUST_USE enum lum_status lum_dir_each(const struct lum_dir *dir, void (*fn)(void *user, const char *name),
                                          void *user, struct lum_error *err);

#endif

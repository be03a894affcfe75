#define _GNU_SOURCE
#include "server/journal/upload_store.h"

#include <dirent.h>
#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <openssl/evp.h>

#define PART "part-" /* before the number of what is on its way */
#define DIR_FLAGS (O_RDONLY | O_DIRECTORY | O_NOFOLLOW | O_CLOEXEC)

bool lum_upload_name_is(const char *name)
{
    bool begins = true; /* a part of the path */
    for (const char *p = name; *p; p++) {
        if ((unsigned char)*p < 0x20 || *p == 0x7f || *p == '\\' || (begins && (*p == '/' || *p == '.')))
            return false;
        begins = *p == '/';
    }
    return !begins && strlen(name) <= LUM_LIMIT_UPLOAD_NAME_BYTES;
}

/* ---- folders ---- */

static void add_one(void *user, int at_fd, const char *name)
{
    struct stat st;
    uint64_t *n_bytes = user;
    if (fstatat(at_fd, name, &st, AT_SYMLINK_NOFOLLOW) == 0 && S_ISREG(st.st_mode))
        *n_bytes += (uint64_t)st.st_size;
}

static void look_at(void *user, const char *name)
{
    struct lum_upload_store *store = user;
    if (strncmp(name, PART, sizeof PART - 1) == 0)
        lum_dir_remove_tree(store->dir.fd, name);
    else
        lum_dir_walk(store->dir.fd, name, add_one, &store->n_bytes);
}

enum lum_status lum_upload_store_open(const char *root, const struct lum_disk *disk, struct lum_upload_store *ret_store,
                                      struct lum_error *err)
{
    struct lum_dir above;
    *ret_store = (struct lum_upload_store){.dir.fd = -1};
    enum lum_status st = lum_dir_open(AT_FDCWD, root, false, disk, &above, err);
    if (st)
        return st;
    st = lum_dir_open(above.fd, LUM_UPLOAD_FOLDER, true, disk, &ret_store->dir, err);
    lum_dir_close(&above);
    if (!st)
        st = lum_dir_each(&ret_store->dir, look_at, ret_store, err);
    if (!st && !(ret_store->sha = EVP_MD_fetch(NULL, "SHA256", NULL)))
        st = lum_fail(err, LUM_ERR_NOMEM, "", "no memory for SHA-256");
    if (st)
        lum_upload_store_close(ret_store);
    return st;
}

void lum_upload_store_close(struct lum_upload_store *store)
{
    lum_dir_close(&store->dir);
    EVP_MD_free(store->sha);
    store->sha = NULL;
}

/* ---- a root of its own ---- */

#define ROOT "lumend-uploads-" /* before what makes its name its own */
#define ROOT_TRIES 8

/* Opens such a folder of this user's that no process holds, and holds it: by a lock on the folder, which ends with its
 * process even when that is killed. -1: it is not there, of another kind, or held. */
static int hold(int at_fd, const char *name)
{
    struct stat held, named;
    int fd = openat(at_fd, name, DIR_FLAGS);
    if (fd < 0)
        return -1;
    if (!fstat(fd, &held) && held.st_uid == geteuid() && (held.st_mode & 07777) == 0700 &&
        !flock(fd, LOCK_EX | LOCK_NB) && !fstatat(at_fd, name, &named, AT_SYMLINK_NOFOLLOW) &&
        named.st_dev == held.st_dev && named.st_ino == held.st_ino) /* else it was removed before it was held */
        return fd;
    close(fd);
    return -1;
}

/* Of daemons that were killed. */
static void remove_left(const char *tmp)
{
    DIR *list = opendir(tmp);
    for (struct dirent *e = list ? readdir(list) : NULL; e; e = readdir(list)) {
        int fd = strncmp(e->d_name, ROOT, sizeof ROOT - 1) == 0 ? hold(dirfd(list), e->d_name) : -1;
        if (fd < 0)
            continue;
        lum_dir_remove_tree(dirfd(list), e->d_name);
        close(fd);
    }
    if (list)
        closedir(list);
}

enum lum_status lum_upload_root_make(struct lum_upload_root *ret_root, struct lum_error *err)
{
    const char *tmp = getenv("TMPDIR");
    tmp = tmp && tmp[0] ? tmp : "/tmp";
    remove_left(tmp);
    for (int i = 0; i < ROOT_TRIES; i++) { /* one that another start takes for left, before it is held, is lost */
        int n = snprintf(ret_root->path, sizeof ret_root->path, "%s/" ROOT "XXXXXX", tmp);
        if (n < 0 || (size_t)n >= sizeof ret_root->path || !mkdtemp(ret_root->path))
            return lum_fail(err, LUM_ERR_IO, "upload-mib", "cannot make a folder for uploads in %.100s: %s", tmp,
                            strerror(errno));
        ret_root->fd = hold(AT_FDCWD, ret_root->path);
        if (ret_root->fd >= 0)
            return LUM_OK;
        (void)rmdir(ret_root->path);
    }
    return lum_fail(err, LUM_ERR_IO, "upload-mib", "cannot hold a folder for uploads in %.100s: %s", tmp,
                    strerror(errno));
}

void lum_upload_root_remove(struct lum_upload_root *root)
{
    lum_dir_remove_tree(AT_FDCWD, root->path);
    close(root->fd);
}

/* ---- one upload ---- */

struct lum_upload_writer {
    struct lum_upload_store *store;
    const struct lum_upload_file *files;
    size_t n_files, n_begun;
    uint64_t left;      /* bytes of the file that was begun last */
    int fd;             /* of it; -1: none */
    struct lum_dir dir; /* it lies there */
    struct lum_dir part;
    char part_name[40];
    EVP_MD_CTX *sha;
};

static enum lum_status add_to_sha(struct lum_upload_writer *w, const void *bytes, size_t n, struct lum_error *err)
{
    return EVP_DigestUpdate(w->sha, bytes, n) == 1 ? LUM_OK : lum_fail(err, LUM_ERR_INTERNAL, "", "SHA-256 failed");
}

/* Opens the folder that the file lies in, and makes it. *ret_name: the last part of its name. */
static enum lum_status open_folder(struct lum_upload_writer *w, const char *name, const char **ret_name,
                                   struct lum_error *err)
{
    enum lum_status st = lum_dir_open(w->part.fd, ".", false, w->part.disk, &w->dir, err);
    for (const char *slash = strchr(name, '/'); slash && !st; name = slash + 1, slash = strchr(name, '/')) {
        char folder[LUM_LIMIT_UPLOAD_NAME_BYTES + 1];
        struct lum_dir next;
        snprintf(folder, sizeof folder, "%.*s", (int)(slash - name), name);
        st = lum_dir_open(w->dir.fd, folder, true, w->part.disk, &next, err);
        lum_dir_close(&w->dir);
        if (!st)
            w->dir = next;
    }
    *ret_name = name;
    return st;
}

static enum lum_status begin_file(struct lum_upload_writer *w, const struct lum_upload_file *file,
                                  struct lum_error *err)
{
    char size[24];
    const char *name;
    int n = snprintf(size, sizeof size, "%llu", (unsigned long long)file->n_bytes);
    enum lum_status st = add_to_sha(w, file->name, strlen(file->name) + 1, err);
    if (!st)
        st = add_to_sha(w, size, (size_t)n + 1, err);
    if (!st)
        st = open_folder(w, file->name, &name, err);
    if (!st)
        st = lum_dir_create(&w->dir, name, &w->fd, err);
    w->left = file->n_bytes;
    return st;
}

static enum lum_status end_file(struct lum_upload_writer *w, struct lum_error *err)
{
    enum lum_status st = lum_dir_sync_file(&w->dir, w->files[w->n_begun - 1].name, w->fd, err);
    close(w->fd);
    w->fd = -1;
    if (!st)
        st = lum_dir_sync(&w->dir, err);
    lum_dir_close(&w->dir);
    return st;
}

/* Ends the file that is whole, and begins the next one, which may be empty. */
static enum lum_status advance(struct lum_upload_writer *w, struct lum_error *err)
{
    enum lum_status st = LUM_OK;
    while (!st && w->left == 0) {
        if (w->fd >= 0)
            st = end_file(w, err);
        if (st || w->n_begun == w->n_files)
            break;
        st = begin_file(w, &w->files[w->n_begun++], err);
    }
    return st;
}

enum lum_status lum_upload_writer_create(struct lum_upload_store *store, const struct lum_upload_file *files,
                                         size_t n_files, struct lum_upload_writer **ret_writer, struct lum_error *err)
{
    struct lum_upload_writer *w = lum_calloc(1, sizeof *w);
    if (!w)
        return lum_fail(err, LUM_ERR_NOMEM, "", "no memory for an upload");
    *w = (struct lum_upload_writer){.store = store, .files = files, .n_files = n_files, .fd = -1};
    w->dir.fd = w->part.fd = -1;
    snprintf(w->part_name, sizeof w->part_name, PART "%llu", (unsigned long long)atomic_fetch_add(&store->n_made, 1));
    w->sha = EVP_MD_CTX_new();
    enum lum_status st = w->sha && EVP_DigestInit_ex(w->sha, store->sha, NULL) == 1
                             ? LUM_OK
                             : lum_fail(err, LUM_ERR_NOMEM, "", "no memory for an upload");
    if (!st)
        st = lum_dir_open(store->dir.fd, w->part_name, true, store->dir.disk, &w->part, err);
    if (!st)
        st = advance(w, err);
    if (st)
        lum_upload_writer_destroy(w);
    else
        *ret_writer = w;
    return st;
}

enum lum_status lum_upload_write(struct lum_upload_writer *w, const void *bytes, size_t n, struct lum_error *err)
{
    const char *at = bytes;
    enum lum_status st = LUM_OK;
    while (n > 0 && !st) {
        size_t k = n < w->left ? n : (size_t)w->left;
        if (k == 0)
            return lum_fail(err, LUM_ERR_INVALID, "", "there are more bytes than the files were said to have");
        st = add_to_sha(w, at, k, err);
        if (!st)
            st = lum_dir_write(&w->dir, w->files[w->n_begun - 1].name, w->fd, at, k, err);
        at += k;
        n -= k;
        w->left -= k;
        if (!st)
            st = advance(w, err);
    }
    return st;
}

/* Half of the SHA-256: 128 bits. */
static enum lum_status make_id(struct lum_upload_writer *w, lum_upload_id ret_id, struct lum_error *err)
{
    uint8_t bytes[EVP_MAX_MD_SIZE];
    if (EVP_DigestFinal_ex(w->sha, bytes, NULL) != 1)
        return lum_fail(err, LUM_ERR_INTERNAL, "", "SHA-256 failed");
    for (int i = 0; i < LUM_UPLOAD_ID_BYTES / 2; i++)
        snprintf(ret_id + 2 * i, 3, "%02x", bytes[i]);
    return LUM_OK;
}

static bool is_kept(const struct lum_upload_store *store, const char *name)
{
    struct stat st;
    return fstatat(store->dir.fd, name, &st, AT_SYMLINK_NOFOLLOW) == 0;
}

enum lum_status lum_upload_finish(struct lum_upload_writer *w, lum_upload_id ret_id, bool *ret_known,
                                  struct lum_error *err)
{
    if (w->n_begun < w->n_files || w->left > 0)
        return lum_fail(err, LUM_ERR_INVALID, "", "bytes are missing");
    enum lum_status status = make_id(w, ret_id, err);
    if (status)
        return status;
    *ret_known = is_kept(w->store, ret_id);
    if (!*ret_known) {
        status = lum_dir_rename(&w->store->dir, w->part_name, ret_id, err);
        /* Somebody sent the same, and was faster: that is a folder with files in it, which no other takes the place of.
         */
        *ret_known = status && is_kept(w->store, w->part_name) && is_kept(w->store, ret_id);
    }
    return *ret_known ? lum_dir_sync(&w->store->dir, err) : status; /* who was faster may not have come to that */
}

void lum_upload_writer_destroy(struct lum_upload_writer *w)
{
    if (!w)
        return;
    if (w->fd >= 0)
        close(w->fd);
    lum_dir_close(&w->dir);
    lum_dir_close(&w->part);
    lum_dir_remove_tree(w->store->dir.fd, w->part_name); /* it is not there any more if all went well */
    EVP_MD_CTX_free(w->sha);
    lum_free(w);
}

#define _GNU_SOURCE /* strcasestr */
#include "server/import/asset_list.h"

#include <dirent.h>
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "protocol/base/utf8.h"
#include "server/import/asset.h"

#define DIR_FLAGS (O_RDONLY | O_DIRECTORY | O_NOFOLLOW | O_CLOEXEC)

struct walk {
    bool (*wanted)(const char *name);
    const char *match;
    const _Atomic bool *cancel;
    struct lum_asset_list *list;
    bool uploads;    /* only those that are whole */
    uint32_t n_seen; /* entries of folders, of whatever kind */
};

void lum_asset_list_finish(struct lum_asset_list *list)
{
    lum_free(list->entries);
    memset(list, 0, sizeof *list);
}

/* An asset can be called so, and text can hold it. */
static bool is_name(const char *s)
{
    const uint8_t *p = (const uint8_t *)s, *end = p + strlen(s);
    if (*p == '.')
        return false;
    while (p < end) {
        size_t n = lum_utf8_length(p, end);
        if (n == 0 || *p < 0x20 || *p == '\\')
            return false;
        p += n;
    }
    return true;
}

static bool may_go_on(struct walk *w)
{
    if (w->cancel && atomic_load_explicit(w->cancel, memory_order_relaxed))
        return false;
    if (w->n_seen++ < LUM_LIMIT_ASSET_ENTRIES)
        return true;
    w->list->whole = false;
    return false;
}

static void take_file(struct walk *w, const char *path, uint64_t n_bytes)
{
    struct lum_asset_list *list = w->list;
    if (!w->wanted(path) || !strcasestr(path, w->match) || (w->uploads && !lum_asset_is_upload(path)))
        return;
    if (list->n == LUM_LIMIT_ASSETS_LISTED) {
        list->whole = false;
        return;
    }
    struct lum_asset_entry *e = &list->entries[list->n++];
    memcpy(e->name, path, strlen(path) + 1);
    e->n_bytes = n_bytes;
}

/* Takes dir_fd over. path: of the folder, with a slash at its end, or "". */
static void walk_folder(struct walk *w, int dir_fd, const char *path, uint32_t depth)
{
    DIR *dir = fdopendir(dir_fd);
    if (!dir) {
        close(dir_fd);
        return;
    }
    for (struct dirent *e = readdir(dir); e && may_go_on(w); e = readdir(dir)) {
        char name[LUM_LIMIT_ASSET_BYTES + 2]; /* and the slash */
        struct stat st;
        int n = snprintf(name, sizeof name - 1, "%s%s", path, e->d_name);
        if (!is_name(e->d_name) || n < 0 || n > LUM_LIMIT_ASSET_BYTES ||
            fstatat(dirfd(dir), e->d_name, &st, AT_SYMLINK_NOFOLLOW))
            continue;
        if (S_ISREG(st.st_mode))
            take_file(w, name, (uint64_t)st.st_size);
        if (!S_ISDIR(st.st_mode))
            continue;
        int fd = depth < LUM_LIMIT_ASSET_DEPTH ? openat(dirfd(dir), e->d_name, DIR_FLAGS) : -1;
        w->list->whole = w->list->whole && fd >= 0; /* too deep, or not for us */
        memcpy(name + n, "/", 2);
        if (fd >= 0)
            walk_folder(w, fd, name, depth + 1);
    }
    closedir(dir);
}

static int by_name(const void *a, const void *b)
{
    const struct lum_asset_entry *x = a, *y = b;
    return strcmp(x->name, y->name);
}

/* Nobody sent anything yet: there is no folder, and that is no error. */
static void walk_uploads(struct walk *w, const char *root)
{
    int root_fd = open(root, DIR_FLAGS & ~O_NOFOLLOW), fd = -1;
    if (root_fd >= 0)
        fd = openat(root_fd, LUM_UPLOAD_FOLDER, DIR_FLAGS);
    if (fd >= 0)
        walk_folder(w, fd, LUM_UPLOAD_FOLDER "/", 1);
    if (root_fd >= 0)
        close(root_fd);
}

enum lum_status lum_asset_list(const char *root, const char *uploads, bool (*wanted)(const char *name),
                               const char *match, const _Atomic bool *cancel, struct lum_asset_list *ret_list)
{
    struct lum_asset_list list = {.entries = lum_calloc(LUM_LIMIT_ASSETS_LISTED, sizeof *list.entries), .whole = true};
    if (!list.entries)
        return LUM_ERR_NOMEM;
    int fd = root ? open(root, O_RDONLY | O_DIRECTORY | O_CLOEXEC) : -1;
    if (root && fd < 0) {
        lum_asset_list_finish(&list);
        return LUM_ERR_IO;
    }
    struct walk w = {.wanted = wanted, .match = match, .cancel = cancel, .list = &list};
    if (root)
        walk_folder(&w, fd, "", 1);
    w.uploads = true;
    if (uploads)
        walk_uploads(&w, uploads);
    qsort(list.entries, list.n, sizeof *list.entries, by_name);
    *ret_list = list;
    return LUM_OK;
}

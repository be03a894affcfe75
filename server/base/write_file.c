#define _GNU_SOURCE
#include "server/base/write_file.h"

#include <errno.h>
#include <stdio.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

/* part: the file beside path, which is the name for the message. */
static enum lum_status write_part(const char *part, const char *path, const void *bytes, size_t n,
                                  struct lum_error *err)
{
    FILE *f = fopen(part, "wb");
    if (!f)
        return lum_fail(err, LUM_ERR_IO, "", "cannot write %s: %s", path, strerror(errno));
    bool ok = fwrite(bytes, 1, n, f) == n;
    int saved_errno = errno;
    if (fclose(f) != 0 && ok) {
        ok = false;
        saved_errno = errno;
    }
    return ok ? LUM_OK : lum_fail(err, LUM_ERR_IO, "", "cannot write %s: %s", path, strerror(saved_errno));
}

static char *part_of(const char *path)
{
    size_t size = strlen(path) + sizeof ".part";
    char *part = lum_calloc(size, 1);
    if (part)
        snprintf(part, size, "%s.part", path);
    return part;
}

enum lum_status lum_write_file(const char *path, const void *bytes, size_t n, struct lum_error *err)
{
    char *part = part_of(path);
    if (!part)
        return lum_fail(err, LUM_ERR_NOMEM, "", "no memory to write %s", path);
    enum lum_status st = write_part(part, path, bytes, n, err);
    if (!st && rename(part, path) != 0)
        st = lum_fail(err, LUM_ERR_IO, "", "cannot write %s: %s", path, strerror(errno));
    if (st)
        remove(part);
    lum_free(part);
    return st;
}

enum lum_status lum_part_open(const char *path, struct lum_part_file *ret_file, struct lum_error *err)
{
    struct stat st;
    bool plain = stat(path, &st) != 0 || S_ISREG(st.st_mode);
    struct lum_part_file f = {.path = path, .part = plain ? part_of(path) : NULL};
    if (plain && !f.part)
        return lum_fail(err, LUM_ERR_NOMEM, "", "no memory to write %s", path);
    f.out = fopen(plain ? f.part : path, "w");
    if (!f.out) {
        lum_fail(err, LUM_ERR_IO, "", "cannot write %s: %s", path, strerror(errno));
        lum_free(f.part);
        return LUM_ERR_IO;
    }
    *ret_file = f;
    return LUM_OK;
}

enum lum_status lum_part_close(struct lum_part_file *file, bool keep, struct lum_error *err)
{
    bool ok = !ferror(file->out) && fflush(file->out) == 0 && (!file->part || fsync(fileno(file->out)) == 0);
    int saved_errno = errno;
    ok = fclose(file->out) == 0 && ok;
    if (ok && keep && file->part && rename(file->part, file->path) != 0) {
        ok = false;
        saved_errno = errno;
    }
    if (file->part && !(ok && keep))
        remove(file->part);
    lum_free(file->part);
    return ok ? LUM_OK : lum_fail(err, LUM_ERR_IO, "", "cannot write %s: %s", file->path, strerror(saved_errno));
}

enum lum_status lum_may_write_file(const char *path, struct lum_error *err)
{
    char folder[4096];
    const char *slash = strrchr(path, '/');
    size_t n = slash ? (size_t)(slash - path) : 0;
    if (n >= sizeof folder)
        return lum_fail(err, LUM_ERR_LIMIT, "", "the path %.100s... is too long", path);
    memcpy(folder, path, n);
    folder[n] = '\0';
    const char *name = slash == path ? "/" : slash ? folder : ".";
    return access(name, W_OK | X_OK) == 0
               ? LUM_OK
               : lum_fail(err, LUM_ERR_IO, "", "cannot write to %.150s: %s", name, strerror(errno));
}
